"""Loads and attached bodies that determine the static shapes of a body, and torques on its markers.

With linear strain, if the reduction does not set `loads`, the static shape of a load or a disturbance of the case is
added to the modes where these represent less than 99 % of its static work (for attached bodies see `joint_shapes`).
With it sums over modes converge: what the modes above those of the body contribute is quasi-static.

With nonlinear strain static shapes matter more: vibration modes represent the stress under a load badly. With four of
them a strip buckles laterally 17 % too late. There the slow static shapes of all loads, and of attached bodies and
loops, are added; those of weight and spin only if the reduction does not set `attachment`. The centrifugal load of a
spin grows with the distance from the axis, so that the static responses to accelerations of the clamp are close to the
change of the modes: at 12 sqrt(EI / m L^4) the first frequency is 2 % off with four modes, 0.2 % with eight, and 0.02 %
with four modes and four of these shapes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array
from femflex.case.body import BodyTable, FlexibleTable
from femflex.case.case import Case
from femflex.disturbances import BaseMotion, MarkerDisturbance
from femflex.fem import Structure
from femflex.fem.support import COMPONENTS
from femflex.noun.problems import CaseError, Problem
from femflex.reduction import ModeSet
from femflex.reduction.boundary.markers import MarkerRows, marker_rows
from femflex.reduction.methods import Cantilever
from femflex.reduction.modes.damping import UNANSWERED
from femflex.system import Load
from femflex.system.joints.noun import JointNoun

LEFT_OVER = 0.01  # share of a load's static work that modes with linear strain may lack


@dataclass(frozen=True)
class ActingLoads:
    """Loads on a body whose static shapes may be added to its modes.

    loads   mesh group -> directions of forces and moments
    base    directions of accelerations of its clamp
    causes  names of the loads that act as such accelerations
    least   least share of a load's work that the modes lack, for its static shape to be added
    induced groups in which effectors induce strain
    """

    loads: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    base: tuple[str, ...] = ()
    causes: tuple[str, ...] = ()
    least: float = 0.0
    induced: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.loads or self.base or self.induced)


def acting_loads(case: Case, name: str, table: FlexibleTable, groups: Mapping[str, str]) -> ActingLoads:
    """The loads on a body whose reduction does not set its static shapes; no loads otherwise.

    groups: the mesh group of every marker. A load given in axes that are not the body's may point along any of them.
    """
    r, linear = table.reduction, (table.strain or "linear") == "linear"
    automatic = {"condensed": (None, "auto"), "nonlinear": ("auto",)}.get(table.strain or "linear", (None, "none"))
    if (
        not isinstance(r, Cantilever)
        or r.derivatives not in automatic
        or r.third_derivatives
        or r.deflection is not None
        or table.segmented_member is not None
    ):
        return ActingLoads()
    if linear:
        shaken = any(isinstance(noun, BaseMotion) for noun in case.disturbances.values())
        base = tuple(d for d in COMPONENTS[:3] * shaken if d not in r.attachment)
        causes = ("the shaken base",) * bool(base)
        loads = _loads_by_group(load_directions(case, name), r, groups)
        return ActingLoads(loads, base, causes, LEFT_OVER, tuple(induced_groups(case, name)))
    is_open = "attachment" not in r.model_fields_set
    weight, spin = (
        is_open and any(case.environment.gravity),
        is_open and spins_steadily(case) if r.spin is None else r.spin,
    )
    loads = _loads_by_group((*load_directions(case, name), *_attached_body_loads(case, name)), r, groups)
    causes = ("weight",) * weight + ("spin",) * spin
    directions = COMPONENTS if spin else COMPONENTS[:3] if weight else ()
    base = tuple(direction for direction in directions if direction not in r.attachment)
    return ActingLoads(loads, base, causes, induced=tuple(induced_groups(case, name)))


def induced_groups(case: Case, name: str) -> list[str]:
    """Groups of a body in which effectors of the case induce strain."""
    nouns = [noun for named in case.effectors.values() for noun in named.values()]
    return sorted({group for noun in nouns for body, group in noun.strained_groups() if body == name})


def _loads_by_group(
    pushed: Iterable[tuple[str, list[str]]], r: Cantilever, groups: Mapping[str, str]
) -> dict[str, tuple[str, ...]]:
    """Mesh groups and directions of the loads at markers, without clamps; none where the reduction sets `loads`."""
    by_group: dict[str, set[str]] = {}
    for marker, directions in () if "loads" in r.model_fields_set else pushed:
        if (group := groups.get(marker)) is not None and group not in r.clamp:
            by_group.setdefault(group, set()).update(directions)
    return {group: tuple(d for d in COMPONENTS if d in loaded) for group, loaded in by_group.items() if loaded}


def spins_steadily(case: Case) -> bool:
    """Whether the spacecraft of a case spins steadily, in a run or in its Campbell diagram."""
    return case.campbell is not None or (case.attitude.frame == "spinning" and any(case.attitude.spin or ()))


def load_directions(case: Case, name: str) -> Iterator[tuple[str, list[str]]]:
    """The markers of a body with loads and disturbances of the case, and the possible directions of these."""
    for noun in case.disturbances.values():
        if isinstance(noun, MarkerDisturbance) and noun.body == name:
            yield noun.marker, list(COMPONENTS)
    for table in case.loads:
        if table.body != name:
            continue
        with suppress(ValueError, OSError):  # reported where the loads of the case are built
            load = table.read_from(case.path.parent)
            loaded = [bool(column.any()) for value in (load.force, load.torque) for column in np.atleast_2d(value).T]
            if load.frame != "body":
                loaded = [any(loaded[:3])] * 3 + [any(loaded[3:])] * 3
            yield table.marker, [d for d, is_loaded in zip(COMPONENTS, loaded, strict=True) if is_loaded]


def _attached_body_loads(case: Case, name: str) -> Iterator[tuple[str, list[str]]]:
    """Markers with attached bodies, and the directions of their loads; a ball joint transmits no moment."""
    loops: list[JointNoun] = list(case.loops)
    ends = [(joint, joint.parent, joint.parent_marker) for joint in (*case.joints, *loops)]
    ends += [(loop, loop.child, loop.child_marker) for loop in loops]
    for joint, body, marker in ends:
        if body == name:
            yield marker, list(COMPONENTS[:3] if joint.kind == "spherical" else COMPONENTS)


def added_shapes_text(acting: ActingLoads, modes: ModeSet, joints: Mapping[str, Sequence[str]]) -> str:
    """A note on the static shapes that were added to the modes of a body for its loads and for its joints.

    joints: mesh group -> directions of the shapes added for joints
    """
    count = modes.kinds.count("attachment") + modes.kinds.count(UNANSWERED)
    if not count or not (acting or joints):
        return ""
    parts, keys = [], []
    if acting:
        loaded = [f"{group} {' '.join(directions)}" for group, directions in acting.loads.items()]
        parts.append(f"of its loads ({', '.join([*loaded, *acting.causes])})")
        keys += ["loads = {}"] * bool(acting.loads) + ["attachment = []"] * bool(acting.base)
    if joints:
        parts.append(
            f"of its joints ({', '.join(f'{group} {chr(32).join(at_joint)}' for group, at_joint in joints.items())})"
        )
        keys.append("joints = {}")
    shapes = "1 static shape" if count == 1 else f"{count} static shapes"
    left_out = f"({' and '.join(keys)} in its reduction would leave them out)"
    return f"{shapes} {' and '.join(parts)} in addition to its modes {left_out}"


NEGLIGIBLE = 1e-9  # share of a torque about axes without rotation that is rounding of its direction


def check_torques(case: Case, name: str, groups: Mapping[str, str], structure: Structure) -> None:
    """Raise CaseError for torques on a body about axes about which their markers have no rotation.

    groups: mesh group of each marker. In frames that do not rotate with the body a torque may point along any axis: it
    is refused only if the marker has no rotation at all.
    """
    problems = []
    for load in torque_loads(case, name):
        if load.marker in groups:
            rows = marker_rows(structure, groups[load.marker])
            if text := _lost_torque_text(load, rows, case.bodies[name]):
                problems.append(Problem(f"loads[{load.name}].torque", text))
    if problems:
        raise CaseError(case.path.name, problems)


def torque_loads(case: Case, name: str) -> Iterator[Load]:
    """The loads on a body that have a torque. Loads that cannot be read are reported by `problems_of_loads`."""
    for load in case.loads:
        with suppress(ValueError, OSError):
            if load.body == name and (torque_load := load.read_from(case.path.parent)).torque.any():
                yield torque_load


def _lost_torque_text(load: Load, rows: MarkerRows, table: BodyTable) -> str:
    """The message on a torque about axes about which its marker has no rotation; empty if there is none."""
    blind = rows.blind
    if not blind.shape[1]:
        return ""
    axes = np.eye(3)
    if load.frame == "marker" and (entry := table.markers.get(load.marker)) is not None and entry.orientation:
        axes = np.array(entry.orientation)
    along = np.atleast_2d(load.torque) @ axes.T @ blind
    if load.frame not in ("body", "marker"):
        along = along if blind.shape[1] == 3 else 0.0 * along
    largest = float(np.linalg.norm(along, axis=1).max())
    if largest <= NEGLIGIBLE * float(np.linalg.norm(np.atleast_2d(load.torque), axis=1).max()):
        return ""
    reason = "shows no rotation" if blind.shape[1] == 3 else f"shows no rotation about {_axes(blind)}"
    return (
        f"found {largest:.4g} N m at marker {load.marker!r} of body {load.body!r}, which {reason}: its nodes have no "
        "rotational degrees of freedom and lie at one point or on one line, so the torque would deform nothing. Name a "
        f"group of several nodes around this point (markers.{load.marker} = {{ group = ... }})"
    )


def _axes(blind: Array) -> str:
    blind = blind * np.sign(blind[np.abs(blind).argmax(axis=0), np.arange(blind.shape[1])])
    return " and ".join(f"[{', '.join(f'{x + 0.0:.3g}' for x in axis)}]" for axis in np.round(blind.T, 12))
