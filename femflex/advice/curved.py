"""Curved bodies: large bends that condensed strain and derivatives taken at rest do not represent."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.advice.advice import Advice
from femflex.advice.bodies import BodyOrigin, BodyOrigins
from femflex.advice.buckling import BucklingMargin
from femflex.advice.limits import DISPLACEMENT_OF_RISE, RESPONSE_REACH, RESPONSES, SOFTENING_RATIO
from femflex.body import FlexibleBody, StrainTensors
from femflex.fem.structure import Structure
from femflex.reduction import ModeSet
from femflex.reduction.large_deflection.foreshortening import least_stiffness_ratio, mesh_rise
from femflex.reduction.large_deflection.stretch import stretching
from femflex.reduction.large_deflection.third_derivatives import sheet_note
from femflex.reduction.origin import Meshed


def shape_notes(bodies: Mapping[str, FlexibleBody], origins: BodyOrigins) -> list[Advice]:
    """Notes on large deflections that the shapes of curved bodies and of wide thin sheets do not represent."""
    out: list[Advice] = []
    texts_of_source: dict[int, list[str]] = {}
    for name, body in bodies.items():
        source = origins[name].origin.source if name in origins else None
        if not isinstance(source, Meshed) or not body.n_modes or "nodal" in source.modes.kinds:
            continue
        if id(source) not in texts_of_source:
            texts_of_source[id(source)] = _notes(source, body)
        out += [Advice(name, "shapes", None, text) for text in texts_of_source[id(source)]]
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
    """Note on a set with static responses that is too stiff under other loads; empty where it is not.

    It represents the deflections under its own loads, whatever energy its other shapes store alone (`require_stretch`).
    """
    stretch = stretching(structure, modes, tensors)
    if stretch.sound:
        return ""
    return (
        f"its static responses represent their own loads. For other loads it is too stiff: with its lowest mode "
        f"deflected by {stretch.deflection:.3g} m, its strain energy is {stretch.alone:.3g} times the linear one, and "
        f"{stretch.relaxed:.3g} times it in the full structure. Set derivatives = 'auto' for other loads; it adds "
        "coordinates"
    )


def curvature_note(structure: Structure, modes: ModeSet) -> str:
    """Note on derivatives at rest of a structure that softens as it bends; empty where it does not."""
    ratio, rise = least_stiffness_ratio(structure, modes), mesh_rise(structure)
    if ratio > SOFTENING_RATIO or not rise:
        return ""
    change = f"to {ratio:.0%} of that at rest" if ratio > 0 else "below zero (snap-through)"
    return (
        f"it is curved (rise {rise:.3g} m). Deflected in one direction, the tangent stiffness of a low mode falls "
        f"{change}; modal derivatives at rest represent this only in part. For such deflections set strain = "
        "'nonlinear' "
        f"with responses = {RESPONSES}, deflection = '{RESPONSE_REACH * rise:.2g} m' and the load in `loads` or "
        "`attachment`"
    )


def snap_through_advice(
    origin: BodyOrigin, name: str, displacement: float, margin: BucklingMargin | None
) -> Advice | None:
    """The advice to give a curved body nonlinear strain; None for other bodies, and for small displacements.

    displacement: estimated displacement [m] with linear strain.
    """
    softening = origin.softening(displacement / DISPLACEMENT_OF_RISE if margin is None else np.inf)
    if softening is None or softening[0] > SOFTENING_RATIO or not softening[1]:
        return None
    ratio, rise = softening
    change = f"to {ratio:.0%} of that at rest" if ratio > 0.0 else "below zero (possible snap-through)"
    cause = f"loads and motions may bend it by {displacement:.2g} m by linear strain" if margin is None else str(margin)
    reason = (
        f"it is curved (rise {rise:.3g} m), {cause}, and in one direction the tangent stiffness of a low mode falls "
        f"{change}, which condensed strain cannot follow. Where it snaps through, give it responses = {RESPONSES} with "
        f"deflection = '{RESPONSE_REACH * rise:.2g} m' and its load in `loads` or `attachment`"
    )
    return Advice(name, "strain", "nonlinear", reason, ratio, SOFTENING_RATIO)
