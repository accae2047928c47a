"""Springs and dampers of joints by a table: a monotone cubic through the given forces, integrated once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.system.law import DAMPER, Elastic, Law, Piece
from femflex.system.profile import Profile


@dataclass(frozen=True, eq=False)
class TabulatedSpring(Elastic):
    """Resisting force through a table over the coordinate, monotone between monotone points, linear beyond them.

    stretch (n,) ascending [m, rad];  resisting (n,) [N, N m]. The force is C1 (piecewise cubic).
    """

    stretch: ArrayLike = ()
    resisting: ArrayLike = ()

    kind: ClassVar[str] = "spring"

    @cached_property
    def potential(self) -> Profile:
        return _integral(self.stretch, self.resisting, "spring")


@dataclass(frozen=True, eq=False)
class TabulatedDamper(Law):
    """Resisting force through a table over the rate, monotone between monotone points, linear beyond them.

    rate (n,) ascending [m/s, rad/s];  resisting (n,) [N, N m]; it must not push: force times rate is not negative.
    """

    rate: ArrayLike = ()
    resisting: ArrayLike = ()

    kind: ClassVar[str] = "damper"

    def __post_init__(self) -> None:
        rate, force = np.asarray(self.rate, float), np.asarray(self.resisting, float)
        _ = self.dissipation
        if np.any(rate * force < 0):
            k = int(np.argmax(rate * force < 0))
            raise ValueError(f"a damper with force {force[k]:g} at rate {rate[k]:g} drives the joint; it must resist")

    @cached_property
    def dissipation(self) -> Profile:
        """Rayleigh's R(u) with R' the force."""
        return _integral(self.rate, self.resisting, "damper")

    def force(self, q: Array, u: Array) -> Array:
        return self.dissipation(u)[1]

    def kernel_pieces(self) -> list[Piece]:
        return [(DAMPER, self.dissipation.numbers)]


def _integral(x: ArrayLike, f: ArrayLike, what: str) -> Profile:
    """V(x), zero at x = 0, with V' through the table (n,)."""
    x, f = np.asarray(x, float), np.asarray(f, float)
    if x.ndim != 1 or x.shape != f.shape or len(x) < 2:
        raise ValueError(f"a tabulated {what} needs two equally long lists of at least 2 numbers")
    if not (np.all(np.isfinite(x)) and np.all(np.isfinite(f))):
        raise ValueError(f"a tabulated {what} holds a number that is not finite")
    if np.any(np.diff(x) <= 0):
        raise ValueError(f"the first list of a tabulated {what} must ascend: {x.tolist()}")
    from scipy.interpolate import PchipInterpolator

    table = PchipInterpolator(x, f)
    slopes = table(x[[0, -1]], 1)
    rows = np.zeros((len(x) + 1, 5))
    rows[1:-1, 1:] = table.c[::-1].T / np.arange(1, 5)
    rows[0, 1:3] = f[0] - slopes[0], slopes[0] / 2
    rows[-1, 1:3] = f[-1], slopes[-1] / 2
    knots = np.concatenate([[x[0] - 1.0], x])
    for k, step in enumerate(np.diff(knots)):
        rows[k + 1, 0] = rows[k] @ step ** np.arange(5)
    profile = Profile(knots, rows)
    rows[:, 0] -= float(profile(0.0)[0])
    return Profile(knots, rows)
