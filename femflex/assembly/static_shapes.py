"""Bodies with all static shapes of their joints, by which it is seen which of these their craft needs."""

from __future__ import annotations

from femflex.assembly.bodies import marker_groups
from femflex.assembly.decks import with_deck
from femflex.assembly.open_choices import open_joints, with_joints, with_tables
from femflex.case.body import AnalyticTable, BodyTable, FlexibleTable
from femflex.case.case import Case
from femflex.case.deploying import DeployingTable
from femflex.case.reduction import CantileverTable
from femflex.case.support import DIRECTIONS


def with_all_static_shapes(case: Case) -> Case:
    """The case whose bodies that leave their static shapes of joints open have all of them, and linear strain."""
    joints = {name: static_shapes(case, name) for name in open_joints(case)}
    return with_joints(with_tables(case, {name: _linear(case.bodies[name]) for name in joints}), joints)


def static_shapes(case: Case, name: str) -> dict[str, list[str]]:
    """All static shapes of the joints of a body that its table leaves open: group -> directions; of beams, the ends.

    They are those of accelerations of its root, and those of forces and moments at joints, loops, constraints and
    springs elsewhere.
    """
    table, markers = case.bodies[name], joined_markers(case, name)
    if isinstance(table, FlexibleTable):
        table = with_deck(case, name, table)
        requested = table.reduction.model_fields_set if isinstance(table.reduction, CantileverTable) else set()
        clamp, groups = getattr(table.reduction, "clamp", {}), {marker_groups(table).get(m, m) for m in markers}
        roots = [*clamp][:1] if "attachment" not in requested else []
        others = sorted(groups - {*clamp, "origin"}) if "loads" not in requested else []
        return {group: list(DIRECTIONS) for group in (*roots, *others)}
    return {end: [] for end in ("root", *["tip"] * any(_is_tip(table, marker) for marker in markers))}


def joined_markers(case: Case, name: str) -> set[str]:
    """The markers of a body at joints, loops, constraints and springs."""
    ends = [(joint.child, joint.child_marker) for joint in (*case.joints, *case.loops)]
    ends += [(joint.parent or "", joint.parent_marker) for joint in (*case.joints, *case.loops)]
    ends += [(tie.body or "", tie.marker) for tie in (*case.springs, *case.constraints)]
    ends += [(tie.parent or "", tie.parent_marker) for tie in (*case.springs, *case.constraints)]
    return {marker for body, marker in ends if body == name}


def _is_tip(table: BodyTable, marker: str) -> bool:
    """Whether a marker of a beam, or of a member that deploys, is at its tip."""
    entry = table.markers.get(marker)
    if isinstance(table, DeployingTable):
        return marker == "tip" or (entry is not None and getattr(entry, "fraction", None) == 1.0)
    return "tip" in (marker, entry and entry.group)


def _linear(table: BodyTable) -> BodyTable:
    """The table with linear strain and without derivatives, where it has these keys."""
    if isinstance(table, FlexibleTable):
        assert table.reduction is not None
        reduction = table.reduction.model_copy(update={"derivatives": None})
        return table.model_copy(update={"strain": "linear", "reduction": reduction})
    return table.model_copy(update={"strain": "linear"}) if isinstance(table, AnalyticTable) else table
