"""Every term of eq. (9) against an answer of its own, and their sum against zero."""

import numpy as np
import pytest
from support.random_systems import random_tree

from femflex.dynamics import compile_system
from femflex.dynamics.terms.by_source import force_units, inertia_by_source, linear_terms, sources, terms
from femflex.integrate import integrator
from femflex.system import Frame, Load, Orbit, free, revolute, spherical, universal

STRONG = Orbit(7e6, 0.3, inclination=0.4, node=0.2, perigee=1.0, true_anomaly=0.7, mu=5e20)
KINDS = {
    "inertial": {},
    "spinning": {"frame": Frame("spinning", np.array([0.3, -0.5, 0.7]))},
    "specified orbit": {"root": spherical, "orbit": STRONG, "frame": Frame("orbital")},
    "held on an orbit": {"root": universal, "orbit": STRONG, "frame": Frame("orbital")},
    "free orbit": {"root": free, "orbit": Orbit(7e6, 0.3, mu=5e20, free=True), "frame": Frame("orbital")},
}


def random_model(seed, kind, n_bodies=5):
    """A random tree with springs and dampers in its joints and two loads, and a state of it."""
    rng = np.random.default_rng(seed)
    system, _, (q, u) = random_tree(seed, n_bodies=n_bodies, **KINDS[kind])
    return compile_system(furnished(system, rng)), np.concatenate([q, u])


def furnished(system, rng):
    from dataclasses import replace

    joints = []
    for joint in system.joints:
        springs = {key: rng.uniform(0.5, 2, joint.n_u) for key in ("stiffness", "damping", "rest")}
        joints.append(joint if joint.parent is None else replace(joint, **springs))
    loads = (
        Load("push", system.order[-1], "a", "marker", force=rng.normal(size=3), torque=rng.normal(size=3)),
        Load("pull", system.root, "b", "inertial", force=rng.normal(size=(2, 3)), times=np.array([0.0, 3.0])),
    )
    return replace(system, joints=tuple(joints), loads=loads)


def one(model, x, t=0.0):
    """The terms at one instant, name -> (n_u,)."""
    return {name: rows[0] for name, rows in terms(model, np.array([t]), x[None]).items()}


def along(model, x, path, step=1e-4):
    """d/ds of a monitor along the motion of the model at a frozen clock, by differences of order four."""
    dx = model.state_rate(0.0, x)
    points = np.array([x + k * step * dx for k in (-2, -1, 1, 2)])
    values = model.observe(np.zeros(4), points)[path]
    return (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(5))
def test_terms_sum_to_zero_at_random_states(kind, seed):
    model, x = random_model(seed, kind)
    found = one(model, x, t=0.4)
    largest = max(np.abs(row).max() for row in found.values())
    assert np.abs(sum(found.values())).max() < 1e-12 * largest  # rounding of the recursion against the ledger


@pytest.mark.parametrize("kind", ["spinning", "specified orbit"])
def test_terms_sum_to_zero_along_a_run(kind):
    model, x = random_model(2, kind, n_bodies=4)
    times = np.linspace(0, 3, 61)
    solution = integrator("dop853", rtol=1e-8, atol=1e-8).solve(model, times, x)
    found = terms(model, solution.times, solution.states)
    largest = max(np.abs(rows).max() for rows in found.values())
    assert largest > 1 and len(solution.times) == 61
    assert np.abs(sum(found.values())).max() < 1e-10 * largest


@pytest.mark.parametrize("kind", KINDS)
def test_inertia_is_the_mass_matrix_times_the_accelerations(kind):
    model, x = random_model(3, kind)
    M, udot = model.mass_matrix(0.0, x), model.state_rate(0.0, x)[model.n_q :]
    row = one(model, x)["inertia"]
    assert row == pytest.approx(M @ udot, abs=1e-10 * np.abs(row).max())


def test_elastic_terms_are_the_bodies_matrices_on_the_elastic_rows():
    model, x = random_model(4, "spinning")
    found, q, u = one(model, x), x[: model.n_q], x[model.n_q :]
    expected = {key: np.zeros(model.n_u) for key in ("elastic", "prestress", "damping")}
    iq = iu = 0
    for name in model.system.order:
        body, joint = model.system.bodies[name], model.system.joint_of(name)
        iq, iu = iq + joint.n_q, iu + joint.n_u
        rows, delta = slice(iu, iu + body.n_modes), slice(iq, iq + body.n_modes)
        expected["elastic"][rows] = body.strain.V1 @ q[delta]
        expected["prestress"][rows] = body.strain.f0
        expected["damping"][rows] = body.damping @ u[rows]
        iq, iu = iq + body.n_modes, iu + body.n_modes
    for key, row in expected.items():
        assert np.abs(row).max() > 0.1
        assert found[key] == pytest.approx(row, abs=1e-13 * np.abs(row).max())


@pytest.mark.parametrize("seed", range(3))
def test_power_of_inertia_forces_is_the_rate_of_kinetic_energy(seed):
    model, x = random_model(seed, "inertial")
    found, u = one(model, x), x[model.n_q :]
    power = u @ (found["inertia"] + found["coriolis_centrifugal"])
    assert power == pytest.approx(along(model, x, "monitors/kinetic"), rel=1e-8)


@pytest.mark.parametrize("kind", ["spinning", "specified orbit"])
@pytest.mark.parametrize("seed", range(3))
def test_elastic_and_spring_power_is_the_rate_of_their_energies(kind, seed):
    model, x = random_model(seed, kind)
    found, u = one(model, x), x[model.n_q :]
    assert u @ (found["elastic"] + found["prestress"]) == pytest.approx(along(model, x, "monitors/elastic"), rel=1e-8)
    assert u @ found["joint_springs"] == pytest.approx(along(model, x, "monitors/spring"), rel=1e-8)
    assert u @ found["joint_dampers"] > 0 and u @ found["damping"] > 0  # they brake


