"""Locked and prescribed freedoms: the equations, and the forces they need, against Kane's equations over points."""

from dataclasses import replace

import numpy as np
import pytest
from support.pointwise import Tree, equations
from support.prescribed_systems import at_time, held_tree
from support.random_systems import random_tree
from test_equations import elastic_forces, frozen

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.joints.held_places import held_places
from femflex.dynamics.terms.by_source import terms
from femflex.dynamics.terms.prescribed_motion_report import drives
from femflex.integrate import integrator
from femflex.system import Frame, Load, Orbit, Profile, System, free, prismatic, revolute, spherical, turns, universal

NOW = 0.4
STRONG = Orbit(7e6, 0.3, inclination=0.4, node=0.2, perigee=1.0, true_anomaly=0.7, mu=5e20)
KINDS = {
    "inertial": {},
    "spinning": {"frame": Frame("spinning", np.array([0.3, -0.5, 0.7]))},
    "specified orbit": {"root": universal, "orbit": STRONG, "frame": Frame("orbital")},
}


def no_field(m, r):
    return np.zeros((len(m), 3))


def held_rows(system):
    return [u for _, _, _, u in held_places(system)]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", range(16))
def test_motion_and_drives_satisfy_kanes_equations_over_material_points(seed):
    system, clouds, state = held_tree(seed)
    model, held = compile_system(system), held_rows(system)
    q, u = at_time(system, NOW, *state)
    raw = np.concatenate(state)  # what stands in held places of the state is not looked at
    udot = model.state_rate(NOW, raw)[model.n_q :]
    assert udot[held] == pytest.approx(at_time(system, NOW, q, u, udot)[2][held], abs=1e-12)
    theirs = equations(Tree(system, clouds), q, u, udot, frozen(np.eye(3)), no_field) + elastic_forces(system, q, u)
    size = np.abs(elastic_forces(system, q, u)).max(initial=1) + np.abs(theirs).max()
    needed = drives(model, np.array([NOW]), raw[None])[0]
    assert theirs == pytest.approx(needed, abs=1e-10 * size)
    assert np.count_nonzero(needed) == len(held)


