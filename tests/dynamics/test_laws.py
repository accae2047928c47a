"""Laws of joint freedoms: forces against differences of the energy, motion against closed forms, integrators alike."""

from dataclasses import replace

import numpy as np
import pytest
from support.random_systems import random_tree

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.terms.by_source import terms
from femflex.integrate import integrator
from femflex.system import (
    Friction,
    Latch,
    Stop,
    System,
    TabulatedDamper,
    TabulatedSpring,
    knife_edge,
    prismatic,
    revolute,
    spherical,
)

LAWS = (
    TabulatedSpring(stretch=[-1.0, 0.0, 0.5, 2.0], resisting=[-4.0, 0.0, 1.0, 9.0]),
    TabulatedDamper(rate=[-2.0, 0.0, 1.0, 3.0], resisting=[-3.0, 0.0, 0.5, 4.0]),
    Stop(lower=-0.3, upper=0.4, stiffness=50.0, damping=2.0, width=0.1),
    Stop(upper=0.1, stiffness=20.0, width=0.05, name="bumper"),
    Stop(lower=0.2, stiffness=20.0, width=0.05, name="pad"),
    Friction(limit=0.7, velocity=0.2),
)


def furnished(seed):
    """A random tree with all laws, and an elastic latch, on one of its slides or turns; and a state."""
    system, _, (q, u) = random_tree(seed, n_bodies=4)
    joint = next(j for j in system.joints if j.ball is None and j.n_u)
    laws = tuple(replace(law, freedom=joint.n_u - 1) for law in LAWS)
    grown = replace(joint, laws=laws, damping=np.full(joint.n_u, 0.3))
    joints = tuple(grown if j is joint else j for j in system.joints)
    return replace(system, joints=joints), grown, q, u


def at(system, joint):
    """Places in q and u of the joint's last freedom."""
    iq = iu = 0
    for name in system.order:
        own = system.joint_of(name)
        if own is joint:
            return iq + joint.n_u - 1, iu + joint.n_u - 1
        iq, iu = iq + own.n_q + system.bodies[name].n_modes, iu + own.n_u + system.bodies[name].n_modes
    raise LookupError(joint.label)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name or law.kind)
def test_elastic_force_is_the_gradient_of_the_energy_and_no_law_gives_energy(law):
    q, h = np.linspace(-1.7, 2.4, 83), 1e-4
    zero = np.zeros_like(q)
    gradient = (law.energy(q - 2 * h) - 8 * law.energy(q - h) + 8 * law.energy(q + h) - law.energy(q + 2 * h)) / (
        12 * h
    )
    assert law.force(q, zero) == pytest.approx(gradient, abs=1e-6)  # knots of C1 tables: third derivative jumps
    for u in (-2.5, -0.1, 0.1, 2.5):
        assert np.all(law.power(q, u + zero) >= 0)
        work = law.force(q, u + zero) * u - law.force(q, zero) * u
        assert law.power(q, u + zero) == pytest.approx(work, abs=1e-12)


def test_a_stop_is_smooth_and_linear_beyond_its_width():
    stop, w = LAWS[2], 0.1
    for limit, sign in ((0.4, 1.0), (-0.3, -1.0)):
        assert stop.force(np.array(limit - 1e-9 * sign), np.array(0.0)) == 0.0
        depth = np.array([w, 2 * w, 3 * w])
        force = stop.force(limit + sign * depth, 0 * depth)
        assert sign * np.diff(force) == pytest.approx(50.0 * w)
        assert sign * force[0] == pytest.approx(50.0 * w / 2)  # the step's mean is a half
        assert stop.contact(limit + sign * depth)[0] == pytest.approx(2.0)


