"""Which strain a flexible body of a case gets: what it says, or the one its spin and bend call for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from femflex.body import Foreshortening
from femflex.case.body import AnalyticTable, FlexibleTable
from femflex.case.case import Case
from femflex.case.reduction import Stretchable

Strain = Literal["linear", "nonlinear", "condensed"]

STIFFENED = 0.01  # of the first frequency: spins that would stiffen a body by more get condensed strain
TOLD = 5e-5  # less than the hundredth of a per cent that is printed
BENT = 0.05  # initial displacement over length from which on strain is condensed
LONG = 1e4  # s, looked at of a specified motion where the duration is given in orbits
SAMPLES = 400  # of a specified motion, for its largest rate
KEEPS = " (strain = 'linear' would keep it so)"


@dataclass(frozen=True)
class Reach:
    """How far the stiffness of a body goes: the most and least that is added, in parts of its first shape's own.

    spin: its rate where most is added [rad/s]; fastest: its largest rate.
    """

    most: float
    least: float
    spin: float
    fastest: float


def chosen_strain(case: Case, table: FlexibleTable | AnalyticTable, ignored: Foreshortening) -> tuple[Strain, str]:
    """Strain of a body that does not say, looked at alone, and the reason; ignored: what linear strain leaves out.

    Alone it turns about its own origin with nothing on it; `choice` looks at it in its system.
    """
    r = getattr(table, "reduction", None)
    if isinstance(table, FlexibleTable) and not isinstance(r, Stretchable):
        return "linear", ""
    if isinstance(r, Stretchable) and r.derivatives in ("none", 0):
        return "linear", (
            f"strain is linear: derivatives = {r.derivatives!r} leaves its set without shapes that let bending go "
            "without stretching, so no other was looked at; without that key strain is chosen by what stiffens the body"
        )
    spin = fastest_turn(case)
    own = largest_stiffening(ignored, spin)
    return judged(table, Reach(own, own, spin, spin))


def judged(table: FlexibleTable | AnalyticTable, reach: Reach) -> tuple[Strain, str]:
    """The strain that a body wants of which linear strain leaves so much out, and the reason."""
    raised = float(np.sqrt(1.0 + max(reach.most, 0.0)) - 1.0)
    fallen = 1.0 - float(np.sqrt(max(1.0 + min(reach.least, 0.0), 0.0)))
    way = f"turning at {reach.spin:.4g} rad/s" if reach.spin > 0.0 else "what pulls along it"
    if raised > STIFFENED and raised >= fallen:
        text = f"{way} may raise the first frequency {grown(raised)}, which linear strain leaves out"
        return "condensed", f"strain is condensed: {text}{KEEPS}"
    if fallen > STIFFENED:
        how = f"lower the first frequency by {fallen:.1%}" if fallen < 1.0 else "make it buckle in its first shape"
        text = f"loads or inertia that press along it may {how}, which linear strain leaves out"
        return "condensed", f"strain is condensed: {text}{KEEPS}"
    if (bent := initial_bend(table)) > BENT:
        text = f"the body starts bent by {bent:.0%} of its length, and linear strain holds up to about {BENT:.0%}"
        return "condensed", f"strain is condensed: {text}{KEEPS}"
    return "linear", f"strain is linear: {_small(reach, raised, fallen, way)}"


def _small(reach: Reach, raised: float, fallen: float, way: str) -> str:
    """Why linear strain is enough, in words."""
    if max(raised, fallen) >= TOLD:
        if fallen > raised:
            return f"loads or inertia that press along it lower the first frequency by {fallen:.2%}"
        return f"{way} raises the first frequency by {raised:.2%}"
    if reach.fastest == 0.0:
        return "the case tells of no spin that would stiffen it"
    return f"turning at {reach.fastest:.4g} rad/s does not stiffen it (by less than {TOLD:.3%})"


def grown(gain: float) -> str:
    """How much larger in words: "by 16.2%", and beyond that "14.5-fold".

    >>> grown(0.162), grown(13.49)
    ('by 16.2%', '14.5-fold')
    """
    return f"by {gain:.1%}" if gain < 1.0 else f"{1.0 + gain:.3g}-fold"


def largest_stiffening(ignored: Foreshortening, spin: float) -> float:
    """The largest part of its own stiffness that a spin about any axis through the origin adds to the first shape."""
    g = ignored.mass[1:]
    return max(float(spin**2 * (np.linalg.eigvalsh((g + g.T) / 2)[-1] - np.trace(g))), 0.0)


def fastest_turn(case: Case) -> float:
    """What the case says of how fast anything turns [rad/s]: the attitude's rates, and those of joints, added up."""
    attitude = case.attitude
    total = sum(float(np.linalg.norm(rate)) for rate in (attitude.spin, attitude.rates) if rate is not None)
    if case.campbell is not None:
        total = max(total, case.campbell.speeds[-1])
    return total + fastest_joints(case)


def fastest_joints(case: Case) -> float:
    """What the case says of how fast joints turn [rad/s], added up."""
    total = 0.0
    until = float(case.run.duration or LONG)
    for joint in case.joints:
        for key in ("rate", "rates"):
            given = getattr(joint, key, None)
            total += float(np.linalg.norm(given)) if given is not None else 0.0
        for key in ("angle", "angles"):
            for motion in joint.motions(key):
                if motion is not None and motion.profile is not None:
                    profile = motion.profile(case.path.parent)
                    times = np.linspace(max(profile.first, 0.0), min(profile.last, until), SAMPLES)
                    total += float(np.abs(profile(times)[1]).max())
    return total


def initial_bend(table: FlexibleTable | AnalyticTable) -> float:
    """Initial displacement over the body's length, where the case tells both."""
    start = table.initial
    if start is None:
        return 0.0
    if start.relative is not None:
        return float(np.linalg.norm(start.relative))
    length = start.length or getattr(table, "length", None)
    if start.displacement is None or not length:
        return 0.0
    return float(np.linalg.norm(start.displacement)) / float(length)
