import numpy as np
import pytest
from support.pointwise import Jet, Tree, equations, skew
from support.random_systems import random_tree

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.rotations import ANGLE_SEQUENCES
from femflex.system import Frame, Orbit, System, spherical, universal, weld


def frozen(C):
    return lambda moving: Jet(C)


def elastic_forces(system, q, u):
    """f0 + V1 delta + D ddelta at the elastic rows."""
    out, iq, iu = np.zeros(len(u)), 0, 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        iq, iu, n = iq + joint.n_q, iu + joint.n_u, body.n_modes
        out[iu : iu + n] = body.strain.f0 + body.strain.V1 @ q[iq : iq + n] + body.damping @ u[iu : iu + n]
        iq, iu = iq + n, iu + n
    return out


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(12))
def test_residual_equals_kanes_equations_over_material_points(seed):
    system, clouds, (q, u) = random_tree(seed)
    model = compile_system(system)
    udot = np.random.default_rng(seed).normal(size=model.n_u)
    ours = model.residual(0.0, np.concatenate([q, u]), udot)
    theirs = equations(Tree(system, clouds), q, u, udot, frozen(np.eye(3)), lambda m, r: np.zeros((len(m), 3)))
    theirs = theirs + elastic_forces(system, q, u)
    assert ours == pytest.approx(theirs, rel=1e-11, abs=1e-11 * np.abs(theirs).max(initial=1))


@pytest.mark.parametrize("seed", range(12))
def test_recursion_solves_the_equations_it_is_derived_from(seed):
    system, _, (q, u) = random_tree(seed, n_bodies=7)
    model = compile_system(system)
    x = np.concatenate([q, u])
    udot = model.state_rate(0.0, x)[model.n_q :]
    scale = np.abs(model.bias(0.0, x)).max(initial=1)
    assert model.residual(0.0, x, udot) == pytest.approx(np.zeros(model.n_u), abs=1e-10 * scale)


@pytest.mark.parametrize("seed", range(4))
def test_recursion_solves_for_bodies_whose_joints_stand_on_markers_that_do_not_move(seed):
    system, _, (q, u) = random_tree(seed, n_bodies=6, moving_markers=False)  # no mass matrix of shapes is the unit one
    model, x = compile_system(system), np.concatenate([q, u])
    udot = model.state_rate(0.0, x)[model.n_q :]
    scale = np.abs(model.bias(0.0, x)).max(initial=1)
    assert model.residual(0.0, x, udot) == pytest.approx(np.zeros(model.n_u), abs=1e-10 * scale)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("root", [spherical, weld, universal])
def test_specified_orbit_eliminates_the_translation(seed, root):
    orbit = Orbit(7e6, 0.3, inclination=0.4, node=0.2, perigee=1.0, true_anomaly=0.7, mu=5e20)  # strong gradient
    system, clouds, (q, u) = random_tree(seed, root=root, orbit=orbit, frame=Frame("orbital"))
    model = compile_system(system)
    C, omega, alpha, r_hat, k = orbital_frame(orbit)

    def base(moving):
        W = skew([omega, 0, 0])
        return Jet(C, C @ W, C @ (W @ W + skew([alpha, 0, 0]))) if moving else Jet(C)

    def gradient(m, r):
        return -k * m[:, None] * (r - 3 * np.outer(r @ r_hat, r_hat))

    udot = np.random.default_rng(seed).normal(size=model.n_u)
    ours = model.residual(0.0, np.concatenate([q, u]), udot)
    theirs = equations(Tree(system, clouds), q, u, udot, base, gradient, hidden=True) + elastic_forces(system, q, u)
    assert ours == pytest.approx(theirs, rel=1e-10, abs=1e-10 * np.abs(theirs).max(initial=1))
    x = np.concatenate([q, u])
    found = model.state_rate(0.0, x)[model.n_q :]
    assert model.residual(0.0, x, found) == pytest.approx(np.zeros(model.n_u), abs=1e-9 * np.abs(theirs).max(initial=1))


def orbital_frame(orbit):
    """C_NO, rate, acceleration, vertical and mu/r^3 at the orbit's initial true anomaly, from the conic's equations."""
    nu, e, p = orbit.true_anomaly, orbit.eccentricity, orbit.semi_major_axis * (1 - orbit.eccentricity**2)
    r = p / (1 + e * np.cos(nu))
    rate = np.sqrt(orbit.mu * p) / r**2
    accel = -2 * np.sqrt(orbit.mu / p) * e * np.sin(nu) * rate / r
    up, ahead = np.array([np.cos(nu), np.sin(nu), 0]), np.array([-np.sin(nu), np.cos(nu), 0])
    C_PO = np.column_stack([[0, 0, 1], up, ahead])
    C = orbit.C_NP() @ C_PO
    return C, rate, accel, C[:, 1], orbit.mu / r**3


@pytest.mark.parametrize(("c_m", "c_d", "c_k"), [(2.0, 0.3, 0.7), (2.0, 0.0, 0.7), (2.0, 0.3, 0.0), (1.5, 0.0, 0.0)])
@pytest.mark.parametrize("seed", range(4))
def test_effective_solve_inverts_mass_damping_and_stiffness(seed, c_m, c_d, c_k):
    system, _, (q, u) = random_tree(seed, moving_markers=seed % 2 == 0)
    model = compile_system(system)
    rhs = np.random.default_rng(seed).normal(size=model.n_u)
    out = np.empty(model.n_u)
    model.second_order.solve(0.0, q, rhs, out, c_m, c_d, c_k, model.table, model.pool, model.work)
    M = model.mass_matrix(0.0, np.concatenate([q, 0 * u]))
    D, K, iu = np.zeros_like(M), np.zeros_like(M), 0
    for name in system.order:
        body = system.bodies[name]
        iu += system.joint_of(name).n_u
        s = slice(iu, iu + body.n_modes)
        D[s, s], K[s, s] = body.damping, body.strain.V1
        iu += body.n_modes
    assert (c_m * M + c_d * D + c_k * K) @ out == pytest.approx(rhs, abs=1e-9)


@pytest.mark.parametrize("sequence", ANGLE_SEQUENCES)
def test_advanced_angles_stay_beside_the_old_ones(sequence):
    joint = spherical("hub", rotation=sequence, q0=[0.1, 0.7, 0.2])
    system = System({"hub": rigid_body(1.0, np.eye(3))}, (joint,))
    model, rng = compile_system(system), np.random.default_rng(8)
    for _ in range(20):  # all over, also where arctangents would name the same turn by other angles
        q, step = rng.uniform(-7, 7, 3), 1e-5 * rng.normal(size=3)
        if abs(np.sin(q[1]) if sequence[0] == sequence[2] else np.cos(q[1])) < 0.1:
            continue  # close to the singularity
        qdot, out = np.empty(3), np.empty(3)
        model.second_order.kinematic(0.0, q, step, qdot, model.table, model.pool, model.work)
        model.second_order.advance(q, step, out, model.table, model.pool, model.work)
        assert out == pytest.approx(q + qdot, abs=1e-7)
