"""Prescribed motion: forces it needs, its power, moving bases, and every kind of profile."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.system import Load, Profile, System, prismatic, revolute, turns


def crane(motion=(), torque=0.0, n=2):
    """A hub afloat with a flexible arm on a hinge, and the torque on it as an equal and opposite pair."""
    rng = np.random.default_rng(5)
    from support.random_systems import random_body

    arm = replace(random_body(rng, n)[0], damping=np.zeros((n, n)))
    hub = rigid_body(
        30.0,
        np.diag([20.0, 30.0, 25.0]),
        center_of_mass=[0.1, 0.2, 0.0],
        markers={"side": Marker.at_position(np.array([0.5, 0.3, 0.0]))},
    )
    loads = tuple(
        Load(name, body, frame="inertial", torque=np.array([0, 0, sign * torque]))
        for name, body, sign in (("on_arm", "arm", 1.0), ("on_hub", "hub", -1.0))
    )
    root = turns("hub", motion=(None, 0.0, 0.0), sequence="zxy")  # plane motion: one axis throughout
    hinge = revolute("arm", "hub", parent_marker="side", motion=motion, name="hinge")
    return System({"hub": hub, "arm": arm}, (root, hinge), loads=loads)


def test_prescribed_motion_torque_equals_applied_torque():
    model = compile_system(crane(torque=3.0))
    rng = np.random.default_rng(3)
    for _ in range(5):
        x = np.concatenate([0.2 * rng.normal(size=model.n_q), rng.normal(size=model.n_u)])
        x[[1, 2, model.n_q + 1, model.n_q + 2]] = 0.0
        rate = model.state_rate(0.0, x)
        motion = (Profile.polynomial(x[3], x[model.n_q + 3], rate[model.n_q + 3] / 2),)
        driven = compile_system(crane(motion))
        needed = driven.observe(np.zeros(1), x[None])["joints/hinge/drive"][0, 0]
        assert needed == pytest.approx(3.0, rel=1e-10)


@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
def test_power_of_prescribed_motion_is_rate_of_energy(method):
    model = compile_system(crane((Profile.smooth_step(0.1, 1.1, 0.0, 0.8) + Profile.sine(0.1, 5.0),)))
    times = np.linspace(0.0, 1.5, 601)
    tolerance = {"dop853": 1e-11, "esdirk4": 1e-9}[method]
    states = integrator(method, rtol=tolerance, atol=tolerance).solve(model, times, model.x0).states
    seen = model.observe(times, states)
    from scipy.interpolate import CubicSpline

    work = CubicSpline(times, seen["monitors/drive_power"]).antiderivative()(times)
    energy = seen["monitors/energy"]
    error = {"dop853": 1e-7, "esdirk4": 1e-5}[method]
    assert np.ptp(energy) > 1.0
    assert energy - energy[0] == pytest.approx(work, abs=error * np.ptp(energy))
    s = model.system.joint_of("arm").prescribed[0](times)
    assert seen["q"][:, 3] == pytest.approx(s[0], abs=1e-14) and seen["u"][:, 3] == pytest.approx(s[1], abs=1e-14)


def test_prescribed_root_is_moving_base():
    """A pendulum whose support is accelerated steadily sideways hangs and swings about the tilted vertical."""
    g, a, length = 9.81, 3.0, 0.7
    bob = rigid_body(2.0, 1e-9 * np.eye(3), center_of_mass=[0.0, -length, 0.0])
    cart = rigid_body(1.0, np.eye(3))
    lift = Profile.polynomial(0.0, 0.0, g / 2)  # the floor going up stands for weight
    base = turns("cart", slides=np.eye(3), motion=(Profile.polynomial(0.0, 0.0, a / 2), lift, 0.0, 0.0, 0.0, 0.0))
    model = compile_system(System({"cart": cart, "bob": bob}, (base, revolute("bob", "cart", name="pivot"))))
    x = model.x0.copy()
    for angle in (-0.4, 0.0, 0.3):
        x[6] = angle
        udot = model.state_rate(0.2, x)[model.n_q + 6]
        assert udot == pytest.approx(-(g * np.sin(angle) + a * np.cos(angle)) / length, rel=1e-6)
    seen = model.observe(np.array([0.2]), x[None])
    assert seen["bodies/cart/position"][0] == pytest.approx([a * 0.02, g * 0.02, 0.0])
    assert model.channels["joints/base-cart/drive"].names[:2] == ("slide1", "slide2")


KNOTS = np.array([-0.5, 0.8, 2.0, 2.3, 4.1])
BENDS = np.array([[0.7, -0.4], [-1.1, 0.3], [2.0, 0.9], [0.2, -0.8], [-0.6, 0.5]])  # of second and third order
SINES = np.array([[0.3, 5.0, 0.4], [-0.2, 11.0, 1.9]])


def pieces():
    """Cubics that go on with place and rate from one to the next."""
    out, s, rate = [], 0.2, -1.3
    for k, (second, third) in enumerate(BENDS):
        out.append(Polynomial([s, rate, second, third]))
        if k + 1 < len(KNOTS):
            gap = KNOTS[k + 1] - KNOTS[k]
            s, rate = out[-1](gap), out[-1].deriv()(gap)
    return out


def expected(t, order):
    k = max(0, np.searchsorted(KNOTS, t, side="right") - 1)
    wave = sum(a * w**order * np.sin(w * t + phase + order * np.pi / 2) for a, w, phase in SINES)
    return pieces()[k].deriv(order)(t - KNOTS[k]) + wave if order else pieces()[k](t - KNOTS[k]) + wave


@pytest.mark.parametrize("t", [-1.0, -0.5, 0.3, 0.8, 1.9, 2.0, 2.2, 2.3, 3.0, 4.1, 5.5])
def test_mass_follows_profile(t):
    profile = Profile(KNOTS, np.array([piece.coef for piece in pieces()]), SINES)
    joint = prismatic("mass", axis=(0, 0, 1), motion=(profile,), name="lead")
    model = compile_system(System({"mass": rigid_body(2.5, np.eye(3))}, (joint,)))
    seen = model.observe(np.array([t]), np.zeros((1, 2)))
    assert seen["bodies/mass/position"][0] == pytest.approx([0, 0, expected(t, 0)], abs=1e-12)
    assert seen["monitors/momentum"][0] == pytest.approx([0, 0, 2.5 * expected(t, 1)], abs=1e-11)
    assert seen["joints/lead/drive"][0] == pytest.approx([2.5 * expected(t, 2)], abs=1e-10)
    assert seen["q"][0] == pytest.approx([expected(t, 0)], abs=1e-12)
    assert seen["u"][0] == pytest.approx([expected(t, 1)], abs=1e-12)
