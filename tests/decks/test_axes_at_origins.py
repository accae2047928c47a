"""Directions of coordinate systems at their origins and on their axes, where radial and tangential are none."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.decks.nastran.systems import System

ORIGIN, C = np.array([0.3, -0.2, 0.5]), np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])


@pytest.mark.parametrize(
    ("kind", "along", "order"),
    [("C", 0.0, [0, 1, 2]), ("C", 0.7, [0, 1, 2]), ("S", 0.0, [2, 0, 1]), ("S", 0.7, [2, 0, 1])],
)
def test_directions_on_the_axis_are_those_of_the_defining_system(kind: str, along: float, order: list[int]):
    """Radial is x of a cylinder and z of a sphere, whose polar direction is then x."""
    found = System(kind, ORIGIN, C).axes_at(ORIGIN + along * C[2])
    np.testing.assert_allclose(found, C[order], atol=1e-12)