def test_a_table_goes_through_its_points_and_on_in_straight_lines():
    spring = LAWS[0]
    x = np.array(spring.stretch)
    assert spring.force(x, 0 * x) == pytest.approx(spring.resisting)
    assert spring.energy(np.zeros(1)) == pytest.approx(0.0, abs=1e-15)
    assert np.diff(spring.force(np.array([3.0, 4.0, 5.0]), np.zeros(3)), 2) == pytest.approx(0.0, abs=1e-12)
    assert np.all(np.diff(spring.force(np.linspace(-3, 4, 200), np.zeros(200))) > 0)


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_laws_act_on_their_own_coordinate_alone_and_stand_in_the_ledger(seed):
    system, joint, q, u = furnished(seed)
    model, x = compile_system(system), np.concatenate([q, u])
    bare = compile_system(replace(system, joints=tuple(replace(j, laws=()) for j in system.joints)))
    iq, iu = at(system, joint)
    for value, rate in ((0.05, 0.3), (0.45, -1.0), (0.7, 2.5), (-0.35, -2.2), (-0.8, 0.0)):
        x[iq], x[model.n_q + iu] = value, rate
        expected = np.zeros(model.n_u)
        forces = [float(law.force(np.array(value), np.array(rate))) for law in joint.laws]
        expected[iu] = sum(forces)
        size = np.abs(bare.bias(0.0, x)).max()
        assert model.bias(0.0, x) - bare.bias(0.0, x) == pytest.approx(expected, abs=1e-12 * size)
        found = {name: row[0] for name, row in terms(model, np.zeros(1), x[None]).items()}
        assert np.abs(sum(found.values())).max() < 1e-11 * max(np.abs(row).max() for row in found.values())
        rows = {name: row for name, row in found.items() if name.startswith("laws/")}
        assert [row[iu] for row in rows.values()] == pytest.approx(forces, abs=1e-13)
        seen = model.observe(np.zeros(1), x[None])
        energy = sum(law.energy(np.array(value)) for law in joint.laws)
        assert seen["monitors/spring"][0] == pytest.approx(energy, abs=1e-13)
        assert seen["laws/pad/force"][0] == pytest.approx(forces[4], abs=1e-13)
        taken = seen["monitors/dissipation"] - bare.observe(np.zeros(1), x[None])["monitors/dissipation"]
        assert taken[0] == pytest.approx(sum(law.power(np.array(value), np.array(rate)) for law in joint.laws))


def test_a_law_can_be_left_out_by_name():
    system, joint, q, u = furnished(0)
    model, x = compile_system(system), np.concatenate([q, u])
    iq, iu = at(system, joint)
    x[iq], x[model.n_q + iu] = 0.7, 1.0
    less = model.without("pad", f"laws/{joint.label}.friction")
    names = [name for name in terms(less, np.zeros(1), x[None]) if name.startswith("laws/")]
    assert len(names) == len(LAWS) - 2 and "laws/pad" not in names
    change = (model.bias(0.0, x) - less.bias(0.0, x))[iu]
    assert change == pytest.approx(LAWS[4].force(np.array(0.7), 0.0) + LAWS[5].force(0.7, np.array(1.0)), abs=1e-9)


def slider(**more):
    """A mass of 2 kg on a rail."""
    return compile_system(System({"cart": rigid_body(2.0, np.eye(3))}, (prismatic("cart", **more),)))


def test_a_cart_slides_to_rest_by_friction_as_far_as_coulomb_says():
    model = slider(laws=(Friction(limit=4.0, velocity=1e-5),), u0=[3.0])
    states = integrator("dop853", rtol=1e-10, atol=1e-10).solve(model, np.linspace(0, 2.0, 21), model.x0).states
    t = 3.0 * 2.0 / 4.0  # until it rests
    assert states[5, 0] == pytest.approx(3.0 * 0.5 - 0.5 * 2.0 * 0.5**2, abs=1e-5)
    assert states[-1, 0] == pytest.approx(3.0 * t / 2, abs=1e-4)  # within a few times velocity x duration
    assert abs(states[-1, 1]) < 1e-5


