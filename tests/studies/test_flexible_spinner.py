"""Multipliers of a spinner with an asymmetric flexible body against its own linear equations.

A hub of inertia A, B, C turns about its fixed centre; a mass m at (a, 0, 0) on it moves along z on a spring k and a
damper d. With the spin W about z, small rates x, y and the displacement w obey, from T = 1/2 (A x^2 + B y^2 + C W^2) +
1/2 m ((y w)^2 + (W a - x w)^2 + (w' - y a)^2),

    A x' + (C - B) W y = 0
    (B + m a^2) y' - m a w'' + W (A x - m a W w) - (C + m a^2) W x = 0
    m w'' - m a y' + m a W x + d w' + k w = 0
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors, rigid_body
from femflex.studies.floquet import floquet
from femflex.studies.stability import judged_motion, judged_rest
from femflex.system import Frame, System, free, spherical, weld

W, M, ARM, K, D = 0.8, 2.0, 1.5, 3.0, 0.2
PERIOD = 2 * np.pi / W


def sprung_mass(damping: float) -> FlexibleBody:
    """The mass on its spring as a body of one shape, along z."""
    second = np.zeros((2, 3, 2, 3))
    second[0, 0, 0, 0], second[1, 2, 1, 2] = M * ARM**2, 1.0
    second[0, 0, 1, 2] = second[1, 2, 0, 0] = np.sqrt(M) * ARM
    first = np.array([[M * ARM, 0.0, 0.0], [0.0, 0.0, np.sqrt(M)]])
    tip = Marker(np.array([ARM, 0.0, 0.0]), np.array([[0.0], [0.0], [1 / np.sqrt(M)]]), np.zeros((3, 1)))
    strain = StrainTensors.linear(np.array([[K / M]]))
    return FlexibleBody(MassMoments(M, first, second), strain, np.array([[damping / M]]), {"tip": tip})


def spinner(inertia: tuple[float, float, float], damping: float, joint=spherical, frame: Frame | None = None) -> System:
    """The craft, at rest in a spinning frame, or turning in an inertial one."""
    n = 3 if joint is spherical else 6
    rates = np.zeros(n)
    if frame is None:
        rates[-1] = W
    hub = joint("hub", u0=rates)
    bodies = {"hub": rigid_body(30.0, np.diag(inertia)), "mass": sprung_mass(damping)}
    return System(bodies, (hub, weld("mass", "hub")), frame=frame or Frame())


def own_matrix(inertia: tuple[float, float, float], damping: float) -> np.ndarray:
    """Matrix (4, 4) of d(x, y, w, w')/dt."""
    A, B, C = inertia
    left = np.array([[A, 0, 0, 0], [0, B + M * ARM**2, 0, -M * ARM], [0, 0, 1, 0], [0, -M * ARM, 0, M]], float)
    right = np.array([
        [0, -(C - B) * W, 0, 0],
        [W * (C + M * ARM**2 - A), 0, M * ARM * W**2, 0],
        [0, 0, 0, 1],
        [-M * ARM * W, 0, -K, -damping],
    ])  # fmt: skip
    return np.linalg.solve(left, right)


@pytest.mark.parametrize(("inertia", "stable"), [((10.0, 14.0, 20.0), True), ((10.0, 20.0, 14.0), False)])
def test_multipliers_are_those_of_its_own_equations_and_the_trivial_ones_are_named(inertia, stable):
    found = floquet(spinner(inertia, D), PERIOD)
    wanted = np.linalg.eigvals(expm(own_matrix(inertia, D) * PERIOD))
    assert sorted(found.trivial) == ["drift", "rotation x", "rotation y", "rotation z"]
    own = found.multipliers[found.multipliers != 1.0]
    assert len(own) == 4 and len(found.multipliers) == 8
    for one in wanted:
        assert np.abs(own - one).min() < 3e-6 * max(1.0, abs(one))
    assert found.stable == stable == bool((np.abs(wanted) < 1).all())
    assert found.split < 1e-2  # the root of an error of 1e-8 is 1e-4; a defective pair keeps no more


def test_a_spin_is_stable_without_damping_though_its_trivial_multipliers_split():
    found = floquet(spinner((10.0, 14.0, 20.0), 0.0), PERIOD)
    assert found.stable and np.abs(found.multipliers) == pytest.approx(np.ones(8), abs=1e-6)
    assert judged_motion(spinner((10.0, 14.0, 20.0), 0.0), PERIOD).stable


def test_a_free_spinner_has_the_multipliers_of_its_poles_in_the_spinning_frame():
    """Two formulations: motions in inertial axes over a turn, and the equations linearised in axes that spin."""
    spun = spinner((10.0, 14.0, 20.0), D, free, Frame("spinning", np.array([0.0, 0.0, W])))
    rest = judged_rest(spun)
    assert rest.about is not None
    own = floquet(spun, PERIOD, rest.about.x)
    for pole in rest.values:
        assert np.abs(own.multipliers - np.exp(pole * PERIOD)).min() < 3e-6
    assert own.stable and own.trivial.count("drift") >= 3 and "neutral" not in own.trivial
    with pytest.raises(ValueError, match="the motion is not periodic"):
        floquet(spun, PERIOD)
