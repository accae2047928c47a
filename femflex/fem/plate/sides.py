"""In-plane displacement of plate sides relative to the straight line between their nodes, shared by all plates on a
side.

u(s) = (1 - s) u_1 + s u_2 + 4 s (1 - s) b on a side from node 1 to node 2. Between plates of one plane b is free in the
plane, so that their in-plane field is quadratic. At a fold b is free along the side only; across, it follows the
rotations of the nodes as the deflection of the plate on the other side does, b = (theta_1 - theta_2) x (x_2 - x_1) / 8.

Plates with a twist w,xy of their own at each node turn about a fold at the rate d(theta.t)/dt = -w,xy along it where t
lies along their x axis, +w,xy where along y. Both plates must rotate alike, or the fold would open between its nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.plate.blocks import LocalDofs
from femflex.fem.plate.frames import PLANE_TOLERANCE, orient_normals
from femflex.fem.sections.laminates import PlateSection, isotropic
from femflex.fem.sections.materials import Material
from femflex.mesh.cells import CELL_TYPES

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Sides:
    """Sides of elements with c corners, side i from corner i to the next.

    dofs   (e, c, 2)  raw dofs: b along the axes of the plane; at a fold along the side, the second repeats the first
    folds  (e, c)     whether plates of another plane lie on the side
    along  (e, c, 3)  unit vectors along the sides, the same for all elements on a side
    """

    dofs: IntArray
    folds: BoolArray
    along: Array


class SideTable:
    """Raw dofs that members have assigned to sides and twists so far."""

    def __init__(self, mesh: Mesh) -> None:
        self.n_nodes = len(mesh.points)
        self.folds = fold_keys(mesh)
        self._keys: IntArray = np.zeros(0, np.int64)
        self._dofs: IntArray = np.zeros((0, 2), np.int64)
        self._twists: list[tuple[IntArray, Array]] = []  # per slot: raw dof (n_nodes,) and normal (n_nodes, 3)
        self._turning: dict[tuple[int, int], tuple[int, float]] = {}  # (node, fold) -> its first twist, and sign

    def sides(self, keys: IntArray, numbering: Numbering, axes: Array, along: Array, spans: Array) -> IntArray:
        """Numbers (k, 2) of the raw dofs of sides by key (k,); new sides get theirs from the numbering.

        axes (k, 2, 3) are those of the plane, along (k, 3) those of the sides: the directions of the dofs; spans (k, 3)
        point from the lower node to the upper.
        """
        fresh, first = np.unique(keys, return_index=True)
        new = ~np.isin(fresh, self._keys)
        fresh, first = fresh[new], first[new]
        fold = np.isin(fresh, self.folds)
        pairs = np.stack([fresh // self.n_nodes, fresh % self.n_nodes], axis=1)
        dofs = np.empty((len(fresh), 2), np.int64)
        for rows, count in ((np.flatnonzero(~fold), 2), (np.flatnonzero(fold), 1)):
            if len(rows):
                directions = axes[first[rows]] if count == 2 else along[first[rows], None]
                side_dofs = numbering.extra(count * len(rows)).reshape(-1, count)
                numbering.attach(side_dofs, pairs[rows], directions, spans=spans[first[rows]])
                dofs[rows] = side_dofs
        all_keys = np.concatenate([self._keys, fresh])
        order = np.argsort(all_keys, kind="stable")
        self._keys, self._dofs = all_keys[order], np.concatenate([self._dofs, dofs])[order]
        return self._dofs[np.searchsorted(self._keys, keys)]

    def existing_dofs(self, keys: IntArray) -> IntArray:
        """Numbers (k, 1), each once, of the raw dofs of sides by key (n,), for sides that have some."""
        return np.unique(self._dofs[np.isin(self._keys, keys)])[:, None]

    def twists(self, nodes: IntArray, normals: Array, numbering: Numbering) -> IntArray:
        """Numbers (k,) of the raw dofs of the twist at nodes (k,) in planes of these normals (k, 3); one per node and
        plane."""
        dofs = np.full(len(nodes), -1, np.int64)
        slot = 0
        while (dofs < 0).any():
            if slot == len(self._twists):
                self._twists.append((np.full(self.n_nodes, -1, np.int64), np.zeros((self.n_nodes, 3))))
            dof, normal = self._twists[slot]
            open_nodes, first = np.unique(nodes[dofs < 0], return_index=True)
            rows = np.flatnonzero(dofs < 0)[first[dof[open_nodes] < 0]]
            if len(rows):
                dof[nodes[rows]] = numbering.extra(len(rows))
                numbering.attach(dof[nodes[rows], None], nodes[rows, None], kind="rotation")
                normal[nodes[rows]] = normals[rows]
            same = np.linalg.norm(np.cross(normal[nodes], normals), axis=1) < PLANE_TOLERANCE
            dofs = np.where((dofs < 0) & same, dof[nodes], dofs)
            slot += 1
        return dofs

    def attach_twists(self, twists: IntArray, corners: IntArray, axes: Array, numbering: Numbering) -> None:
        """Record that the dofs twists (e, 4) rotate plates about their sides; axes (e, 2, 3) are unit vectors along
        these."""
        for side in range(4):
            ends = [side, (side + 1) % 4]
            pairs, about = np.repeat(corners[:, ends], 2, axis=0), np.repeat(axes[:, side % 2], 2, axis=0)
            numbering.attach(twists[:, ends].reshape(-1, 1), pairs, about[:, None], kind="rotation")

    def tie_folds(self, twists: IntArray, corners: IntArray, numbering: Numbering) -> None:
        """Tie twists (e, 4), dof numbers, that meet at a fold; corners (e, 4), node numbers, sides 1 and 3 along the x
        axis."""
        for side, sign in enumerate((-1.0, 1.0, -1.0, 1.0)):
            ends = [side, (side + 1) % 4]
            pairs = np.sort(corners[:, ends], axis=1)
            keys = pairs[:, 0] * self.n_nodes + pairs[:, 1]
            folded = np.flatnonzero(np.isin(keys, self.folds))
            for end in ends:
                for key, node, twist in zip(keys[folded], corners[folded, end], twists[folded, end], strict=True):
                    first, first_sign = self._turning.setdefault((int(node), int(key)), (int(twist), sign))
                    if first != twist:
                        numbering.tie(first, int(twist), first_sign * sign)


_TABLES: WeakKeyDictionary[Numbering, SideTable] = WeakKeyDictionary()


def side_table(mesh: Mesh, numbering: Numbering) -> SideTable:
    """Return the table that all plate members of one numbering share."""
    if numbering not in _TABLES:
        _TABLES[numbering] = SideTable(mesh)
    return _TABLES[numbering]


def element_sides(mesh: Mesh, corners: IntArray, axes: Array, numbering: Numbering) -> Sides:
    """The sides of elements with corners (e, c) and axes (1|e, 3, 3), rows e1, e2, normal."""
    table = side_table(mesh, numbering)
    pairs = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2)
    keys = pairs[:, :, 0] * table.n_nodes + pairs[:, :, 1]
    vectors = (mesh.points[pairs[:, :, 1]] - mesh.points[pairs[:, :, 0]]).reshape(-1, 3)
    along = orient_normals(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
    plane = np.repeat(np.broadcast_to(axes[:, :2], (len(corners), 2, 3)), corners.shape[1], axis=0)
    dofs = table.sides(keys.ravel(), numbering, plane, along, vectors).reshape(*keys.shape, 2)
    return Sides(dofs, np.isin(keys, table.folds), along.reshape(*keys.shape, 3))


def fold_keys(mesh: Mesh) -> IntArray:
    """Keys (k,), numbers (lower node * n_points + upper node), ascending, of sides where surface cells of different
    planes meet."""
    keys, normals = [np.zeros(0, np.int64)], [np.zeros((0, 3))]
    for name, cells in mesh.cells.items():
        if CELL_TYPES[name].dimension != 2:
            continue
        corners = cells[:, : CELL_TYPES[name].n_corners]
        pairs = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2)
        keys.append((pairs[:, :, 0] * len(mesh.points) + pairs[:, :, 1]).ravel())
        x = mesh.points[corners[:, :3]]
        normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normals.append(np.repeat(normal / np.where(length > 0, length, 1.0), corners.shape[1], axis=0))
    key, normal = np.concatenate(keys), np.concatenate(normals)
    sides, first, which = np.unique(key, return_index=True, return_inverse=True)
    bent = np.linalg.norm(np.cross(normal, normal[first][which]), axis=1) > PLANE_TOLERANCE
    return np.unique(sides[which[bent]])


def member_section(member: Member, coupled: bool = False) -> PlateSection:
    """Return the member's plate section: the given section, or that of a plain sheet of a thickness [m] and the
    member's material.

    coupled: whether the family accepts sections that couple membrane and bending. Raises ValueError if it is neither.
    """
    section, material, where = member.section, member.material, f"{member.family} on group {member.group!r}"
    if isinstance(section, PlateSection):
        if material is not None:
            raise ValueError(f"{where} has a material and a section with its own material; leave one out")
        if section.coupled and not coupled:
            raise ValueError(
                f"{where} has a section that couples membrane and bending, or lies off its nodes; use the family shell"
            )
        return section
    if isinstance(section, int | float | np.floating) and not isinstance(section, bool):
        if not isinstance(material, Material):
            raise ValueError(f"{where} has a thickness but no isotropic material; give one, or a section of plies")
        return isotropic(float(section), material)
    raise ValueError(
        f"{where} has the section {section!r}; give a plate section of femflex.fem.sections.laminates, or a thickness "
        "in metres and a material"
    )


def flat_map(
    mesh: Mesh, corners: IntArray, axes: Array, numbering: Numbering, element_dofs: Array | None = None
) -> LocalDofs:
    """Return the map of elements with corners (e, c) and axes (1|e, 3, 3), rows e1, e2, normal.

    Raw dofs: translations and rotations of the corners, two per side, then element_dofs (e, c + 2): a twist per corner
    and an in-plane bubble. Local: (u, v) of corners, sides (and bubble), then (w, theta_x, theta_y (, twist)) of
    corners.
    """
    e, c = corners.shape
    normals = np.broadcast_to(axes[:, 2], (e, 3))
    nodal = [
        numbering.translation(corners.ravel()),
        numbering.rotation(corners.ravel(), np.repeat(normals, c, axis=0)),
    ]
    sides = element_sides(mesh, corners, axes, numbering)
    dofs = np.concatenate([d.reshape(e, -1) for d in (*nodal, sides.dofs)], axis=1)
    if element_dofs is not None:
        dofs = np.concatenate([dofs, element_dofs], axis=1)
    m = 2 * c + (element_dofs is not None)
    X = _plain_map(axes, c, element_dofs is not None)
    if sides.folds.any():
        X = np.array(np.broadcast_to(X, (e, *X.shape[1:])))
        _follow_folds(X, mesh.points[corners], np.broadcast_to(axes, (e, 3, 3)), sides)
    return LocalDofs(dofs, X, 2 * m)


def _plain_map(axes: Array, c: int, extended: bool) -> Array:
    """X (1|e, local, raw) of elements without folds."""
    m, b = 2 * c + extended, 3 + extended
    X = np.zeros((len(axes), 2 * m + b * c, 8 * c + (c + 2) * extended))
    for i in range(c):
        move, turn = slice(3 * i, 3 * i + 3), slice(3 * (c + i), 3 * (c + i) + 3)
        bend, side = 2 * m + b * i, 2 * (c + i)
        X[:, 2 * i : 2 * i + 2, move], X[:, bend, move] = axes[:, :2], axes[:, 2]
        X[:, bend + 1 : bend + 3, turn] = axes[:, :2]
        X[:, side : side + 2, 6 * c + 2 * i : 6 * c + 2 * i + 2] = np.eye(2)
        if extended:
            X[:, bend + 3, 8 * c + i] = 1.0
    if extended:
        X[:, 2 * m - 2 : 2 * m, 9 * c :] = np.eye(2)
    return X


def _follow_folds(X: Array, x: Array, axes: Array, sides: Sides) -> None:
    """Replace the rows of sides at folds in X (e, local, raw): free along the side, following rotations across it."""
    c = x.shape[1]
    for i in range(c):
        folded = np.flatnonzero(sides.folds[:, i])
        j = (i + 1) % c
        plane, along = axes[folded, :2], sides.along[folded, i]
        across = np.eye(3) - along[:, :, None] * along[:, None, :]
        span = x[folded, j] - x[folded, i]
        rotation_rows = plane @ across @ np.cross(np.eye(3), -span[:, None, :]) / 8
        for row, slot in ((2 * (c + i), 0), (2 * (c + i) + 1, 1)):
            X[folded, row] = 0.0
            X[folded, row, 6 * c + 2 * i] = np.sum(plane[:, slot] * along, axis=1)
            X[folded, row, 3 * (c + i) : 3 * (c + i) + 3] = rotation_rows[:, slot]
            X[folded, row, 3 * (c + j) : 3 * (c + j) + 3] = -rotation_rows[:, slot]
