"""Laws of joint freedoms beyond linear springs and dampers: their common interface, and friction.

Each acts on one slide or turn of a joint. A law's force counts as it resists: against a positive stretch or rate it is
positive, and the joint feels minus it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from femflex.arrays import Array
from femflex.system.profile import Profile

# kinds of pieces of laws (femflex.dynamics.force_terms.laws).
SPRING, DAMPER, CONTACT, FRICTION, LATCHED = 0, 1, 2, 3, 4
Piece = tuple[int, Array]  # one of these, and its numbers


@dataclass(frozen=True, eq=False)
class Law:
    """A law of freedom number `freedom` of a joint, translations first."""

    freedom: int = 0
    name: str = ""

    kind: ClassVar[str] = "law"

    def force(self, q: Array, u: Array) -> Array:
        """Resisting force or torque at coordinates q and rates u (any equal shape)."""
        raise NotImplementedError

    def energy(self, q: Array) -> Array:
        """Energy stored at coordinates q [J]."""
        return np.zeros_like(q)

    def power(self, q: Array, u: Array) -> Array:
        """Power taken out of the motion for good [W]."""
        return self.force(q, u) * u

    @property
    def stiffest(self) -> float:
        """Largest stiffness it can have."""
        return 0.0

    def kernel_pieces(self) -> list[Piece]:
        """Return the pieces that the compiled equations evaluate and add up."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Elastic(Law):
    """A law with a potential V(q), a piecewise polynomial."""

    @property
    def potential(self) -> Profile:
        """V, V' and V'' of the coordinate."""
        raise NotImplementedError

    def force(self, q: Array, u: Array) -> Array:
        return self.potential(q)[1]

    def energy(self, q: Array) -> Array:
        return self.potential(q)[0]

    def power(self, q: Array, u: Array) -> Array:
        return np.zeros_like(q)

    @property
    def stiffest(self) -> float:
        knots = self.potential.knots
        return float(np.max(self.potential(np.concatenate([knots, (knots[1:] + knots[:-1]) / 2]))[2]))

    def kernel_pieces(self) -> list[Piece]:
        return [(SPRING, self.potential.numbers)]


@dataclass(frozen=True, eq=False)
class Friction(Law):
    """Coulomb friction, regularised: resisting limit tanh(rate / velocity).

    limit [N, N m]; velocity [m/s, rad/s] below which the joint creeps instead of sticking.
    """

    limit: float = 0.0
    velocity: float = 1e-3

    kind: ClassVar[str] = "friction"

    def __post_init__(self) -> None:
        if self.limit < 0 or not self.velocity > 0:
            raise ValueError(
                f"friction has limit {self.limit:g} and velocity scale {self.velocity:g}; the limit must not be "
                "negative and the scale positive"
            )

    def force(self, q: Array, u: Array) -> Array:
        return self.limit * np.tanh(u / self.velocity)

    def kernel_pieces(self) -> list[Piece]:
        return [(FRICTION, np.array([self.limit, self.velocity]))]
