"""Modes of systems at the edge of what has modes, factors of graphs of every shape, and the one choice of signs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from femflex.fem.eigen.modes import lowest_modes
from femflex.fem.eigen.multifrontal import Cholesky

RNG = np.random.default_rng(6)


def chain(n: int, springs, ground=0.0) -> sparse.csr_array:
    """Stiffness of n masses in a row, of springs between neighbours and one to the ground at the first."""
    k = np.broadcast_to(springs, n - 1)
    K = np.diag(np.append(k, 0) + np.append(0, k)) - np.diag(k, 1) - np.diag(k, -1)
    K[0, 0] += ground
    return sparse.csr_array(K)


def words(make, kind=ValueError) -> str:
    with pytest.raises(kind) as refusal:
        make()
    return str(refusal.value)


@pytest.mark.parametrize("parts", [3, 13])
@pytest.mark.parametrize("n", [5, 60])
def test_chains_that_float_apart_have_a_motion_each_and_their_own_frequencies(n, parts):
    """More motions without stiffness than the first search looks for, dense and by Lanczos; unequal springs."""
    springs = np.linspace(1.0, 2.0, parts)
    K = sparse.block_diag([chain(n, k) for k in springs]).tocsr()
    M = sparse.eye_array(n * parts, format="csr")
    exact = np.sort(2 * np.sqrt(springs)[:, None] * np.sin(np.arange(1, n) * np.pi / 2 / n), axis=None)
    found = lowest_modes(K, M, 4)
    assert found.null.shape[1] == parts
    assert found.omega[:4] == pytest.approx(exact[:4], rel=1e-7)
    assert np.abs(K @ found.null).max() < 1e-7 and found.null.T @ found.null == pytest.approx(np.eye(parts), abs=1e-9)


def test_all_the_modes_of_a_floating_chain_are_found_and_no_more():
    n = 12
    K, M = chain(n, 3.0), sparse.csr_array(np.diag(np.full(n, 0.5)))
    exact = 2 * np.sqrt(6.0) * np.sin(np.arange(1, n) * np.pi / 2 / n)
    assert lowest_modes(K, M, n - 1).omega == pytest.approx(exact, rel=1e-9)
    assert "request at most 11" in words(lambda: lowest_modes(K, M, n))


GRAPHS = {
    "a path": [(k, k + 1) for k in range(199)],
    "a star of paths": [(0, 1 + 7 * k) for k in range(40)]
    + [(1 + 7 * k + j, 2 + 7 * k + j) for k in range(40) for j in range(6)],
    "a star": [(0, k) for k in range(1, 300)],
    "a grid": [(30 * i + j, 30 * i + j + d) for i in range(20) for j in range(29) for d in (1,)]
    + [(30 * i + j, 30 * i + j + 30) for i in range(19) for j in range(30)],
    "a broom": [(k, k + 1) for k in range(100)] + [(100, k) for k in range(101, 400)],
    "pieces": [(k, k + 1) for k in range(70)] + [(k, k + 1) for k in range(80, 180)] + [(180, 182), (181, 182)],
    "a full block with a tail": [(i, j) for i in range(80) for j in range(i)] + [(k, k + 1) for k in range(79, 150)],
}  # fmt: skip


@pytest.mark.parametrize("dofs", [1, 3])
@pytest.mark.parametrize("name", GRAPHS)
def test_factors_solve_matrices_on_graphs_of_every_shape(name, dofs):
    """Random symmetric matrices with a heavy diagonal, numbered at random; one load and several."""
    edges = np.array(GRAPHS[name])
    n = int(edges.max()) + 1
    edges = RNG.permutation(n)[edges]
    A = sparse.coo_array((RNG.uniform(0.5, 1.0, len(edges)), edges.T), shape=(n, n))
    A = (A + A.T).tocsr()
    block = RNG.uniform(0.5, 1.0, (dofs, dofs))
    A = sparse.kron(A, block + block.T).tocsr()
    A = (A + sparse.diags_array(1.0 + abs(A).sum(axis=1))).tocsr()
    x = RNG.normal(size=(n * dofs, 2))
    factors = Cholesky(A)
    assert np.array_equal(np.sort(factors.order), np.arange(n * dofs))
    np.testing.assert_allclose(factors.solve(A @ x), x, atol=1e-10)
    np.testing.assert_allclose(factors.solve(A @ x[:, 0]), x[:, 0], atol=1e-10)
