"""Lowest modes of (K, M) against closed forms, known spectra and dense solutions; factors of sparse matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from femflex.fem import Material, Member, build_structure
from femflex.fem.eigen.modes import lowest_modes, stiffness_ratio
from femflex.fem.eigen.multifrontal import Cholesky
from femflex.fem.eigen.shift_invert import canonical_modes
from femflex.fem.sections import StiffnessSection
from femflex.mesh import box, line
from femflex.reduction import cantilever_modes

CLAMPED_FREE = np.array([1.87510406871196, 4.69409113297417, 7.85475743823761, 10.9955407348755]) ** 2


FREE_FREE = np.array([4.73004074486270, 7.85320462409584, 10.9956078380017]) ** 2


def hermite_beam(n, length=1.0):
    """K, M of n cubic elements of a unit beam (EI = m = 1), dofs w, w' by node; written out from the textbook."""
    h = length / n
    k = (
        np.array([[12, 6 * h, -12, 6 * h], [0, 4 * h**2, -6 * h, 2 * h**2], [0, 0, 12, -6 * h], [0, 0, 0, 4 * h**2]])
        / h**3
    )
    m = np.array(
        [[156, 22 * h, 54, -13 * h], [0, 4 * h**2, 13 * h, -3 * h**2], [0, 0, 156, -22 * h], [0, 0, 0, 4 * h**2]]
    )
    dofs = 2 * np.arange(n)[:, None] + np.arange(4)
    rows, columns = np.repeat(dofs, 4, axis=1).ravel(), np.tile(dofs, (1, 4)).ravel()

    def assembled(upper):
        full = upper + np.triu(upper, 1).T
        triplets = (np.tile(full.ravel(), n), (rows, columns))
        return sparse.coo_array(triplets, shape=(2 * n + 2, 2 * n + 2)).tocsr()

    return assembled(k), assembled(m * h / 420)


def cantilever(n):
    K, M = hermite_beam(n)
    return K[2:][:, 2:], M[2:][:, 2:]


def copies(A, count):
    return sparse.block_diag([A] * count).tocsr()


@pytest.mark.parametrize("n", [40, 300])  # dense, Lanczos
def test_cantilever_frequencies(n):
    modes = lowest_modes(*cantilever(n), 4)
    bound = (np.sqrt(CLAMPED_FREE) / n) ** 4 / 1440  # of the cubic element, half of it shows in omega
    assert np.all(np.abs(modes.omega / CLAMPED_FREE - 1) < bound + 1e-7)  # 1e-7: rounding at 300 elements
    assert modes.null.shape[1] == 0


@pytest.mark.parametrize("n", [40, 300])
def test_free_beam_frequencies(n):
    K, M = hermite_beam(n)
    modes = lowest_modes(K, M, 3)
    assert modes.null.shape[1] == 2
    assert np.all(np.abs(stiffness_ratio(K, modes.null)) < 1e-15)
    assert modes.omega == pytest.approx(FREE_FREE, rel=1e-5 if n == 40 else 1e-7)
    assert np.abs(modes.null.T @ (M @ modes.phi)).max() < 1e-9


def test_modes_at_both_ends_of_spectrum():
    rng = np.random.default_rng(4)
    eigenvalues = np.logspace(0, 9, 40)
    Q = np.linalg.qr(rng.standard_normal((40, 40)))[0]
    K = sparse.csr_array(Q @ np.diag(eigenvalues) @ Q.T)
    modes = lowest_modes((K + K.T) / 2, sparse.csr_array(np.eye(40)), 40)
    rounding = 1e-15 * eigenvalues[-1] / eigenvalues  # of K itself
    assert np.all(np.abs(modes.omega**2 / eigenvalues - 1) < 30 * rounding + 1e-11)


def test_repeated_frequencies_are_all_found():
    K, M = cantilever(200)
    modes = lowest_modes(copies(K, 7), copies(M, 7), 8)
    assert len(modes.omega) == 14
    assert modes.omega == pytest.approx(np.repeat(CLAMPED_FREE[:2], 7), rel=1e-6)
    assert np.abs(modes.phi.T @ (copies(M, 7) @ modes.phi) - np.eye(14)).max() < 1e-12


