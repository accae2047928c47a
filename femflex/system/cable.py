"""Cables between two markers: massless, of a length over time, under tension or slack."""

from __future__ import annotations

import numpy as np

from femflex.system.effector import Effector
from femflex.system.profile import Profile

FOREVER = 1e300  # s, in place of infinity
SAMPLES = 2001  # of the length, to find its least


def cable(
    name: str,
    markers: tuple[tuple[str, str], tuple[str, str]],
    length: Profile | float,
    stiffness: float,
    damping: float = 0.0,
) -> Effector:
    """A cable without mass that pulls two markers together while they are farther apart than its length; else slack.

    length     let out, a profile over time or a constant [m]; while it grows or falls a drum at either end works
    stiffness  EA [N]: force per strain;  damping  [N s/m], never so that the cable pushes

    Channels: tension [N], 0 while slack; distance [m]; length [m]. Raises ValueError for numbers that are not positive;
    a run ends with an error where the length comes to zero later.
    """
    profile = length if isinstance(length, Profile) else Profile.constant(float(length))
    ends = [0.0, *profile.knots, *([profile.last] if np.isfinite(profile.last) else [])]
    least = float(np.nanmin(profile(np.linspace(min(ends), max(ends), SAMPLES))[0]))
    if markers[0] == markers[1]:
        raise ValueError(f"both ends of cable {name!r} are at marker {markers[0][1]!r} of body {markers[0][0]!r}")
    if not (stiffness > 0.0 and damping >= 0.0):
        raise ValueError(f"stiffness of cable {name!r} must be positive, and its damping not negative")
    if not least > 0.0:
        raise ValueError(f"the length of cable {name!r} comes to {least:g} m; it must stay positive")
    return Effector(
        name,
        "cable",
        markers,
        channels={"tension": "N", "distance": "m", "length": "m"},
        accounts=("energy", "dissipation", "supplied"),
        exerts=("force",),
        parameters=np.concatenate([[stiffness, damping], np.clip(profile.numbers, -FOREVER, FOREVER)]),
        breaks=profile.breaks,
    )
