"""A line member cut into segments: each is a small mesh with its part of the member and the members attached to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.line.chain import LINE_TYPES, arc_length, straight_elements
from femflex.fem.point_mass import PointMass
from femflex.fem.sections.materials import Material
from femflex.fem.sections.section import Outline, Resultants, Section
from femflex.fem.structure import Member

if TYPE_CHECKING:
    from femflex.mesh import Mesh

NEAR, FAR, ENDS = ".near", ".far", ".ends"  # groups of a segment: its first node, its last, and both
MOST = 500  # segments; more of them hardly change a result except by rounding


@dataclass(frozen=True, eq=False)
class Segment:
    """One segment of a cut member: mesh (whole mesh's coordinates), members and point masses.

    Point groups NEAR, FAR and ENDS are its ends. `groups` names the groups of the whole mesh that lie on it entirely;
    they keep their names.
    """

    mesh: Mesh
    members: tuple[Member, ...]
    point_masses: tuple[PointMass, ...] = ()
    groups: frozenset[str] = frozenset()


@dataclass(frozen=True, eq=False)
class SectionOfSegment:
    """A section that varies along a longer member, as a function of the arc length of a segment: s = start + sign *
    (arc length of the segment)."""

    section: Section
    start: float
    sign: float
    whole_length: float

    @property
    def varies(self) -> bool:
        """Always true, because the section depends on the position of the segment."""
        return True

    def resultants(self, material: Material | None, s: Array, length: Array) -> Resultants:
        """`Section.resultants` of the longer member at arc lengths s (...) [m] of the segment."""
        return self.section.resultants(material, self.start + self.sign * s, np.full_like(length, self.whole_length))

    def outline(self, s: Array, length: Array) -> Outline:
        """`Section.outline` of the longer member at arc lengths s (...) [m] of the segment."""
        return self.section.outline(self.start + self.sign * s, np.full_like(length, self.whole_length))


def cut_into_segments(
    mesh: Mesh,
    members: Sequence[Member],
    k: int,
    group: str | None = None,
    point_masses: Sequence[PointMass] = (),
    start: str | None = None,
) -> tuple[Segment, ...]:
    """Cut the line member on `group` into k equally long segments, counted from the end in point group `start`.

    By default `group` is that of the only line member, and `start` is the member's own option, or the end that its
    cells point away from. Cuts between nodes split the element there. Other members and point masses belong to the
    segment that they are attached to; at a cut, to the first of two. Raises ValueError when k is below 1 or above 500,
    the member is no single open line (see `path_of`), or another member joins two segments or is attached to none.
    """
    if not 1 <= k <= MOST:
        raise ValueError(f"found {k} segments; a line member can be cut into 1 to {MOST}")
    member = _line_member(mesh, members, group)
    elements = straight_elements(mesh.group_cells(member.group))
    path = path_of(mesh, elements, member.group, start or member.options.get("start"))
    sign = _section_sign(mesh, member, elements, path)
    path = path.with_nodes_at_cuts(k)
    others = [other for other in members if other is not member]
    attachments = attached_parts(mesh, others, path, k, member.group)
    middle = path.arc(path.elements).mean(axis=1)
    of_element = np.minimum((middle / path.length * k).astype(np.int64), k - 1)
    groups_of_mesh = all_groups(mesh)
    segments = []
    for j in range(k):
        segment_member = _segment_member(member, path.length, j, k, sign)
        attached_members = tuple(other for other in others if attachments.cells_of(other.group, j))
        lines = path.elements[of_element == j]
        segment_mesh = _segment_mesh(mesh, path, j, lines, member.group, attached_members, attachments)
        masses, groups = _masses(mesh, point_masses, attachments, j)
        names = frozenset(
            name for name, points in groups_of_mesh.items() if np.isin(points, _points_of(segment_mesh)).all()
        )
        segments.append(
            Segment(
                segment_mesh.with_groups(points=groups).compacted(), (segment_member, *attached_members), masses, names
            )
        )
    return tuple(segments)


def _line_member(mesh: Mesh, members: Sequence[Member], group: str | None) -> Member:
    """The member to cut: that of the group, or the only one made of lines."""
    lines = [m for m in members if set(mesh.group_cells(m.group)) <= set(LINE_TYPES)]
    if group is not None:
        members_of_group = [m for m in members if m.group == group]
        if not members_of_group:
            raise ValueError(f"no member lies on group {group!r}; members lie on {[m.group for m in members]}")
        if members_of_group[0] not in lines:
            kinds = sorted(mesh.group_cells(group))
            raise ValueError(
                f"the member on group {group!r} is made of {', '.join(kinds)} cells; only a member of line cells can "
                "be cut into segments"
            )
        return members_of_group[0]
    if len(lines) != 1:
        raise ValueError(
            f"{len(lines)} members are made of line cells ({[m.group for m in lines]}); name the group of the one "
            "that is cut into segments"
        )
    return lines[0]


def _section_sign(mesh: Mesh, member: Member, elements: IntArray, path: Path) -> float:
    """Return 1 if the section's arc length runs like the path, -1 if it runs the other way."""
    if not member.section.varies:
        return 1.0
    arc = arc_length(mesh, elements, member.group, member.options.get("start"))
    return 1.0 if np.allclose(arc.ends, path.arc(elements), atol=1e-9 * path.length) else -1.0


def _segment_member(member: Member, length: float, j: int, k: int, sign: float) -> Member:
    """Return the member on segment j, with a varying section as a function of the segment's arc length."""
    options = {key: v for key, v in member.options.items() if key != "start"}
    if member.family == "beam":
        options.setdefault("extent", length)
    if not member.section.varies:
        return replace(member, options=options)
    start = length * j / k if sign > 0 else length * (1 - j / k)
    return replace(
        member,
        section=SectionOfSegment(member.section, start, sign, length),
        options={**options, "start": NEAR},
    )


def _segment_mesh(
    mesh: Mesh,
    path: Path,
    j: int,
    lines: IntArray,
    group: str,
    attached_members: Sequence[Member],
    attachments: Attachments,
) -> Mesh:
    """Mesh of segment j: its line cells, the cells of other members on it, and the groups that lie on it."""
    from femflex.mesh import Mesh

    cells: dict[str, list[IntArray]] = {"line": [lines]}
    groups: dict[str, dict[str, IntArray]] = {group: {"line": np.arange(len(lines))}}
    for member in attached_members:
        groups[member.group] = {}
        for kind, rows in attachments.cells_of(member.group, j).items():
            count = sum(len(part) for part in cells.get(kind, []))
            cells.setdefault(kind, []).append(mesh.cells[kind][rows])
            groups[member.group][kind] = count + np.arange(len(rows))
    joined = {kind: np.concatenate(parts) for kind, parts in cells.items()}
    part = Mesh(path.points, joined, groups)
    segment_points = _points_of(part)
    points = {
        name: group_points
        for name, group_points in all_groups(mesh).items()
        if name not in groups and np.isin(group_points, segment_points).all()
    }
    ends = path.nodes[[np.flatnonzero(np.isin(path.nodes, lines))[i] for i in (0, -1)]]
    points |= {NEAR: ends[:1], FAR: ends[1:], ENDS: ends}
    return part.with_groups(points=points)


def _points_of(mesh: Mesh) -> IntArray:
    """Points that belong to cells."""
    return np.unique(np.concatenate([rows.ravel() for rows in mesh.cells.values()]))


def all_groups(mesh: Mesh) -> dict[str, IntArray]:
    """Numbers (k,) of the points of every group of a mesh that has any; of a name shared by points and cells, the
    points."""
    groups = {}
    for name, by_type in mesh.cell_groups.items():
        parts = [mesh.cells[kind][rows].ravel() for kind, rows in by_type.items()]
        groups[name] = np.unique(np.concatenate([np.empty(0, np.int64), *parts]))
    return {name: rows for name, rows in {**groups, **mesh.point_groups}.items() if rows.size}


def _masses(
    mesh: Mesh, point_masses: Sequence[PointMass], attachments: Attachments, j: int
) -> tuple[tuple[PointMass, ...], dict[str, IntArray]]:
    """Return the point masses of segment j, and their point groups."""
    masses, groups = [], {}
    for i, mass in enumerate(point_masses):
        points = mesh.group_points(mass.group)
        if (attachments.nodes[points] < 0).any():
            raise ValueError(
                f"{int((attachments.nodes[points] < 0).sum())} of the {points.size} points of group {mass.group!r} "
                "belong to no member, so no mass can stand there; name a group that lies on a member"
            )
        if (points_here := points[attachments.nodes[points] == j]).size:
            groups[f".mass {i}"] = points_here
            masses.append(mass.model_copy(update={"group": f".mass {i}"}))
    return tuple(masses), groups


AT_NODE = 1e-9  # of the whole length; a cut closer than this to a node is at the node


@dataclass(frozen=True, eq=False)
class Path:
    """An open line of straight elements.

    points    (n_p, 3)  the mesh's points and those that cuts have added [m]
    elements  (e, 2)    nodes of each element, in its own direction
    nodes     (m,)      nodes in order along the line
    s         (m,)      arc length of these nodes [m]
    """

    points: Array
    elements: IntArray
    nodes: IntArray
    s: Array

    @property
    def length(self) -> float:
        """Arc length of the whole line [m]."""
        return float(self.s[-1])

    def arc(self, nodes: IntArray) -> Array:
        """Arc length of nodes of the line, in their shape [m]."""
        s_of_point = np.zeros(len(self.points))
        s_of_point[self.nodes] = self.s
        return s_of_point[nodes]

    def with_nodes_at_cuts(self, k: int) -> Path:
        """Return the line with nodes at all multiples of a k-th of its length; elements there are split in two."""
        cuts = self.length * np.arange(1, k) / k
        at_node = np.abs(self.s[None, :] - cuts[:, None]).min(axis=1, initial=np.inf) <= AT_NODE * self.length
        new_s = cuts[~at_node]
        new_points = np.stack([np.interp(new_s, self.s, self.points[self.nodes, axis]) for axis in range(3)], axis=1)
        number = len(self.points) + np.arange(len(new_s))
        nodes, s = np.concatenate([self.nodes, number]), np.concatenate([self.s, new_s])
        order = np.argsort(s, kind="stable")
        ends = self.arc(self.elements)
        elements = []
        for (a, b), (s_a, s_b) in zip(self.elements, ends, strict=True):
            inside = (new_s > min(s_a, s_b)) & (new_s < max(s_a, s_b))
            between = number[inside] if s_a < s_b else number[inside][::-1]
            chain = np.concatenate([[a], between, [b]])
            elements.append(np.stack([chain[:-1], chain[1:]], axis=1))
        points = np.concatenate([self.points, new_points])
        return Path(points, np.concatenate(elements), nodes[order], s[order])


def path_of(mesh: Mesh, elements: IntArray, group: str, start: str | None = None) -> Path:
    """The line that the elements (e, 2), node numbers, of a group form, from the end that lies in the point group
    `start`.

    Without `start` it begins where its cells point away from. Raises ValueError when they branch, close, fall into
    several lines, or when `start` is at neither end.
    """
    nodes, local = np.unique(elements, return_inverse=True)
    local = local.reshape(-1, 2)
    degree = np.bincount(local.ravel(), minlength=nodes.size)
    if degree.max() > 2:
        raise ValueError(
            f"group {group!r} branches at {int((degree > 2).sum())} of its nodes; only a single line can be cut into "
            "segments, so make each branch a group and a member of its own"
        )
    length = np.linalg.norm(mesh.points[elements[:, 1]] - mesh.points[elements[:, 0]], axis=1)
    graph = sparse.coo_array((length, (local[:, 0], local[:, 1])), shape=(nodes.size, nodes.size)).tocsr()
    n_lines = int(csgraph.connected_components(graph, directed=False)[0])
    ends = np.flatnonzero(degree == 1)
    if n_lines > 1:
        raise ValueError(
            f"group {group!r} falls into {n_lines} lines that share no node; only a single line can be cut into "
            "segments, so make each a group and a member of its own"
        )
    if not ends.size:
        raise ValueError(
            f"group {group!r} is a closed line, which has no end to begin at; only an open line can be cut into "
            "segments, so open it, or divide it into two members"
        )
    begin = _begin(mesh, nodes, ends, local, group, start)
    s = csgraph.dijkstra(graph, directed=False, indices=np.array([begin]))[0]
    order = np.argsort(s, kind="stable")
    return Path(mesh.points, elements, nodes[order], s[order])


def _begin(mesh: Mesh, nodes: IntArray, ends: IntArray, local: IntArray, group: str, start: str | None) -> int:
    """Return the end, as an index into `nodes`, where the line begins."""
    if start is None:
        pointing_away = np.isin(ends, local[:, 0])
        return int(ends[np.lexsort((ends, ~pointing_away))[0]])
    matching_ends = ends[np.isin(nodes[ends], mesh.group_points(start))]
    if matching_ends.size != 1:
        where = "both ends" if matching_ends.size else "neither end"
        raise ValueError(
            f"group {start!r} lies at {where} of the line {group!r}; name the group of the one end where its segments "
            "are counted from"
        )
    return int(matching_ends[0])


@dataclass(frozen=True, eq=False)
class Attachments:
    """The segment of each point (n_points,), -1 for points without a member, and the segments of the members' cells.

    cells  group -> cell type -> (rows of the mesh's cells, their segments)
    """

    nodes: IntArray
    cells: dict[str, dict[str, tuple[IntArray, IntArray]]]

    def cells_of(self, group: str, j: int) -> dict[str, IntArray]:
        """Indices (k,) of the cells of a member that go with segment j, by cell type."""
        rows_by_kind = {kind: rows[segment == j] for kind, (rows, segment) in self.cells[group].items()}
        return {kind: rows for kind, rows in rows_by_kind.items() if rows.size}


def attached_parts(mesh: Mesh, others: Sequence[Member], path: Path, k: int, group: str) -> Attachments:
    """Assign everything to one of the k segments of the line of `group`; connected parts of other members are assigned
    as a whole.

    A part consists of cells that share points off the line. Raises ValueError when a part touches several segments, or
    none.
    """
    on = segments_of(path, k)
    nodes = np.where(on.any(axis=1), on.argmax(axis=1), -1)
    cells: dict[str, dict[str, tuple[IntArray, IntArray]]] = {other.group: {} for other in others}
    member_cells = [(o.group, kind, rows) for o in others for kind, rows in mesh.cell_groups[o.group].items()]
    if not member_cells:
        return Attachments(nodes, cells)
    corner = [mesh.cells[kind][rows] for _, kind, rows in member_cells]
    owner = np.concatenate([np.full(len(c), i) for i, c in enumerate(corner)])
    cell = np.concatenate([np.repeat(np.flatnonzero(owner == i), c.shape[1]) for i, c in enumerate(corner)])
    node = np.concatenate([c.ravel() for c in corner])
    part = _parts(node, cell, np.asarray(~on.any(axis=1)), len(owner))
    allowed = np.ones((part.max() + 1, k), bool)
    touched = np.zeros(part.max() + 1, bool)
    line = np.asarray(on[node].any(axis=1))
    np.logical_and.at(allowed, part[len(on) + cell[line]], on[node[line]])
    touched[part[len(on) + cell[line]]] = True
    part_of_cell = part[len(on) :]
    for i, (name, _, _) in enumerate(member_cells):
        _check(allowed[part_of_cell[owner == i]], touched[part_of_cell[owner == i]], name, group, k)
    segment = allowed.argmax(axis=1)
    off = ~on[node].any(axis=1)
    nodes[node[off]] = segment[part_of_cell[cell[off]]]
    for i, (name, kind, rows) in enumerate(member_cells):
        cells[name][kind] = (rows, segment[part_of_cell[owner == i]])
    return Attachments(nodes, cells)


def segments_of(path: Path, k: int) -> BoolArray:
    """Mask (n_points, k) of the segments that each point lies on; a cut lies on two."""
    position = path.s / path.length * k
    on = np.zeros((len(path.points), k), bool)
    slack = 2 * AT_NODE * k
    for j in range(k):
        on[path.nodes, j] = (position >= j - slack) & (position <= j + 1 + slack)
    return on


def _parts(node: IntArray, cell: IntArray, off: BoolArray, n_cells: int) -> IntArray:
    """Part numbers of all points and then of all cells: cells that share points off the line are one part."""
    kept = off[node]
    size = len(off) + n_cells
    graph = sparse.coo_array((np.ones(kept.sum()), (node[kept], len(off) + cell[kept])), shape=(size, size))
    return csgraph.connected_components(graph, directed=False)[1].astype(np.int64)


def _check(allowed: BoolArray, touched: BoolArray, name: str, group: str, k: int) -> None:
    """Raise ValueError when cells of a member cannot go with one segment."""
    if not touched.all():
        raise ValueError(
            f"the member on group {name!r} has parts that do not touch the line {group!r}, which is cut into {k} "
            "segments; every part must be attached to a segment; make them a separate body"
        )
    if not allowed.any(axis=1).all():
        raise ValueError(
            f"the member on group {name!r} holds several of the {k} segments of {group!r} together, so the line cannot "
            "be cut there; take fewer segments, or make that member a body of its own joined by a joint"
        )
