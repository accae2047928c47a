"""Springs and dampers of joints by a table: a monotone cubic through the forces of the table, integrated once."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from femflex.noun.table import refuse
from femflex.noun.values import counted_noun
from femflex.system.law import DAMPER, ByCoordinate, Elastic, Law, Piece
from femflex.system.profile import Profile

Numbers = tuple[float, ...]


class TabulatedSpring(Elastic):
    """A spring by a table: monotone between monotone points, linear beyond them. Its force is C1 (piecewise cubic)."""

    kind: Literal["spring"] = "spring"
    """Selects this law: a spring by a table."""
    at: Annotated[Numbers, ByCoordinate("m", (None,))]
    """Values of the coordinate, rising."""
    force: Annotated[Numbers, ByCoordinate("N", (None,))]
    """Resisting force or torque at each value."""

    @model_validator(mode="after")
    def _points_fit(self) -> TabulatedSpring:
        _check_points(self.kind, self.at, self.force)
        return self

    @cached_property
    def potential(self) -> Profile:
        """V, V' and V'' of the coordinate, V zero at zero."""
        return _integral(self.at, self.force)


class TabulatedDamper(Law):
    """A damper by a table: monotone between monotone points, linear beyond them."""

    kind: Literal["damper"] = "damper"
    """Selects this law: a damper by a table."""
    rate: Annotated[Numbers, ByCoordinate("m/s", (None,))]
    """Rates of the coordinate, rising."""
    force: Annotated[Numbers, ByCoordinate("N", (None,))]
    """Resisting force or torque at each rate."""

    @model_validator(mode="after")
    def _it_resists(self) -> TabulatedDamper:
        _check_points(self.kind, self.rate, self.force)
        for rate, force in zip(self.rate, self.force, strict=True):
            if rate * force < 0:
                refuse(f"a damper with force {force:g} at rate {rate:g} drives the joint; it must resist")
        return self

    @cached_property
    def dissipation(self) -> Profile:
        """Rayleigh's R(u) with R' the force."""
        return _integral(self.rate, self.force)

    def pieces(self) -> list[Piece]:
        """Its dissipation function."""
        return [(DAMPER, self.dissipation.numbers)]


def _check_points(kind: str, points: Numbers, force: Numbers) -> None:
    if len(points) != len(force):
        places, forces = counted_noun(len(points), "place", "places"), counted_noun(len(force), "force", "forces")
        refuse(f"found {places} and {forces} in a {kind}; give as many of both")
    if len(points) < 2:
        refuse(f"a tabulated {kind} needs two equally long lists of at least 2 numbers")
    if any(b <= a for a, b in pairwise(points)):
        refuse(f"the first list of a tabulated {kind} must ascend: {list(points)}")


def _integral(points: Numbers, forces: Numbers) -> Profile:
    """V(x), zero at x = 0, with V' through the table (n,)."""
    from scipy.interpolate import PchipInterpolator

    x, f = np.array(points), np.array(forces)
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
