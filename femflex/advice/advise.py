"""Advice on a system and the time that it is to run for, whatever it was made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from femflex.advice.advice import Advice, doubt, warn_of
from femflex.advice.bodies import KnownBodies
from femflex.advice.buckling.margin import buckling_margins, buckling_warnings, unassessed_bodies
from femflex.advice.curved import shape_notes
from femflex.advice.model_warnings import model_warnings
from femflex.advice.motion_estimate import estimate_motion
from femflex.advice.remedies import division_remedy
from femflex.advice.strain import strain_advice
from femflex.advice.truncation import richer_craft, truncation_warnings
from femflex.reduction.origin import Origin
from femflex.system import System


def advise(
    system: System,
    duration: float,
    origins: Mapping[str, Origin] | None = None,
    *,
    fastest: ArrayLike | None = None,
    band: float = 0.0,
    warn: bool = True,
) -> tuple[Advice, ...]:
    """What the bodies of a system want in a run of that duration [s], and what is doubtful of them.

    A preliminary simulation with all bodies rigid, and their small elastic answer to it, tell what comes. Each Advice
    has the body, the decision, its reason, the value found and its limit. Those that speak against what a body is
    (linear strain where spin, loads or bends call for more) are doubts, and given as PhysicsWarning too unless `warn`
    is false.

    origins  what bodies were reduced from, by name: with it buckling, curved shapes and truncation are assessed as well
    fastest  (3,) a steady spin that the system is to be looked at too [rad/s]
    band     frequency up to which modes of the craft matter in addition to the first three [Hz]
    """
    known = KnownBodies(origins or {})
    elastic = [name for name, body in system.bodies.items() if body.n_modes]
    linear = [name for name in elastic if system.bodies[name].strain_form == "linear"]
    view = estimate_motion(system, duration)
    near = buckling_margins(view.rigid, system, known)
    spin = None if fastest is None else np.asarray(fastest, float)
    wanted = strain_advice(system, linear, {}, view, known, spin)
    found = [strain_doubt(system, known, one) for name, one in wanted.items()]
    found += shape_notes(system.bodies, known)
    found += unassessed_bodies(system, known, view.rigid, view.short)
    found += buckling_warnings(system, known, near)
    if any(name in known for name in elastic):
        found += truncation_warnings(system, richer_craft(system, known), band)
    found += model_warnings(system, known, duration)
    if warn:
        warn_of(found)
    return tuple(found)


def strain_doubt(system: System, known: KnownBodies, wanted: Advice) -> Advice:
    """The advice on the strain of a body that has linear strain: a doubt where it wants another."""
    if wanted.choice == "linear":
        return wanted
    other = division_remedy(system.bodies[wanted.body])
    way = f"{known.remedy(wanted.body)}, or {other}"
    text = f"body {wanted.body!r} has linear strain: {wanted.reason}. To follow it, {way}"
    return replace(doubt(wanted.body, "strain", text, wanted.value, wanted.limit), choice=wanted.choice)
