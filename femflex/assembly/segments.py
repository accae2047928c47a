"""Build a body of a case whose line member is cut into segments."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from femflex.assembly.structures import members_of
from femflex.case.body import FlexibleTable
from femflex.case.case import Case
from femflex.fem import Structure, cut_into_segments
from femflex.fem.line.chain import straight_elements
from femflex.fem.line.segments import NEAR
from femflex.mesh import Mesh
from femflex.noun.problems import CaseError, Problem
from femflex.reduction import (
    ModeSet,
    cantilever_modes,
    chord_modes,
    free_free_modes,
    nodal,
    reduce_segments,
    with_attachment,
)
from femflex.reduction.methods import Cantilever, CraigBampton, FreeFree, Nodal, with_static_derivatives
from femflex.system import Segments
from femflex.warning import warn_of_physics


def build_segments(
    case: Case,
    name: str,
    table: FlexibleTable,
    mesh: Mesh,
    markers: Mapping[str, str],
    modes: int | None = None,
    segments: int | None = None,
    patches: Sequence[str] = (),
) -> Segments:
    """The Segments of a body, with `segments` of them or `modes` modes each instead of the case's numbers if given.

    markers: name -> group; patches: groups over which forces are spread. Raises CaseError if its member cannot be cut.
    """
    member = table.segmented_member
    assert member is not None
    groups = [*getattr(table.reduction, "clamp", ()), *getattr(table.reduction, "interfaces", ())]
    start_group = None if member.options.get("start") else _end_among(mesh, member.group, groups)
    members = members_of(case, name, table)
    count = segments or member.segments
    assert count is not None
    try:
        pieces = cut_into_segments(mesh, members, count, member.group, table.point_masses, start_group)
    except ValueError as error:
        where = f"bodies.{name}.members[{member.group}].segments"
        raise CaseError(case.path.name, [Problem(where, str(error))]) from error
    if prestress := member.options.get("prestress"):
        warn_of_physics(
            "{body_or_joint}: the prestress of {value:g} N on {group!r} relaxes to 0 N, because its segments are "
            "welded end to end and no support reacts it.",
            body_or_joint=f"bodies.{name}",
            value=prestress,
            remedy="Remove segments or the prestress",
            group=member.group,
        )
    all_markers = {**{group: group for group in groups}, **markers}
    shapes = _segment_shapes(table, modes, f"bodies.{name}")
    return Segments(reduce_segments(pieces, all_markers, shapes, table.damping, table.strain or "linear", patches))


def _end_among(mesh: Mesh, line: str, groups: list[str]) -> str | None:
    """The first of the groups that contains exactly one end of the line; None if there is none."""
    nodes, count = np.unique(straight_elements(mesh.group_cells(line)), return_counts=True)
    ends = nodes[count == 1]
    return next((group for group in groups if np.isin(ends, mesh.group_points(group)).sum() == 1), None)


def _segment_shapes(table: FlexibleTable, modes: int | None, where: str) -> Callable[[Structure], ModeSet]:
    """A function that returns the set of a segment, with derivatives if its strain needs them and the case allows."""
    modes_of, derivatives = _segment_modes(table, modes), getattr(table.reduction, "derivatives", None)
    if derivatives is None and table.strain not in (None, "linear"):
        derivatives = "auto"
    deflection = getattr(table.reduction, "deflection", None)
    return (
        modes_of
        if derivatives in (None, "none", 0)
        else lambda s: with_static_derivatives(s, modes_of(s), derivatives, deflection, where)
    )


def _segment_modes(table: FlexibleTable, modes: int | None) -> Callable[[Structure], ModeSet]:
    """A function that returns the modes of a segment by the body's reduction, with its ends as clamp and interfaces."""
    r = table.reduction
    n = getattr(r, "modes", 0) if modes is None else modes
    if isinstance(r, Cantilever):
        directions = tuple(r.attachment)
        if directions:
            return lambda s: with_attachment(s, cantilever_modes(s, NEAR, n), directions)
        return lambda s: cantilever_modes(s, NEAR, n)
    if isinstance(r, FreeFree):
        return lambda s: free_free_modes(s, n)
    if isinstance(r, Nodal):
        return lambda s: nodal(s, NEAR)
    assert r is None or isinstance(r, CraigBampton)
    return lambda s: chord_modes(s, n)