@pytest.mark.parametrize("method", ["dop853", "esdirk4", "generalized_alpha"])
def test_a_cart_between_stops_keeps_its_energy_with_every_integrator(method):
    model = slider(laws=(Stop(lower=-0.5, upper=0.5, stiffness=2e4, width=0.02),), u0=[1.0])
    tolerance = {"dop853": 1e-10, "esdirk4": 1e-7, "generalized_alpha": 1e-6}[method]
    solution = integrator(method, rtol=tolerance, atol=tolerance).solve(model, np.linspace(0, 4.0, 201), model.x0)
    seen = model.observe(solution.times, solution.states)
    allowed = {"dop853": 1e-7, "esdirk4": 2e-3, "generalized_alpha": 5e-2}[method]
    assert seen["monitors/spring"].max() > 0.1
    assert seen["monitors/energy"] == pytest.approx(1.0, rel=allowed)
    assert np.abs(solution.states[:, 0]).max() < 0.55
    assert solution.steps.rejected < solution.steps.accepted


def test_damped_stops_and_tables_take_the_energy_they_report():
    laws = (
        LAWS[0],
        LAWS[1],
        Stop(upper=0.3, stiffness=300.0, damping=8.0, width=0.05),
        Friction(limit=0.1, velocity=0.05),
    )
    model = slider(laws=laws, u0=[2.0], damping=0.1)
    times = np.linspace(0, 3.0, 6001)
    seen = model.observe(times, integrator("dop853", rtol=1e-11, atol=1e-12).solve(model, times, model.x0).states)
    from scipy.integrate import simpson

    lost = simpson(seen["monitors/dissipation"], x=times)
    assert lost > 1.0
    assert seen["monitors/energy"][0] - seen["monitors/energy"][-1] == pytest.approx(lost, rel=1e-6)


def test_stiffness_of_laws_counts_in_the_highest_frequency_and_in_newtons_matrix():
    stop = Stop(upper=0.5, stiffness=2e4, width=0.02)
    model = slider(laws=(stop,), stiffness=8.0)
    assert model.max_frequency == pytest.approx(100.0)
    q, out = np.array([0.6]), np.empty(1)
    model.second_order.solve(0.0, q, np.ones(1), out, 2.0, 0.0, 0.5, model.table, model.pool, model.work)
    assert out[0] == pytest.approx(1 / (2.0 * 2.0 + 0.5 * (8.0 + 2e4)))


def test_dampers_faster_than_any_vibration_count_as_the_highest_frequency():
    assert slider(stiffness=8.0, damping=400.0).max_frequency == pytest.approx(200.0, rel=1e-8)  # c / m
    stuck = slider(laws=(Friction(limit=3.0, velocity=1e-3),))
    assert stuck.max_frequency == pytest.approx(3.0 / 1e-3 / 2.0, rel=1e-5)


LAWFUL = (
    Stop(upper=0.5, stiffness=2e4, damping=30.0, width=0.02),
    Friction(limit=3.0, velocity=1e-2),
    TabulatedDamper(rate=[-1.0, 0.0, 2.0], resisting=[-4.0, 0.0, 6.0]),
    TabulatedSpring(stretch=[0.0, 0.5, 1.0], resisting=[0.0, 1.0, 5.0]),
)


