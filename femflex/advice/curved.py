"""Curved bodies: what derivatives taken at rest do not hold of them, and the static responses that do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from femflex.advice.advice import Advice
from femflex.advice.bodies import KnownBodies, KnownBody
from femflex.advice.buckling.margin import BucklingMargin
from femflex.advice.limits import HEARD, PRESSED, REACHED, RESPONSES, SOFTENED
from femflex.arrays import Array
from femflex.body import FlexibleBody, StrainTensors
from femflex.dynamics import compile_system
from femflex.fem.structure import Structure
from femflex.reduction import ModeSet, least_stiffness_ratio, mesh_rise, stretching
from femflex.reduction.origin import Meshed
from femflex.reduction.wide_sheets import of_sheet
from femflex.rotations import dcm_from_quaternion
from femflex.system import Load, System

Answers = dict[str, object]  # keys of a reduction and their values


def shape_notes(bodies: Mapping[str, FlexibleBody], known: KnownBodies) -> list[Advice]:
    """What the shapes of bodies do not hold of large bends: of those that are curved, and of wide thin sheets."""
    out: list[Advice] = []
    found: dict[int, list[str]] = {}
    for name, body in bodies.items():
        source = known[name].origin.source if name in known else None
        if not isinstance(source, Meshed) or not body.n_modes or "nodal" in source.modes.kinds:
            continue
        if id(source) not in found:
            found[id(source)] = _notes(source, body)
        out += [Advice(name, "shapes", None, text) for text in found[id(source)]]
    return out


def _notes(source: Meshed, body: FlexibleBody) -> list[str]:
    structure, modes = source.structure, source.modes
    if body.strain_form == "nonlinear" and "response" in modes.kinds:
        if text := response_note(structure, modes, body.strain):
            return [text]
    if body.strain_form == "linear" or source.deflection is not None:
        return []
    curved = curvature_note(structure, modes) if modes.held.size else ""
    return [text for text in (curved, of_sheet(structure, modes, source.third_derivatives)) if text]


def response_note(structure: Structure, modes: ModeSet, tensors: StrainTensors) -> str:
    """What a set with responses does not hold: bends that the loads they answer do not bring about; nothing if little.

    It holds those that they do, whatever its other shapes store alone (`require_stretch`).
    """
    found = stretching(structure, modes, tensors)
    if found.sound:
        return ""
    return (
        f"its static responses represent their own loads. For other loads it is too stiff: with its lowest mode "
        f"deflected by {found.deflection:.3g} m, its strain energy is {found.alone:.3g} times the linear one, and "
        f"{found.relaxed:.3g} times it in the full structure. Set derivatives = 'auto' for other loads; it adds "
        "coordinates"
    )


def curvature_note(structure: Structure, modes: ModeSet) -> str:
    """Note on derivatives at rest of a structure that softens as it bends; empty where it does not."""
    left, high = least_stiffness_ratio(structure, modes), mesh_rise(structure)
    if left > SOFTENED or not high:
        return ""
    how = f"to {left:.0%} of that at rest" if left > 0 else "below zero (snap-through)"
    return (
        f"it is curved (rise {high:.3g} m). Deflected in one direction, the tangent stiffness of a low mode falls "
        f"{how}; modal derivatives at rest represent this only in part. For such deflections set strain = 'nonlinear' "
        f"with responses = {RESPONSES}, deflection = '{REACHED * high:.2g} m' and the load in `loads` or `attachment`"
    )


def snap_through_advice(known: KnownBody, name: str, moved: float, near: BucklingMargin | None) -> Advice | None:
    """The advice to give a body responses to its loads; None where it is not curved, or hardly moved.

    moved: estimated displacement [m] with linear strain.
    """
    found = known.softening(moved / PRESSED if near is None else np.inf)
    if found is None or found[0] > SOFTENED or not found[1]:
        return None
    left, high = found
    how = f"to {left:.0%} of that at rest" if left > 0.0 else "below zero (possible snap-through)"
    pressed = f"loads and motions may bend it by {moved:.2g} m by linear strain" if near is None else str(near)
    reason = (
        f"it is curved (rise {high:.3g} m), {pressed}, and bent one way the tangent stiffness of a low mode falls {how}"
    )
    return Advice(name, "strain", "nonlinear", reason, left, SOFTENED)


def response_advice(
    known: KnownBody, system: System, name: str, given: Mapping[str, Sequence[str]], base: Sequence[str]
) -> Advice:
    """The keys of a reduction by which a curved body answers to its loads, and these in words.

    given, base: `loads` and `attachment` of its table. Where no load acts on it, it answers to its weight; else to the
    acceleration that moves it most.
    """
    source, found = known.origin.source, known.softening(np.inf)
    assert isinstance(source, Meshed) and found is not None
    loads = {group: list(ways) for group, ways in given.items()}
    for marker, ways in _loads(system, name).items():
        own = loads.setdefault(source.places.get(marker, marker), [])
        own += [way for way in ways if way not in own]
    attachment = [*base, *([] if loads or base else _weight(system, name))]
    words = [f"{', '.join(ways)} at {group!r}" for group, ways in loads.items()]
    words += [f"acceleration along {', '.join(attachment)}"] if attachment else []
    keys: Answers = {
        "loads": loads,
        "attachment": attachment,
        "derivatives": "none",
        "responses": RESPONSES,
        "deflection": REACHED * found[1],
    }
    text = " and ".join(words) or "the acceleration with the largest response"
    return Advice(
        name,
        "responses",
        keys,
        f"{RESPONSES} of its shapes are static responses to {text}, up to a deflection of {REACHED * found[1]:.2g} m",
    )


def _loads(system: System, name: str) -> dict[str, list[str]]:
    """Components of the loads on a body in its axes, by marker."""
    found: dict[str, list[str]] = {}
    words = ("x", "y", "z", "rx", "ry", "rz")
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


def _weight(system: System, name: str) -> list[str]:
    """Directions of the weight of a body in its axes as it starts."""
    g = np.asarray(system.environment.gravity, float)
    if not g.any():
        return []
    model = compile_system(system)
    C_NB = dcm_from_quaternion(model.observe(np.zeros(1), model.x0[None])[f"bodies/{name}/attitude"][0])
    own = np.abs(C_NB.T @ g)
    return [way for way, part in zip(("x", "y", "z"), own, strict=True) if part > HEARD * own.max()]
