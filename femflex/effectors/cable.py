"""Cables between two markers: under tension while these are farther apart than its length, or slack.

Without mass:

    N = max(0, S + c (d' - L')) where d > L, else 0,    S = EA (d - L) / L

d is the distance, L(t) the length that is let out. Stored energy EA (d - L)^2 / (2 L). What its drum supplies is
-(N + S^2 / (2 EA)) L': the second part is the strain of the length that comes to it. A cable with mass is a row of
point masses (femflex.effectors.cable_chain).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.effectors.noun import MarkerPair
from femflex.kernels.profiles import profile_at
from femflex.kernels.vectors import dot, load3, scale, store3, sub
from femflex.noun.values import Count, Quantity
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector
from femflex.system.motion import Motion, MotionOf
from femflex.system.profile import Profile

FOREVER = 1e300  # s, in place of infinity
SAMPLES = 2001  # of the length, to find its least


class Cable(MarkerPair, heading="cables"):
    """A cable between two markers: it pulls while they are farther apart than its length, else it is slack.

    Channels without mass: tension, 0 while slack; distance; length. A run ends with an error where the length comes to
    zero later.
    """

    length: Annotated[Motion, MotionOf("m")]
    """Length that is let out: a value, or a profile over time such as { kind = "smooth_step", from = "5 m", to =
    "33 m", start = 0, end = "500 s" }. It must stay above zero."""
    EA: Annotated[float, Quantity("N", above=0.0)]
    """Axial stiffness, force per strain."""
    damping: Annotated[float, Quantity("N s/m", least=0.0)] = 0.0
    """Damping while it is taut; it never makes the cable push."""
    mass_per_length: Annotated[float | None, Quantity("kg/m", above=0.0)] = None
    """Mass per length of a cable of constant length, as point masses on a line. Default: no mass."""
    masses: Annotated[int, Count(1, 500)] = 20
    """Number of point masses, with mass_per_length."""
    start: Literal["straight", "hanging"] = "straight"
    """Where the masses start: on the straight line between the markers, or as the cable hangs at rest under gravity
    and its weight in water, in part on the sea floor where its lower end lies there."""

    channels = {"tension": "N", "distance": "m", "length": "m"}
    accounts = ("energy", "dissipation", "supplied")
    exerts = ("force",)
    derived = ("profile",)

    def profile(self, context: Context = ALONE) -> Profile:
        """Its length over time. Raises ValueError for one that is not given, and OSError for its file."""
        if self.length.profile is None:
            raise ValueError("found a length that is locked; give its value")
        return self.length.profile(context.folder)

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name, without mass. Raises ValueError for a length that comes to zero."""
        profile = self.profile(context)
        ends = [0.0, *profile.knots, *([profile.last] if np.isfinite(profile.last) else [])]
        least = float(np.nanmin(profile(np.linspace(min(ends), max(ends), SAMPLES))[0]))
        if not least > 0.0:
            raise ValueError(f"the length of cable {name!r} comes to {least:g} m; it must stay positive")
        numbers = np.clip(profile.numbers, -FOREVER, FOREVER)
        own = super().effector(name, context)
        return replace(own, parameters=np.concatenate([own.parameters[:-1], numbers]), breaks=profile.breaks)

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector]:
        """Its effector; none for a cable with mass, whose point masses are placed when its ends are known."""
        return () if self.mass_per_length is not None else (self.effector(name, context),)

    def numbers(self) -> dict[str, ArrayLike]:
        """EA, damping and mass, and the place of the profile, which stands behind them."""
        return super().numbers() | {"profile": 0.0}


P, IN, OUT = Cable.places()


@Cable.kernel
def cable(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Forces on two markers."""
    separation = sub(load3(seen, IN.position + 3), load3(seen, IN.position))
    d = math.sqrt(dot(separation, separation))
    length, rate, _ = profile_at(t, P.profile, parameters)
    tension = 0.0 if length > 0.0 else math.nan
    out[OUT.force] = tension  # which ends the run
    if d > length > 0.0:
        e = scale(1.0 / d, separation)
        faster = dot(e, sub(load3(seen, IN.velocity + 3), load3(seen, IN.velocity))) - rate
        elastic = parameters[P.EA] * (d - length) / length
        tension = max(0.0, elastic + parameters[P.damping] * faster)
        store3(out, OUT.force, scale(tension, e))
        store3(out, OUT.force + 3, scale(-tension, e))
        out[OUT.energy] = 0.5 * elastic * (d - length)
        out[OUT.dissipation] = (tension - elastic) * faster
        out[OUT.supplied] = -(tension + 0.5 * elastic * elastic / parameters[P.EA]) * rate
    out[OUT.tension], out[OUT.distance], out[OUT.length] = tension, d, length
