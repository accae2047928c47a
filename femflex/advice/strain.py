"""Choice of the strain form of a body, from the motion estimate of its system with linear strain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from femflex.advice.advice import Advice
from femflex.advice.bodies import BodyOrigins
from femflex.advice.buckling import BucklingMargin
from femflex.advice.curved import snap_through_advice
from femflex.advice.deflections import deflection_watches
from femflex.advice.limits import (
    BUCKLING_FACTOR,
    CHOICE_FRACTION,
    FREQUENCY_CHANGE,
    LINEAR_ABOVE,
    NONLINEAR_INVALID_ABOVE,
    PHASE_ERROR,
    SMALL_VIBRATION,
    SMALLEST_PRINTED,
    SPIN_STIFFENING_RATIO,
    ZERO_RATE,
    division_remedy,
)
from femflex.advice.motion_estimate import MotionEstimate
from femflex.advice.stiffening import OmittedStiffness, attached_masses, body_rate, lowest_frequency
from femflex.arrays import Array
from femflex.dynamics import compile_system
from femflex.system import Environment, Frame, System

Strain = Literal["linear", "nonlinear", "condensed"]


@dataclass(frozen=True)
class MotionExtent:
    """Stiffening, rates and deflections of a body in the preliminary simulation.

    largest_gain, smallest_gain  geometric stiffness of its first shape, over its elastic stiffness
    spin, largest_rate           its rate at the largest gain, and its largest rate [rad/s]
    deflection, initial_deflection  largest displacement of a point over the body's size, along the motion and at its
                   start
    size           diagonal of its box [m]
    shortfall      why the estimate covers less than the whole run; empty for the whole
    division       how to divide the body into several where its deflection is too large for one
    hardening      force on its first shape due to stretching, over the linear force, at the deflection by linear strain
    phase          phase error of its slowest vibration at the end, because of linear strain [rad]
    swing          half the variation of the largest displacement of a point, over the body's size
    """

    largest_gain: float
    smallest_gain: float
    spin: float
    largest_rate: float
    deflection: float = 0.0
    initial_deflection: float = 0.0
    size: float = 0.0
    shortfall: str = ""
    division: str = "cut the member into segments"
    hardening: float = 0.0
    phase: float = 0.0
    swing: float = 0.0


def strain_advice(
    system: System,
    names: list[str],
    margins: Mapping[str, BucklingMargin],
    estimate: MotionEstimate,
    origins: BodyOrigins,
    fastest: Array | None = None,
) -> dict[str, Advice]:
    """Strain form of each of these bodies, which have linear strain in this system, with its reason.

    margins: buckling margins of the bodies that are near buckling; estimate: the preliminary motion; fastest (3,): a
    steady spin [rad/s] that is considered too, such as the last speed of a Campbell diagram. Rigid bodies are omitted.
    """
    extents = motion_extents(estimate, origins)
    if fastest is not None:
        spun = compile_system(replace(system, frame=Frame("spinning", fastest)))
        steady = motion_extents(MotionEstimate(spun, np.zeros(1), spun.x0[None], spun.x0[None]), origins)
        extents = {name: _combined_extent(extent, steady[name]) for name, extent in extents.items()}
    for name, gain in pendulum_stiffening(system).items():
        extents[name] = _combined_extent(extents[name], MotionExtent(gain, -gain, 0.0, 0.0))
    chosen = {
        name: _with_buckling_margin(strain_of_extent(name, extents[name]), margins.get(name))
        for name in names
        if name in extents
    }
    for name in chosen:
        displacement = extents[name].deflection * extents[name].size
        if name in origins and (curved := snap_through_advice(origins[name], name, displacement, margins.get(name))):
            chosen[name] = curved
    return chosen


def strain_of_extent(name: str, extent: MotionExtent) -> Advice:
    """The strain form of a body and its reason: an effect that linear strain omits, or a deflection over its limit."""
    raised = float(np.sqrt(1.0 + max(extent.largest_gain, 0.0)) - 1.0)
    lowered = 1.0 - float(np.sqrt(max(1.0 + min(extent.smallest_gain, 0.0), 0.0)))
    stretched = float(np.sqrt(1.0 + extent.hardening) - 1.0)
    cause = f"turning at {extent.spin:.4g} rad/s" if extent.spin > 0.0 else "axial tension"
    reason, numbers = "", (raised, CHOICE_FRACTION * FREQUENCY_CHANGE)
    if raised > CHOICE_FRACTION * FREQUENCY_CHANGE and raised >= lowered:
        reason = f"{cause} may raise the first frequency {growth_text(raised)}, which linear strain leaves out"
    elif lowered > CHOICE_FRACTION * FREQUENCY_CHANGE:
        effect = f"lower the first frequency by {lowered:.1%}" if lowered < 1.0 else "buckle it in its first mode"
        reason = f"axial compression (loads or inertia) may {effect}, which linear strain leaves out"
        numbers = (lowered, CHOICE_FRACTION * FREQUENCY_CHANGE)
    elif extent.deflection > CHOICE_FRACTION * LINEAR_ABOVE:
        reason = (
            f"{_deflection_text(extent)} (limit {CHOICE_FRACTION * LINEAR_ABOVE:.0%}; linear strain is valid up to "
            "about "
            f"{LINEAR_ABOVE:.0%})"
        )
        numbers = (extent.deflection, CHOICE_FRACTION * LINEAR_ABOVE)
    elif stretched > CHOICE_FRACTION * FREQUENCY_CHANGE:
        reason = (
            f"loads and motions may bend it by {extent.deflection * extent.size:.2g} m. Stretching, which linear "
            f"strain leaves out, then adds {extent.hardening:.0%} to the restoring force of its first mode"
        )
        numbers = (stretched, CHOICE_FRACTION * FREQUENCY_CHANGE)
    elif extent.swing > SMALL_VIBRATION and extent.phase > CHOICE_FRACTION * PHASE_ERROR:
        reason = (
            f"axial forces, which linear strain leaves out, change its first frequency by at most "
            f"{max(raised, lowered):.2%}. Its vibration would be out of phase by {extent.phase:.2g} rad at the end of "
            f"the run (limit {CHOICE_FRACTION * PHASE_ERROR:.2g} rad)"
        )
        numbers = (extent.phase, CHOICE_FRACTION * PHASE_ERROR)
    if not reason:
        return Advice(
            name,
            "strain",
            "linear",
            f"{_linear_frequency_text(extent, raised, lowered, cause)}; {_linear_deflection_text(extent)}",
            *numbers,
        )
    return Advice(name, "strain", "condensed", f"{reason}{_large_deflection_text(extent)}", *numbers)


def _with_buckling_margin(chosen: Advice, margin: BucklingMargin | None) -> Advice:
    """The choice, changed to condensed strain where a load near buckling requires it."""
    if margin is None or chosen.choice != "linear":
        return chosen
    reason = f"{margin}, which linear strain leaves out"
    return replace(chosen, choice="condensed", reason=reason, value=margin.ratio, limit=1.0 / BUCKLING_FACTOR)


def _deflection_text(extent: MotionExtent) -> str:
    size = f"of its size of {extent.size:.3g} m"
    if extent.initial_deflection > CHOICE_FRACTION * LINEAR_ABOVE:
        return f"its initial deflection is {extent.initial_deflection:.1%} {size}"
    return f"loads and motions may bend it by {extent.deflection:.1%} {size}"


def _large_deflection_text(extent: MotionExtent) -> str:
    """Text about a deflection beyond the limit of condensed strain; empty below it."""
    if extent.deflection <= NONLINEAR_INVALID_ABOVE:
        return ""
    return (
        f"; the estimated deflection is {extent.deflection:.0%} of its size, and condensed strain is valid up to about "
        f"{NONLINEAR_INVALID_ABOVE:.0%}. If the run confirms it, {extent.division}"
    )


def _linear_frequency_text(extent: MotionExtent, raised: float, lowered: float, cause: str) -> str:
    """Text on why linear strain suffices for the axial forces in the body."""
    if max(raised, lowered) >= SMALLEST_PRINTED:
        if lowered > raised:
            return f"axial compression (loads or inertia) lowers the first frequency by {lowered:.2%}"
        return f"{cause} raises the first frequency by {raised:.2%}"
    if extent.largest_rate < ZERO_RATE:
        return "it does not turn"
    return f"turning at {extent.largest_rate:.4g} rad/s changes its first frequency by less than {SMALLEST_PRINTED:.3%}"


def _linear_deflection_text(extent: MotionExtent) -> str:
    """Text on why linear strain suffices for the estimated deflection of the body."""
    text = f"predicted peak deflection {extent.deflection:.2%} of its size"
    if extent.deflection < SMALLEST_PRINTED:
        text = (
            f"predicted peak deflection below {SMALLEST_PRINTED:.3%} of its size"
            if extent.deflection
            else "no load bends it"
        )
    return f"{text} (estimated {extent.shortfall}; the run checks it)" if extent.shortfall else text


def growth_text(gain: float) -> str:
    """A relative growth as text: "by 16.2%", or from 100 % on "14.5-fold".

    >>> growth_text(0.162), growth_text(13.49)
    ('by 16.2%', '14.5-fold')
    """
    return f"by {gain:.1%}" if gain < 1.0 else f"{1.0 + gain:.3g}-fold"


def pendulum_stiffening(system: System) -> dict[str, float]:
    """Largest relative change of each body's stiffness by gravity, in any attitude of the body.

    Bodies that no joint lets turn are omitted: their attitude is the initial one.
    """
    g = float(np.linalg.norm(system.environment.gravity))
    turning = [name for name in system.order if _can_rotate(system, name)] if g > 0.0 else []
    if not turning:
        return {}
    model = compile_system(system)
    channels = model.observe(np.zeros(1), model.x0[None])
    environments = [Environment(gravity=direction) for direction in (*np.eye(3), np.zeros(3))]
    x, y, z, none = (OmittedStiffness(replace(system, environment=pull)).gains(channels) for pull in environments)
    return {
        name: g * float(np.linalg.norm([axis[name][0] - none[name][0] for axis in (x, y, z)]))
        for name in turning
        if name in none
    }


def _can_rotate(system: System, name: str | None) -> bool:
    """Whether a joint between the base frame and a body lets it turn."""
    while name is not None:
        joint = system.joint_of(name)
        slides = len(joint.translations)
        if any(k >= slides and k not in joint.prescribed for k in range(joint.n_u)):
            return True
        name = joint.parent
    return False


def motion_extents(estimate: MotionEstimate, origins: BodyOrigins) -> dict[str, MotionExtent]:
    """Stiffening, rates and deflections of each elastic body in a preliminary motion."""
    model, system = estimate.model, estimate.model.system
    channels = model.observation(estimate.times, estimate.rigid_states)
    gains = OmittedStiffness(system).gains(channels)
    extents = {}
    for watch, initial_watch in zip(deflection_watches(model), deflection_watches(model), strict=True):
        name, body = watch.name, system.bodies[watch.name]
        rate = np.linalg.norm(body_rate(channels, name), axis=1)
        gain = gains.get(name, np.zeros(len(rate)))
        linear = float(watch.relative_displacements(estimate.elastic_states).max())
        states = estimate.elastic_states.copy()
        states[:, watch.first_coordinate : watch.first_coordinate + body.n_modes] /= (
            1.0 + np.maximum(gain, 0.0)[:, None]
        )  # the stiffening reduces the deflection
        watch.shape_displacements(states)
        initial_watch.shape_displacements(model.x0[None])
        hardening = origins[name].hardening if name in origins and linear > 0.0 else 0.0
        bent = max(hardened_bend(watch.largest_deflection, hardening * watch.size**2), initial_watch.largest_deflection)
        swing = float(np.ptp(watch.relative_displacements(states))) / 2.0
        phase = _phase_error(system, name, estimate.times, gain) if swing > SMALL_VIBRATION and name in gains else 0.0
        spin = float(rate[np.argmax(gain)])
        if gain.max() > SMALLEST_PRINTED and body.strain.V1.any():
            omega = lowest_frequency(body, attached_masses(system, name))
            spin = (
                0.0 if float(gain.max()) * omega**2 > SPIN_STIFFENING_RATIO * spin**2 else spin
            )  # then forces other than spin stiffen it
        gain_values = float(gain.max()), float(gain.min()), spin, float(rate.max())
        stretched = hardening * (max(linear, initial_watch.largest_deflection) * watch.size) ** 2
        other_values = {"hardening": stretched, "phase": phase, "swing": swing}
        extents[name] = MotionExtent(
            *gain_values,
            bent,
            initial_watch.largest_deflection,
            watch.size,
            estimate.shortfall,
            division_remedy(body),
            **other_values,
        )
    return extents


def hardened_bend(linear: float, hardening: float) -> float:
    """The root w of w + hardening w^3 = linear: the deflection with the stiffening by stretch."""
    if hardening <= 0.0 or linear <= 0.0:
        return linear
    third = math.asinh(1.5 * linear * math.sqrt(3.0 * hardening)) / 3.0  # 3 sinh(a) + 4 sinh(a)^3 = sinh(3 a)
    return 2.0 * math.sinh(third) / math.sqrt(3.0 * hardening)


def _phase_error(system: System, name: str, times: Array, gain: Array) -> float:
    """Phase error [rad] of the slowest vibration of a clamped body at the end, int omega |sqrt(1 + gain) - 1| dt.

    With damping, the integral extends over 1 / (zeta omega) at most.
    """
    body = system.bodies[name]
    omega = lowest_frequency(body, attached_masses(system, name))
    off = omega * np.abs(np.sqrt(np.maximum(1.0 + gain, 0.0)) - 1.0)
    whole = float(np.sum((off[1:] + off[:-1]) / 2.0 * np.diff(times)))
    rate = float(body.damping[0, 0] / body.moments.elastic_mass()[0, 0]) / 2.0  # zeta omega of its first shape
    return min(whole, float(off.max(initial=0.0)) / rate) if rate > 0.0 else whole


def _combined_extent(a: MotionExtent, b: MotionExtent) -> MotionExtent:
    spin = a.spin if a.largest_gain >= b.largest_gain else b.spin
    return replace(
        a,
        largest_gain=max(a.largest_gain, b.largest_gain),
        smallest_gain=min(a.smallest_gain, b.smallest_gain),
        spin=spin,
        largest_rate=max(a.largest_rate, b.largest_rate),
    )
