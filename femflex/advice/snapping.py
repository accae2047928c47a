"""Curved bodies that loads may snap: nonlinear strain with static responses to these loads, where none is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femflex.advice.curved import REACHED, SOFTENED
from femflex.advice.near_buckling import Nearness
from femflex.advice.strain import Reach
from femflex.assembly.bodies import marker_groups
from femflex.body import FlexibleBody
from femflex.case.body import FlexibleTable
from femflex.case.case import Case
from femflex.case.reduction import CantileverTable, Component
from femflex.dynamics import compile_system
from femflex.rotations import dcm_from_quaternion
from femflex.system import Load, System

Array = NDArray[np.float64]

PRESSED = 0.1  # of a body's rise: foreseen displacement from which on its softening counts
COUNT = 8  # responses
HEARD = 0.05  # of a load's largest component: those below are not followed


def why_snapping(case: Case, name: str, body: FlexibleBody, reach: Reach, near: Nearness | None) -> str:
    """Why a body is to have responses to its loads; nothing where it is not curved, or its loads leave it at rest."""
    table = case.bodies[name]
    if body.softening is None or not _open(table):
        return ""
    moved = reach.bent * reach.size
    left, rise = body.softening(moved / PRESSED if near is None else np.inf)
    if left > SOFTENED or not rise:
        return ""
    how = f"to {left:.0%} of that at rest" if left > 0.0 else "below zero: it may snap through"
    pressed = f"loads and motions may bend it by {moved:.2g} m by linear strain" if near is None else str(near)
    return (
        f"it is curved (it rises by {rise:.3g} m), {pressed}, and bent one way a low shape's stiffness falls {how}; "
        f"{COUNT} shapes of it are its static responses to %s, up to {REACHED * rise:.2g} m (strain = 'linear' or "
        "'condensed', or a reduction with responses of its own, would keep it from that)"
    )


def responding(case: Case, system: System, name: str) -> tuple[Case, str]:
    """The case with responses to its loads in the reduction of a curved body, and the loads in words.

    Where no load acts on it, to the weight of it; else to the acceleration that moves it most.
    """
    table, body = case.bodies[name], system.bodies[name]
    assert isinstance(table, FlexibleTable) and isinstance(table.reduction, CantileverTable)
    assert body.softening is not None
    r, groups = table.reduction, marker_groups(table)
    loads: dict[str, list[Component]] = {group: list(ways) for group, ways in r.loads.items()}
    for marker, ways in _loads(system, name).items():
        known = loads.setdefault(groups.get(marker, marker), [])
        known += [way for way in ways if way not in known]
    weight = [] if loads or r.attachment else _weight(system, name)
    attachment = [*r.attachment, *weight]
    said = [f"{', '.join(ways)} at {group!r}" for group, ways in loads.items()]
    said += [f"acceleration along {', '.join(attachment)}"] if attachment else []
    update = {
        "loads": loads,
        "attachment": attachment,
        "derivatives": "none",
        "responses": COUNT,
        "deflection": REACHED * body.softening(np.inf)[1],
    }
    changed = table.model_copy(update={"reduction": r.model_copy(update=update), "strain": "nonlinear"})
    words = " and ".join(said) or "the acceleration that moves it most"
    return case.model_copy(update={"bodies": {**case.bodies, name: changed}}), words


def _open(table: object) -> bool:
    """Whether the table leaves it open what its set of shapes holds of large bends."""
    if not isinstance(table, FlexibleTable) or not isinstance(table.reduction, CantileverTable):
        return False
    r = table.reduction
    return r.derivatives is None and r.deflection is None and not r.responses and not r.third_derivatives


def _loads(system: System, name: str) -> dict[str, list[Component]]:
    """Components of the loads on a body in its axes, by marker."""
    found: dict[str, list[Component]] = {}
    words: tuple[Component, ...] = ("x", "y", "z", "rx", "ry", "rz")
    for load, force, torque in _at_largest(system, [load for load in system.loads if load.body == name]):
        ways = found.setdefault(load.marker, [])
        for value, named in ((force, words[:3]), (torque, words[3:])):
            size = np.abs(value).max()
            ways += [w for w, v in zip(named, value, strict=True) if size > 0.0 and abs(v) > HEARD * size]
    return {marker: list(dict.fromkeys(ways)) for marker, ways in found.items() if ways}


def _at_largest(system: System, loads: list[Load]) -> list[tuple[Load, Array, Array]]:
    """Loads with force and torque (3,) where they are largest, as they point in axes of their bodies at the start."""
    model = compile_system(replace(system, loads=tuple(map(_held, loads)), reactions=False, sights=()))
    seen = model.observe(np.zeros(1), model.x0[None])
    values = [[np.asarray(seen[f"loads/{load.name}/{what}"][0]) for what in ("force", "torque")] for load in loads]
    return [(load, force, torque) for load, (force, torque) in zip(loads, values, strict=True)]


def _held(load: Load) -> Load:
    """The load held where it is largest."""
    if load.times is None:
        return load
    row = int(np.argmax(np.linalg.norm(load.force, axis=1) + np.linalg.norm(load.torque, axis=1)))
    return replace(load, times=None, force=load.force[row], torque=load.torque[row])


def _weight(system: System, name: str) -> list[Component]:
    """Directions of the weight of a body in its axes as it starts."""
    g = np.asarray(system.environment.gravity, float)
    if not g.any():
        return []
    model = compile_system(system)
    C_NB = dcm_from_quaternion(model.observe(np.zeros(1), model.x0[None])[f"bodies/{name}/attitude"][0])
    own = np.abs(C_NB.T @ g)
    words: tuple[Component, ...] = ("x", "y", "z")
    return [way for way, part in zip(words, own, strict=True) if part > HEARD * own.max()]
