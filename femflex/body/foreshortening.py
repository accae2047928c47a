"""Foreshortening of a body by its lowest shape: an indicator of the stiffness that linear strain leaves out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array


@dataclass(frozen=True, eq=False)
class Foreshortening:
    """theta, the displacement of second order that goes with the lowest shape, over that shape's stiffness.

    mass  (4, 3)   int z theta^T dm, z = (1, rho) [s^2/m, s^2]: in a field of accelerations -(b + W r) the lowest shape
                   is stiffened by the part b . mass[0] + W : mass[1:] of its own stiffness
    at    marker -> (3,)  theta there [1/N]: a force F stiffens it by -F . theta
    """

    mass: Array = field(default_factory=lambda: np.zeros((4, 3)))
    at: dict[str, Array] = field(default_factory=dict)
