"""Separation springs, which push two bodies apart once a latch between them has opened (see `Latch.opens`)."""

from __future__ import annotations

import numpy as np

from femflex.system.effector import Effector


def separation_spring(
    name: str, markers: tuple[tuple[str, str], tuple[str, str]], stiffness: float, length: float
) -> Effector:
    """A spring [N/m] between two markers that pushes while they are closer than its free length [m], and never pulls.

    Channel: distance [m]. Raises ValueError for numbers that are not positive.
    """
    if markers[0] == markers[1]:
        body, marker = markers[0]
        raise ValueError(f"both ends of separation spring {name!r} are at marker {marker!r} of body {body!r}")
    if not (stiffness > 0.0 and length > 0.0):
        raise ValueError(f"stiffness and length of separation spring {name!r} must be positive")
    return Effector(
        name,
        "separation",
        markers,
        channels={"distance": "m"},
        accounts=("energy",),
        exerts=("force",),
        parameters=np.array([stiffness, length]),
    )
