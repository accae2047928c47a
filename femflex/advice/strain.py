"""Choice of the strain form of a body, from the motion estimate of its system with linear strain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from femflex.advice.advice import Advice
from femflex.advice.bodies import KnownBodies
from femflex.advice.buckling.margin import BucklingMargin
from femflex.advice.curved import snap_through_advice
from femflex.advice.deflections import deflection_watches
from femflex.advice.limits import BENT, BOWING, BY_SPIN, LEEWAY, PHASE, PRINTED, STIFFENED, STILL, SWINGING, SWUNG
from femflex.advice.motion_estimate import MotionEstimate
from femflex.advice.remedies import division_remedy
from femflex.advice.stiffening import OmittedStiffness, attached_masses, lowest_frequency
from femflex.arrays import Array
from femflex.dynamics import compile_system
from femflex.system import Environment, Frame, System

Strain = Literal["linear", "nonlinear", "condensed"]


@dataclass(frozen=True)
class MotionExtent:
    """How far a body goes, by the preliminary motion.

    most, least    what is added to the stiffness of its first shape, in parts of it
    spin, fastest  its rate where most is added, and its largest rate [rad/s]
    bent, start    largest displacement of a point over the body's size, along the motion and at its start
    size           diagonal of its box [m]
    doubt          why less than the whole is known, or nothing
    dividing       how it is made of several bodies where it bends too far for one
    stretched      what stretching adds to the force on its first shape, bent as far as linear strain has it, over the
                   linear one
    phase          by which its slowest vibration is out in the end for what linear strain leaves out [rad]
    swing          half of what the largest displacement of a point varies by, over the body's size
    """

    most: float
    least: float
    spin: float
    fastest: float
    bent: float = 0.0
    start: float = 0.0
    size: float = 0.0
    doubt: str = ""
    dividing: str = "cut the member into segments"
    stretched: float = 0.0
    phase: float = 0.0
    swing: float = 0.0


def strain_advice(
    system: System,
    names: list[str],
    near: Mapping[str, BucklingMargin],
    view: MotionEstimate,
    known: KnownBodies,
    fastest: Array | None = None,
) -> dict[str, Advice]:
    """Strain of these bodies, which are linear in this system, and its reason; those that are rigid need none.

    near: of bodies that bear nearly what buckles them, how near; view: the preliminary motion; fastest (3,): a steady
    spin [rad/s] that counts too, as the last of a diagram over speeds.
    """
    found = motion_extents(view, known)
    if fastest is not None:
        spun = compile_system(replace(system, frame=Frame("spinning", fastest)))
        steady = motion_extents(MotionEstimate(spun, np.zeros(1), spun.x0[None], spun.x0[None]), known)
        found = {name: _wider(reach, steady[name]) for name, reach in found.items()}
    for name, gain in pendulum_stiffening(system).items():
        found[name] = _wider(found[name], MotionExtent(gain, -gain, 0.0, 0.0))
    chosen = {
        name: _with_buckling(strain_of_extent(name, found[name]), near.get(name)) for name in names if name in found
    }
    for name in chosen:
        moved = found[name].bent * found[name].size
        if name in known and (curved := snap_through_advice(known[name], name, moved, near.get(name))):
            chosen[name] = curved
    return chosen


def strain_of_extent(name: str, reach: MotionExtent) -> Advice:
    """The strain that a body wants, and why: what linear strain leaves out of it, or does not hold up to."""
    raised = float(np.sqrt(1.0 + max(reach.most, 0.0)) - 1.0)
    fallen = 1.0 - float(np.sqrt(max(1.0 + min(reach.least, 0.0), 0.0)))
    stretched = float(np.sqrt(1.0 + reach.stretched) - 1.0)
    way = f"turning at {reach.spin:.4g} rad/s" if reach.spin > 0.0 else "axial tension"
    why, found = "", (raised, LEEWAY * STIFFENED)
    if raised > LEEWAY * STIFFENED and raised >= fallen:
        why = f"{way} may raise the first frequency {growth_text(raised)}, which linear strain leaves out"
    elif fallen > LEEWAY * STIFFENED:
        how = f"lower the first frequency by {fallen:.1%}" if fallen < 1.0 else "buckle it in its first mode"
        why = f"axial compression (loads or inertia) may {how}, which linear strain leaves out"
        found = (fallen, LEEWAY * STIFFENED)
    elif reach.bent > LEEWAY * BENT:
        why = f"{_bent(reach)} (limit {LEEWAY * BENT:.0%}; linear strain is valid up to about {BENT:.0%})"
        found = (reach.bent, LEEWAY * BENT)
    elif stretched > LEEWAY * STIFFENED:
        why = (
            f"loads and motions may bend it by {reach.bent * reach.size:.2g} m. Stretching between its supports, which "
            f"linear strain leaves out, then adds {reach.stretched:.0%} to the restoring force of its first mode"
        )
        found = (stretched, LEEWAY * STIFFENED)
    elif reach.swing > SWINGING and reach.phase > LEEWAY * PHASE:
        why = (
            f"axial forces, which linear strain leaves out, change its first frequency by at most "
            f"{max(raised, fallen):.2%}. Its vibration would be out of phase by {reach.phase:.2g} rad at the end of "
            f"the run (limit {LEEWAY * PHASE:.2g} rad)"
        )
        found = (reach.phase, LEEWAY * PHASE)
    if not why:
        return Advice(name, "strain", "linear", f"{_small(reach, raised, fallen, way)}; {_hardly_bent(reach)}", *found)
    return Advice(name, "strain", "condensed", f"{why}{_far(reach)}", *found)


def _with_buckling(chosen: Advice, near: BucklingMargin | None) -> Advice:
    """A choice, with what a load near buckling adds to it."""
    if near is None:
        return chosen
    left_out = f"{near}, which linear strain leaves out"
    if near.part < BOWING:
        if chosen.choice != "linear":
            return chosen
        return replace(chosen, choice="condensed", reason=left_out, value=near.part, limit=BOWING)
    return replace(chosen, choice="nonlinear", reason=left_out, value=near.part, limit=BOWING)


def _bent(reach: MotionExtent) -> str:
    size = f"of its size of {reach.size:.3g} m"
    if reach.start > LEEWAY * BENT:
        return f"its initial deflection is {reach.start:.1%} {size}"
    return f"loads and motions may bend it by {reach.bent:.1%} {size}"


def _far(reach: MotionExtent) -> str:
    """A word on bends that condensed strain does not hold up to either."""
    if reach.bent <= SWUNG:
        return ""
    return (
        f"; the estimated deflection is {reach.bent:.0%} of its size, and condensed strain is valid up to about "
        f"{SWUNG:.0%}. If the run confirms it, {reach.dividing}"
    )


def _small(reach: MotionExtent, raised: float, fallen: float, way: str) -> str:
    """Why linear strain is enough for what pulls along the body, in words."""
    if max(raised, fallen) >= PRINTED:
        if fallen > raised:
            return f"axial compression (loads or inertia) lowers the first frequency by {fallen:.2%}"
        return f"{way} raises the first frequency by {raised:.2%}"
    if reach.fastest < STILL:
        return "it does not turn"
    return f"turning at {reach.fastest:.4g} rad/s changes its first frequency by less than {PRINTED:.3%}"


def _hardly_bent(reach: MotionExtent) -> str:
    """Why linear strain is enough for how far the body bends, and how far that is estimated."""
    text = f"predicted peak deflection {reach.bent:.2%} of its size"
    if reach.bent < PRINTED:
        text = f"predicted peak deflection below {PRINTED:.3%} of its size" if reach.bent else "no load bends it"
    return f"{text} (estimated {reach.doubt}; the run checks it)" if reach.doubt else text


def growth_text(gain: float) -> str:
    """How much larger in words: "by 16.2%", and beyond that "14.5-fold".

    >>> growth_text(0.162), growth_text(13.49)
    ('by 16.2%', '14.5-fold')
    """
    return f"by {gain:.1%}" if gain < 1.0 else f"{1.0 + gain:.3g}-fold"


def pendulum_stiffening(system: System) -> dict[str, float]:
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
    x, y, z, none = (OmittedStiffness(replace(system, environment=pull)).gains(seen) for pull in pulls)
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


def motion_extents(view: MotionEstimate, known: KnownBodies) -> dict[str, MotionExtent]:
    """How far each elastic body goes in a preliminary motion, by what runs warn of."""
    model, system = view.model, view.model.system
    channels = model.observe(view.times, view.carried)
    gains = OmittedStiffness(system).gains(channels)
    out = {}
    for bend, start in zip(deflection_watches(model), deflection_watches(model), strict=True):
        name, body = bend.name, system.bodies[bend.name]
        rate = np.linalg.norm(channels[f"bodies/{name}/rate"], axis=1)
        gain = gains.get(name, np.zeros(len(rate)))
        linear = float(bend.over(view.bent).max())
        held = view.bent.copy()
        held[:, bend.at : bend.at + body.n_modes] /= 1.0 + np.maximum(gain, 0.0)[:, None]  # as spin holds it straight
        bend.moved(held)
        start.moved(model.x0[None])
        hardening = known[name].hardening if name in known and linear > 0.0 else 0.0
        bent = max(hardened_bend(bend.reached, hardening * bend.size**2), start.reached)
        swing = float(np.ptp(bend.over(held))) / 2.0
        phase = _phase(system, name, view.times, gain) if swing > SWINGING and name in gains else 0.0
        spin = float(rate[np.argmax(gain)])
        if gain.max() > PRINTED and body.strain.V1.any():
            omega = lowest_frequency(body, attached_masses(system, name))
            spin = 0.0 if float(gain.max()) * omega**2 > BY_SPIN * spin**2 else spin  # then other forces pull
        pulled = float(gain.max()), float(gain.min()), spin, float(rate.max())
        stretched = hardening * (max(linear, start.reached) * bend.size) ** 2
        more = {"stretched": stretched, "phase": phase, "swing": swing}
        out[name] = MotionExtent(*pulled, bent, start.reached, bend.size, view.short, division_remedy(body), **more)
    return out


def hardened_bend(linear: float, hardening: float) -> float:
    """The root w of w + hardening w^3 = linear: a bend that stretch holds back."""
    if hardening <= 0.0 or linear <= 0.0:
        return linear
    third = math.asinh(1.5 * linear * math.sqrt(3.0 * hardening)) / 3.0  # 3 sinh(a) + 4 sinh(a)^3 = sinh(3 a)
    return 2.0 * math.sinh(third) / math.sqrt(3.0 * hardening)


def _phase(system: System, name: str, times: Array, gain: Array) -> float:
    """Phase [rad] by which the slowest vibration of a body, held, is out in the end: int omega |sqrt(1 + gain) - 1| dt.

    What is damped out counts for 1 / (zeta omega) at most.
    """
    body = system.bodies[name]
    omega = lowest_frequency(body, attached_masses(system, name))
    off = omega * np.abs(np.sqrt(np.maximum(1.0 + gain, 0.0)) - 1.0)
    whole = float(np.sum((off[1:] + off[:-1]) / 2.0 * np.diff(times)))
    rate = float(body.damping[0, 0] / body.moments.elastic_mass()[0, 0]) / 2.0  # zeta omega of its first shape
    return min(whole, float(off.max(initial=0.0)) / rate) if rate > 0.0 else whole


def _wider(a: MotionExtent, b: MotionExtent) -> MotionExtent:
    spin = a.spin if a.most >= b.most else b.spin
    return replace(
        a, most=max(a.most, b.most), least=min(a.least, b.least), spin=spin, fastest=max(a.fastest, b.fastest)
    )
