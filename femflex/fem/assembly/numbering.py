"""Numbering of raw degrees of freedom while members are added, and the map to the independent ones.

Members ask for dofs node by node: translations, rotations (three global components each) and extra dofs that belong
to no single node (bubbles, edge and twist dofs). A node that only flat plates of one plane share has no stiffness
about its normal; its rotation is then restricted to the plane, so that M and K stay regular. raw = T independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.assembly.conditions import Condition, directions_of
from femflex.fem.assembly.dependence import Dependence, independent_of

if TYPE_CHECKING:
    from femflex.fem.structure import Member

RANK_TOLERANCE = 1e-6  # sine of the fold angle below which two plate facets count as one plane
ACROSS = 1e-12  # squared cosine below which a direction counts as across those of a support
ALIGNED = 1e-9  # off-diagonal part of a projector below which axes stay as they are
ALLOWED = 0.5  # squared cosine with a rotation that a support allows, above which a flat node turns
MIRRORED = 1e-6  # likewise on a plane of symmetry; a fold that is flatter is none
STAYS = 1e-6  # part of a side's bulge r that a support may leave along its own directions


class Numbering:
    """Assigns numbers to raw dofs; the same node always gets the same numbers."""

    def __init__(self, n_nodes: int, members: Sequence[Member] = ()) -> None:
        self.members = tuple(members)  # all members of the structure: elements may depend on their neighbours
        self._translation = np.full((n_nodes, 3), -1, np.int64)
        self._rotation = np.full((n_nodes, 3), -1, np.int64)
        self._spin_space = np.zeros((n_nodes, 3, 3))  # sum of projectors on the directions members stiffen
        self._extras: list[Extras] = []
        self._dependences: list[Dependence] = []
        self._ties: dict[int, tuple[int, float]] = {}  # raw dof -> the one it follows, and its factor (0: it is zero)
        self._sides: dict[tuple[int, int], IntArray] = {}  # side between two nodes -> raw dofs (3,) of its displacement
        self._fading: list[IntArray] = []
        self.n_raw = 0

    def translation(self, nodes: IntArray) -> IntArray:
        """Numbers (k, 3) of raw dofs of the translation of nodes (k,), global components."""
        return self._numbers(self._translation, nodes)

    def rotation(self, nodes: IntArray, normals: Array | None = None) -> IntArray:
        """Raw dofs (k, 3) of the rotation of nodes (k,), global components.

        normals (k, 3), unit: the member gives no stiffness about them (flat plates). None: stiffness about all axes.
        """
        projector = np.eye(3) if normals is None else np.eye(3) - normals[:, :, None] * normals[:, None, :]
        np.add.at(self._spin_space, nodes, projector)
        return self._numbers(self._rotation, nodes)

    def extra(self, count: int) -> IntArray:
        """Numbers (n,) of raw dofs that belong to no single node; no support holds them before they are `attach`ed."""
        return self._next_numbers(count)

    def sides(self, ends: IntArray) -> IntArray:
        """Raw dofs (k, 3), global components, of the displacement 4 s (1 - s) b of straight sides with ends (k, 2).

        Tethers and membranes share them: the same pair of nodes always gets the same numbers.
        """
        pairs = [(int(a), int(b)) for a, b in np.sort(ends, axis=1)]
        fresh = list(dict.fromkeys(pair for pair in pairs if pair not in self._sides))
        if fresh:
            self._sides |= zip(fresh, self.fading(np.array(fresh, np.int64), 1)[:, 0], strict=True)
        return np.array([self._sides[pair] for pair in pairs], np.int64).reshape(-1, 3)

    def fading(self, nodes: IntArray, count: int) -> IntArray:
        """Raw dofs (n, count, 3), global components, of functions that vanish at nodes (n, m); all are zero where the
        element moves linearly with these nodes."""
        dofs = self.extra(3 * count * len(nodes)).reshape(len(nodes), count, 3)
        for k in range(count):
            self.attach(dofs[:, k], nodes, np.broadcast_to(np.eye(3), (len(nodes), 3, 3)))
        self._fading.append(dofs.ravel())
        return dofs

    @property
    def fading_dofs(self) -> IntArray:
        """Numbers (k,) of the raw dofs that `fading` assigned."""
        return np.concatenate([np.zeros(0, np.int64), *self._fading])

    def attach(
        self,
        dofs: IntArray,
        nodes: IntArray,
        directions: Array | None = None,
        kind: Literal["translation", "rotation"] = "translation",
        spans: Array | None = None,
    ) -> None:
        """Record the nodes (n, m) between which extra dofs (n, k) fade, so that supports of all these nodes act on
        them.

        kind        they are components of a displacement (bubbles, sides) or of a turn (twists)
        directions  (n, k, 3) unit vectors that they act along; None: along all, so that only a full support holds them
        spans       (n, 3) from the first node to the second, of sides of plates, which deflect as their nodes turn
        """
        self._extras.append(Extras(np.asarray(dofs), np.asarray(nodes), kind, directions, spans))

    def tie(self, first: int, second: int, factor: float) -> None:
        """Tie two raw dofs: the second is factor (not 0) times the first. Where ties contradict each other, both stay
        zero."""
        (a, p), (b, q) = self._leader(first), self._leader(second)
        if a != b and p and q:
            self._ties[b] = a, factor * p / q
        elif a != b or p * factor != q:
            self._ties |= {a: (a, 0.0), b: (b, 0.0)}

    def connect(self, dependences: Sequence[Dependence]) -> None:
        """Add vectors of raw dofs that follow others."""
        self._dependences += dependences

    def _leader(self, dof: int) -> tuple[int, float]:
        """Return the dof that this one follows in the end (itself if none) and the factor, which is 0 for a dof that is
        zero."""
        factor = 1.0
        while factor and dof in self._ties:
            dof, ratio = self._ties[dof]
            factor *= ratio
        return dof, factor

    def translation_of(self, nodes: IntArray) -> IntArray:
        """Numbers (k, 3) of raw dofs that members already gave the translation of nodes (k,); -1 where none did."""
        return self._translation[nodes]

    def rotation_of(self, nodes: IntArray) -> IntArray:
        """Raw dofs (k, 3) that members already gave the rotation of nodes (k,); -1 where none did."""
        return self._rotation[nodes]

    def turns_about_all_axes(self, dofs: IntArray) -> BoolArray:
        """Whether the nodes with these first rotational dofs (...) rotate about all axes, not only in a plane."""
        flat = np.zeros(self.n_raw, bool)
        flat[self._rotation[self._flat_nodes()[0], 0]] = True
        return np.asarray(~flat[dofs])

    def layout(self, supports: Sequence[Condition] = ()) -> Layout:
        """Return the layout of the raw dofs along the axes of supports."""
        nodes, axes = self._flat_nodes()
        return layout(self.n_raw, self._translation, self._rotation, (nodes, axes), self._extras, supports)

    def independent(self, supports: Sequence[Condition] = ()) -> sparse.csr_array:
        """T (n_raw, n_dof) [1]: raw dofs from the independent ones, which lie along the axes of these supports."""
        dropped = self._rotation[self._flat_nodes()[0]]
        keep = np.ones(self.n_raw, bool)
        keep[dropped.ravel()] = False
        keep[list(self._ties)] = False
        number = np.cumsum(keep) - 1
        n_dof = int(keep.sum())
        tied = [(dof, *self._leader(dof)) for dof in self._ties]
        rows = [np.flatnonzero(keep), dropped[:, :2].ravel(), np.array([dof for dof, _, _ in tied], np.int64)]
        cols = [number[keep], n_dof + np.arange(2 * len(dropped))]  # two directions in the plane of each flat node
        cols.append(number[[first for _, first, _ in tied]] if tied else np.zeros(0, np.int64))
        values = [np.ones(n_dof + 2 * len(dropped)), np.array([factor for _, _, factor in tied])]
        triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(cols)))
        selection = sparse.coo_array(triplets, shape=(self.n_raw, n_dof + 2 * len(dropped))).tocsr()
        T = (self.layout(supports).E @ selection).tocsr()
        T.eliminate_zeros()
        T.sort_indices()
        return independent_of(T, self._dependences)

    def _flat_nodes(self) -> tuple[IntArray, Array]:
        """Nodes (k,) that only flat plates of one plane share; two axes in it and its normal (k, 3, 3), as rows."""
        nodes = np.flatnonzero(self._rotation[:, 0] >= 0)
        value, axes = np.linalg.eigh(self._spin_space[nodes])
        flat = value[:, 0] < RANK_TOLERANCE**2 * value[:, 2]
        return nodes[flat], axes[flat][:, :, ::-1].swapaxes(1, 2)  # eigh gives x last in the xy plane

    def node_rows(self, n_raw: int) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Operators (3 n_nodes, n_raw) that give every node's translation and rotation; zero rows where it has none."""
        return _rows(self._translation, n_raw), _rows(self._rotation, n_raw)

    def _numbers(self, table: IntArray, nodes: IntArray) -> IntArray:
        fresh = np.unique(nodes[table[nodes, 0] < 0])
        table[fresh] = self._next_numbers(3 * len(fresh)).reshape(-1, 3)
        return table[nodes]

    def _next_numbers(self, count: int) -> IntArray:
        start, self.n_raw = self.n_raw, self.n_raw + count
        return np.arange(start, self.n_raw, dtype=np.int64)


