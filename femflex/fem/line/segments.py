"""A line member cut into segments: each is a small mesh with its part of the member and the members attached to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.line.attachments import Attachments, attached_parts
from femflex.fem.line.chain import LINE_TYPES, arc_length, straight_elements
from femflex.fem.line.path import Path, path_of
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
