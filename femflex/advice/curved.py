"""Curved bodies: large bends that condensed strain and derivatives taken at rest do not represent."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.advice.advice import Advice
from femflex.advice.bodies import KnownBodies, KnownBody
from femflex.advice.buckling.margin import BucklingMargin
from femflex.advice.limits import PRESSED, REACHED, RESPONSES, SOFTENED
from femflex.body import FlexibleBody, StrainTensors
from femflex.fem.structure import Structure
from femflex.reduction import ModeSet, least_stiffness_ratio, mesh_rise, stretching
from femflex.reduction.origin import Meshed
from femflex.reduction.wide_sheets import sheet_note

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
    return [text for text in (curved, sheet_note(structure, modes, source.third_derivatives)) if text]


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
    """The advice to give a body nonlinear strain because it is curved; None where it is not, or where it hardly moves.

    moved: estimated displacement [m] with linear strain.
    """
    found = known.softening(moved / PRESSED if near is None else np.inf)
    if found is None or found[0] > SOFTENED or not found[1]:
        return None
    left, high = found
    how = f"to {left:.0%} of that at rest" if left > 0.0 else "below zero (possible snap-through)"
    pressed = f"loads and motions may bend it by {moved:.2g} m by linear strain" if near is None else str(near)
    reason = (
        f"it is curved (rise {high:.3g} m), {pressed}, and bent one way the tangent stiffness of a low mode falls "
        f"{how}, which condensed strain cannot follow. Where it snaps through, give it responses = {RESPONSES} with "
        f"deflection = '{REACHED * high:.2g} m' and its load in `loads` or `attachment`"
    )
    return Advice(name, "strain", "nonlinear", reason, left, SOFTENED)
