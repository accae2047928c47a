"""Free lengths: a reel whose tension, brake and motor act on the deployed length, instead of a profile in time."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np

from femflex.system import Effector


@dataclass(frozen=True)
class Reel:
    """A drum that pulls on the member with a tension: F = -(tension + damping U + stiffness (L - rest)).

    name        of the effector, whose states are "length" and "speed"
    length      at t = 0 [m];  speed  at t = 0 [m/s]
    tension     constant pull [N], negative for a motor that pushes the member out
    damping     brake [N s/m]
    stiffness   of a length controller [N/m];  rest  length at which it pulls with `tension` alone [m]
    mass        inertia of the drum over its radius squared [kg]

    A run ends with an error where the length reaches zero or the stock.
    """

    name: str
    length: float
    speed: float = 0.0
    tension: float = 0.0
    damping: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    mass: float = 0.0

    def __post_init__(self) -> None:
        if not self.length > 0.0:
            raise ValueError(f"the initial length of reel {self.name!r} is {self.length:g} m; it must be positive")
        if min(self.damping, self.stiffness, self.mass) < 0.0:
            raise ValueError(f"damping, stiffness and mass of the reel {self.name!r} must be zero or positive")

    @property
    def state(self) -> str:
        """Name of the state that is the length."""
        return f"{self.name}.length"

    def effector(self, stock: float = math.inf) -> Effector:
        """The effector of a system that has the length and its rate as states; stock: length of the whole member."""
        law = np.array([self.tension, self.damping, self.stiffness, self.rest, min(stock, sys.float_info.max)])
        return Effector(
            self.name,
            reel_law,
            states={"length": "m", "speed": "m/s"},
            z0=np.array([self.length, self.speed]),
            sizes=np.array([self.length, max(abs(self.speed), 1e-3 * self.length)]),
            channels={"tension": "N"},
            parameters=law,
        )


def reel_law(seen, out):  # type: ignore[no-untyped-def]
    """Rate of the length, and in place of the rate of the speed the force on the length."""
    p, length, speed = seen.parameters, seen.z[0], seen.z[1]
    tension = p[0] + p[1] * speed + p[2] * (length - p[3])
    out.zdot[0] = speed
    out.zdot[1] = -tension if 0.0 < length <= p[4] else np.nan  # which ends the run
    out.channel[0] = tension