@pytest.mark.parametrize("kind", ["specified orbit", "free orbit", "held on an orbit"])
@pytest.mark.parametrize("seed", range(3))
def test_gravity_is_the_gradient_of_its_energy(kind, seed):
    model, x = random_model(seed, kind)
    power = x[model.n_q :] @ one(model, x)["gravity_gradient"]
    rate = along(model, x, "monitors/gravity")
    if kind == "free orbit":  # its energy is counted from the Earth, the force from the fall of O
        mass = sum(body.moments.mass for body in model.system.bodies.values())
        seen = model.observe(np.zeros(1), x[None])
        r, nu = seen["orbit/radius"][0], seen["orbit/true_anomaly"][0]
        R = r * np.array([np.cos(nu), np.sin(nu), 0])
        fall = -model.system.orbit.mu * R / np.linalg.norm(R) ** 3
        # two numbers of 1e8 W nearly cancel: rounding of 1e-8 J over the step
        rate = along(model, x, "monitors/gravity", 1e-2)
        rate += mass * fall @ along(model, x, "monitors/center_of_mass", 1e-2)
    assert power == pytest.approx(rate, rel=1e-5 if kind == "free orbit" else 1e-8)


def test_specified_motion_is_minus_the_gradient_of_the_energy_at_rest():
    model, x = random_model(1, "spinning")
    row = one(model, x)["specified_motion"]
    dx = model.state_rate(0.0, x)
    dx[model.n_q :] = 0.0  # T0 is the kinetic energy with u = 0
    rest = np.concatenate([x[: model.n_q], np.zeros(model.n_u)])
    T0 = model.observe(np.zeros(4), np.array([rest + k * 1e-4 * dx for k in (-2, -1, 1, 2)]))["monitors/kinetic"]
    rate = (T0[0] - 8 * T0[1] + 8 * T0[2] - T0[3]) / 12e-4
    assert x[model.n_q :] @ row == pytest.approx(-rate, rel=1e-8)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_what_is_linear_in_the_velocities_is_skew_and_does_no_work(kind, seed):
    model, x = random_model(seed, kind)
    M_t, G = linear_terms(model, 0.3, x)
    found = one(model, x, t=0.3)
    u, size = x[model.n_q :], np.abs(G).max()
    if kind == "inertial":
        assert size < 1e-12 and "gyroscopic" not in found
    else:
        assert size > 0.1 and np.abs(M_t).max() <= 1e-12 * size
        assert found["gyroscopic"] == pytest.approx(G @ u, abs=1e-12 * size * np.abs(u).sum())
        assert abs(u @ found["gyroscopic"]) < 1e-12 * size * (u @ u)


def test_a_load_works_through_the_velocity_of_its_marker():
    model, x = random_model(5, "inertial")
    found, u = one(model, x, t=1.0), x[model.n_q :]
    load = next(load for load in model.system.loads if load.name == "pull")
    seen = model.observe(np.ones(1), x[None])
    at = seen[f"markers/{load.body}.{load.marker}/velocity"][0]
    assert u @ found["loads/pull"] == pytest.approx(-at @ (2 * load.force[0] + load.force[1]) / 3, rel=1e-11)
    assert force_units(model.system)[0] in ("N", "N m", "kg^1/2 m/s^2")


def test_pitch_of_a_rigid_craft_is_pushed_by_the_gravity_gradient_alone():
    from femflex.body import rigid_body
    from femflex.system import System

    orbit, J = Orbit(7e6), np.diag([900.0, 300.0, 700.0])
    bodies, joint = {"craft": rigid_body(100.0, J)}, revolute("craft", axis=(1, 0, 0))
    craft = System(bodies, (joint,), frame=Frame("orbital"), orbit=orbit)
    model = compile_system(craft)
    theta, n = 0.3, orbit.mean_motion
    found = one(model, np.array([theta, 2e-4]))
    pull = 3 * n**2 * (700.0 - 300.0) * np.sin(theta) * np.cos(theta)
    assert found["gravity_gradient"][0] == pytest.approx(pull, rel=1e-9)
    assert found["inertia"][0] == pytest.approx(-pull, rel=1e-9)
    others = [row for name, row in found.items() if name not in ("inertia", "gravity_gradient")]
    assert np.abs(others).max() < 1e-12 * pull


def test_states_of_another_shape_are_refused():
    model, x = random_model(0, "inertial")
    with pytest.raises(ValueError, match=rf"states have shape \(1, 3\); 2 times of this model need \(2, {len(x)}\)"):
        terms(model, np.zeros(2), np.zeros((1, 3)))


@pytest.mark.parametrize("kind", KINDS)
def test_inertia_splits_by_whose_acceleration_it_is(kind):
    model, x = random_model(4, kind)
    split = {name: rows[0] for name, rows in inertia_by_source(model, np.zeros(1), x[None]).items()}
    M, udot = model.mass_matrix(0.0, x), model.state_rate(0.0, x)[model.n_q :]
    size = max(np.abs(row).max() for row in split.values())
    for source, places in sources(model.system).items():
        assert split[f"inertia/{source}"] == pytest.approx(M[:, places] @ udot[places], abs=1e-10 * size)
    assert sum(split.values()) == pytest.approx(one(model, x)["inertia"], abs=1e-12 * size)
    assert sum(places.stop - places.start for places in sources(model.system).values()) == model.n_u