def _rows(table: IntArray, n_raw: int) -> sparse.csr_array:
    flat = table.ravel()
    rows = np.flatnonzero(flat >= 0)
    return sparse.coo_array((np.ones(len(rows)), (rows, flat[rows])), shape=(flat.size, n_raw)).tocsr()


# Axes along which dofs are counted, chosen so that every support condition sets some of them to zero.
#
# A node on a support has its translations and rotations along the support's axes. A node that flat plates of one
# plane share has no stiffness about its normal m and turns in the plane alone. On a plane of symmetry or antisymmetry
# (zero rotations are those across the zero displacements) the plate meets its mirror image at a fold, whose nodes
# turn about m too: the node keeps all directions in the plane in which an allowed rotation has a component. Elsewhere
# a plate hardly turns about m, and the node keeps the directions that make less than 45 degrees with an allowed
# rotation.
#
# Dofs that belong to no single node are components along directions D of a vector b (or a rotation) that vanishes at
# the nodes. A side that cannot move in directions H has H D b = 0. A side of plates deflects between its nodes too,
# by m (m.r) with r = (theta_1 - theta_2) x (x_2 - x_1) / 8. Where the support lets nodes turn only so that H r = 0 (a
# plane of symmetry or antisymmetry), the side stays on it: H (D b + m (m.r)) = 0, which is what the fold between the
# plate and its mirror image does (`femflex.fem.plate.sides`).


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