def test_basis_of_degenerate_cluster_is_unique():
    rng = np.random.default_rng(7)
    phi = rng.standard_normal((30, 4))
    eigenvalues = np.array([1.0, 2.0, 2.0, 2.0])
    turned = phi.copy()
    turned[:, 1:] = phi[:, 1:] @ np.linalg.qr(rng.standard_normal((3, 3)))[0]
    turned[:, 0] *= -1
    assert np.abs(canonical_modes(eigenvalues, turned) - canonical_modes(eigenvalues, phi)).max() < 1e-13


@pytest.mark.parametrize("n", [40, 300])
def test_massless_dofs(n):
    K, _ = cantilever(n)
    h = 1.0 / n
    lumps = np.zeros(2 * n)
    lumps[::2] = h
    lumps[-2] = h / 2  # the tip's half element
    modes = lowest_modes(K, sparse.diags_array(lumps).tocsr(), 3)
    assert modes.omega == pytest.approx(CLAMPED_FREE[:3], rel=10 / n**2)


@pytest.mark.parametrize("slenderness", [1e3, 1e5, 1e6])
def test_many_modes_of_slender_beams(slenderness):
    """Rounding in the stretch, EA L^2 / EI = slenderness^2 times as stiff, once had 18 modes of 8 elements refused."""
    section = StiffnessSection(slenderness**2, 1.0, 1.0, 1.0, 1.0, ry=1 / slenderness, rz=1 / slenderness)
    member = Member("line", "beam", section, None, {"rotary_inertia": False, "order": 5})
    structure = build_structure(line([[0, 0, 0], [1, 0, 0]], 8), [member])
    omega = cantilever_modes(structure, "start", 18).omega
    assert omega[:8:2] == pytest.approx(CLAMPED_FREE, rel=1e-6)
    assert omega[1:8:2] == pytest.approx(CLAMPED_FREE, rel=1e-6)


RNG = np.random.default_rng(6)


def chain(n: int, springs, ground=0.0) -> sparse.csr_array:
    """Stiffness of n masses in a row, of springs between neighbours and one to the ground at the first."""
    k = np.broadcast_to(springs, n - 1)
    K = np.diag(np.append(k, 0) + np.append(0, k)) - np.diag(k, 1) - np.diag(k, -1)
    K[0, 0] += ground
    return sparse.csr_array(K)


@pytest.mark.parametrize("parts", [3, 13])
@pytest.mark.parametrize("n", [5, 60])
def test_disconnected_chains(n, parts):
    """More motions without stiffness than the first search looks for, dense and by Lanczos; unequal springs."""
    springs = np.linspace(1.0, 2.0, parts)
    K = sparse.block_diag([chain(n, k) for k in springs]).tocsr()
    M = sparse.eye_array(n * parts, format="csr")
    exact = np.sort(2 * np.sqrt(springs)[:, None] * np.sin(np.arange(1, n) * np.pi / 2 / n), axis=None)
    computed = lowest_modes(K, M, 4)
    assert computed.null.shape[1] == parts
    assert computed.omega[:4] == pytest.approx(exact[:4], rel=1e-7)
    assert np.abs(K @ computed.null).max() < 1e-7 and computed.null.T @ computed.null == pytest.approx(
        np.eye(parts), abs=1e-9
    )


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


@pytest.mark.parametrize("name", GRAPHS)
def test_factors_of_matrices_on_various_graphs(name, dofs=3):
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


METAL = Material(70e9, 0.3, 2700.0)


def clamped(mesh, member) -> sparse.csr_array:
    s = build_structure(mesh, [member])
    free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("left"))
    return s.K[free][:, free]


def block() -> sparse.csr_array:
    return clamped(box(2.0, 1.0, 1.0, 8, 4, 4, "hexahedron20"), Member("volume", "solid", material=METAL))