@pytest.mark.parametrize("seed", range(6))
def test_residual_and_solve_agree_with_the_recursion(seed):
    system, _, state = held_tree(seed, n_bodies=6)
    model, held = compile_system(system), held_rows(system)
    x, rng = np.concatenate(state), np.random.default_rng(seed)
    udot = model.state_rate(NOW, x)[model.n_q :]
    size = np.abs(model.bias(NOW, x)).max(initial=1)
    assert model.residual(NOW, x, udot) == pytest.approx(np.zeros(model.n_u), abs=1e-10 * size)
    rhs, out = rng.normal(size=model.n_u), np.empty(model.n_u)
    model.second_order.solve(NOW, x[: model.n_q], rhs, out, 2.0, 0.0, 0.0, model.table, model.pool, model.work)
    M = model.mass_matrix(NOW, x)
    assert M[held] == pytest.approx(np.eye(model.n_u)[held], abs=1e-9)
    assert 2.0 * M @ out == pytest.approx(rhs, abs=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_driving_with_the_motion_of_a_free_run_needs_no_force(seed):
    system, _, (q, u) = random_tree(seed, n_bodies=4)
    k = next(k for k, joint in enumerate(system.joints) if joint.ball is None and joint.n_u)
    model, x = compile_system(system), np.concatenate([q, u])
    rate = model.state_rate(0.0, x)
    joint = system.joints[k]
    iq, iu = places(system, joint)
    motion = tuple(Profile.polynomial(q[iq + j], u[iu + j], rate[model.n_q + iu + j] / 2) for j in range(joint.n_u))
    led = replace(joint, motion=motion)
    driven = compile_system(replace(system, joints=tuple(led if j is joint else j for j in system.joints)))
    assert driven.state_rate(0.0, x) == pytest.approx(rate, abs=1e-9 * np.abs(rate).max())
    size = np.abs(terms(model, np.zeros(1), x[None])["inertia"]).max()
    assert drives(driven, np.zeros(1), x[None])[0] == pytest.approx(0.0, abs=1e-10 * size)


def places(system, joint):
    iq = iu = 0
    for name in system.order:
        if system.joint_of(name) is joint:
            return iq, iu
        iq, iu = iq + system.joint_of(name).n_q + system.bodies[name].n_modes, iu + system.joint_of(name).n_u
        iu += system.bodies[name].n_modes
    raise LookupError(joint.label)


def crane(motion=(), torque=0.0, n=2):
    """A hub afloat with a flexible arm on a hinge, and the torque on it as an equal and opposite pair."""
    rng = np.random.default_rng(5)
    from support.random_systems import random_body

    arm = replace(random_body(rng, n)[0], damping=np.zeros((n, n)))
    hub = rigid_body(
        30.0,
        np.diag([20.0, 30.0, 25.0]),
        center_of_mass=[0.1, 0.2, 0.0],
        markers={"side": Marker.rigid(np.array([0.5, 0.3, 0.0]))},
    )
    loads = tuple(
        Load(name, body, frame="inertial", torque=np.array([0, 0, sign * torque]))
        for name, body, sign in (("on_arm", "arm", 1.0), ("on_hub", "hub", -1.0))
    )
    root = turns("hub", motion=(None, 0.0, 0.0), sequence="zxy")  # plane motion: one axis throughout
    hinge = revolute("arm", "hub", parent_marker="side", motion=motion, name="hinge")
    return System({"hub": hub, "arm": arm}, (root, hinge), loads=loads)


def test_drive_reproduces_the_torque_of_a_free_run_to_1e_10():
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


@pytest.mark.parametrize("method", ["dop853", "esdirk4", "generalized_alpha"])
def test_power_of_drives_is_the_rate_of_energy_along_a_run(method):
    model = compile_system(crane((Profile.smooth_step(0.1, 1.1, 0.0, 0.8) + Profile.sine(0.1, 5.0),)))
    times = np.linspace(0.0, 1.5, 601)
    tolerance = {"dop853": 1e-11, "esdirk4": 1e-9, "generalized_alpha": 1e-7}[method]
    states = integrator(method, rtol=tolerance, atol=tolerance).solve(model, times, model.x0).states
    seen = model.observe(times, states)
    from scipy.interpolate import CubicSpline

    work = CubicSpline(times, seen["monitors/drive_power"]).antiderivative()(times)
    energy = seen["monitors/energy"]
    error = {"dop853": 1e-7, "esdirk4": 1e-5, "generalized_alpha": 1e-3}[method]
    assert np.ptp(energy) > 1.0
    assert energy - energy[0] == pytest.approx(work, abs=error * np.ptp(energy))
    s = model.system.joint_of("arm").held[0](times)
    assert seen["q"][:, 3] == pytest.approx(s[0], abs=1e-14) and seen["u"][:, 3] == pytest.approx(s[1], abs=1e-14)


def test_a_root_that_moves_as_specified_is_a_moving_base():
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


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_terms_sum_to_zero_with_drives_among_them(kind, seed):
    system, _, state = held_tree(seed, **KINDS[kind])
    system = replace(
        system, loads=(Load("push", system.order[-1], "a", "marker", force=np.ones(3), torque=np.ones(3)),)
    )
    model, x = compile_system(system), np.concatenate(state)
    found = {name: rows[0] for name, rows in terms(model, np.array([NOW]), x[None]).items()}
    assert sum(name.startswith("drives/") for name in found) == len(held_places(system))
    largest = max(np.abs(row).max() for row in found.values())
    assert np.abs(sum(found.values())).max() < 1e-11 * largest


@pytest.mark.parametrize("seed", [2, 4, 11])
def test_linear_terms_split_into_the_change_of_the_mass_matrix_and_a_skew_part(seed):
    system, _, state = held_tree(seed, n_bodies=4)
    model, held = compile_system(system), held_rows(system)
    q, u = at_time(system, NOW, *state)
    found = {name: rows[0] for name, rows in terms(model, np.array([NOW]), np.concatenate([q, u])[None]).items()}
    free_ = [k for k in range(model.n_u) if k not in held]
    # M_t: the mass matrix of the tree with the held freedoms free, differentiated along their motion alone
    loose = compile_system(replace(system, joints=tuple(replace(j, motion=()) for j in system.joints)))

    def M(t):
        return loose.mass_matrix(0.0, np.concatenate(at_time(system, t, q, u)))[np.ix_(free_, free_)]

    h = 1e-4
    M_t = (M(NOW - 2 * h) - 8 * M(NOW - h) + 8 * M(NOW + h) - M(NOW + 2 * h)) / (12 * h)
    size = np.abs(M_t @ u[free_]).max()
    assert size > 0.1
    assert found["moving_mass"][free_] == pytest.approx(M_t @ u[free_], abs=1e-8 * size)
    assert abs(u[free_] @ found["gyroscopic"][free_]) < 1e-11 * size * np.abs(u).max() * len(free_)


def test_terms_can_be_left_out_of_a_led_motion():
    model = compile_system(crane((Profile.sine(0.4, 5.0),)))
    x, t = model.x0 + 0.2, 0.3
    for name in ("gyroscopic", "moving_mass", "specified_motion", "coriolis_centrifugal"):
        less = model.without(name)
        udot = less.state_rate(t, x)[model.n_q :]
        found = terms(less, np.array([t]), x[None])
        assert name not in found and np.abs(sum(rows[0] for rows in found.values())).max() < 1e-9
        assert udot[3] == pytest.approx(Profile.sine(0.4, 5.0)(t)[2])
        assert not np.allclose(udot, model.state_rate(t, x)[model.n_q :], rtol=1e-6)
        drive = less.observe(np.array([t]), x[None])["joints/hinge/drive"][0, 0]
        assert found["drives/hinge.angle"][0, 3] == pytest.approx(-drive)
    with pytest.raises(
        ValueError, match=r"'drives/hinge.angle' cannot be switched off: it is the force that the prescribed"
    ):
        model.without("drives/hinge.angle")


def test_what_cannot_be_held_is_refused():
    step = Profile.smooth_step(0.0, 1.0, 0.0, 1.0)
    for make, text in (
        (lambda: revolute("a", motion=(step, step)), r"motion of joint 'base-a' has 2 entries; the joint needs 1"),
        (
            lambda: spherical("a", motion=(step, None, None)),
            r"of a ball cannot be prescribed by itself; give joint 'base-a' tu",
        ),
        (lambda: revolute("a", motion=(step,), stiffness=3.0), r"'base-a.angle' has a stiffness of 3 and a prescribed"),
        (lambda: prismatic("a", motion=(0.0,), damping=2.0), r"'base-a.slide' has a damping of 2 and a prescribed"),
        (
            lambda: revolute("a", motion=(step,), q0=[0.3]),
            r"q0 of 'base-a.angle' is 0.3, but its motion is prescribed and",
        ),
        (
            lambda: revolute("a", motion=(Profile.spline([1, 2, 3, 4], [0, 1, 0, 1]),)),
            r"the motion of 'base-a.angle' is known from 1 s to 4 s; it must begin at or before 0 s",
        ),
    ):
        with pytest.raises(ValueError, match=text):
            make()
    assert free("a", motion=(step, None, None, None, None, None)).u0.shape == (6,)  # slides of a free joint
