"""The linearised equations against differences of the compiled rate, and the turning of balls against rotations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.random_systems import random_tree

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.elastic_response import modal_response
from femflex.dynamics.equilibria.linearised import linearised
from femflex.rotations import dcm_from_vector, vector_from_dcm
from femflex.system import Friction, Joint, System, TabulatedDamper, cable, free, revolute, weld


def plain_trees(count: int):
    """Random trees without balls, whose coordinates are their own increments."""
    seed, found = 0, 0
    while found < count:
        system, _, state = random_tree(seed, n_bodies=4)
        seed += 1
        if all(joint.ball is None for joint in system.joints) and len(state[1]) > 3:
            found += 1
            yield system, np.concatenate(state)


@pytest.mark.parametrize(("system", "x"), list(plain_trees(3)))
def test_the_state_matrix_is_the_derivative_of_the_rate(system, x):
    model = compile_system(system)
    udot = model.state_rate(0.0, x)[model.n_q :]
    A = linearised(model, 0.0, x, udot).state_matrix()
    steps = np.eye(model.n_x) * 1e-6
    wanted = np.column_stack([(model.state_rate(0.0, x + e) - model.state_rate(0.0, x - e)) / 2e-6 for e in steps])
    assert pytest.approx(wanted, rel=1e-6, abs=1e-6 * np.abs(wanted).max()) == A


def test_increments_of_a_turning_ball_turn_with_it():
    system, _, (q, u) = random_tree(3, n_bodies=1, root=free)
    model = compile_system(system)
    W = linearised(model, 0.0, np.concatenate([q, u])).W[3:6, 3:6]
    omega, xi, dt, size = u[3:6], np.array([0.3, -0.2, 0.5]), 1e-4, 1e-4
    moved = [
        vector_from_dcm(dcm_from_vector(-omega * h) @ dcm_from_vector(size * xi) @ dcm_from_vector(omega * h))
        for h in (-dt, dt)
    ]
    assert (moved[1] - moved[0]) / (2 * dt * size) == pytest.approx(W @ xi, rel=1e-5)


@pytest.mark.parametrize(
    ("law", "rate", "damping"),
    [
        (Friction(limit=0.7, velocity=2e-3), 0.0, 0.7 / 2e-3),
        (Friction(limit=0.7, velocity=0.2), 0.3, 0.7 / 0.2 / np.cosh(1.5) ** 2),
        (TabulatedDamper(rate=[-1.0, 0.0, 1.0], resisting=[-2.0, 0.0, 2.0]), 0.0, 2.0),
    ],
)
def test_friction_and_dampers_are_linearised_where_they_are(law, rate, damping):
    hinge = replace(revolute("arm"), laws=(law,), u0=[rate])
    model = compile_system(System({"arm": rigid_body(1.0, np.eye(3))}, (hinge,)))
    assert linearised(model, 0.0, model.x0).D[0, 0] == pytest.approx(damping, rel=1e-7)


def test_a_cable_is_damped_while_small_motions_leave_it_taut():
    """4 N of tension and a damper of 50 N s/m, which a speed of 1 m/s would let push."""
    away = Joint("tip", translations=np.eye(3)[:1], q0=np.array([1.1]), kind="general")
    line = cable("line", (("base", "origin"), ("tip", "origin")), 1.0, 40.0, damping=50.0)
    bodies = {"base": rigid_body(1.0, np.eye(3)), "tip": rigid_body(2.0, np.eye(3))}
    model = compile_system(System(bodies, (weld("base"), away), effectors=(line,)))
    assert linearised(model, 0.0, model.x0).D == pytest.approx(np.array([[50.0]]), rel=1e-8)


def test_the_response_of_modes_to_a_ramp_and_a_kick_is_exact():
    """y'' + 2 a y' + omega^2 y = 3 + 2 t, with a kick of the rate at the end of the second interval."""
    omega, damping = np.array([4.0]), np.array([1.2])
    times = np.array([0.0, 0.3, 0.8, 1.5])
    force, kick = (3 + 2 * times)[:, None], np.array([[0.0], [0.7], [0.0], [0.0]])
    y, rate = modal_response(omega, damping, times, force, kick, np.array([[0.2], [-0.1]]))
    x = np.array([0.2, -0.1])
    for k in range(3):
        solved = solve_ivp(
            lambda t, x: [x[1], 3 + 2 * t - 1.2 * x[1] - 16 * x[0]], times[k : k + 2], x, rtol=1e-11, atol=1e-13
        )
        x = solved.y[:, -1] + [0.0, kick[k, 0]]
        assert [y[k + 1, 0], rate[k + 1, 0]] == pytest.approx(x, rel=1e-8)
