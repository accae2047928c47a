"""Newton's correction in one pass of the recursion against the residual and the linear solve, two other ways."""

from dataclasses import replace

import numpy as np
import pytest
from support.prescribed_systems import held_tree
from support.random_systems import random_tree
from test_condensed import random_condensed
from test_curved_strain import curved

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.system import (
    Frame,
    Load,
    Orbit,
    System,
    TabulatedDamper,
    TabulatedSpring,
    free,
    reaction_wheel,
    revolute,
    universal,
)

ORBIT = Orbit(7e6, 0.3, inclination=0.4, node=0.2, perigee=1.0, true_anomaly=0.7, mu=5e20)
NOW, C_D, C_K = 0.3, 0.2, 0.5


def sprung(seed):
    """A random tree with springs and dampers at every joint, and a load."""
    system, _, state = random_tree(seed, n_bodies=6)
    rng = np.random.default_rng(seed)
    joints = tuple(
        replace(j, stiffness=rng.uniform(0, 5, j.n_u), damping=rng.uniform(0, 2, j.n_u)) for j in system.joints
    )
    load = Load("push", system.order[-1], "a", force=rng.normal(size=3), torque=rng.normal(size=3))
    return replace(system, joints=joints, loads=(load,)), state


def nonlinear(seed):
    """A random tree with nonlinear strain."""
    system, _, state = random_tree(seed, n_bodies=5)
    return curved(system, np.random.default_rng(seed), 0.1), state


def orbiting(seed):
    """A random tree whose root translation is eliminated."""
    system, _, state = random_tree(seed, root=universal, orbit=ORBIT, frame=Frame("orbital"))
    return system, state


def sprung_orbiting(seed):
    """The same with springs and dampers at every joint, the root's too, which a law resists as well."""
    system, _, state = random_tree(seed, root=universal, orbit=ORBIT, frame=Frame("orbital"))
    rng = np.random.default_rng(seed)
    law = TabulatedDamper(rate=[-9.0, 0.0, 9.0], resisting=[-27.0, 0.0, 27.0], freedom=1)
    joints = tuple(
        replace(
            j,
            stiffness=rng.uniform(1, 5, j.n_u),
            damping=rng.uniform(1, 2, j.n_u),
            laws=(law,) if j.parent is None else (),
        )
        for j in system.joints
    )
    return replace(system, joints=joints), state


def held(seed):
    """A random tree with held freedoms."""
    system, _, state = held_tree(seed, n_bodies=6)
    return system, state


def condensed(seed):
    """A random tree of bodies with slaves."""
    system, _, state = random_condensed(seed, n_bodies=5)
    return system, state


@pytest.mark.parametrize("make", [sprung, nonlinear, orbiting, held, condensed], ids=lambda make: make.__name__)
@pytest.mark.parametrize("seed", range(5))
def test_correction_is_that_of_residual_and_solve(make, seed):
    system, (q, u) = make(seed)
    model = compile_system(system)
    own, calls = (model.table, model.pool, model.work), model.second_order
    udot = np.random.default_rng(seed).normal(size=model.n_u)
    r, expected, found = np.empty(model.n_u), np.empty(model.n_u), np.empty(model.n_u)
    calls.residual(NOW, q, u, udot, r, *own)
    calls.solve(NOW, q, -r, expected, 1.0, C_D, C_K, *own)
    calls.correct(NOW, q, u, udot, found, C_D, C_K, *own)
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(3))
def test_springs_dampers_and_laws_of_a_root_on_a_specified_orbit_count_in_the_correction(seed):
    """By columns of the mass matrix, and springs, dampers and the law's slope of 3 at the root's second turn."""
    system, (q, u) = sprung_orbiting(seed)
    model = compile_system(system)
    x, n = np.concatenate([q, u]), model.n_u
    matrix, first = model.mass_matrix(NOW, x), 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        law = 3.0 * np.eye(joint.n_u)[1] if joint.laws else 0.0
        own, shapes = slice(first, first + joint.n_u), slice(first + joint.n_u, first + joint.n_u + body.n_modes)
        matrix[own, own] += np.diag(C_D * (joint.damping + law) + C_K * joint.stiffness)
        matrix[shapes, shapes] += C_D * body.damping + C_K * body.strain.V1
        first = shapes.stop
    udot, found = np.random.default_rng(seed).normal(size=n), np.empty(n)
    model.second_order.correct(NOW, q, u, udot, found, C_D, C_K, model.table, model.pool, model.work)
    left = model.residual(NOW, x, udot)
    assert matrix @ found == pytest.approx(-left, abs=1e-8 * np.abs(left).max())


def test_a_law_whose_force_falls_with_its_stretch_is_left_out_of_the_correction():
    """Implicit steps hold against motion by positive slopes alone."""
    law = TabulatedSpring(stretch=[-9.0, 0.0, 9.0], resisting=[18.0, 0.0, -18.0])
    joint = revolute("arm", axis=(0, 0, 1), stiffness=5.0, laws=(law,), q0=[0.3])
    model = compile_system(System({"arm": rigid_body(1.0, np.diag([1.0, 1.0, 2.0]))}, (joint,)))
    found = np.empty(1)
    model.second_order.correct(0.0, np.array([0.3]), np.zeros(1), np.zeros(1), found, C_D, C_K, *model.workspace.own)
    assert found == pytest.approx([-(5.0 - 2.0) * 0.3 / (2.0 + C_K * 5.0)], rel=1e-10)


def test_states_are_corrected_at_the_velocities_that_the_same_step_finds():
    """A wheel with viscous friction: (1 + c_d c / J) dz = tau(u + c_d du, z) - given."""
    J, c, h = 0.2, 0.9, 0.7
    wheel = reaction_wheel("w", "hub", J, axis=(0, 0, 1), viscous=c)
    system = System({"hub": rigid_body(3.0, np.diag([2.0, 3.0, 4.0]))}, (free("hub"),), effectors=(wheel,))
    model = compile_system(system)
    u, given = np.array([0.1, 0.2, -0.3, 0.5, -0.4, 0.8]), np.array([0.3, -0.2, 0.1, 0.4, 2.0, -1.5, 0.25])
    q, out = model.x0[: model.n_q], np.empty(7)
    model.second_order.correct(0.0, q, np.append(u, h), given, out, C_D, C_K, *model.workspace.own)
    assert abs(out[5]) > 0.1
    tau = -c * (h / J - (u[5] + C_D * out[5]))
    assert out[6] == pytest.approx((tau - given[6]) / (1.0 + C_D * c / J), rel=1e-6)


def test_correction_without_damping_and_stiffness_leads_to_the_accelerations():
    system, (q, u) = sprung(1)
    model = compile_system(system)
    udot, out = np.ones(model.n_u), np.empty(model.n_u)
    model.second_order.correct(0.0, q, u, udot, out, 0.0, 0.0, model.table, model.pool, model.work)
    expected = model.state_rate(0.0, np.concatenate([q, u]))[model.n_q :]
    assert udot + out == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


def test_correction_of_equations_without_a_term_is_that_of_their_residual():
    system, (q, u) = orbiting(2)
    model = compile_system(system).without("gyroscopic")
    own, calls = (model.table, model.pool, model.work), model.second_order
    udot = np.random.default_rng(0).normal(size=model.n_u)
    r, expected, found = np.empty(model.n_u), np.empty(model.n_u), np.empty(model.n_u)
    calls.residual(NOW, q, u, udot, r, *own)
    calls.solve(NOW, q, -r, expected, 1.0, C_D, C_K, *own)
    calls.correct(NOW, q, u, udot, found, C_D, C_K, *own)
    assert found == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())
