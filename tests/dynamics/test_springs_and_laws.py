"""Springs and laws of joints: forces as gradients of energy, closed forms, frequencies."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from support.random_systems import random_body

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.integrate.dop853 import Dop853
from femflex.system import (
    Friction,
    Latch,
    Spring,
    Stop,
    System,
    TabulatedDamper,
    TabulatedSpring,
    cylindrical,
    free,
    prismatic,
    revolute,
    spherical,
    universal,
)

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
def test_spring_force_is_gradient_of_energy(kind):
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


def test_body_on_spring_oscillates_at_closed_form():
    wheel = rigid_body(1.0, np.diag([0.4, 0.5, 0.8]))
    model = compile_system(System({"wheel": wheel}, (revolute("wheel", stiffness=5.0, rest=0.3, q0=[0.5]),)))
    times = np.linspace(0.0, 10.0, 41)
    states = Dop853(rtol=1e-12, atol=1e-13).solve(model, times, model.x0).states
    assert states[:, 0] == pytest.approx(0.3 + 0.2 * np.cos(np.sqrt(5.0 / 0.8) * times), abs=1e-10)
    assert model.max_frequency == pytest.approx(2.5, rel=1e-8)


def test_damped_spring_dissipates_energy_lost():
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


LAWS = (
    TabulatedSpring(at=[-1.0, 0.0, 0.5, 2.0], force=[-4.0, 0.0, 1.0, 9.0]),
    TabulatedDamper(rate=[-2.0, 0.0, 1.0, 3.0], force=[-3.0, 0.0, 0.5, 4.0]),
    Stop(lower=-0.3, upper=0.4, stiffness=50.0, damping=2.0, width=0.1),
    Stop(upper=0.1, stiffness=20.0, width=0.05, name="bumper"),
    Stop(lower=0.2, stiffness=20.0, width=0.05, name="pad"),
    Friction(force=0.7, velocity=0.2),
)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name or law.kind)
def test_joint_laws_are_gradient_of_energy_and_dissipate(law):
    q, h = np.linspace(-1.7, 2.4, 83), 1e-4
    energies = [law_values(law, q + k * h)["monitors/spring"] for k in (-2, -1, 1, 2)]
    gradient = np.array([1, -8, 8, -1]) @ energies / (12 * h)
    force = f"laws/{law.name or f'rail.{law.kind}'}/force"
    still = law_values(law, q)[force]
    assert still == pytest.approx(gradient, abs=1e-6)  # knots of C1 tables: third derivative jumps
    for u in (-2.5, -0.1, 0.1, 2.5):
        seen = law_values(law, q, u)
        assert np.all(seen["monitors/dissipation"] >= 0)
        assert seen["monitors/dissipation"] == pytest.approx((seen[force] - still) * u, abs=1e-12)


def slider(**more):
    """A mass of 2 kg on a rail."""
    return compile_system(System({"cart": rigid_body(2.0, np.eye(3))}, (prismatic("cart", name="rail", **more),)))


def law_values(law, q, u=0.0):
    """Channels of a slider with a law at coordinates q (n,) and a rate."""
    return slider(laws=(law,)).observe(np.zeros(len(q)), np.stack([q, u + 0 * q], axis=1))


def test_coulomb_friction_stopping_distance():
    model = slider(laws=(Friction(force=4.0, velocity=1e-5),), u0=[3.0])
    states = integrator("dop853", rtol=1e-10, atol=1e-10).solve(model, np.linspace(0, 2.0, 21), model.x0).states
    t = 3.0 * 2.0 / 4.0  # until it rests
    assert states[5, 0] == pytest.approx(3.0 * 0.5 - 0.5 * 2.0 * 0.5**2, abs=1e-5)
    assert states[-1, 0] == pytest.approx(3.0 * t / 2, abs=1e-4)  # within a few times velocity x duration
    assert abs(states[-1, 1]) < 1e-5


@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
def test_cart_between_stops_conserves_energy(method):
    model = slider(laws=(Stop(lower=-0.5, upper=0.5, stiffness=2e4, width=0.02),), u0=[1.0])
    tolerance = {"dop853": 1e-10, "esdirk4": 1e-7}[method]
    solution = integrator(method, rtol=tolerance, atol=tolerance).solve(model, np.linspace(0, 4.0, 201), model.x0)
    seen = model.observe(solution.times, solution.states)
    allowed = {"dop853": 1e-7, "esdirk4": 2e-3}[method]
    assert seen["monitors/spring"].max() > 0.1
    assert seen["monitors/energy"] == pytest.approx(1.0, rel=allowed)
    assert np.abs(solution.states[:, 0]).max() < 0.55
    assert solution.steps.rejected < solution.steps.accepted


def test_sticking_joint_takes_long_implicit_steps():
    """Without friction's slope Newton's method contracts only up to h = 0.8 m v / (gamma limit), 2 ms here."""
    limit, creep, mass, gamma = 3.0, 1e-3, 2.0, 0.25
    model = slider(laws=(Friction(force=limit, velocity=creep),), stiffness=2.0, u0=[1.0])
    solution = integrator("esdirk4", rtol=1e-6, atol=1e-7).solve(model, np.linspace(0, 40, 11), model.x0)
    without = 0.8 * mass * creep / (gamma * limit)
    assert solution.steps.largest > 100 * without
    assert solution.steps.evaluations < 0.1 * 5 * 40 / without


BODY = rigid_body(2.0, [1.0, 2.0, 2.5])


def slides(*laws, damping=(0.0, 0.0)) -> System:
    """Two boxes of 2 and 5 kg, the second on the first, along axes 60 degrees apart."""
    first = prismatic("a", axis=(1, 0, 0), name="first", damping=damping[0], q0=[0.1])
    axis = (0.5, np.sqrt(0.75), 0)
    second = prismatic("b", "a", axis=axis, name="second", damping=damping[1], laws=laws, q0=[0.2])
    return System({"a": BODY, "b": rigid_body(5.0, [1.0] * 3)}, (first, second))


M = np.array([[7.0, 2.5], [2.5, 5.0]])  # of both slides: 2 + 5, 5 cos 60 deg, 5


def test_highest_frequency_of_joint_laws():
    stops = Stop(upper=1.0, stiffness=80.0), Stop(upper=2.0, stiffness=20.0)  # neither touches at the start
    found = compile_system(slides(*stops)).max_frequency
    assert found == pytest.approx(np.sqrt(80.0 * np.linalg.inv(M)[1, 1]), rel=1e-9)
    latch = Latch(0, at=0.9, stiffness=500.0)
    system = slides(*stops)
    system = replace(system, joints=(replace(system.joints[0], latches=(latch,)), system.joints[1]))
    assert compile_system(system).max_frequency == pytest.approx(np.sqrt(500.0 * np.linalg.inv(M)[0, 0]), rel=1e-9)


def test_highest_rate_of_dampers():
    model = compile_system(slides(damping=(300.0, 40.0)))
    rates = np.linalg.eigvals(np.linalg.solve(M, np.diag([300.0, 40.0])))
    assert model.max_frequency == pytest.approx(rates.max(), rel=1e-7)
    rubbed = compile_system(slides(Friction(force=2.0, velocity=0.01)))
    assert rubbed.max_frequency == pytest.approx(2.0 / 0.01 * np.linalg.inv(M)[1, 1], rel=1e-3)
    assert compile_system(slides()).max_frequency == 0.0
