"""A line member cut into segments: each a small mesh with its part of the member and the members attached to it."""

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
MOST = 500  # segments; more hardly change an answer but for rounding


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
class Stretch:
    """A section that varies along a longer member, seen from a segment: s = at + sign * (arc length there)."""

    section: Section
    at: float
    sign: float
    whole: float

    @property
    def varies(self) -> bool:
        """Always: it depends on where the segment lies."""
        return True

    def resultants(self, material: Material | None, s: Array, length: Array) -> Resultants:
        """`Section.resultants` of the longer member at arc lengths s (...) [m] of the segment."""
        return self.section.resultants(material, self.at + self.sign * s, np.full_like(length, self.whole))

    def outline(self, s: Array, length: Array) -> Outline:
        """`Section.outline` of the longer member at arc lengths s (...) [m] of the segment."""
        return self.section.outline(self.at + self.sign * s, np.full_like(length, self.whole))


def cut(
    mesh: Mesh,
    members: Sequence[Member],
    k: int,
    group: str | None = None,
    point_masses: Sequence[PointMass] = (),
    start: str | None = None,
) -> tuple[Segment, ...]:
    """The k segments, equally long, of the line member on `group`, from the end in point group `start`.

    Left out, `group` is that of the only line member, `start` the member's own option, or the end its cells point
    away from. Cuts between nodes split the element there. Other members and point masses go with the segment they
    hang on; of two at a cut, with the first. Raises ValueError when k is below 1 or above 500, the member is no single
    open line (see `path_of`), or another member joins two segments or is attached to none.
    """
    if not 1 <= k <= MOST:
        raise ValueError(f"found {k} segments; a line member can be cut into 1 to {MOST}")
    member = _line_member(mesh, members, group)
    elements = straight_elements(mesh.group_cells(member.group))
    path = path_of(mesh, elements, member.group, start or member.options.get("start"))
    sign = _section_sign(mesh, member, elements, path)
    path = path.divided(k)
    others = [other for other in members if other is not member]
    attached = attached_parts(mesh, others, path, k, member.group)
    middle = path.arc(path.elements).mean(axis=1)
    of_element = np.minimum((middle / path.length * k).astype(np.int64), k - 1)
    everything = all_groups(mesh)
    segments = []
    for j in range(k):
        own = _own_member(member, path.length, j, k, sign)
        held = tuple(other for other in others if attached.cells_of(other.group, j))
        lines = path.elements[of_element == j]
        part = _part_mesh(mesh, path, j, lines, member.group, held, attached)
        masses, groups = _masses(mesh, point_masses, attached, j)
        whole = frozenset(name for name, at in everything.items() if np.isin(at, _points_of(part)).all())
        segments.append(Segment(part.with_groups(points=groups).compacted(), (own, *held), masses, whole))
    return tuple(segments)


def _line_member(mesh: Mesh, members: Sequence[Member], group: str | None) -> Member:
    """The member to cut: that of the group, or the only one made of lines."""
    lines = [m for m in members if set(mesh.group_cells(m.group)) <= set(LINE_TYPES)]
    if group is not None:
        chosen = [m for m in members if m.group == group]
        if not chosen:
            raise ValueError(f"no member lies on group {group!r}; members lie on {[m.group for m in members]}")
        if chosen[0] not in lines:
            kinds = sorted(mesh.group_cells(group))
            raise ValueError(
                f"the member on group {group!r} is made of {', '.join(kinds)} cells; only a member of line cells can "
                "be cut into segments"
            )
        return chosen[0]
    if len(lines) != 1:
        raise ValueError(
            f"{len(lines)} members are made of line cells ({[m.group for m in lines]}); name the group of the one "
            "that is cut into segments"
        )
    return lines[0]


def _section_sign(mesh: Mesh, member: Member, elements: IntArray, path: Path) -> float:
    """1 when the section's arc length runs as the path, -1 when it runs the other way."""
    if not member.section.varies:
        return 1.0
    arc = arc_length(mesh, elements, member.group, member.options.get("start"))
    return 1.0 if np.allclose(arc.ends, path.arc(elements), atol=1e-9 * path.length) else -1.0


def _own_member(member: Member, length: float, j: int, k: int, sign: float) -> Member:
    """The member on segment j: a section that varies is seen from there."""
    options = {key: v for key, v in member.options.items() if key != "start"}
    if member.family == "beam":
        options.setdefault("extent", length)
    if not member.section.varies:
        return replace(member, options=options)
    at = length * j / k if sign > 0 else length * (1 - j / k)
    return replace(
        member,
        section=Stretch(member.section, at, sign, length),
        options={**options, "start": NEAR},
    )


def _part_mesh(
    mesh: Mesh, path: Path, j: int, lines: IntArray, group: str, held: Sequence[Member], attached: Attachments
) -> Mesh:
    """Mesh of segment j: its line cells, the cells of other members on it, and the groups that lie on it."""
    from femflex.mesh import Mesh

    cells: dict[str, list[IntArray]] = {"line": [lines]}
    groups: dict[str, dict[str, IntArray]] = {group: {"line": np.arange(len(lines))}}
    for member in held:
        groups[member.group] = {}
        for kind, rows in attached.cells_of(member.group, j).items():
            at = sum(len(part) for part in cells.get(kind, []))
            cells.setdefault(kind, []).append(mesh.cells[kind][rows])
            groups[member.group][kind] = at + np.arange(len(rows))
    joined = {kind: np.concatenate(parts) for kind, parts in cells.items()}
    part = Mesh(path.points, joined, groups)
    mine = _points_of(part)
    points = {name: at for name, at in all_groups(mesh).items() if name not in groups and np.isin(at, mine).all()}
    ends = path.nodes[[np.flatnonzero(np.isin(path.nodes, lines))[i] for i in (0, -1)]]
    points |= {NEAR: ends[:1], FAR: ends[1:], ENDS: ends}
    return part.with_groups(points=points)


def _points_of(mesh: Mesh) -> IntArray:
    """Points that belong to cells."""
    return np.unique(np.concatenate([rows.ravel() for rows in mesh.cells.values()]))


def all_groups(mesh: Mesh) -> dict[str, IntArray]:
    """Numbers (k,) of the points of every group of a mesh that has any; of a name shared by points and cells, the
    points."""
    found = {}
    for name, by_type in mesh.cell_groups.items():
        parts = [mesh.cells[kind][rows].ravel() for kind, rows in by_type.items()]
        found[name] = np.unique(np.concatenate([np.empty(0, np.int64), *parts]))
    return {name: rows for name, rows in {**found, **mesh.point_groups}.items() if rows.size}


def _masses(
    mesh: Mesh, point_masses: Sequence[PointMass], attached: Attachments, j: int
) -> tuple[tuple[PointMass, ...], dict[str, IntArray]]:
    """Point masses that segment j holds, and the point groups they stand at."""
    masses, groups = [], {}
    for i, mass in enumerate(point_masses):
        at = mesh.group_points(mass.group)
        if (attached.nodes[at] < 0).any():
            raise ValueError(
                f"{int((attached.nodes[at] < 0).sum())} of the {at.size} points of group {mass.group!r} belong to no "
                "member, so no mass can stand there; name a group that lies on a member"
            )
        if (here := at[attached.nodes[at] == j]).size:
            groups[f".mass {i}"] = here
            masses.append(replace(mass, group=f".mass {i}"))
    return tuple(masses), groups
