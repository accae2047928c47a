"""Bodies with all static shapes of their joints, by which it is seen which of these their craft needs."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from femflex.assembly.bodies import marker_groups
from femflex.assembly.decks import with_deck
from femflex.assembly.initial import initial_shape
from femflex.assembly.open_choices import open_joints, with_joints, with_tables
from femflex.case.body import AnalyticTable, BodyTable, FlexibleTable
from femflex.case.case import Case
from femflex.case.deploying import DeployingTable
from femflex.fem.support import COMPONENTS
from femflex.reduction.methods import Cantilever
from femflex.reduction.modes.damping import is_added
from femflex.system import System


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
        requested = table.reduction.model_fields_set if isinstance(table.reduction, Cantilever) else set()
        clamp, groups = getattr(table.reduction, "clamp", {}), {marker_groups(table).get(m, m) for m in markers}
        roots = [*clamp][:1] if "attachment" not in requested else []
        others = sorted(groups - {*clamp, "origin"}) if "loads" not in requested else []
        return {group: list(COMPONENTS) for group in (*roots, *others)}
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
    """The table with linear strain and without derivatives; where bodies start deflected, see `with_deflections`."""
    if isinstance(table, FlexibleTable):
        assert table.reduction is not None
        reduction = table.reduction.model_copy(update={"derivatives": None})
        return table.model_copy(update={"strain": "linear", "reduction": reduction, "initial": None})
    if isinstance(table, AnalyticTable):
        return table.model_copy(update={"strain": "linear", "initial": None})
    return table.model_copy(update={"strain": "linear"})


def with_deflections(case: Case, system: System) -> System:
    """The system of `with_all_static_shapes` whose bodies start as their tables say, without added static shapes.

    A start that these do not reach is left out; it is reported where the body gets its shapes.
    """
    delta, ddelta = dict(system.delta0), dict(system.ddelta0)
    for name in open_joints(case):
        table, body = case.bodies[name].initial, system.bodies[name]
        if table is None or name in delta:
            continue
        added, at = is_added(body.kinds[: body.n_modes]), body.marker(system.joint_of(name).child_marker).position
        without = body.truncated(int(np.argmax(added)) if added.any() else body.n_modes)
        with suppress(ValueError, KeyError):
            start = initial_shape(table, without, at)
            delta[name], ddelta[name] = (np.append(x, np.zeros(body.n_modes - len(x))) for x in start)
    return replace(system, delta0=delta, ddelta0=ddelta)
