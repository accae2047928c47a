"""Springs of joints: forces are minus the gradient of the energy they report, and motion keeps the total."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from support.random_systems import random_body

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate.dop853 import Dop853
from femflex.system import Spring, System, cylindrical, free, prismatic, revolute, spherical, universal

STIFFNESS, REST = np.array([5.0, 2.0, 9.0, 4.0, 7.0, 3.0]), np.array([0.1, -0.2, 0.15, 0.3, -0.1, 0.2])
KINDS = {
    "revolute": (revolute, {"axis": (1.0, 2.0, -0.5)}),
    "prismatic": (prismatic, {"axis": (0.3, -1.0, 0.4)}),
    "cylindrical": (cylindrical, {"axis": (0.3, -1.0, 0.4)}),
    "universal": (universal, {"axes": ((1.0, 0.2, 0.0), (0.1, 0.9, 0.5))}),
    "spherical": (spherical, {}),
    "spherical by angles": (spherical, {"rotation": "zxz", "q0": [0.05, 0.05, 0.05]}),
    "spherical by modified parameters": (spherical, {"rotation": "modified_rodrigues"}),
    "free": (free, {}),
}


def sprung(kind, damping=0.0, flexible=True):
    """A body on a sprung joint, by a moving marker, to a hub on a spherical joint with springs."""
    make, where = KINDS[kind]
    rng = np.random.default_rng(2)
    side = Marker(np.array([0.4, 0.1, -0.2]), np.zeros((3, 0)), np.zeros((3, 0)))
    hub = rigid_body(3.0, np.diag([2.0, 3.0, 2.5]), center_of_mass=[0.1, 0.2, 0.0], markers={"side": side})
    arm = random_body(rng, 5)[0] if flexible else rigid_body(2.0, np.diag([0.5, 0.6, 0.4]), [0.3, 0.0, 0.2])
    arm = replace(arm, damping=0.0 * arm.damping)
    root = spherical("hub", stiffness=[3.0, 5.0, 4.0], rest=[0.2, 0.0, -0.1])
    joint = make("arm", "hub", parent_marker="side", child_marker="b" if flexible else "origin", **where)
    joint = replace(
        joint, stiffness=STIFFNESS[: joint.n_u], rest=REST[: joint.n_u], damping=np.full(joint.n_u, damping)
    )
    return compile_system(System({"hub": hub, "arm": arm}, (root, joint)))


def state(model, seed=0):
    """Some state of unit Euler parameters, its turns well below half a turn."""
    rng = np.random.default_rng(seed)
    q, step = np.empty(model.n_q), 0.3 * rng.normal(size=model.n_u)
    start = model.x0[: model.n_q].copy()
    start[start == 0.0] = 0.05  # off the singularity of angle sets
    for first in model.renormalise:
        start[first : first + 4] /= np.linalg.norm(start[first : first + 4])
    model.second_order.advance(start, step, q, model.table, model.pool, model.work)
    return np.concatenate([q, 0.5 * rng.normal(size=model.n_u)])


def potential(model, q):
    out = model.observe(np.zeros(1), np.concatenate([q, np.zeros(model.n_u)])[None])
    return out["monitors/spring"][0] + out["monitors/elastic"][0]


@pytest.mark.parametrize("kind", KINDS)
def test_force_is_minus_the_gradient_of_the_reported_energy(kind):
    model = sprung(kind)
    q, h = state(model)[: model.n_q], 1e-5
    force = model.bias(0.0, np.concatenate([q, np.zeros(model.n_u)]))  # dV/d(quasi-coordinates): nothing else acts
    gradient, moved = np.empty(model.n_u), np.empty((2, model.n_q))
    for k, unit in enumerate(np.eye(model.n_u)):
        for row, sign in zip(moved, (1, -1), strict=True):
            model.second_order.advance(q, sign * h * unit, row, model.table, model.pool, model.work)
        gradient[k] = (potential(model, moved[0]) - potential(model, moved[1])) / (2 * h)
    assert np.abs(force).min() > 1e-3
    assert force == pytest.approx(gradient, abs=1e-8)


@pytest.mark.parametrize("kind", KINDS)
def test_motion_on_springs_keeps_the_energy(kind):
    model = sprung(kind)
    times = np.linspace(0.0, 1.5, 16)
    out = model.observe(times, Dop853(rtol=1e-12, atol=1e-13).solve(model, times, state(model)).states)
    energy = out["monitors/energy"]
    assert np.ptp(out["monitors/spring"]) > 0.05 * energy[0]
    assert energy == pytest.approx(np.full(16, energy[0]), rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_damper_takes_its_coefficient_times_the_square_of_the_rate(kind):
    free_, damped = sprung(kind), sprung(kind, damping=0.7)
    x = state(free_)
    joint = damped.system.joint_of("arm")
    u = x[damped.n_q + 3 : damped.n_q + 3 + joint.n_u]  # after the root's three
    difference = damped.bias(0.0, x) - free_.bias(0.0, x)
    assert difference[3 : 3 + joint.n_u] == pytest.approx(0.7 * u, abs=1e-11)
    assert np.delete(difference, slice(3, 3 + joint.n_u)) == pytest.approx(0.0, abs=1e-11)


def test_a_body_on_one_spring_swings_at_its_textbook_frequency():
    wheel = rigid_body(1.0, np.diag([0.4, 0.5, 0.8]))
    model = compile_system(System({"wheel": wheel}, (revolute("wheel", stiffness=5.0, rest=0.3, q0=[0.5]),)))
    times = np.linspace(0.0, 10.0, 41)
    states = Dop853(rtol=1e-12, atol=1e-13).solve(model, times, model.x0).states
    assert states[:, 0] == pytest.approx(0.3 + 0.2 * np.cos(np.sqrt(5.0 / 0.8) * times), abs=1e-10)
    assert model.max_frequency == pytest.approx(2.5, rel=1e-8)


def test_what_a_damped_spring_between_markers_takes_is_what_its_craft_loses():
    """Two bodies in free flight: energy falls by the power of the damper, c times the square of the line's rate."""
    line = Spring("line", "tip", "hub", "origin", "side", stiffness=20.0, damping=3.0, length=0.5)
    side = Marker(np.array([0.4, 0.1, -0.2]), np.zeros((3, 0)), np.zeros((3, 0)))
    hub = rigid_body(3.0, np.diag([2.0, 3.0, 2.5]), markers={"side": side})
    joints = (
        free("hub", u0=[0.3, 0, 0, 0.2, -0.5, 0.4]),
        free("tip", q0=[1.5, 0.7, 0, 1, 0, 0, 0], u0=[0, 1.0] + [0] * 4),
    )
    system = System({"hub": hub, "tip": rigid_body(2.0, np.diag([0.5, 0.6, 0.4]))}, joints, springs=(line,))
    model, times = compile_system(system), np.linspace(0.0, 3.0, 61)
    seen = model.observe(times, Dop853(rtol=1e-11, atol=1e-12).solve(model, times, model.x0).states)
    lost = seen["monitors/energy"][0] - seen["monitors/energy"]
    power = seen["monitors/dissipation"]
    length = np.linalg.norm(seen["bodies/tip/position"] - seen["markers/hub.side/position"], axis=1)
    rate = CubicSpline(times, length)(times, 1)
    assert lost[-1] > 0.5 and power[5:-5] == pytest.approx(3.0 * rate[5:-5] ** 2, abs=2e-3 * power.max())
    assert CubicSpline(times, power).integrate(0.0, 3.0) == pytest.approx(lost[-1], rel=1e-4)


