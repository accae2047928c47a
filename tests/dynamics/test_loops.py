"""Closed loops against the independent dense derivation, and along runs."""

import numpy as np
import pytest
from support.pointwise import Jet, Tree, equations, partial_velocities
from support.random_loops import random_loops, row_jets
from test_equations import elastic_forces, frozen, orbital_frame

from femflex.dynamics import compile_system
from femflex.system import Frame, Orbit, spherical


def dense(system, clouds, q, u, base, force, hidden=False):
    """M, h, A and Adot u of the independent derivation, u brought onto A u = 0 first."""
    tree, n = Tree(system, clouds), len(u)
    A = np.array([[g.d.item() for g in row_jets(tree, q, unit, 0 * u, base(False))] for unit in np.eye(n)]).T
    drift = np.array([g.d.item() for g in row_jets(tree, q, 0 * u, 0 * u, base(True))])
    u = u - np.linalg.pinv(A, rcond=1e-10) @ (A @ u + drift)
    partial = partial_velocities(tree, q, n, base)
    h = equations(tree, q, u, 0 * u, base, force, hidden, partial)
    masses = np.concatenate([clouds[name][0] for name in system.order])
    M = np.einsum("kpa,p,lpa->kl", partial, masses, partial)
    if hidden:
        M_v = np.einsum("kpa,p->ka", partial, masses)
        M = M - M_v @ M_v.T / masses.sum()
    swept = np.array([g.dd.item() for g in row_jets(tree, q, u, 0 * u, base(True))])
    return u, M, h + elastic_forces(system, q, u), A, swept


def solved(M, h, A, swept):
    """udot and the smallest multipliers of the dense equations."""
    free = -np.linalg.solve(M, h)
    S = A @ np.linalg.solve(M, A.T)
    multipliers = np.linalg.pinv(S, rcond=1e-10) @ (-swept - A @ free)
    return free + np.linalg.solve(M, A.T @ multipliers), multipliers


def no_force(m, r):
    return np.zeros((len(m), 3))


def seeds(quick, all_):
    """Seeds of random systems, those past the first few marked slow."""
    return [seed if seed < quick else pytest.param(seed, marks=pytest.mark.slow) for seed in range(all_)]


@pytest.mark.sampled(3)
@pytest.mark.parametrize("n_loops", [1, 2])
@pytest.mark.parametrize("seed", seeds(4, 30))
def test_closed_loops_move_as_the_dense_equations_say(seed, n_loops):
    system, clouds, (q, u) = random_loops(seed, n_loops)
    model = compile_system(system)
    u, M, h, A, swept = dense(system, clouds, q, u, frozen(np.eye(3)), no_force)
    x = np.concatenate([q, u])
    assert model.x0[: model.n_q] == pytest.approx(q, abs=1e-11)  # already closed: stays where it is
    assert model.constraints.matrix(0.0, x) == pytest.approx(A, abs=1e-12 * np.abs(A).max())
    udot, _ = solved(M, h, A, swept)
    assert model.state_rate(0.0, x)[model.n_q :] == pytest.approx(udot, abs=1e-10 * np.abs(udot).max())


@pytest.mark.sampled(2)
@pytest.mark.parametrize("n_loops", [1, 2])
@pytest.mark.parametrize("seed", seeds(2, 12))
def test_mass_bias_and_rows_are_those_of_the_dense_equations(seed, n_loops):
    """M and h of the spanning tree, and gamma of A udot = gamma, each by itself; A udot = gamma of the motion."""
    system, clouds, (q, u) = random_loops(seed, n_loops)
    model = compile_system(system)
    u, M, h, A, swept = dense(system, clouds, q, u, frozen(np.eye(3)), no_force)
    x = np.concatenate([q, u])
    assert model.mass_matrix(0.0, x) == pytest.approx(M, abs=1e-10 * np.abs(M).max())
    assert model.bias(0.0, x) == pytest.approx(h, abs=1e-10 * np.abs(h).max())
    udot = model.state_rate(0.0, x)[model.n_q :]
    assert A @ udot == pytest.approx(-swept, abs=1e-10 * max(1.0, (np.abs(A) @ np.abs(udot)).max()))


@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", seeds(2, 12))
def test_closed_loops_on_a_specified_orbit(seed):
    orbit = Orbit(7e6, 0.3, inclination=0.4, node=0.2, perigee=1.0, true_anomaly=0.7, mu=5e20)
    system, clouds, (q, u) = random_loops(seed, root=spherical, orbit=orbit, frame=Frame("orbital"))
    model = compile_system(system)
    C, omega, alpha, up, k = orbital_frame(orbit)
    W = np.array([[0, 0, 0], [0, 0, -omega], [0, omega, 0]])
    V = W * alpha / omega

    def base(moving):
        return Jet(C, C @ W, C @ (W @ W + V)) if moving else Jet(C)

    def gradient(m, r):
        return -k * m[:, None] * (r - 3 * np.outer(r @ up, up))

    u, M, h, A, swept = dense(system, clouds, q, u, base, gradient, hidden=True)
    udot, _ = solved(M, h, A, swept)
    found = model.state_rate(0.0, np.concatenate([q, u]))[model.n_q :]
    assert found == pytest.approx(udot, abs=1e-9 * np.abs(udot).max())


@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", seeds(2, 12))
def test_velocities_are_brought_to_the_nearest_by_mass(seed):
    system, clouds, (q, u) = random_loops(seed, 2)
    model = compile_system(system)
    _, M, _, A, _ = dense(system, clouds, q, u, frozen(np.eye(3)), no_force)
    x = np.concatenate([q, u])
    model.project(0.0, x, model.table, model.pool, model.work)
    root = np.linalg.cholesky(M).T
    nearest = u - np.linalg.solve(root, np.linalg.pinv(A @ np.linalg.inv(root), rcond=1e-9) @ (A @ u))
    assert x[model.n_q :] == pytest.approx(nearest, abs=1e-10 * np.abs(u).max())
