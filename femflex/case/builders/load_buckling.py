"""Warnings of loads near what buckles a body, where its shapes would have it buckle later than it does."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from femflex.body.burden import Bearing
from femflex.case.body import AnalyticTable
from femflex.case.builders.loads import build_load
from femflex.case.case import Case
from femflex.case.load import LoadTable
from femflex.fem.structure import Structure
from femflex.reduction.beam_bearing import BeamBearing
from femflex.reduction.beam_buckling import beam_buckling
from femflex.reduction.bearing import JudgedBearing
from femflex.reduction.load_buckling import LoadBuckling, load_buckling
from femflex.reduction.markers import marker_rows
from femflex.reduction.modeset import ModeSet
from femflex.reduction.structure_bearing import StructureBearing
from femflex.reduction.uniform_beam import BeamFunctions, UniformBeam
from femflex.system import Load
from femflex.warning import PhysicsWarning

Array = NDArray[np.float64]
Judge = Callable[[Load, Array, Array], LoadBuckling]

NEAR = 4.0  # times a load: a body that buckles beyond it has lost at most a sixteenth of its stiffness to bending
LATE = 0.03  # of the load at which a body buckles: a set that buckles later by more is told of


def warn_of_meshed(case: Case, name: str, groups: Mapping[str, str], structure: Structure, modes: ModeSet) -> None:
    """Warn of loads on a meshed, clamped body with nonlinear strain, with both multiples."""
    if not (modes.held.size and modes.n_modes):
        return
    places = {**{group: group for group in modes.groups}, **groups}

    def judge(load: Load, force: Array, torque: Array) -> LoadBuckling:
        rows = marker_rows(structure, places[load.marker])
        return load_buckling(
            structure, modes, rows.translation.T @ force + rows.rotation.T @ torque, load.frame != "body"
        )

    _warn(case, name, [load for load in _loads(case, name) if load.marker in places], judge)


def warn_of_analytic(case: Case, name: str, beam: UniformBeam, functions: BeamFunctions) -> None:
    """Warn of loads at the tip of a beam on admissible functions with nonlinear strain, with both multiples."""
    if functions.y or functions.z:

        def judge(load: Load, force: Array, torque: Array) -> LoadBuckling:
            return beam_buckling(beam, functions, force, torque, load.frame != "body")

        loads = [load for load in _loads(case, name) if load.marker == "tip"]
        _warn(case, name, loads, judge)


def bearing_of_meshed(groups: Mapping[str, str], structure: Structure, modes: ModeSet) -> Bearing | None:
    """What tells how a meshed, clamped body buckles, at work when asked."""
    if not (modes.held.size and modes.n_modes):
        return None
    places = {**{group: group for group in modes.groups}, **groups}
    return JudgedBearing(StructureBearing(structure, modes, places))


def bearing_of_analytic(beam: UniformBeam, functions: BeamFunctions, table: AnalyticTable) -> Bearing | None:
    """The same of a beam on admissible functions."""
    if not (functions.y or functions.z):
        return None
    names = {name: entry.group or name for name, entry in table.markers.items()} | {"root": "root", "tip": "tip"}
    return JudgedBearing(BeamBearing(beam, functions, names))


def judged_loads(case: Case, name: str) -> list[str]:
    """What is told of the loads by which a body may be warned of: none of one with linear strain."""
    linear = getattr(case.bodies[name], "strain", "linear") == "linear"
    return [] if linear else [table.model_dump_json(exclude={"body"}) for table in _dead_loads(case, name)]


def _dead_loads(case: Case, name: str) -> list[LoadTable]:
    """Loads on a body whose directions do not follow it as it bends."""
    return [table for table in case.loads if table.body == name and table.frame != "marker"]


def _loads(case: Case, name: str) -> list[Load]:
    """The same, read; one that cannot be is told of where the loads of the case are built."""
    found = []
    for table in _dead_loads(case, name):
        with suppress(ValueError, OSError):
            found.append(build_load(case, table))
    return found


def _warn(case: Case, name: str, loads: list[Load], judge: Judge) -> None:
    for load in loads:
        for force, torque, along in _largest(load):
            found = judge(load, force, torque)
            if found.structure < NEAR and found.shapes > (1 + LATE) * found.structure:
                when = f"at {found.shapes:.3g} times it" if np.isfinite(found.shapes) else "under none"
                warnings.warn(
                    f"bodies.{name}: load {load.name!r}{along} is near what buckles the body, {found.structure:.3g} "
                    f"times it, and the shapes kept buckle {when}: they hold its stress, or the twist that goes with "
                    "it, too badly. Add the load's own static shape to the reduction (`loads`), or more shapes, "
                    "torsion among them",
                    PhysicsWarning,
                    stacklevel=3,
                )


def _largest(load: Load) -> Iterator[tuple[Array, Array, str]]:
    """Force and torque (3,) of a load where it is largest, and what to say of them.

    Of loads whose axes are not the body's, as large along each axis of the body, one way or the other.
    """
    force, torque = (np.atleast_2d(value) for value in (load.force, load.torque))
    if load.frame == "body":
        row = int(np.argmax(np.linalg.norm(force, axis=1) + np.linalg.norm(torque, axis=1)))
        yield force[min(row, len(force) - 1)], torque[min(row, len(torque) - 1)], ""
        return
    sizes = [float(np.linalg.norm(value, axis=1).max()) for value in (force, torque)]
    for axis, unit in zip("xyz", np.eye(3), strict=True):
        yield sizes[0] * unit, sizes[1] * unit, f", where it acts along {axis} of it,"
