"""Floquet multipliers against Mathieu's equation and librations in a circular orbit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import mathieu_a, mathieu_b

from femflex.body import rigid_body
from femflex.case import read_case, with_values
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.equilibrium import equilibrium
from femflex.integrate import Dop853
from femflex.pipeline.decisions import build_system
from femflex.studies.floquet import floquet, periodic_state
from femflex.system import Environment, Frame, Orbit, Profile, System, prismatic, revolute, spherical


def pendulum(a: float, q: float) -> System:
    """A pendulum whose pivot is shaken up and down, x'' + (a - 2 q cos 2 t) x = 0 for small angles."""
    bob = rigid_body(2.0, np.diag([0.1, 0.3, 0.3]), [0.7, 0, 0])
    length = (0.3 + 2.0 * 0.7**2) / (2.0 * 0.7)
    shaken = Profile(np.zeros(1), np.zeros((1, 1)), np.array([[q * length / 2, 2.0, np.pi / 2]]))
    return System(
        {"pivot": rigid_body(1.0, np.eye(3)), "bob": bob},
        (
            prismatic("pivot", axis=[0, 1, 0], motion=(shaken,), name="shake"),
            revolute("bob", "pivot", name="pin", q0=[-np.pi / 2]),
        ),
        environment=Environment(gravity=np.array([0.0, -a * length, 0.0])),
    )


def mathieu_trace(a: float, q: float) -> float:
    """Trace of the monodromy matrix over pi."""
    ends = [
        solve_ivp(lambda t, y: [y[1], -(a - 2 * q * np.cos(2 * t)) * y[0]], (0, np.pi), y, rtol=1e-12, atol=1e-14)
        for y in ([1.0, 0.0], [0.0, 1.0])
    ]
    return float(ends[0].y[0, -1] + ends[1].y[1, -1])


@pytest.mark.parametrize(("a", "q"), [(0.7, 0.2), (1.0, 0.4), (2.5, 0.8)])
def test_a_shaken_pendulum_has_the_multipliers_of_mathieu(a, q):
    found = floquet(pendulum(a, q), np.pi)
    assert found.names == ("pin.angle", "pin.angle_rate") and found.gap < 1e-9
    assert np.trace(found.monodromy) == pytest.approx(mathieu_trace(a, q), abs=1e-6)
    assert np.prod(found.multipliers).real == pytest.approx(1.0, abs=1e-6)
    assert found.stable == (abs(mathieu_trace(a, q)) < 2)


def test_the_first_tongue_begins_and_ends_at_the_characteristic_values():
    q, slack = 0.4, 1e-3
    low, high = float(mathieu_b(1, q)), float(mathieu_a(1, q))
    stable = [floquet(pendulum(a, q), np.pi).stable for a in (low - slack, low + slack, high - slack, high + slack)]
    assert stable == [True, False, False, True]


def test_librations_in_a_circular_orbit_come_back_by_their_phase():
    """Of quaternions: multipliers exp(i omega T) of the three librations."""
    orbit = Orbit.from_perigee(620e3, 0.0)
    craft = System(
        {"craft": rigid_body(100.0, np.diag([90.0, 30.0, 100.0]))},
        (spherical("craft"),),
        frame=Frame("orbital"),
        orbit=orbit,
    )
    modes = equilibrium(craft).eigenvalues
    found = floquet(craft, orbit.period)
    wanted = np.exp(modes * orbit.period)
    for one in wanted:
        assert np.abs(found.multipliers - one).min() < 1e-5 * max(1.0, abs(one))


def test_shooting_finds_the_pitch_that_an_eccentric_orbit_forces():
    """VALIDATION J: the amplitude of the case eccentric_pitch, begun without the rate that makes it periodic."""
    case = with_values(
        read_case(Path(__file__).parents[2] / "cases" / "eccentric_pitch.toml"), {"attitude.rates": [0, 0, 0]}
    )
    system = build_system(case)
    assert system.orbit is not None
    period = system.orbit.period
    x = periodic_state(system, period)
    model = compile_system(system)
    times = np.linspace(0, period, 201)
    motion = Dop853(rtol=1e-11).solve(model, times, x)
    pitch = model.observe(times, motion.states)["attitude/angles"][:, 0]
    assert np.abs(pitch).max() == pytest.approx(case.expect.answers["pitch_amplitude"].value, rel=3e-4)
    assert floquet(system, period, x).stable


def test_a_motion_that_is_not_periodic_is_refused():
    system = pendulum(1.0, 0.4)
    x = system.initial_state()
    x[1] += 0.2
    with pytest.raises(ValueError, match=r"the motion is not periodic: after 3\.14159265 s pin\.angle"):
        floquet(system, np.pi, x)
    with pytest.raises(ValueError, match=r"the period is 0\.0 s; it must be above 0"):
        floquet(system, 0.0)