def test_every_spring_reports_its_length_and_its_pull():
    """Of two: k (length - free length) + c times the rate of the length; the ground holds the one's other end."""
    side = Marker(np.array([0.4, 0.1, -0.2]), np.zeros((3, 0)), np.zeros((3, 0)))
    hub = rigid_body(3.0, np.diag([2.0, 3.0, 2.5]), markers={"side": side})
    line = Spring("line", "tip", "hub", "origin", "side", stiffness=20.0, damping=3.0, length=0.5)
    stay = Spring("stay", "hub", marker="side", stiffness=7.0, length=1.5)
    joints = (
        free("hub", u0=[0.3, 0, 0, 0.2, -0.5, 0.4]),
        free("tip", q0=[1.5, 0.7, 0, 1, 0, 0, 0], u0=[0, 1.0] + [0] * 4),
    )
    system = System({"hub": hub, "tip": rigid_body(2.0, np.diag([0.5, 0.6, 0.4]))}, joints, springs=(line, stay))
    model, times = compile_system(system), np.linspace(0.0, 1.0, 201)
    seen = model.observe(times, Dop853(rtol=1e-11, atol=1e-12).solve(model, times, model.x0).states)
    at, v = seen["markers/hub.side/position"], seen["markers/hub.side/velocity"]
    across = seen["bodies/tip/position"] - at
    length = np.linalg.norm(across, axis=1)
    assert seen["springs/line/length"] == pytest.approx(length, rel=1e-12)
    assert seen["springs/stay/length"] == pytest.approx(np.linalg.norm(at, axis=1), rel=1e-12)
    assert seen["springs/stay/tension"] == pytest.approx(7.0 * (np.linalg.norm(at, axis=1) - 1.5), rel=1e-12)
    tip = np.gradient(seen["bodies/tip/position"], times, axis=0)[90]  # central differences, to 1e-4
    rate = (across[90] / length[90]) @ (tip - v[90])
    assert seen["springs/line/tension"][90] == pytest.approx(20.0 * (length[90] - 0.5) + 3.0 * rate, rel=1e-3)
    assert [model.channels[f"springs/{name}"].unit for name in ("line/length", "stay/tension")] == ["m", "N"]


def test_a_spring_pulls_with_the_force_that_it_reports():
    """The momentum of a body on one spring changes by the reported tension along the line."""
    stay = Spring("stay", "hub", stiffness=7.0, damping=0.4, length=0.5)
    system = System(
        {"hub": rigid_body(3.0, np.eye(3))}, (free("hub", q0=[1, 2, 2, 1, 0, 0, 0], u0=[1, 0, 0, 0, 0, 0]),)
    )
    model = compile_system(replace(system, springs=(stay,)))
    seen = model.observe(np.zeros(1), model.x0[None])
    assert seen["springs/stay/length"] == pytest.approx(3.0)
    assert seen["springs/stay/tension"] == pytest.approx(7.0 * 2.5 + 0.4 / 3)  # its end moves along x alone
    push = model.bias(0.0, model.x0)[:3]  # resisting
    assert push == pytest.approx(seen["springs/stay/tension"][0] * np.array([1, 2, 2]) / 3)
