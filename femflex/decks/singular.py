"""Components of nodes without stiffness, which Nastran fixes automatically (AUTOSPC)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.decks.builder import direction_key
from femflex.fem import Structure, Support

# Stiffness of a component, relative to the largest of its node, below which it is singular (Nastran's EPZERO). The
# largest is limited to the median of all nodes, since bushings and springs may represent rigid links.
RATIO = 1e-8
ROUNDING = 1e-13  # stiffness, relative to the largest of a node, that may be rounding
MOTION_TOLERANCE = 1e-9  # difference between the motion of a node and that of three independent dofs


def singular_components(
    structure: Structure, points: IntArray, fixed: Sequence[int] = ()
) -> list[tuple[IntArray, Support]]:
    """Nodes (k,) among `points` (n,) with the components that have no stiffness, as supports.

    fixed: dofs already fixed by supports, at nodes that depend on others in some components.

    Nodes are examined one by one, as in Nastran, by the 3 x 3 stiffness of their displacement and of their rotation.
    Nodes whose components all depend on others through connections are skipped.
    """
    nodes_by_key: dict[tuple[float, ...], list[int]] = {}
    supports: dict[tuple[float, ...], Support] = {}
    users = _users(structure)
    users[list(fixed)] = 0
    for kind, rows in enumerate((structure.translation, structure.rotation)):
        block, directions, independent = _blocks(structure.K, rows, users)
        nodes = points[independent[points].any(axis=1)]
        if not len(nodes):
            continue
        largest_entry = float(np.abs(block[nodes]).max(initial=0.0))
        block = directions.swapaxes(1, 2) @ block @ directions
        for a in range(3):  # dependent directions are treated as stiff
            dependent = nodes[~independent[nodes, a]]
            block[dependent, a] = block[dependent, :, a] = 0.0
            block[dependent, a, a] = np.maximum(
                np.abs(block[dependent]).max(axis=(1, 2)), max(largest_entry, 1.0) * 1e-12
            )
        block = directions @ block @ directions.swapaxes(1, 2)
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


def _users(structure: Structure) -> IntArray:
    """Number (n_dof,) of nodes that each dof displaces or rotates."""
    motions = [sparse.csr_array(abs(rows)) for rows in (structure.translation, structure.rotation)]
    n = motions[0].shape[0] // 3
    sums = sparse.csr_array((np.ones(3 * n), np.arange(3 * n), np.arange(0, 3 * n + 1, 3)), shape=(n, 3 * n))
    return np.bincount((sums @ (motions[0] + motions[1])).tocoo().coords[1], minlength=motions[0].shape[1])


def _blocks(K: sparse.csr_array, rows: sparse.csr_array, users: IntArray) -> tuple[Array, Array, BoolArray]:
    """Stiffness (n, 3, 3) of nodes in their three components, orthogonal directions (n, 3, 3) as columns, and a mask
    (n, 3) of the directions with independent dofs."""
    n = rows.shape[0] // 3
    forces = (rows @ K).tocsr()
    block, gram = np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    for a in range(3):
        for b in range(3):
            rows_b = rows[b::3]
            block[:, a, b] = np.asarray(forces[a::3].multiply(rows_b).sum(axis=1)).ravel()
            gram[:, a, b] = np.asarray(rows[a::3].multiply(rows_b).sum(axis=1)).ravel()
    directions = np.tile(np.eye(3), (n, 1, 1))
    independent = np.abs(gram - np.eye(3)).max(axis=2) < MOTION_TOLERANCE
    # a node may depend on others along skew axes, and have dofs across them
    for node in np.flatnonzero(~independent.all(axis=1)).tolist():
        starts = rows.indptr[3 * node : 3 * node + 4]
        columns, values = rows.indices[starts[0] : starts[3]], rows.data[starts[0] : starts[3]]
        single = users[columns] == 1
        dofs, place = np.unique(columns[single], return_inverse=True)
        R = np.zeros((3, len(dofs)))
        R[np.repeat(np.arange(3), np.diff(starts))[single], place] = values[single]
        U, size, Vt = np.linalg.svd(R)
        r = int((size > MOTION_TOLERANCE).sum())
        if r:
            V = Vt[:r].T / size[:r]
            directions[node], independent[node] = U, np.arange(3) < r
            block[node] = U[:, :r] @ (V.T @ K[dofs][:, dofs].toarray() @ V) @ U[:, :r].T
    return (block + block.swapaxes(1, 2)) / 2, directions, independent
