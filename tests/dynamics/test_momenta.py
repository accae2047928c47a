"""Canonical momenta and the Hamiltonian against closed forms, Hamilton's equations and known integrals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.case import read_case
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.pipeline.decisions import build_system
from femflex.system import Environment, Frame, Profile, System, free, prismatic, revolute

CASES = Path(__file__).parents[2] / "cases"
CART, BOB, LENGTH, INERTIA, WEIGHT = 3.0, 2.0, 0.7, 0.3, 9.81


def cart(**more) -> System:
    """A pendulum on a cart that slides along x; gravity along -y, the angle from x."""
    joints = (
        prismatic("cart", axis=[1, 0, 0], name="rail", u0=[0.4]),
        revolute("bob", "cart", name="pin", q0=[-0.9], u0=[1.3]),
    )
    bodies = {"cart": rigid_body(CART, np.eye(3)), "bob": rigid_body(BOB, INERTIA * np.eye(3), [LENGTH, 0, 0])}
    gravity = Environment(gravity=np.array([0.0, -WEIGHT, 0.0]))
    return System(bodies, joints, environment=gravity, **{"momenta": True, **more})


def motion(system: System, times: np.ndarray) -> dict:
    """Every channel of a motion from the initial state."""
    model = compile_system(system)
    return model.observe(times, Dop853(rtol=1e-12, atol=1e-13).solve(model, times, model.x0).states)


def test_momenta_of_a_pendulum_on_a_cart_are_those_of_its_lagrangian():
    times = np.linspace(0, 2, 9)
    seen = motion(cart(), times)
    (_, angle), (speed, rate) = seen["q"].T, seen["u"].T
    across = -BOB * LENGTH * np.sin(angle)
    wanted = np.stack([(CART + BOB) * speed + across * rate, across * speed + (INERTIA + BOB * LENGTH**2) * rate], 1)
    assert seen["momenta"] == pytest.approx(wanted, rel=1e-11)
    assert seen["monitors/hamiltonian"] == pytest.approx(seen["monitors/energy"], rel=1e-11)
    assert np.ptp(seen["momenta"][:, 0]) < 1e-9  # nothing acts along the rail


def test_the_rate_of_a_momentum_is_minus_the_derivative_of_the_hamiltonian():
    """dp/dt = -dH/dq at constant p, by differences over time and over the angle."""
    model, h = compile_system(cart()), 1e-4
    times = np.array([0.0, 0.5 - h, 0.5, 0.5 + h])
    found = Dop853(rtol=1e-13, atol=1e-14).solve(model, times, model.x0)
    p = model.observe(times, found.states)["momenta"]
    rate = (p[3] - p[1]) / (2 * h)
    q = found.states[2, :2]

    def hamiltonian(angle: float) -> float:
        across = -BOB * LENGTH * np.sin(angle)
        M = np.array([[CART + BOB, across], [across, INERTIA + BOB * LENGTH**2]])
        return float(p[2] @ np.linalg.solve(M, p[2]) / 2 + BOB * WEIGHT * LENGTH * np.sin(angle))

    slope = (hamiltonian(q[1] + h) - hamiltonian(q[1] - h)) / (2 * h)
    assert rate == pytest.approx([0.0, -slope], abs=1e-5 * abs(slope))


def test_the_hamiltonian_in_a_circular_orbit_is_the_jacobi_integral():
    system = replace(build_system(read_case(CASES / "orbiter_roll5.toml")), momenta=True)
    assert system.orbit is not None
    seen = motion(system, np.linspace(0, system.orbit.period / 2, 7))
    jacobi = seen["monitors/jacobi"]
    assert seen["monitors/hamiltonian"] == pytest.approx(jacobi, rel=1e-9) and np.ptp(jacobi) < 1e-6 * abs(jacobi[0])


def test_in_a_spinning_frame_the_hamiltonian_is_the_energy_less_spin_times_angular_momentum():
    spin = np.array([0.0, 0.0, 0.7])
    body = rigid_body(5.0, np.diag([1.0, 2.0, 2.5]))
    craft = System(
        {"hub": body}, (free("hub", u0=[0.1, 0, 0, 0.2, 0.1, 0]),), frame=Frame("spinning", spin), momenta=True
    )
    seen = motion(craft, np.linspace(0, 5, 6))
    H = seen["monitors/angular_momentum"] + np.cross(seen["monitors/center_of_mass"], seen["monitors/momentum"])
    assert seen["monitors/hamiltonian"] == pytest.approx(seen["monitors/energy"] - H @ spin, rel=1e-10)
    assert np.ptp(seen["monitors/hamiltonian"]) < 1e-9


def test_a_prescribed_coordinate_has_no_momentum_and_channels_come_only_on_request():
    driven = Profile(np.zeros(1), np.zeros((1, 1)), np.array([[0.1, 2.0, 0.0]]))
    joints = (prismatic("cart", axis=[1, 0, 0], name="rail", motion=(driven,)), cart().joints[1])
    seen = motion(replace(cart(), joints=joints), np.linspace(0, 1, 3))
    assert not seen["momenta"][:, 0].any() and seen["momenta"][:, 1].all()
    channels = compile_system(cart(momenta=False)).channels
    assert "momenta" not in channels and "monitors/hamiltonian" not in channels
    named = compile_system(cart()).channels["momenta"]
    assert named.unit == "kg m/s, kg m^2/s" and named.names[1] == "pin.angle_rate"
