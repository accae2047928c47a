"""Components of nodes that nothing resists, which Nastran holds by itself (AUTOSPC)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.decks.builder import direction_key
from femflex.fem import Structure, Support

# Least over largest stiffness of a node below which nothing resists (Nastran's EPZERO). A largest above that of the
# usual node counts as that, for bushings and springs may stand for rigid links.
RATIO = 1e-8
ROUNDING = 1e-13  # part of the largest stiffness of a node that may be rounding of it
SAME = 1e-9  # part by which a node's motion may differ from that of three dofs of its own


def unresisted(structure: Structure, points: IntArray, held: Sequence[int] = ()) -> list[tuple[IntArray, Support]]:
    """Nodes (k,) and the components that nothing resists at them, of the points that count (n,).

    held: dofs that supports fix already, of nodes that follow others in part.

    A node is looked at by itself, as Nastran does: the 3 x 3 stiffness of its displacement and of its rotation. Nodes
    that follow others by connections in all components are passed over.
    """
    found: dict[tuple[float, ...], list[int]] = {}
    supports: dict[tuple[float, ...], Support] = {}
    users = _users(structure)
    users[list(held)] = 0
    for kind, rows in enumerate((structure.translation, structure.rotation)):
        block, along, own = _blocks(structure.K, rows, users)
        nodes = points[own[points].any(axis=1)]
        if not len(nodes):
            continue
        overall = float(np.abs(block[nodes]).max(initial=0.0))
        block = along.swapaxes(1, 2) @ block @ along
        for a in range(3):  # directions that follow others count as stiff
            follows = nodes[~own[nodes, a]]
            block[follows, a] = block[follows, :, a] = 0.0
            block[follows, a, a] = np.maximum(np.abs(block[follows]).max(axis=(1, 2)), max(overall, 1.0) * 1e-12)
        block = along @ block @ along.swapaxes(1, 2)
        value, vectors = np.linalg.eigh(block[nodes])
        largest = value[:, 2]
        usual = float(np.median(largest[largest > 0])) if largest.any() else 0.0
        least = np.maximum(RATIO * np.minimum(largest, usual), ROUNDING * largest)  # a rigid link makes no other loose
        loose = value <= np.maximum(least[:, None], RATIO * np.finfo(float).tiny)
        loose |= (largest <= 1e-14 * overall)[:, None]
        for node, free, axes in zip(nodes, loose, vectors.swapaxes(1, 2), strict=True):
            if not free.any():
                continue
            P = axes[free].T @ axes[free]
            if np.abs(P - np.diag(np.round(np.diag(P)))).max() < 1e-6:  # along the mesh's axes
                axes, free = np.eye(3), np.diag(P) > 0.5
            elif np.linalg.det(axes) < 0:
                axes = axes * np.array([[1.0], [1.0], [-1.0]])
            words = tuple(word for word, one in zip(("x", "y", "z"), free, strict=True) if one)
            words = tuple("r" + word for word in words) if kind else words
            key = (float(kind), *(float(one) for one in free), *direction_key(axes.ravel(), 6))
            supports[key] = Support(words, tuple(map(tuple, axes.tolist())))
            found.setdefault(key, []).append(int(node))
    return [(np.array(nodes), supports[key]) for key, nodes in found.items()]


def _users(structure: Structure) -> IntArray:
    """Number (n_dof,) of the nodes that each dof moves or turns."""
    moved = [sparse.csr_array(abs(rows)) for rows in (structure.translation, structure.rotation)]
    n = moved[0].shape[0] // 3
    sums = sparse.csr_array((np.ones(3 * n), np.arange(3 * n), np.arange(0, 3 * n + 1, 3)), shape=(n, 3 * n))
    return np.bincount((sums @ (moved[0] + moved[1])).tocoo().coords[1], minlength=moved[0].shape[1])


def _blocks(K: sparse.csr_array, rows: sparse.csr_array, users: IntArray) -> tuple[Array, Array, BoolArray]:
    """Stiffness (n, 3, 3) of nodes against their own three components, directions (n, 3, 3) at right angles, as
    columns, and which of these (n, 3) have a dof of their own."""
    n = rows.shape[0] // 3
    moved = (rows @ K).tocsr()
    block, gram = np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    for a in range(3):
        for b in range(3):
            other = rows[b::3]
            block[:, a, b] = np.asarray(moved[a::3].multiply(other).sum(axis=1)).ravel()
            gram[:, a, b] = np.asarray(rows[a::3].multiply(other).sum(axis=1)).ravel()
    along = np.tile(np.eye(3), (n, 1, 1))
    own = np.abs(gram - np.eye(3)).max(axis=2) < SAME
    for node in np.flatnonzero(~own.all(axis=1)).tolist():  # it may follow others along skew axes, and have dofs across
        starts = rows.indptr[3 * node : 3 * node + 4]
        columns, values = rows.indices[starts[0] : starts[3]], rows.data[starts[0] : starts[3]]
        single = users[columns] == 1
        dofs, place = np.unique(columns[single], return_inverse=True)
        R = np.zeros((3, len(dofs)))
        R[np.repeat(np.arange(3), np.diff(starts))[single], place] = values[single]
        U, size, Vt = np.linalg.svd(R)
        r = int((size > SAME).sum())
        if r:
            V = Vt[:r].T / size[:r]
            along[node], own[node] = U, np.arange(3) < r
            block[node] = U[:, :r] @ (V.T @ K[dofs[:, None], dofs].toarray() @ V) @ U[:, :r].T
    return (block + block.swapaxes(1, 2)) / 2, along, own
