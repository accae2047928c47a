"""Automatic choices of the tables of bodies, and these tables with the choices filled in."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace

import numpy as np

from femflex.assembly.bodies import marker_groups
from femflex.assembly.decks import with_deck
from femflex.assembly.initial import initial_shape
from femflex.case.body import AnalyticTable, BodyTable, FlexibleTable, Strain
from femflex.case.case import Case
from femflex.case.deploying import DeployingTable
from femflex.fem.support import COMPONENTS
from femflex.reduction.methods import Cantilever, Stretchable
from femflex.reduction.modes.damping import is_added
from femflex.system import System

AXIAL = 2  # axial functions per bending function: the stretch by bending has twice its polynomial degree


def _is_strain_open(table: BodyTable) -> bool:
    bending = isinstance(table, AnalyticTable) and (table.functions.y or table.functions.z)
    unsegmented = isinstance(table, FlexibleTable) and table.segmented_member is None
    return bool(bending or unsegmented) and getattr(table, "strain", None) is None


def _are_joints_open(table: BodyTable) -> bool:
    if isinstance(table, AnalyticTable):
        return table.functions.joints is None and "static" not in table.functions.model_fields_set
    if isinstance(table, DeployingTable):
        f = table.functions
        if f is None or table.family != "beam" or f.family not in (None, "characteristic"):
            return False
        return f.joints is None and not f.model_fields_set & {"static", "tip"}
    if not isinstance(table, FlexibleTable) or table.segmented_member is not None:
        return False
    r = table.reduction
    if not isinstance(r, Stretchable) or r.joints is not None:
        return False
    return not (r.responses or r.deflection or r.third_derivatives or isinstance(r.derivatives, int))


def open_strains(case: Case) -> list[str]:
    """Names of the bodies whose tables do not set the strain."""
    return [name for name, table in case.bodies.items() if _is_strain_open(table)]


def open_joints(case: Case) -> list[str]:
    """Names of the bodies whose tables do not set their static shapes of joints."""
    return [name for name, table in case.bodies.items() if _are_joints_open(table)]


def with_tables(case: Case, tables: Mapping[str, BodyTable]) -> Case:
    """The case in which the tables of some bodies are replaced."""
    return case.model_copy(update={"bodies": {**case.bodies, **tables}}) if tables else case


def with_strains(case: Case, strains: Mapping[str, Strain]) -> Case:
    """The case with the strain of some bodies set; with nonlinear strain, also shapes in which the body stretches."""
    tables = {}
    for name, strain in strains.items():
        table = case.bodies[name]
        stretch = _stretching_shapes(table) if strain == "nonlinear" else {}
        tables[name] = table.model_copy(update={"strain": strain, **stretch})
    return with_tables(case, tables)


def _stretching_shapes(table: BodyTable) -> dict[str, object]:
    """The keys that give a body shapes to stretch in, if its table sets none: derivatives or axial functions."""
    if isinstance(table, AnalyticTable) and not table.functions.axial:
        count = AXIAL * max(table.functions.y, table.functions.z)
        return {"functions": table.functions.model_copy(update={"axial": count})}
    if isinstance(table, FlexibleTable) and getattr(table.reduction, "derivatives", "none") is None:
        assert table.reduction is not None
        return {"reduction": table.reduction.model_copy(update={"derivatives": "auto"})}
    return {}


def with_joints(case: Case, chosen: Mapping[str, Mapping[str, list[str]]]) -> Case:
    """The case with the static shapes of joints of some bodies set: group -> directions; of beams, their ends."""
    return with_tables(case, {name: _with_joints(case.bodies[name], ways) for name, ways in chosen.items()})


def _with_joints(table: BodyTable, ways: Mapping[str, list[str]]) -> BodyTable:
    if isinstance(table, AnalyticTable | DeployingTable):
        assert table.functions is not None
        return table.model_copy(update={"functions": table.functions.model_copy(update={"joints": list(ways)})})
    assert isinstance(table, FlexibleTable) and isinstance(table.reduction, Stretchable)
    return table.model_copy(update={"reduction": table.reduction.model_copy(update={"joints": dict(ways)})})


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
