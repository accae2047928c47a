"""Which strain a flexible body of a case gets that does not say: the one that its motion calls for, as foreseen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.advice.bends import BENT, SWUNG
from femflex.advice.ignored import STIFFENED
from femflex.case.body import Strain

LEEWAY = 0.5  # of what runs warn of: from there on strain is condensed, for what is foreseen is an estimate
TOLD = 5e-5  # less than the hundredth of a per cent that is printed
STILL = 1e-12  # rad/s: rounding
KEEPS = " (strain = 'linear' would keep it so)"


@dataclass(frozen=True)
class Reach:
    """How far a body goes, as foreseen.

    most, least    what is added to the stiffness of its first shape, in parts of it
    spin, fastest  its rate where most is added, and its largest rate [rad/s]
    bent, start    largest displacement of a place over the body's size, along the motion and at its start
    size           diagonal of its box [m]
    stretched      what stretching adds to the force on its first shape bent so far, over the linear one
    doubt          why less than the whole is foreseen, or nothing
    dividing       how it is made of several bodies where it bends too far for one
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


def judged(reach: Reach) -> tuple[Strain, str]:
    """The strain that a body wants, and why: what linear strain leaves out of it, or does not hold up to."""
    raised = float(np.sqrt(1.0 + max(reach.most, 0.0)) - 1.0)
    fallen = 1.0 - float(np.sqrt(max(1.0 + min(reach.least, 0.0), 0.0)))
    way = f"turning at {reach.spin:.4g} rad/s" if reach.spin > 0.0 else "what pulls along it"
    why = ""
    if raised > LEEWAY * STIFFENED and raised >= fallen:
        why = f"{way} may raise the first frequency {grown(raised)}, which linear strain leaves out"
    elif fallen > LEEWAY * STIFFENED:
        how = f"lower the first frequency by {fallen:.1%}" if fallen < 1.0 else "make it buckle in its first shape"
        why = f"loads or inertia that press along it may {how}, which linear strain leaves out"
    elif reach.bent > LEEWAY * BENT:
        why = f"{_bent(reach)}, and linear strain is left from {LEEWAY * BENT:.0%} on (it holds up to {BENT:.0%})"
    elif float(np.sqrt(1.0 + reach.stretched) - 1.0) > LEEWAY * STIFFENED:
        why = (
            f"loads and motions may bend it by {reach.bent * reach.size:.2g} m by linear strain, where stretch between "
            f"its supports, which that leaves out, adds {reach.stretched:.0%} to the force on its first shape"
        )
    if not why:
        return "linear", f"{_small(reach, raised, fallen, way)}; {_hardly_bent(reach)}"
    return "condensed", f"{why}{KEEPS}{_far(reach)}"


def _bent(reach: Reach) -> str:
    size = f"of its size of {reach.size:.3g} m"
    if reach.start > LEEWAY * BENT:
        return f"the body starts bent by {reach.start:.0%} {size}"
    return f"loads and motions may bend it by {reach.bent:.0%} {size}"


def _far(reach: Reach) -> str:
    """A word on bends that condensed strain does not hold up to either."""
    if reach.bent <= SWUNG:
        return ""
    return (
        f"; foreseen is a bend of {reach.bent:.0%}, and condensed strain holds up to about {SWUNG:.0%}: where it "
        f"really bends so far, {reach.dividing}"
    )


def _small(reach: Reach, raised: float, fallen: float, way: str) -> str:
    """Why linear strain is enough for what pulls along the body, in words."""
    if max(raised, fallen) >= TOLD:
        if fallen > raised:
            return f"loads or inertia that press along it lower the first frequency by {fallen:.2%}"
        return f"{way} raises the first frequency by {raised:.2%}"
    if reach.fastest < STILL:
        return "it does not turn"
    return f"turning at {reach.fastest:.4g} rad/s does not stiffen it (by less than {TOLD:.3%})"


def _hardly_bent(reach: Reach) -> str:
    """Why linear strain is enough for how far the body bends, and how far that is foreseen."""
    foreseen = f"loads and motions bend it by {reach.bent:.2%} of its size at most"
    foreseen = foreseen if reach.bent >= TOLD else "nothing bends it"
    return f"{foreseen}, foreseen {reach.doubt}; the run watches it" if reach.doubt else foreseen


def grown(gain: float) -> str:
    """How much larger in words: "by 16.2%", and beyond that "14.5-fold".

    >>> grown(0.162), grown(13.49)
    ('by 16.2%', '14.5-fold')
    """
    return f"by {gain:.1%}" if gain < 1.0 else f"{1.0 + gain:.3g}-fold"
