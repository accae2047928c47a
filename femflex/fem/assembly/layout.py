"""Axes along which dofs are counted, chosen so that every support condition sets some of them to zero.

A node on a support has its translations and rotations along the support's axes. A node that flat plates of one plane
share has no stiffness about its normal m and turns in the plane alone. On a plane of symmetry or antisymmetry (zero
rotations are those across the zero displacements) the plate meets its mirror image at a fold, whose nodes turn about m
too: the node keeps all directions in the plane in which an allowed rotation has a component. Elsewhere a plate hardly
turns about m, and the node keeps the directions that make less than 45 degrees with an allowed rotation.

Dofs that belong to no single node are components along directions D of a vector b (or a rotation) that vanishes at the
nodes. A side that cannot move in directions H has H D b = 0. A side of plates deflects between its nodes too, by m
(m.r) with r = (theta_1 - theta_2) x (x_2 - x_1) / 8. Where the support lets nodes turn only so that H r = 0 (a plane of
symmetry or antisymmetry), the side stays on it: H (D b + m (m.r)) = 0, which is what the fold between the plate and its
mirror image does (`femflex.fem.plate.sides`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.assembly.conditions import Condition, directions_of

ACROSS = 1e-12  # squared cosine below which a direction counts as across those of a support
ALIGNED = 1e-9  # off-diagonal part of a projector below which axes stay as they are
ALLOWED = 0.5  # squared cosine with a rotation that a support allows, above which a flat node turns
MIRRORED = 1e-6  # likewise on a plane of symmetry; a fold that is flatter is none
STAYS = 1e-6  # part of a side's bulge r that a support may leave along its own directions


@dataclass(frozen=True, eq=False)
class Extras:
    """Dofs (n, k) of functions that vanish at the nodes (n, m) between which they lie.

    kind        "translation": displacements; "rotation": turns
    directions  (n, k, 3) unit vectors that they act along; None: along all, so that only a full support holds them
    spans       (n, 3) from the first node to the second, of sides of plates; None for others
    """

    dofs: IntArray
    nodes: IntArray
    kind: Literal["translation", "rotation"]
    directions: Array | None
    spans: Array | None


@dataclass(frozen=True, eq=False)
class Layout:
    """The relation raw = E z between raw dofs and dofs z along the axes of supports, and the z that the supports set to
    zero.

    E, inverse  (n_raw, n_raw)  z = inverse raw, for those z that are used
    zero        (n_raw,)        z that are zero
    """

    E: sparse.csr_array
    inverse: sparse.csr_array
    zero: BoolArray

    @property
    def conditions(self) -> sparse.csr_array:
        """Rows (k, n_raw) of the support conditions rows @ raw = 0."""
        return self.inverse[np.flatnonzero(self.zero)]


class _Blocks:
    """An identity (n, n) some of whose rows are replaced, as triplets."""

    def __init__(self, n: int) -> None:
        self._n, self._plain = n, np.ones(n, bool)
        self._triplets: list[tuple[IntArray, IntArray, Array]] = []

    def replace(self, rows: IntArray, columns: IntArray, values: Array) -> None:
        """Replace rows (n, r) by values (n, r, c) on columns (n, c)."""
        self._plain[rows.ravel()] = False
        self.add(rows, columns, values)

    def add(self, rows: IntArray, columns: IntArray, values: Array) -> None:
        """Add values (n, r, c) to rows (n, r), columns (n, c)."""
        row, column = np.broadcast_to(rows[:, :, None], values.shape), np.broadcast_to(columns[:, None], values.shape)
        self._triplets.append((row.ravel(), column.ravel(), values.ravel()))

    def matrix(self) -> sparse.csr_array:
        """The matrix."""
        plain = np.flatnonzero(self._plain)
        triplets = [(plain, plain, np.ones(len(plain))), *self._triplets]
        rows, columns, values = (np.concatenate(part) for part in zip(*triplets, strict=True))
        matrix = sparse.coo_array((values, (rows, columns)), shape=(self._n, self._n)).tocsr()
        matrix.eliminate_zeros()  # a dof counts as a rotation about an axis only when it has a component about it
        return matrix


def layout(
    n_raw: int,
    translation: IntArray,
    rotation: IntArray,
    flat: tuple[IntArray, Array],
    extras: Sequence[Extras],
    supports: Sequence[Condition] = (),
) -> Layout:
    """The layout of raw dofs under supports.

    translation, rotation  (n_nodes, 3) raw dofs of the nodes, -1 where none
    flat                   nodes (k,) of one plane, and two axes in it and its normal (k, 3, 3) as rows
    """
    zero_dofs = np.zeros(n_raw, bool)
    nodal, nodal_inverse, sides, sides_inverse = (_Blocks(n_raw) for _ in range(4))
    moves, turns = (np.zeros((len(translation), 3, 3)) for _ in range(2))
    on, mirror = np.zeros(len(translation), bool), np.ones(len(translation), bool)
    for support in supports:
        mirror[support.nodes] &= bool(np.abs(support.moves + support.turns - np.eye(3)).max() < ALIGNED)
        moves[support.nodes] += support.moves
        turns[support.nodes] += support.turns
        on[support.nodes] = True
    for table, sums in ((translation, moves), (rotation, turns)):
        nodes = np.flatnonzero(on & (table[:, 0] >= 0))
        if table is rotation:
            nodes = np.setdiff1d(nodes, flat[0])
        F, zero = _frames(directions_of(sums[nodes]))
        _set_axes(nodal, nodal_inverse, table[nodes], F)
        zero_dofs[table[nodes][zero]] = True
    F, zero = _flat_frames(flat[1], directions_of(turns[flat[0]]), on[flat[0]], mirror[flat[0]])
    _set_axes(nodal, nodal_inverse, rotation[flat[0]], F)
    zero_dofs[rotation[flat[0]][zero]] = True
    if supports:
        for e in extras:
            _set_axes_of_extras(sides, sides_inverse, zero_dofs, e, rotation, supports)
    return Layout(
        (sides.matrix() @ nodal.matrix()).tocsr(), (nodal_inverse.matrix() @ sides_inverse.matrix()), zero_dofs
    )


def _set_axes(blocks: _Blocks, inverse: _Blocks, dofs: IntArray, F: Array) -> None:
    """Count the vectors on raw dofs (n, 3) along the rows of F (n, 3, 3)."""
    if len(dofs):
        blocks.replace(dofs, dofs, F.swapaxes(1, 2))
        inverse.replace(dofs, dofs, F)


def _frames(zero: Array) -> tuple[Array, BoolArray]:
    """Return axes (n, k, k) as rows, and a mask (n, k) of those that span the range of projectors (n, k, k). Coordinate
    axes are kept where they span it."""
    value, vectors = np.linalg.eigh(zero)
    k = zero.shape[1]
    aligned = np.abs(zero * (1 - np.eye(k))).max(axis=(1, 2), initial=0.0) < ALIGNED
    F = np.where(aligned[:, None, None], np.eye(k), vectors.swapaxes(1, 2))
    return F, np.where(aligned[:, None], np.einsum("nkk->nk", zero), value) > 0.5


def _flat_frames(axes: Array, turns: Array, on: BoolArray, mirror: BoolArray) -> tuple[Array, BoolArray]:
    """Return the axes (n, 3, 3) of flat nodes as rows, the last of them unused, and a mask of those that supports with
    these projectors set to zero.

    mirror (n,): whether a node is supported by planes of symmetry or antisymmetry alone, one or two that meet.
    """
    F = axes.copy()
    F[:, 2] = 0.0
    zero = np.zeros((len(axes), 3), bool)
    if on.any():
        plane = axes[on, :2]
        allowed = np.matmul(plane @ (np.eye(3) - turns[on]), plane.swapaxes(1, 2))
        value, vectors = np.linalg.eigh(allowed)
        least = np.where(mirror[on], MIRRORED, ALLOWED)[:, None]
        zero_directions = np.einsum("nik,nk,njk->nij", vectors, np.where(value > least, 0.0, 1.0), vectors)
        frames_in_plane, zero[on, :2] = _frames(zero_directions)
        F[on, :2] = frames_in_plane @ plane
    return F, zero


def _set_axes_of_extras(
    blocks: _Blocks,
    inverse: _Blocks,
    zero_dofs: BoolArray,
    extras: Extras,
    rotation: IntArray,
    supports: Sequence[Condition],
) -> None:
    """Set the axes of dofs that belong to no single node along the supported directions, and mark those that are
    zero."""
    moves, turns = (np.zeros((len(extras.dofs), 3, 3)) for _ in range(2))
    for support in supports:
        lies = support.contains(extras.nodes)
        moves[lies] += support.moves
        turns[lies] += support.turns
    rows = np.flatnonzero(moves.any(axis=(1, 2)) | turns.any(axis=(1, 2)))
    if not len(rows):
        return
    moves, turns = directions_of(moves[rows]), directions_of(turns[rows])
    dofs = extras.dofs[rows]
    if extras.directions is None:
        everything = moves if extras.kind == "translation" else np.minimum(moves, turns)
        zero_dofs[dofs[np.trace(everything, axis1=1, axis2=2) > 2.5].ravel()] = True
        return
    D, H = extras.directions[rows], moves if extras.kind == "translation" else turns
    gram = np.matmul(D @ H, D.swapaxes(1, 2))
    value, vectors = np.linalg.eigh(gram)
    F, zero = _frames(np.einsum("nik,nk,njk->nij", vectors, np.where(value > ACROSS, 1.0, 0.0), vectors))
    zero_dofs[dofs[zero]] = True
    if dofs.shape[1] == 1:  # a single dof has no other axes; a twist may lie on several sides
        return
    blocks.replace(dofs, dofs, F.swapaxes(1, 2))
    inverse.replace(dofs, dofs, F)
    if extras.spans is not None:
        bulge = _bulge(D, moves, turns, extras.spans[rows])
        for node, sign in ((0, 1.0), (1, -1.0)):
            columns = rotation[extras.nodes[rows, node]]
            blocks.add(dofs, columns, sign * bulge)
            inverse.add(dofs, columns, -sign * F @ bulge)


def _bulge(D: Array, moves: Array, turns: Array, span: Array) -> Array:
    """Return the matrices by which b (n, 2) of sides follows the rotation (n, 2, 3) of the first node minus that of the
    second so that the sides stay on a support.

    They are zero where the rotations that the support allows move the side off it.
    """
    normal = np.cross(D[:, 0], D[:, 1])
    across = np.cross(np.eye(3), -(span / np.linalg.norm(span, axis=1, keepdims=True))[:, None])  # theta -> theta x t
    off = np.abs(moves @ across @ (np.eye(3) - turns)).max(axis=(1, 2))
    HD = D @ moves
    b = -np.linalg.pinv(HD @ D.swapaxes(1, 2), rcond=ACROSS, hermitian=True) @ (HD @ normal[:, :, None])
    lever = np.cross(span, normal) / 8  # m . (theta x span) / 8 = lever . theta
    return np.where(off[:, None, None] < STAYS, b * lever[:, None, :], 0.0)
