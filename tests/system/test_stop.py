"""Stops: the energy of what they press with, inside, over their width and beyond."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.system import Stop

K, D, W = 500.0, 3.0, 0.02
LIMITS = [(-0.3, 0.5), (None, 0.5), (-0.3, None)]


@pytest.mark.sampled(1)
@pytest.mark.parametrize("stop", [Stop(lower=low, upper=high, stiffness=K, damping=D, width=W) for low, high in LIMITS])
def test_energy_stiffness_and_damping_are_those_of_a_smooth_step_at_every_depth(stop):
    """Stiffness K S(d / w) at a depth d, S rising from 0 to 1; force and energy are its integrals from the limit on."""
    for limit, sign in ((stop.upper, 1.0), (stop.lower, -1.0)):
        if limit is None:
            continue
        depth = np.linspace(0.0, 4 * W, 4001)
        found = np.array([stop.potential(limit + sign * d)[:3] for d in depth], float)
        step = depth[1]
        assert not found[0].any() and np.all(np.diff(found[:, 2]) > -1e-6 * K)
        np.testing.assert_allclose(found[depth >= W * (1 + 1e-9), 2], K, rtol=1e-9)
        force = np.concatenate([[0.0], np.cumsum((found[1:, 2] + found[:-1, 2]) / 2 * step)])
        energy = np.concatenate([[0.0], np.cumsum((force[1:] + force[:-1]) / 2 * step)])
        np.testing.assert_allclose(sign * found[:, 1], force, atol=1e-5 * force[-1])
        np.testing.assert_allclose(found[:, 0], energy, atol=1e-5 * energy[-1])
        damping = np.array([float(stop.contact(limit + sign * d)[0]) for d in depth])
        np.testing.assert_allclose(damping, D * found[:, 2] / K, atol=1e-9)
    assert float(stop.potential(0.1)[0]) == 0.0 == float(stop.contact(0.1)[0])
