"""Separation springs: two markers pushed apart along the line between them, until the spring is at its free length.

They act once a latch between the two bodies has opened (see `Latch.opens`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated

from femflex.arrays import Array
from femflex.effectors.noun import MarkerPair
from femflex.kernels.vectors import dot, load3, scale, store3, sub
from femflex.noun.values import PositiveLength, Quantity
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector

NEAREST = 1e-9  # of the free length: nearer markers have no direction between them


class Separation(MarkerPair, heading="separations"):
    """A spring between two markers that pushes while it is shorter than its free length, and never pulls.

    Channel: distance.
    """

    stiffness: Annotated[float, Quantity("N/m", above=0.0)]
    """Stiffness of the spring."""
    length: PositiveLength
    """Free length; beyond it the spring has let go."""

    label = "separation spring"
    channels = {"distance": "m"}
    accounts = ("energy",)
    exerts = ("force",)

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError where both ends are one marker."""
        return replace(super().effector(name, context), conserves=True, apart=NEAREST * self.length)


P, IN, OUT = Separation.places()


@Separation.kernel
def separation(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Force k (l - d) on both markers while their distance d is below the free length l."""
    vector = sub(load3(seen, IN.position + 3), load3(seen, IN.position))
    d = math.sqrt(dot(vector, vector))
    compression = max(0.0, parameters[P.length] - d)
    push = scale(parameters[P.stiffness] * compression / d if d > 0.0 else 0.0, vector)
    store3(out, OUT.force, scale(-1.0, push))
    store3(out, OUT.force + 3, push)
    out[OUT.distance] = d
    out[OUT.energy] = 0.5 * parameters[P.stiffness] * compression * compression