@pytest.mark.parametrize("tied", [False, True], ids=["tree", "constraint"])
@pytest.mark.parametrize("place", [0.3, 0.513, 0.6])
def test_newtons_correction_counts_every_slope_of_laws(place, tied):
    """-(M + c_d D + c_k K)^-1 r with D and K by differences of the residual, also right after another matrix."""
    model = slider(laws=LAWFUL, stiffness=8.0, damping=0.1)
    if tied:  # a second cart next to it, held together by a knife edge that does not bind this motion
        edge = knife_edge("edge", "cart", (0, 1, 0))
        model = compile_system(replace(model.system, constraints=(edge,)))
    own, c_d, c_k = (model.table, model.pool, model.work), 0.02, 4e-4
    q, u, udot, out = np.array([place]), np.array([0.004]), np.array([0.7]), np.empty(1)
    model.tree.solve(0.0, np.array([0.6]), np.ones(1), out, 1.0, 0.0, 0.5, *own)  # leaves its own slopes behind
    model.second_order.correct(0.0, q, u, udot, out, c_d, c_k, *own)

    def r(q, u, udot=udot):
        return model.residual(0.0, np.concatenate([q, u]), udot)[0]

    h = 1e-7
    S = r(q, u, udot + 1) - r(q, u) + (c_d * (r(q, u + h) - r(q, u - h)) + c_k * (r(q + h, u) - r(q - h, u))) / (2 * h)
    assert out[0] == pytest.approx(-r(q, u) / S, rel=1e-6)


def test_a_joint_that_sticks_by_friction_takes_long_implicit_steps():
    """Without friction's slope Newton's method contracts only up to h = 0.8 m v / (gamma limit), 2 ms here."""
    limit, creep, mass, gamma = 3.0, 1e-3, 2.0, 0.25
    model = slider(laws=(Friction(limit=limit, velocity=creep),), stiffness=2.0, u0=[1.0])
    solution = integrator("esdirk4", rtol=1e-6, atol=1e-7).solve(model, np.linspace(0, 40, 11), model.x0)
    without = 0.8 * mass * creep / (gamma * limit)
    assert solution.steps.largest > 100 * without
    assert solution.steps.evaluations < 0.1 * 5 * 40 / without


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda: Stop(lower=1.0, upper=0.0, stiffness=1.0),
            "the lower limit 1 of a stop is not below its upper",
        ),
        (lambda: Stop(stiffness=1.0), "a stop needs a lower or an upper limit"),
        (lambda: Stop(upper=1.0), "stiffness and width must be positive"),
        (
            lambda: Friction(limit=-1.0),
            "friction has limit -1 and velocity scale 0.001; the limit must",
        ),
        (lambda: Latch(damping=1.0), "damping needs a stiffness"),
        (
            lambda: TabulatedDamper(rate=[0, 1], resisting=[0, -1]),
            "with force -1 at rate 1 drives the joint; it",
        ),
        (lambda: slider(laws=(TabulatedSpring(stretch=[1, 0], resisting=[0, 1]),)), "a tabulated spring must ascend"),
        (lambda: slider(laws=(TabulatedSpring(stretch=[1], resisting=[0]),)), "two equally long lists of at least 2"),
        (lambda: slider(laws=(TabulatedSpring(stretch=[0, 1], resisting=[0, np.nan]),)), "not finite"),
        (
            lambda: slider(laws=(Friction(1, limit=1.0),)),
            "a friction of joint 'base-cart' acts on degree of freedom 1",
        ),
        (
            lambda: slider(laws=(Friction(limit=1.0),), motion=(0.0,)),
            "'base-cart.slide' has a friction and a pre",
        ),
        (
            lambda: slider(latches=(Latch(2),)),
            "a latch of joint 'base-cart' acts on degree of freedom 2; the joint has 1",
        ),
        (lambda: slider(latches=(Latch(0, 0.0),)), "'base-cart.slide' starts at 0, where it latches; lock it"),
        (lambda: slider(latches=(Latch(0, 1.0), Latch(0, 2.0))), "'base-cart.slide' has 2 latches; give it one"),
        (
            lambda: spherical("a", laws=(Friction(limit=1.0),)),
            "of a ball cannot have a friction; give joint",
        ),
        (
            lambda: revolute("a", laws=(Friction(limit=1.0),) * 2).law_names() and Friction(velocity=0.0),
            "velocity scale 0",
        ),
    ],
)
def test_what_is_no_law_is_refused(make, text):
    with pytest.raises(ValueError, match=text):
        model = make()
        for joint in model.system.joints:  # tables are read when they are first needed
            _ = [law.pieces() for law in joint.laws]
