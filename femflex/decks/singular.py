"""Components of nodes without stiffness, which Nastran fixes automatically (AUTOSPC)."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.decks.builder import direction_key
from femflex.fem import Structure, Support

# Stiffness of a component, relative to the largest of its node, below which it is singular (Nastran's EPZERO). The
# largest is limited to the median of all nodes, since bushings and springs may represent rigid links.
RATIO = 1e-8
ROUNDING = 1e-13  # stiffness, relative to the largest of a node, that may be rounding
MOTION_TOLERANCE = 1e-9  # difference between the motion of a node and that of an independent dof


def singular_components(structure: Structure, points: IntArray) -> list[tuple[IntArray, Support]]:
    """Nodes (k,) among `points` (n,) with the components that have no stiffness, as supports.

    Nodes are examined one by one, as in Nastran, by the 3 x 3 stiffness of their displacement and of their rotation.
    Components along the mesh's axes that depend on other nodes through connections count as stiff.
    """
    nodes_by_key: dict[tuple[float, ...], list[int]] = {}
    supports: dict[tuple[float, ...], Support] = {}
    for kind, rows in enumerate((structure.translation, structure.rotation)):
        block, independent = _blocks(structure.K, rows)
        nodes = points[independent[points].any(axis=1)]
        if not len(nodes):
            continue
        largest_entry = float(np.abs(block[nodes]).max(initial=0.0))
        for a in range(3):
            dependent = nodes[~independent[nodes, a]]
            block[dependent, a] = block[dependent, :, a] = 0.0
            block[dependent, a, a] = np.maximum(
                np.abs(block[dependent]).max(axis=(1, 2)), max(largest_entry, 1.0) * 1e-12
            )
        value, vectors = np.linalg.eigh(block[nodes])
        largest = value[:, 2]
        median = float(np.median(largest[largest > 0])) if largest.any() else 0.0
        # so that a rigid link makes no other node singular
        threshold = np.maximum(RATIO * np.minimum(largest, median), ROUNDING * largest)
        is_singular = value <= np.maximum(threshold[:, None], RATIO * np.finfo(float).tiny)
        is_singular |= (largest <= 1e-14 * largest_entry)[:, None]
        for node, singular, axes in zip(nodes, is_singular, vectors.swapaxes(1, 2), strict=True):
            if not singular.any():
                continue
            P = axes[singular].T @ axes[singular]
            if np.abs(P - np.diag(np.round(np.diag(P)))).max() < 1e-6:  # along the mesh's axes
                axes, singular = np.eye(3), np.diag(P) > 0.5
            elif np.linalg.det(axes) < 0:
                axes = axes * np.array([[1.0], [1.0], [-1.0]])
            words = tuple(word for word, flag in zip(("x", "y", "z"), singular, strict=True) if flag)
            words = tuple("r" + word for word in words) if kind else words
            key = (float(kind), *(float(flag) for flag in singular), *direction_key(axes.ravel(), 6))
            supports[key] = Support(words, tuple(map(tuple, axes.tolist())))
            nodes_by_key.setdefault(key, []).append(int(node))
    return [(np.array(nodes), supports[key]) for key, nodes in nodes_by_key.items()]


def _blocks(K: sparse.csr_array, rows: sparse.csr_array) -> tuple[Array, BoolArray]:
    """Stiffness (n, 3, 3) of nodes in their three components, and a mask (n, 3) of those that are independent dofs."""
    n = rows.shape[0] // 3
    forces = (rows @ K).tocsr()
    block, gram = np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    for a in range(3):
        for b in range(3):
            block[:, a, b] = np.asarray(forces[a::3].multiply(rows[b::3]).sum(axis=1)).ravel()
            gram[:, a, b] = np.asarray(rows[a::3].multiply(rows[b::3]).sum(axis=1)).ravel()
    return (block + block.swapaxes(1, 2)) / 2, np.abs(gram - np.eye(3)).max(axis=2) < MOTION_TOLERANCE
