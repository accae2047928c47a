"""Linear equations of random trees and loops against differences of Kane's equations over material points."""

from __future__ import annotations

import numpy as np
import pytest
from support.pointwise import Jet, Tree, equations
from support.random_loops import random_loops, row_jets
from support.random_systems import random_tree
from test_equations import elastic_forces, frozen

from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.linearised import advanced, free_directions, linearised, usual_sizes

BASE = frozen(np.eye(3))


def points_force(system, clouds, q, u, udot):
    """M udot + h - Q (n_u,) from the material points and the bodies' own forces."""
    nothing = lambda m, _: np.zeros((len(m), 3))  # noqa: E731
    return equations(Tree(system, clouds), q, u, udot, BASE, nothing) + elastic_forces(system, q, u)


def difference(force, at, directions, sizes):
    """Columns (n, k) of central differences of force(increment) at a point."""
    return np.column_stack(
        [(force(at + h * e) - force(at - h * e)) / (2 * h) for e, h in zip(directions, sizes, strict=True)]
    )


@pytest.mark.parametrize("seed", [8, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 4))])
def test_a_tree_in_motion_has_the_derivatives_of_its_points(seed):
    system, clouds, (q, u) = random_tree(seed, n_bodies=3, most=3)
    model = compile_system(system)
    udot = np.random.default_rng(seed).normal(size=model.n_u)
    ours = linearised(model, 0.0, np.concatenate([q, u]), udot)
    eye, zero = np.eye(model.n_u), np.zeros(model.n_u)
    M = difference(lambda a: points_force(system, clouds, q, u, a), zero, eye, np.ones(model.n_u))
    D = difference(lambda v: points_force(system, clouds, q, v, udot), u, eye, np.ones(model.n_u))
    sizes = 1e-5 * usual_sizes(model)
    K = difference(lambda d: points_force(system, clouds, advanced(model, q, d), u, udot), zero, eye, sizes)
    for found, wanted in ((ours.M, M), (ours.D, D), (ours.K, K)):
        assert found == pytest.approx(wanted, abs=1e-7 * np.abs(wanted).max())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0])
def test_loops_at_rest_have_the_derivatives_of_their_points(seed):
    """K at constant multipliers, projected onto the motions that the loops leave."""
    system, clouds, (q, u) = random_loops(seed, 1, most=3)
    model, still = compile_system(system), 0 * u
    x = np.concatenate([q, still])
    ours = linearised(model, 0.0, x)
    _, Z = free_directions(model, 0.0, x)

    def rows(q):
        tree = Tree(system, clouds)
        return np.array([[g.d.item() for g in row_jets(tree, q, e, still, Jet(np.eye(3)))] for e in np.eye(len(u))]).T

    G = rows(q)
    assert np.linalg.matrix_rank(G) == len(G) and np.abs(G @ Z).max() < 1e-9 * np.abs(G).max()
    multipliers = np.linalg.lstsq(G.T, points_force(system, clouds, q, still, still), rcond=None)[0]

    def left(d):
        moved = advanced(model, q, d)
        return points_force(system, clouds, moved, still, still) - rows(moved).T @ multipliers

    K = Z.T @ difference(left, 0 * u, np.eye(len(u)), 1e-5 * usual_sizes(model)) @ Z
    M = Z.T @ difference(lambda a: points_force(system, clouds, q, still, a), still, np.eye(len(u)), 1 + still) @ Z
    assert ours.M == pytest.approx(M, abs=1e-8 * np.abs(M).max())
    assert ours.K == pytest.approx(K, abs=1e-6 * np.abs(K).max())
