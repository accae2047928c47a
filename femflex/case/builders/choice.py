"""Strain of the bodies that do not say: by what linear strain would leave out where their system starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femflex.case.body import AnalyticTable, FlexibleTable
from femflex.case.builders.strain import (
    LONG,
    SAMPLES,
    Reach,
    Strain,
    fastest_joints,
    judged,
    largest_stiffening,
)
from femflex.case.case import Case
from femflex.case.reduction import Stretchable
from femflex.dynamics import compile_system
from femflex.dynamics.reports.ignored import IgnoredStiffness
from femflex.system import Environment, Frame, System

Array = NDArray[np.float64]


def undecided(case: Case) -> list[str]:
    """Names of the bodies whose strain is left to be chosen."""
    names = []
    for name, table in case.bodies.items():
        if isinstance(table, AnalyticTable) and table.strain is None:
            names.append(name)
        if isinstance(table, FlexibleTable) and table.strain is None and table.cut is None:
            r = table.reduction
            if isinstance(r, Stretchable) and r.derivatives not in ("none", 0):
                names.append(name)
    return names


def with_strains(case: Case, strains: Mapping[str, Strain]) -> Case:
    """The case with the strain of some bodies said."""
    said = {name: case.bodies[name].model_copy(update={"strain": strain}) for name, strain in strains.items()}
    return case.model_copy(update={"bodies": {**case.bodies, **said}})


def choices(case: Case, system: System, names: list[str]) -> dict[str, tuple[Strain, str]]:
    """Strain and its reason of bodies that are linear in this system, as far as it is known of them."""
    reaches = reaches_of(case, system)
    found = {}
    for name in names:
        table = case.bodies[name]
        if name in reaches and isinstance(table, FlexibleTable | AnalyticTable):
            found[name] = judged(table, reaches[name])
    return found


def reaches_of(case: Case, system: System) -> dict[str, Reach]:
    """What linear strain leaves out of each body at the initial state, under all loads and specified motions to come.

    Of a case with a diagram over spins, the fastest of them counts too; so do the rates of joints, about the worst
    axis of a body, for what moves freely may come to turn so.
    """
    systems = [system]
    if case.campbell is not None and (given := case.campbell.axis or case.attitude.spin) is not None:
        axis = np.array(given) / np.linalg.norm(given)
        systems.append(replace(system, frame=Frame("spinning", axis * case.campbell.speeds[-1])))
    found: dict[str, Reach] = {}
    for each in systems:
        for name, reach in _reaches(each, float(case.run.duration or LONG)).items():
            found[name] = _wider(found[name], reach) if name in found else reach
    if (spin := fastest_joints(case)) > 0.0:
        for name, reach in found.items():
            ignored = system.bodies[name].ignored
            assert ignored is not None
            own = largest_stiffening(ignored, spin)
            found[name] = _wider(reach, Reach(own, own, spin, spin))
    for name, gain in weights_of_swingers(system).items():
        found[name] = _wider(found[name], Reach(gain, -gain, 0.0, 0.0))
    return found


def weights_of_swingers(system: System) -> dict[str, float]:
    """The most that gravity adds to, or takes from, the stiffness of each body that may come to hang or stand along it.

    Bodies that no joint lets turn stay as they start.
    """
    g = float(np.linalg.norm(system.environment.gravity))
    turning = [name for name in system.order if _turns(system, name)] if g > 0.0 else []
    if not turning:
        return {}
    model = compile_system(system)
    seen = model.observe(np.zeros(1), model.x0[None])
    pulls = [Environment(direction) for direction in (*np.eye(3), np.zeros(3))]
    x, y, z, none = (IgnoredStiffness(replace(system, environment=pull)).gains(seen) for pull in pulls)
    return {
        name: g * float(np.linalg.norm([axis[name][0] - none[name][0] for axis in (x, y, z)]))
        for name in turning
        if name in none
    }


def _turns(system: System, name: str | None) -> bool:
    """Whether a joint between the base frame and a body lets it turn."""
    while name is not None:
        joint = system.joint_of(name)
        slides = len(joint.translations)
        if any(k >= slides and k not in joint.held for k in range(joint.n_u)):
            return True
        name = joint.parent
    return False


def _reaches(system: System, until: float) -> dict[str, Reach]:
    model = compile_system(system)
    times = np.zeros(1)
    if len(model.breaks):  # something is told over time: a load or a motion
        knots = np.concatenate([model.breaks, (model.breaks[1:] + model.breaks[:-1]) / 2])
        times = np.union1d(np.linspace(0.0, until, SAMPLES), knots[(knots >= 0.0) & (knots <= until)])
    seen = model.observe(times, np.tile(model.x0, (len(times), 1)))
    out = {}
    for name, gain in IgnoredStiffness(system).gains(seen).items():
        rate = np.linalg.norm(seen[f"bodies/{name}/rate"], axis=1)
        out[name] = Reach(float(gain.max()), float(gain.min()), float(rate[np.argmax(gain)]), float(rate.max()))
    return out


def _wider(a: Reach, b: Reach) -> Reach:
    spin = a.spin if a.most >= b.most else b.spin
    return Reach(max(a.most, b.most), min(a.least, b.least), spin, max(a.fastest, b.fastest))
