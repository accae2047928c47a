"""Kepler orbits: elements, and the directions that they name."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.system import Orbit
from femflex.system.orbit import EARTH_RADIUS


@pytest.mark.parametrize("eccentricity", [0.0, 0.1, 0.7])
def test_the_perigee_lies_at_the_altitude_given(eccentricity):
    """a (1 - e) = R + h, and n^2 a^3 = mu."""
    orbit = Orbit.from_perigee(400e3, eccentricity)
    assert orbit.semi_major_axis * (1 - eccentricity) == pytest.approx(EARTH_RADIUS + 400e3)
    assert orbit.mean_motion**2 * orbit.semi_major_axis**3 == pytest.approx(orbit.mu)
    assert orbit.period * orbit.mean_motion == pytest.approx(2 * np.pi)


def test_node_inclination_and_perigee_are_where_the_elements_say():
    """The normal leans by i from Z, away from the node by a right angle; the perigee lies omega past the node."""
    node, inclination, perigee = np.deg2rad([40.0, 63.4, 110.0])
    C = Orbit(8e6, 0.1, inclination, node, perigee).C_NP()
    line = np.array([np.cos(node), np.sin(node), 0.0])
    normal = np.array([np.sin(inclination) * np.sin(node), -np.sin(inclination) * np.cos(node), np.cos(inclination)])
    np.testing.assert_allclose(C[:, 2], normal, atol=1e-15)
    np.testing.assert_allclose(C[:, 0], np.cos(perigee) * line + np.sin(perigee) * np.cross(normal, line), atol=1e-15)
    assert np.linalg.det(C) == pytest.approx(1.0)
