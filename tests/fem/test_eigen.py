"""Lowest modes of (K, M) against closed forms, known spectra and dense solutions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg, sparse

from femflex.fem import Member, build_structure
from femflex.fem.eigen.canonical import canonical, clusters, whole_clusters
from femflex.fem.eigen.modes import check_residual, lowest_modes, orthonormal, stiffness_ratio
from femflex.fem.eigen.shift_invert import ShiftInverted
from femflex.fem.sections import StiffnessSection
from femflex.mesh import line
from femflex.reduction import cantilever_modes
from femflex.reduction.boundary.clamps import free_dofs, held_dofs
from femflex.warning import PhysicsWarning

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
def test_a_cantilever_has_the_textbook_frequencies(n):
    modes = lowest_modes(*cantilever(n), 4)
    bound = (np.sqrt(CLAMPED_FREE) / n) ** 4 / 1440  # of the cubic element, half of it shows in omega
    assert np.all(np.abs(modes.omega / CLAMPED_FREE - 1) < bound + 1e-7)  # 1e-7: rounding at 300 elements
    assert modes.null.shape[1] == 0


@pytest.mark.parametrize("n", [40, 300])
def test_a_free_beam_has_two_rigid_motions_and_the_textbook_frequencies(n):
    K, M = hermite_beam(n)
    modes = lowest_modes(K, M, 3)
    assert modes.null.shape[1] == 2
    assert np.all(np.abs(stiffness_ratio(K, modes.null)) < 1e-15)
    assert modes.omega == pytest.approx(FREE_FREE, rel=1e-5 if n == 40 else 1e-7)
    assert np.abs(modes.null.T @ (M @ modes.phi)).max() < 1e-9


def test_free_given_beforehand_changes_nothing():
    K, M = hermite_beam(300)
    assert lowest_modes(K, M, 3, free=True).omega == pytest.approx(lowest_modes(K, M, 3).omega, rel=1e-12)


@pytest.mark.parametrize("n", [40, 300])
def test_shapes_are_m_orthonormal(n):
    K, M = cantilever(n)
    phi = lowest_modes(K, M, 8).phi
    assert np.abs(phi.T @ (M @ phi) - np.eye(8)).max() < 1e-12


def test_lanczos_agrees_with_a_dense_solution():
    K, M = cantilever(260)
    dense = np.sqrt(linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True, subset_by_index=[5, 9]))
    assert lowest_modes(K, M, 10).omega[5:] == pytest.approx(dense, rel=1e-8)


def test_every_mode_of_a_stiff_system_is_found_at_both_ends_of_the_spectrum():
    rng = np.random.default_rng(4)
    eigenvalues = np.logspace(0, 9, 40)
    Q = np.linalg.qr(rng.standard_normal((40, 40)))[0]
    K = sparse.csr_array(Q @ np.diag(eigenvalues) @ Q.T)
    modes = lowest_modes((K + K.T) / 2, sparse.csr_array(np.eye(40)), 40)
    rounding = 1e-15 * eigenvalues[-1] / eigenvalues  # of K itself
    assert np.all(np.abs(modes.omega**2 / eigenvalues - 1) < 30 * rounding + 1e-11)


def test_signs_make_the_largest_entry_positive():
    phi = lowest_modes(*cantilever(40), 6).phi
    assert np.all(phi.max(axis=0) >= (1 - 1e-6) * np.abs(phi).max(axis=0))


def test_a_run_repeats_bit_for_bit():
    K, M = cantilever(300)
    first, second = lowest_modes(K, M, 6), lowest_modes(K, M, 6)
    assert np.array_equal(first.phi, second.phi) and np.array_equal(first.omega, second.omega)


def test_a_close_pair_is_not_parted_and_that_is_said():
    K, M = cantilever(300)
    modes = lowest_modes(copies(K, 2), copies(M, 2), 5)
    assert len(modes.omega) == 6
    assert modes.note.startswith("5 modes requested, 6 kept: modes 5 and 6 at 9.8") and "close pair" in modes.note
    assert lowest_modes(copies(K, 2), copies(M, 2), 4).note == ""


def test_many_copies_of_one_frequency_are_all_found():
    K, M = cantilever(200)
    modes = lowest_modes(copies(K, 7), copies(M, 7), 8)
    assert len(modes.omega) == 14
    assert modes.omega == pytest.approx(np.repeat(CLAMPED_FREE[:2], 7), rel=1e-6)
    assert np.abs(modes.phi.T @ (copies(M, 7) @ modes.phi) - np.eye(14)).max() < 1e-12


def test_a_mode_that_lanczos_missed_is_found_beside_the_others():
    K, M = cantilever(300)
    theta, phi = ShiftInverted(K, M, 0.0).largest(5, surely=5)
    keep = [0, 2, 3, 4]
    solver = ShiftInverted(K, M, 0.0)
    found, shapes = solver.completed(theta[keep], phi[:, keep], 4)
    assert np.sort(found)[::-1] == pytest.approx(theta, rel=1e-9)
    assert shapes.shape[1] == 5


def test_the_basis_of_a_degenerate_cluster_depends_on_its_span_alone():
    rng = np.random.default_rng(7)
    phi = rng.standard_normal((30, 4))
    eigenvalues = np.array([1.0, 2.0, 2.0, 2.0])
    turned = phi.copy()
    turned[:, 1:] = phi[:, 1:] @ np.linalg.qr(rng.standard_normal((3, 3)))[0]
    turned[:, 0] *= -1
    assert np.abs(canonical(eigenvalues, turned) - canonical(eigenvalues, phi)).max() < 1e-13


def test_a_degenerate_pair_of_two_separate_beams_is_each_beam_alone():
    K, M = cantilever(300)
    phi = lowest_modes(copies(K, 2), copies(M, 2), 2).phi
    assert np.abs(phi[600:, 0]).max() < 1e-6 and np.abs(phi[:600, 1]).max() < 1e-6


def test_clusters_and_cuts():
    values = np.array([1.0, 1.0 + 1e-10, 2.0, 3.0, 3.0])
    assert [(c.start, c.stop) for c in clusters(values, 1e-8)] == [(0, 2), (2, 3), (3, 5)]
    assert whole_clusters(np.array([1.0, 1.0001, 1.0002, 2.0]), 1) == 3
    assert whole_clusters(np.array([1.0, 2.0, 3.0]), 2) == 2
    assert whole_clusters(np.array([1.0, 2.0, 2.0]), 2) is None


@pytest.mark.parametrize("n", [40, 300])
def test_dofs_without_mass_are_allowed(n):
    K, _ = cantilever(n)
    h = 1.0 / n
    lumps = np.zeros(2 * n)
    lumps[::2] = h
    lumps[-2] = h / 2  # the tip's half element
    modes = lowest_modes(K, sparse.diags_array(lumps).tocsr(), 3)
    assert modes.omega == pytest.approx(CLAMPED_FREE[:3], rel=10 / n**2)


def test_more_modes_than_mass_can_have_says_how_many_there_are():
    K, _ = cantilever(4)
    lumps = np.array([1.0, 0, 1.0, 0, 1.0, 0, 1.0, 0])
    with pytest.raises(ValueError, match="5 modes were requested, but the mass takes part in only 4 elastic motions"):
        lowest_modes(K, sparse.diags_array(lumps).tocsr(), 5)


@pytest.mark.parametrize(
    ("n", "sentence"),
    [
        (0, "0 modes were requested; request at least one"),
        (-3, "-3 modes were requested"),
        (9, "9 modes were requested, but only 8 degrees of freedom are free to move; request at most 8"),
    ],
)
def test_counts_that_cannot_be_are_refused(n, sentence):
    with pytest.raises(ValueError, match=sentence):
        lowest_modes(*cantilever(4), n)


def test_more_elastic_modes_than_a_free_beam_has_are_refused():
    with pytest.raises(
        ValueError, match="of the 10 degrees of freedom 2 are motions without stiffness; request at most 8"
    ):
        lowest_modes(*hermite_beam(4), 9)


@pytest.mark.parametrize("n", [4, 300])
def test_a_dof_with_neither_mass_nor_stiffness_is_refused(n):
    K, M = (sparse.block_diag([A, sparse.csr_array((1, 1))]).tocsr() for A in cantilever(n))
    with pytest.raises(ValueError, match="neither stiffness nor mass"):
        lowest_modes(K, M, 2)


def test_a_wrong_mode_does_not_pass_the_residual_check():
    K, M = cantilever(40)
    modes = lowest_modes(K, M, 3)
    check_residual(K, M, modes.omega, modes.phi)
    with pytest.raises(RuntimeError, match=r"mode 2 at .* Hz has a residual of .* where 1e-09 is allowed"):
        check_residual(K, M, modes.omega * [1, 1.001, 1], modes.phi)


@pytest.mark.parametrize("slenderness", [1e3, 1e5, 1e6])
def test_many_modes_of_beams_however_slender_pass_and_are_right(slenderness):
    """Rounding in the stretch, EA L^2 / EI = slenderness^2 times as stiff, once had 18 modes of 8 elements refused."""
    section = StiffnessSection(slenderness**2, 1.0, 1.0, 1.0, 1.0, ry=1 / slenderness, rz=1 / slenderness)
    member = Member("line", "beam", section, None, {"rotary_inertia": False, "order": 5})
    structure = build_structure(line([[0, 0, 0], [1, 0, 0]], 8), [member])
    omega = cantilever_modes(structure, "start", 18).omega
    assert omega[:8:2] == pytest.approx(CLAMPED_FREE, rel=1e-6)
    assert omega[1:8:2] == pytest.approx(CLAMPED_FREE, rel=1e-6)


def test_a_shape_with_a_little_of_another_does_not_pass_however_slender_the_beam():
    section = StiffnessSection(1e12, 1.0, 1.0, 1.0, 1.0, ry=1e-6, rz=1e-6)
    structure = build_structure(line([[0, 0, 0], [1, 0, 0]], 8), [Member("line", "beam", section)])
    free = free_dofs(structure, held_dofs(structure, "start"))
    K, M = (A[free][:, free] for A in (structure.K, structure.M))
    modes = lowest_modes(K, M, 18)
    wrong = modes.phi.copy()
    wrong[:, 4] += 1e-6 * wrong[:, 0]
    with pytest.raises(RuntimeError, match=r"mode 5 at .* where 1e-09 is allowed"):
        check_residual(K, M, modes.omega, wrong)


def test_a_mesh_so_fine_that_rounding_reaches_the_frequencies_is_warned_of():
    with pytest.warns(PhysicsWarning, match=r"mode 1 at 0.5\d+ Hz: its strain energy is .*e-1[56] of the terms"):
        lowest_modes(*cantilever(3500), 2)


def test_orthonormal_keeps_the_first_direction():
    rng = np.random.default_rng(1)
    _, M = cantilever(10)
    phi = rng.standard_normal((20, 3))
    made = orthonormal(M, phi)
    assert np.abs(made.T @ (M @ made) - np.eye(3)).max() < 1e-14
    assert np.linalg.matrix_rank(np.column_stack([made[:, 0], phi[:, 0]]), tol=1e-12) == 1


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e5])
def test_close_pairs_are_kept_whole_whatever_the_unit(size):
    """A gap of a thousandth of the frequency and less parts nothing, be it in micro- or megahertz."""
    omega = size * np.array([1.0, 2.0, 2.001, 3.0, 3.1])
    assert [whole_clusters(omega, n) for n in (1, 2, 3, 4, 5)] == [1, 3, 3, 4, None]
