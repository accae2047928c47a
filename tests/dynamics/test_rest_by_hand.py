"""What the search for an equilibrium is made of: forces at rest, sizes of them, states that settle; all by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.random_systems import random_body

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.linearised import cancelling, linear_stiffness, usual_sizes
from femflex.dynamics.equilibria.states import own_rates, resting_state, settled_states, state_equations
from femflex.dynamics.equilibria.steady import steady
from femflex.system import (
    Environment,
    Frame,
    Load,
    Sensor,
    System,
    block,
    low_pass,
    prismatic,
    revolute,
    spherical,
    state_space,
    weld,
)

SPIN = np.array([0.3, -0.4, 1.2])


def spinning(**more):
    """A welded hub with a bending arm on a sprung hinge, a locked slide and a loose ball behind it; and its clouds."""
    rng = np.random.default_rng(5)
    arm, cloud = random_body(rng, 3)
    arm = replace(arm, markers=arm.markers | {"a": replace(arm.markers["a"], phi=0 * arm.markers["a"].phi)})
    hub = rigid_body(9.0, [2.0, 3.0, 4.0], [0.1, 0.0, -0.1], {"side": Marker.rigid([0.4, 0.3, -0.2])})
    box, ball = rigid_body(2.0, [0.2, 0.3, 0.4], [0.3, 0.1, 0.0]), rigid_body(1.5, [0.1, 0.1, 0.2], [0.0, 0.2, 0.4])
    joints = (
        weld("hub"),
        revolute("arm", "hub", axis=(1, 2, 2), parent_marker="side", stiffness=7.0, rest=0.2, damping=0.6, q0=[0.5]),
        prismatic("box", "arm", parent_marker="b", motion=(0.25,)),
        spherical("ball", "box"),
    )
    bodies = {"hub": hub, "ball": ball, "box": box, "arm": arm}
    frame = Frame("spinning", SPIN)
    return System(bodies, joints, frame=frame, delta0={"arm": np.array([0.1, -0.2, 0.05])}, **more), cloud


def test_forces_at_rest_are_those_of_springs_and_strain_and_of_all_that_acts():
    push = Load("push", "box", frame="body", force=[0.4, -0.2, 0.9])
    system, _ = spinning(loads=(push,), environment=Environment(2.0 * SPIN))
    problem = steady(system)
    names = [name.removesuffix("_rate") for name, _ in system.velocity_names()]
    model = problem.full
    q = model.x0[: model.n_q].copy()
    hinge, slide = names.index("hub-arm.angle"), names.index("arm-box.slide")
    shapes = [k for k, name in enumerate(names) if ".delta" in name]
    balls = [k for k, name in enumerate(names) if name.startswith("box-ball")]
    assert [names[k] for k in np.flatnonzero(problem.held)] == ["arm-box.slide"]
    assert sorted(np.flatnonzero(problem.elastic)) == sorted([hinge, *shapes])
    sizes = usual_sizes(model)
    np.testing.assert_array_equal(problem.sizes, sizes)
    inner, outer = problem.forces(q)
    delta = np.array([0.1, -0.2, 0.05])
    wanted = np.zeros(len(names))
    wanted[hinge] = 7.0 * (0.5 - 0.2)
    wanted[shapes] = system.bodies["arm"].strain.force(delta)
    np.testing.assert_allclose(inner, wanted * sizes, atol=1e-12)
    still = compile_system(replace(system, joints=tuple(replace(j, damping=0.0 * j.damping) for j in system.joints)))
    whole = np.where(problem.held, 0.0, still.bias(0.0, still.at_rest(q))) * sizes
    np.testing.assert_allclose(inner + outer, whole, atol=1e-9)
    assert np.abs(outer[balls]).max() > 1e-3 and outer[slide] == 0.0
    amplitudes = problem.shape(q)
    assert amplitudes[hinge] == pytest.approx(0.5 / sizes[hinge]) and not amplitudes[balls].any()
    np.testing.assert_allclose(amplitudes[shapes], delta / sizes[shapes])
    own = np.zeros(len(names))  # without rests and preloads, which cancel
    own[hinge], own[shapes] = 7.0 * 0.5, system.bodies["arm"].strain.V1 @ delta
    for share in (1.0, 0.01):
        largest = max(np.abs(inner).max(), share * np.abs(outer).max(), np.abs(own * sizes).max())
        assert problem.largest(q, share) == pytest.approx(largest)
    M = still.mass_matrix(0.0, still.at_rest(q))
    np.testing.assert_allclose(problem.inertia(q), sizes[:, None] * M * sizes, atol=1e-9)
    assert problem.ties(q).shape == (0, len(names)) and problem.closed(q) is q
    E, R = problem.directions(np.zeros((0, len(names))))
    assert {int(np.argmax(one)) for one in E.T} == {hinge, *shapes} and {int(np.argmax(one)) for one in R.T} == {*balls}


def test_the_energy_of_spin_is_that_of_the_points_of_the_craft():
    system, (dm, rho, phi) = spinning()
    problem = steady(system)
    model = problem.full
    seen = model.observe(np.zeros(1), model.at_rest(model.x0[: model.n_q])[None])
    energy = 0.0
    for name in system.order:
        C = Rotation.from_quat(np.roll(seen[f"bodies/{name}/attitude"][0], -1)).as_matrix()
        at, body = seen[f"bodies/{name}/position"][0], system.bodies[name]
        if name == "arm":
            places = at + (rho + phi @ np.array([0.1, -0.2, 0.05])) @ C.T
            energy += 0.5 * dm @ np.sum(np.cross(SPIN, places) ** 2, axis=1)
            continue
        m, c = body.moments.mass, C @ body.moments.center_of_mass()
        J = C @ body.moments.inertia() @ C.T  # about the body's origin
        v = np.cross(SPIN, at)
        energy += 0.5 * m * v @ v + m * v @ np.cross(SPIN, c) + 0.5 * SPIN @ J @ SPIN
    assert problem.energy_of_spin == pytest.approx(energy, rel=1e-9)
    assert steady(replace(system, frame=Frame("inertial"))).energy_of_spin == 0.0


def test_forces_that_cancel_are_measured_by_the_largest_energy_of_their_parts():
    system, _ = spinning()
    model = compile_system(system)
    rng = np.random.default_rng(9)
    x, udot = model.x0.copy(), -rng.uniform(0.5, 1.0, model.n_u)
    names = [name for name, _ in system.coordinate_names()]
    x[[k for k, name in enumerate(names) if "delta" in name]] = [-0.4, -0.3, -0.9]
    x[model.n_q :] = rng.normal(size=model.n_u)
    for moved, asked in ((x, udot), (model.at_rest(x[: model.n_q]), 0 * udot), (x, 50 * udot)):
        K, at = linear_stiffness(model)
        sizes, M = usual_sizes(model), model.mass_matrix(0.0, moved)
        energies = []
        for i in range(model.n_u):
            elastic = sum(abs(K[i, j]) * abs(moved[at[j]]) for j in range(model.n_u) if at[j] >= 0)
            inertial = sum(abs(M[i, j] * asked[j]) for j in range(model.n_u))
            static = (elastic + inertial + abs(model.bias(0.0, moved)[i])) * sizes[i]
            energies.append(static + M[i, i] * sizes[i] ** 2 * (SPIN @ SPIN))
        np.testing.assert_allclose(cancelling(model, 0.0, moved, asked), max(energies) / sizes, rtol=1e-9)


ANGLE = Sensor("angle", "joint", freedom="axle.angle")


def filtered(*blocks):
    """A body on an axle between two hinged ones, and filters of its angle."""
    joints = revolute("other"), revolute("body", name="axle", q0=[0.3], u0=[0.1]), revolute("third")
    bodies = {name: rigid_body(1.0, [4.0, 4.0, 5.0]) for name in ("other", "body", "third")}
    return System(bodies, joints, effectors=(*ANGLE.effectors, *blocks))


def test_states_settle_where_their_rates_are_zero_and_say_how_they_answer():
    """Filters of 0.5 Hz and, ten thousand times slower, of second order; gains of -2 and 1."""
    fast, slow = low_pass(0.5), low_pass(5e-5, 2, 0.4)
    system = filtered(
        block("fast", state_space(fast.A, -2.0 * fast.B, fast.C, fast.D), ["angle.coordinate"], ["y"]),
        block("slow", slow, ["fast.y"], ["y"]),
    )
    model = compile_system(system)
    names = [name for name, _ in system.all_state_names()]
    x = model.x0.copy()
    x[names.index("axle.angle")] = 0.7
    own = [k for k, name in enumerate(names) if name.startswith(("fast", "slow"))]
    x[own] = [3.0, -40.0, 8.0][: len(own)]
    x[model.n_q : model.n_q + model.n_u] = 0.0
    found = settled_states(model, x)
    A, B, C = fast.A, fast.B, fast.C
    z_fast = -np.linalg.solve(A, -2.0 * B[:, 0] * 0.7)
    y = float(C[0] @ z_fast)
    z_slow = -np.linalg.solve(slow.A, slow.B[:, 0] * y)
    np.testing.assert_allclose(found[own], [*z_fast, *z_slow], rtol=1e-8, atol=1e-12)
    others = np.setdiff1d(np.arange(len(x)), own)
    np.testing.assert_array_equal(found[others], x[others])
    assert x[own[0]] == 3.0  # as given, not changed in place
    z = state_equations(model, 0.0, found, np.zeros(model.n_u), usual_sizes(model))
    assert z.names == tuple(names[k] for k in own)
    F = np.zeros((3, 3))
    F[:1, :1], F[1:, 1:], F[1:, :1] = A, slow.A, slow.B @ C
    np.testing.assert_allclose(z.F_z, F, rtol=1e-6, atol=1e-12)
    u = [name for name, _ in system.velocity_names()].index("axle.angle_rate")
    wanted = np.zeros((3, 3))
    wanted[:1, u] = -2.0 * B[:, 0]
    np.testing.assert_allclose(z.F_x, wanted, rtol=1e-6, atol=1e-12)
    assert not z.R.any() and not z.F_u.any()
    places = [k - model.n_q - model.n_u for k in own]
    np.testing.assert_allclose(
        own_rates(model, 0.0, found, places, np.array([2.0, 30.0, 0.1])), F, rtol=1e-6, atol=1e-12
    )
    bare = compile_system(filtered(block("slow", low_pass(5e-5, 2, 0.4), ["angle.coordinate"], ["y"])))
    shared = resting_state(model, found, bare)
    kept = [name for name, _ in bare.system.all_state_names()]
    assert shared[kept.index("axle.angle")] == 0.7 and not shared[bare.n_q : bare.n_q + bare.n_u].any()
    at = [kept.index(names[k]) for k in own[1:]]
    np.testing.assert_allclose(shared[at], found[own[1:]], atol=1e-12)


def test_a_state_that_goes_on_changing_is_named_with_its_rate():
    """dz/dt = -2 z for the first; the second is the integral of 0.25 times the angle of 0.3."""
    A, B = np.array([[-2.0, 0.0], [0.0, 0.0]]), np.array([[1.0], [0.25]])
    drifting = block("drift", state_space(A, B, np.ones((1, 2)), np.zeros((1, 1))), ["angle.coordinate"], ["y"])
    model = compile_system(filtered(drifting))
    size = model.system.state_sizes()[[n for n, _ in model.system.state_names()].index("drift.x2")]
    with pytest.raises(ValueError) as error:
        settled_states(model, model.at_rest(model.x0[: model.n_q]))
    assert str(error.value) == (
        f"the state 'drift.x2' keeps changing at rest, by {0.075 / size:.3g} of its size per second; an equilibrium "
        "needs states that settle. Remove its effector, or start at its zero"
    )
