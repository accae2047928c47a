"""From a mesh to a motion in Python: `flexible_body` and `simulate`."""

from __future__ import annotations

import numpy as np
import pytest

import femflex
from femflex import System, fem, integrate, system
from femflex.mesh import line

LENGTH, RADIUS, E, RHO = 10.0, 0.05, 70e9, 2700.0


def clamped_boom(**options):
    tube = fem.Member("line", "beam", fem.sections.Circle(RADIUS), fem.Material(E, 0.33, RHO))
    mesh = line([[0, 0, 0], [LENGTH, 0, 0]], 20)
    return femflex.flexible_body(mesh, tube, clamp="start", modes=4, markers=["end"], **options)


def test_boom_has_the_frequency_of_a_cantilever_and_swings_with_it():
    """omega = 1.8751041^2 sqrt(EI / (m L^4)); a linear body in its first mode moves by cos(omega t)."""
    omega = 1.8751041**2 * np.sqrt(E * RADIUS**2 / 4 / (RHO * LENGTH**4))
    boom = clamped_boom(strain="linear")
    assert boom.omega[0] == pytest.approx(omega, rel=2e-4)
    craft = System({"boom": boom}, (system.weld("boom", child_marker="start"),), delta0={"boom": [1e-3, 0, 0, 0]})
    motion = femflex.simulate(craft, 10.0, output_step=0.01, rtol=1e-10)
    assert motion.times[-1] == 10.0 and "markers/boom.end/position" in motion
    np.testing.assert_allclose(
        motion["bodies/boom/delta"][:, 0], 1e-3 * np.cos(boom.omega[0] * motion.times), atol=1e-9
    )


def test_unknown_setting_of_an_integrator_is_refused():
    craft = System({"boom": clamped_boom(strain="linear")}, (system.weld("boom", child_marker="start"),))
    with pytest.raises(ValueError, match="rho"):
        femflex.simulate(craft, 1.0, integrator=integrate.Dop853.name, rho=0.5)
