"""Modes of systems at the edge of what has modes, factors of graphs of every shape, and the one choice of signs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg, sparse

from femflex.fem.eigen.canonical import canonical, signs
from femflex.fem.eigen.modes import check_residual, lowest_modes, stiffness_ratio, without_stiffness
from femflex.fem.eigen.multifrontal import Cholesky
from femflex.fem.eigen.shift_invert import ShiftInverted, dense_modes

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


def test_systems_without_mass_or_without_stiffness_say_so():
    none = sparse.csr_array((3, 3))
    assert words(lambda: lowest_modes(chain(3, 1.0, 1.0), none, 1)) == (
        "modes were requested of a structure without mass; give its materials a density, or point masses."
    )
    assert words(lambda: lowest_modes(none, sparse.csr_array(np.diag([1.0, 2, 3])), 1)) == (
        "1 modes were requested, but of the 3 degrees of freedom 3 are motions without stiffness; request at most 0."
    )
    K, M = (sparse.block_diag([sparse.csr_array(A), np.zeros((2, 2))]).tocsr() for A in (chain(3, 1.0, 1.0), np.eye(3)))
    assert "neither stiffness nor mass (2 degrees of freedom by themselves)" in words(lambda: lowest_modes(K, M, 1))


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


def test_shapes_without_stiffness_are_told_from_soft_ones_in_any_unit():
    """A rigid motion of stiff parts, dofs that have no stiffness at all, and a soft spring, in N/m or in GN/m."""
    for unit in (1e-9, 1.0, 1e9):
        K = unit * linalg.block_diag(chain(4, 1e6).toarray(), [[0.0]], [[1e-3]])
        phi = np.zeros((6, 3))
        phi[:4, 0] = phi[4, 1] = phi[5, 2] = 1.0
        M = np.diag([1.0, 2, 3, 4, 5, 6])
        found = without_stiffness(sparse.csr_array(K), sparse.csr_array(M), phi)
        assert found.tolist() == [True, True, False]


def test_the_ratio_of_energies_compares_with_the_sum_of_sizes():
    K = np.array([[2.0, -1.5, 0], [-1.5, 3.0, 0.25], [0, 0.25, -1.0]])
    phi = np.array([[1.0, 2.0], [-1.0, 0.5], [0.5, 0.0]])
    expected = [(x @ K @ x) / (abs(x) @ abs(K) @ abs(x)) for x in phi.T]
    assert stiffness_ratio(sparse.csr_array(K), phi) == pytest.approx(expected)


def test_the_residual_names_its_worst_mode_with_and_without_a_shift():
    K, M = chain(40, 2.0), sparse.csr_array(np.diag(np.linspace(1.0, 2.0, 40)))
    value, phi = linalg.eigh(K.toarray(), M.toarray())
    omega, phi = np.sqrt(value[1:6]), phi[:, 1:6]
    check_residual(K, M, omega, phi, shift=0.1)
    for factors, mode in (([1, 1, 1 + 1e-6, 1, 1 + 1e-7], 3), ([1 + 1e-7, 1, 1, 1 + 1e-5, 1], 4)):
        said = words(lambda factors=factors: check_residual(K, M, omega * factors, phi, shift=0.1), RuntimeError)
        hertz = (omega * factors)[mode - 1] / 2 / np.pi
        assert said.startswith(f"mode {mode} at {hertz:.6g} Hz has a residual of ")
        assert said.endswith(
            "where 1e-09 is allowed; the eigen-solver has failed. Check for stiffnesses many orders apart."
        )


def test_dense_modes_leave_out_massless_shapes_and_take_indefinite_stiffness():
    A, B = RNG.normal(size=(2, 8, 8))
    K, M = A @ A.T + np.eye(8), np.zeros((8, 8))
    M[:5, :5] = (B @ B.T)[:5, :5] + np.eye(5)
    value, phi = dense_modes(K, M)
    exact = linalg.eigh(M, K, eigvals_only=True)
    assert value == pytest.approx(np.sort(1 / exact[exact > 1e-10]))
    assert phi.T @ M @ phi == pytest.approx(np.eye(5), abs=1e-10) and phi.T @ K @ phi == pytest.approx(
        np.diag(value), abs=1e-8
    )
    whole = B @ B.T + np.eye(8)
    value, phi = dense_modes(A + A.T, whole)
    assert value == pytest.approx(linalg.eigh(A + A.T, whole, eigvals_only=True)) and value[0] < 0
    assert (A + A.T) @ phi == pytest.approx(whole @ phi * value, abs=1e-9)
    assert dense_modes(np.zeros((0, 0)), np.zeros((0, 0)))[1].shape == (0, 0)


@pytest.mark.parametrize("surely", [3, 5])
def test_modes_missed_by_one_search_are_added_until_none_of_the_first_is_missing(surely):
    """Five equal frequencies, two of which and a higher one are handed in: what is missing of the first comes back."""
    n = 130
    K = sparse.block_diag([chain(n, 1.0, 1.0)] * 5).tocsr()
    M = sparse.eye_array(5 * n, format="csr")
    value, phi = linalg.eigh(chain(n, 1.0, 1.0).toarray())
    given = np.zeros((5 * n, 5))
    for k, mode in enumerate((0, 0, 1, 1, 2)):
        given[k * n : (k + 1) * n, k] = phi[:, mode]
    theta, shapes = ShiftInverted(K, M, 0.0).completed(1 / value[[0, 0, 1, 1, 2]], given, surely)
    assert np.sort(theta)[::-1][:surely] == pytest.approx(np.full(surely, 1 / value[0]), rel=1e-8)
    assert shapes.shape == (5 * n, len(theta)) and len(theta) == 5 + surely - 2
    assert np.linalg.matrix_rank(shapes, tol=1e-6) == len(theta)


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


def test_of_entries_that_tie_the_first_decides_the_sign():
    phi = np.array([[-1.0, 0.5, 3.0], [1.0 + 1e-9, -2.0, -3.0 - 1e-3], [0.2, 2.0 - 1e-8, 1.0]])
    assert signs(phi).tolist() == [-1.0, -1.0, -1.0]


def test_the_basis_of_a_cluster_begins_with_the_first_of_rows_that_tie():
    """Four rows of one length, those of a square's corners: the first carries the first shape alone."""
    angles = np.array([0.4, 0.4 + np.pi / 2, 0.4 + np.pi, 0.4 - np.pi / 2])
    phi = np.stack([np.cos(angles), np.sin(angles)], axis=1) * (1 + 1e-9 * np.arange(4))[:, None]
    found = canonical(np.array([5.0, 5.0]), phi)
    assert found[0] == pytest.approx([1.0, 0.0], abs=1e-8)
    assert np.abs(found[1:]) == pytest.approx(np.array([[0, 1.0], [1, 0], [0, 1]]), abs=1e-8)
    assert found @ found.T == pytest.approx(phi @ phi.T, abs=1e-7)
