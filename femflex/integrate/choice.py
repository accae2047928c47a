"""The automatic choice between the explicit and the implicit method, with the numbers it rests on."""

from __future__ import annotations

import math
from dataclasses import dataclass

EXPLICIT, IMPLICIT = "dop853", "esdirk4"
KINDS = {EXPLICIT: "explicit, order 8", IMPLICIT: "implicit, order 4"}
STABLE = 5.5  # omega h up to which dop853 is stable on the imaginary axis (it ends at 5.9)
RESOLVED = 0.6  # omega h at which dop853 follows a mode to about 1e-9 a step
FOLLOWED = 0.2  # omega h at which esdirk4 follows a mode to about 1e-6 a step
EXPLICIT_COST, IMPLICIT_COST = 12, 17  # rates a step; implicit: 5 stages, about 2.5 corrections, 1.4 rates each
WORTH = 1e7  # explicit rates (about ten seconds of work) below which stiffness is no reason to leave order 8


@dataclass(frozen=True)
class Choice:
    """A chosen integrator: its name in the register, and a sentence for the screen with the numbers behind it."""

    name: str
    sentence: str


def choose(
    highest: float, duration: float, output_step: float, band: float | None = None, asked: str = "auto"
) -> Choice:
    """The method for a run, or the one `asked` for, with a sentence that says why.

    highest      highest natural frequency of the linear elastic and joint part [rad/s]; 0 for rigid systems
    duration     of the run [s]
    output_step  between output times [s]
    band         highest frequency wanted [rad/s]; by default what the output can show, pi / output_step

    The implicit method is chosen when modes lie above the band, and keeping them stable costs the explicit one more
    rates than following the band costs the implicit one, and more than is worth mentioning.
    """
    wanted = math.pi / output_step if band is None else band
    followed = min(wanted, highest)
    explicit = EXPLICIT_COST * duration * max(highest / STABLE, followed / RESOLVED)
    implicit = IMPLICIT_COST * duration * followed / FOLLOWED
    best = IMPLICIT if highest > wanted and explicit > max(implicit, WORTH) else EXPLICIT
    name, kind = (best, KINDS[best]) if asked == "auto" else (asked, "as asked")
    if highest == 0.0:
        numbers = "nothing in the model vibrates by linear stiffness (0 Hz)."
    else:
        source = "the output can show" if band is None else "wanted"
        numbers = (
            f"the highest natural frequency is {highest / (2 * math.pi):.4g} Hz, the highest {source} "
            f"{wanted / (2 * math.pi):.4g} Hz; {duration:.4g} s cost about {explicit:.1e} rates explicitly, "
            f"{implicit:.1e} implicitly."
        )
    other = "" if name == best else f" The automatic choice is {best}."
    return Choice(name, f"{name} ({kind}): {numbers}{other}")
