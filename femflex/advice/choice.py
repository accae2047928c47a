"""Strain of the bodies that do not say: by what their system is foreseen to come to with linear strain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from femflex.advice.bends import bends
from femflex.advice.divided import divided
from femflex.advice.ignored import IgnoredStiffness
from femflex.advice.motion_estimate import Foresight
from femflex.advice.near_buckling import BOWING, Nearness, beyond
from femflex.advice.snapping import why_snapping
from femflex.advice.strain import KEEPS, Reach, judged
from femflex.case.body import AnalyticTable, BodyTable, FlexibleTable, Strain
from femflex.case.case import Case
from femflex.dynamics import compile_system
from femflex.system import Environment, Frame, System

AXIAL = 2  # axial functions for each of bending: the stretch of bending is of twice its degree


def undecided(case: Case) -> list[str]:
    """Names of the bodies whose strain is left to be chosen."""
    names = []
    for name, table in case.bodies.items():
        bending = isinstance(table, AnalyticTable) and (table.functions.y or table.functions.z)
        whole = isinstance(table, FlexibleTable) and table.cut is None
        if (bending or whole) and getattr(table, "strain", None) is None:
            names.append(name)
    return names


def with_strains(case: Case, strains: Mapping[str, Strain]) -> Case:
    """The case with the strain of some bodies said; nonlinear with the shapes in which it stretches."""
    said = {}
    for name, strain in strains.items():
        table = case.bodies[name]
        stretch = _stretch(table) if strain == "nonlinear" else {}
        said[name] = table.model_copy(update={"strain": strain, **stretch})
    return case.model_copy(update={"bodies": {**case.bodies, **said}})


def _stretch(table: BodyTable) -> dict[str, object]:
    """What a body without a word of it is given to stretch in: derivatives, or axial functions."""
    if isinstance(table, AnalyticTable) and not table.functions.axial:
        most = AXIAL * max(table.functions.y, table.functions.z)
        return {"functions": table.functions.model_copy(update={"axial": most})}
    if isinstance(table, FlexibleTable) and getattr(table.reduction, "derivatives", "none") is None:
        assert table.reduction is not None
        return {"reduction": table.reduction.model_copy(update={"derivatives": "auto"})}
    return {}


def choices(
    case: Case, system: System, names: list[str], near: Mapping[str, Nearness], view: Foresight
) -> dict[str, tuple[Strain, str]]:
    """Strain and its reason of bodies that are linear in this system; those that are rigid need none.

    near: of bodies that bear nearly what buckles them, how near; view: what is foreseen of the system.

    Of a case with a diagram over spins, the fastest of them counts too.
    """
    found = reaches(view)
    if case.campbell is not None and (given := case.campbell.axis or case.attitude.spin) is not None:
        axis = np.array(given) / np.linalg.norm(given)
        spun = compile_system(replace(system, frame=Frame("spinning", axis * case.campbell.speeds[-1])))
        fastest = reaches(Foresight(spun, np.zeros(1), spun.x0[None], spun.x0[None]))
        found = {name: _wider(reach, fastest[name]) for name, reach in found.items()}
    for name, gain in weights_of_swingers(system).items():
        found[name] = _wider(found[name], Reach(gain, -gain, 0.0, 0.0))
    chosen = {name: _buckling_too(judged(found[name]), near.get(name)) for name in names if name in found}
    for name in chosen:
        if why := why_snapping(case, name, system.bodies[name], found[name], near.get(name)):
            chosen[name] = "nonlinear", why
    return chosen


def _buckling_too(chosen: tuple[Strain, str], near: Nearness | None) -> tuple[Strain, str]:
    """Strain and reason, with what a load near buckling adds to them."""
    if near is None:
        return chosen
    left_out = f"{near}, which linear strain leaves out{KEEPS}"
    if near.part < BOWING:
        told = chosen[0] == "linear" or near.sways  # what is judged along it knows no forces that follow
        return ("condensed", left_out) if told else chosen
    return "nonlinear", left_out + beyond(near, "nonlinear")


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


def reaches(view: Foresight) -> dict[str, Reach]:
    """How far each elastic body goes in what is foreseen, by what runs warn of."""
    model = view.model
    channels = model.observe(view.times, view.carried)
    gains = IgnoredStiffness(model.system).gains(channels)
    out = {}
    for bend, start in zip(bends(model), bends(model), strict=True):
        bend.moved(view.bent)
        start.moved(model.x0[None])
        rate = np.linalg.norm(channels[f"bodies/{bend.name}/rate"], axis=1)
        gain = gains.get(bend.name, np.zeros(len(rate)))
        way = divided(model.system.bodies[bend.name])
        bent = max(bend.reached, start.reached)
        hardens = model.system.bodies[bend.name].hardening if bent > 0.0 else None
        stretched = 0.0 if hardens is None else hardens() * (bent * bend.size) ** 2
        pulled = float(gain.max()), float(gain.min()), float(rate[np.argmax(gain)]), float(rate.max())
        out[bend.name] = Reach(*pulled, bent, start.reached, bend.size, view.short, way, stretched)
    return out


def _wider(a: Reach, b: Reach) -> Reach:
    spin = a.spin if a.most >= b.most else b.spin
    return replace(
        a, most=max(a.most, b.most), least=min(a.least, b.least), spin=spin, fastest=max(a.fastest, b.fastest)
    )
