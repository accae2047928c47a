"""What acts on a meshed body where the case says: loads, weight, a steady spin, the bodies and loops that hang on it.

Where strain is linear and the reduction says nothing of `loads`, the static shapes of those of the case's loads stand
added to modes that answer these by less than 99 % (attached bodies: `joint_shapes`). With nonlinear strain they
count for more: vibration modes hold the stress under such a load badly, and four of them let a strip tip over sideways
17 % too late. There the slow static shapes of all these are added to the modes; that of weight and spin where the
reduction says nothing of `attachment`. A spin pulls at every place by its distance: the answers to
accelerations of the clamp are close to how modes change under it (at 12 sqrt(EI / m L^4) four modes are 2 % off in the
first frequency, eight 0.2 %, and four with four of these 0.02 %).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from femflex.assembly.loads import build_load
from femflex.case.body import FlexibleTable
from femflex.case.case import Case
from femflex.case.joint_base import JointTable
from femflex.case.reduction import CantileverTable
from femflex.case.support import DIRECTIONS
from femflex.reduction import ModeSet
from femflex.reduction.modes.damping import UNANSWERED

LEFT_OVER = 0.01  # of a load's static work, by which modes with linear strain may fall short


@dataclass(frozen=True)
class ActingLoads:
    """What acts on a body.

    loads   mesh group -> directions of forces and moments
    base    directions of accelerations of its clamp, in whose way it is pulled
    causes  the loads that act so, in words
    least   share of a load's work that the modes must leave over
    """

    loads: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    base: tuple[str, ...] = ()
    causes: tuple[str, ...] = ()
    least: float = 0.0

    def __bool__(self) -> bool:
        return bool(self.loads or self.base)


def acting_loads(case: Case, name: str, table: FlexibleTable, groups: Mapping[str, str]) -> ActingLoads:
    """What acts on a body whose reduction leaves it to the case which static shapes it keeps; else nothing.

    groups: the mesh group of every marker. A load whose axes are not the body's may come to point along any of them.
    """
    r, linear = table.reduction, (table.strain or "linear") == "linear"
    own = {"condensed": (None, "auto"), "nonlinear": ("auto",)}.get(table.strain or "linear", (None, "none"))
    if (
        not isinstance(r, CantileverTable)
        or r.derivatives not in own
        or r.third_derivatives
        or r.deflection is not None
        or table.segmented_member is not None
    ):
        return ActingLoads()
    if linear:
        return ActingLoads(_loaded(load_directions(case, name), r, groups), least=LEFT_OVER)
    asked = "attachment" not in r.model_fields_set
    heavy, spun = asked and any(case.environment.gravity), asked and spins_steadily(case) if r.spin is None else r.spin
    loads = _loaded((*load_directions(case, name), *_carried(case, name)), r, groups)
    causes = ("weight",) * heavy + ("spin",) * spun
    ways = DIRECTIONS if spun else DIRECTIONS[:3] if heavy else ()
    return ActingLoads(loads, tuple(way for way in ways if way not in r.attachment), causes)


def _loaded(
    pushed: Iterable[tuple[str, list[str]]], r: CantileverTable, groups: Mapping[str, str]
) -> dict[str, tuple[str, ...]]:
    """Mesh groups and directions of pushes at markers, but at clamps; none where the reduction says its loads."""
    found: dict[str, set[str]] = {}
    for marker, directions in () if "loads" in r.model_fields_set else pushed:
        if (group := groups.get(marker)) is not None and group not in r.clamp:
            found.setdefault(group, set()).update(directions)
    return {group: tuple(d for d in DIRECTIONS if d in some) for group, some in found.items() if some}


def spins_steadily(case: Case) -> bool:
    """Whether the craft of a case spins steadily, in a run or in its diagram over speeds."""
    return case.campbell is not None or (case.attitude.frame == "spinning" and any(case.attitude.spin or ()))


def load_directions(case: Case, name: str) -> Iterator[tuple[str, list[str]]]:
    """The markers of a body that loads of the case push, and the directions in which they may."""
    for table in case.loads:
        if table.body != name:
            continue
        with suppress(ValueError, OSError):  # reported where the loads of the case are built
            load = build_load(case, table)
            pushed = [bool(column.any()) for value in (load.force, load.torque) for column in np.atleast_2d(value).T]
            if load.frame != "body":
                pushed = [any(pushed[:3])] * 3 + [any(pushed[3:])] * 3
            yield table.marker, [d for d, some in zip(DIRECTIONS, pushed, strict=True) if some]


def _carried(case: Case, name: str) -> Iterator[tuple[str, list[str]]]:
    """Markers with attached bodies, and the directions of their loads; a ball joint transmits no moment."""
    loops: list[JointTable] = list(case.loops)
    ends = [(joint, joint.parent, joint.parent_marker) for joint in (*case.joints, *loops)]
    ends += [(loop, loop.child, loop.child_marker) for loop in loops]
    for joint, body, marker in ends:
        if body == name:
            yield marker, list(DIRECTIONS[:3] if joint.kind == "spherical" else DIRECTIONS)


def added_shapes_text(found: ActingLoads, modes: ModeSet, joints: Mapping[str, Sequence[str]]) -> str:
    """Note on the static shapes that were added for the loads of a body; joints: those added for its joints."""
    count = modes.kinds.count("attachment") + modes.kinds.count(UNANSWERED)
    if not count or not (found or joints):
        return ""
    parts, keys = [], []
    if found:
        places = [f"{group} {' '.join(directions)}" for group, directions in found.loads.items()]
        parts.append(f"of its loads ({', '.join([*places, *found.causes])})")
        keys += ["loads = {}"] * bool(found.loads) + ["attachment = []"] * bool(found.base)
    if joints:
        parts.append(f"of its joints ({', '.join(f'{group} {chr(32).join(ways)}' for group, ways in joints.items())})")
        keys.append("joints = {}")
    shapes = "1 static shape" if count == 1 else f"{count} static shapes"
    left_out = f"({' and '.join(keys)} in its reduction would leave them out)"
    return f"{shapes} {' and '.join(parts)} in addition to its modes {left_out}"
