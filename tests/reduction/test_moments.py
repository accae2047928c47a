"""Mass moments of reduced bodies against textbook values, points of mass and given matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh
from support.reduction_examples import ALUMINIUM, LENGTH, MASS, bent_boom, frame, slender_beam

from femflex.fem import Material, Member, PointMass, build_structure
from femflex.fem.eigen.modes import stiffness_ratio
from femflex.fem.matrix_structure import structure_from_matrices
from femflex.fem.sections import Rectangle, Tube
from femflex.mesh import Mesh
from femflex.mesh.generators import box, line, rectangle
from femflex.reduction import cantilever_modes, free_free_modes, reduce_structure, rigid_set
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.inertia.moments import mass_moments, strain_stiffness
from femflex.reduction.matrices import reduce_matrices
from femflex.reduction.modes.vibration import ModeSet


@pytest.fixture(scope="module", params=["boom", "frame"])
def structure(request):
    return {"boom": bent_boom, "frame": frame}[request.param]()


def test_a_rigid_tube_has_its_textbook_mass_centre_and_inertia():
    R, t, L = 0.1, 0.004, 6.0
    structure = build_structure(line([[1, 2, 0], [1 + L, 2, 0]], 5), [Member("line", "beam", Tube(R, t), ALUMINIUM)])
    body = reduce_structure(structure, rigid_set(structure.n_dof))
    m = ALUMINIUM.density * np.pi * (R**2 - (R - t) ** 2) * L
    polar = m * (R**2 + (R - t) ** 2) / 2
    across = polar / 2 + m * L**2 / 12
    c = np.array([1 + L / 2, 2.0, 0.0])
    assert body.n_modes == 0
    assert body.moments.mass == pytest.approx(m, rel=1e-13)
    assert body.moments.center_of_mass() == pytest.approx(c, rel=1e-13, abs=1e-13)
    expected = np.diag([polar, across, across]) + m * ((c @ c) * np.eye(3) - np.outer(c, c))
    assert body.moments.inertia() == pytest.approx(expected, rel=1e-12, abs=1e-11)


def test_kinetic_energy_of_the_moments_is_that_of_the_points():
    """T of THEORY section 3 against the sum over material points that move with frame and shapes."""
    structure = bent_boom()
    modes = cantilever_modes(structure, "start", 5)
    m = mass_moments(structure.inertia, structure.T @ modes.phi)
    rng = np.random.default_rng(3)
    v, omega, delta, rate = (
        rng.standard_normal(3),
        rng.standard_normal(3),
        rng.standard_normal(5),
        rng.standard_normal(5),
    )
    y = np.append(1.0, delta)
    eps = np.zeros((3, 3, 3))
    eps[[0, 1, 2], [1, 2, 0], [2, 0, 1]], eps[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = 1, -1
    Cr = np.einsum("abc,Abkc,A->ak", eps, m.second[:, :, 1:, :], y)
    T = 0.5 * m.mass * v @ v + v @ np.cross(omega, y @ m.first) + v @ (rate @ m.first[1:])
    T += 0.5 * omega @ m.inertia(delta) @ omega + omega @ Cr @ rate + 0.5 * rate @ m.elastic_mass() @ rate
    energy = 0.0
    for block in structure.inertia:
        shapes = block.shapes(structure.T @ modes.phi, slice(None))
        r, dr = block.rho + shapes @ delta, shapes @ rate
        energy += 0.5 * (block.dm * ((v + np.cross(omega, r) + dr) ** 2).sum(axis=-1)).sum()
    assert T == pytest.approx(energy, rel=1e-12)


def test_a_point_mass_adds_its_six_points():
    mesh = line([[0, 0, 0], [4, 0, 0]], 4)
    member = Member("line", "beam", Tube(0.05, 0.002), ALUMINIUM)
    lump = PointMass("end", 3.0, np.diag([0.2, 0.3, 0.4]), (0.1, 0.0, 0.2))
    bare, loaded = build_structure(mesh, [member]), build_structure(mesh, [member], [lump])
    a, b = (reduce_structure(s, rigid_set(s.n_dof)).moments for s in (bare, loaded))
    r = np.array([4.1, 0.0, 0.2])
    added = np.diag([0.2, 0.3, 0.4]) + 3.0 * ((r @ r) * np.eye(3) - np.outer(r, r))
    assert b.mass - a.mass == pytest.approx(3.0, rel=1e-12)
    assert b.inertia() - a.inertia() == pytest.approx(added, abs=1e-11)
    phi = cantilever_modes(loaded, "start", 4).phi
    assert np.abs(mass_moments(loaded.inertia, loaded.T @ phi).elastic_mass() - np.eye(4)).max() < 1e-12


def test_first_moments_of_a_cantilever_are_the_closed_form():
    structure = slender_beam()
    modes = cantilever_modes(structure, "start", 2)
    first = mass_moments(structure.inertia, structure.T @ modes.phi).first[1:]
    # int phi_1 dm = 2 sigma / (beta L) sqrt(m), sigma = 0.734096 of the first clamped-free mode
    expected = 2 * 0.7340955137584 / 1.87510406871196 * np.sqrt(MASS * LENGTH)
    assert np.abs(first).max(axis=1) == pytest.approx(expected, rel=1e-8)


def random_system(n=12, k=4, lumped=False, seed=11):
    """Nodes, a consistent (or lumped) mass alike along the axes, a stiffness with six rigid motions, clamped shapes."""
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, 3))
    scalar = np.diag(rng.random(n) + 0.5)
    if not lumped:
        A = rng.standard_normal((n, n)) * 0.2
        scalar = scalar + A @ A.T
    M = np.kron(scalar, np.eye(3))
    K = np.zeros((3 * n, 3 * n))
    for i in range(n):
        for j in range(i):  # springs between all pairs
            d = X[i] - X[j]
            row = np.zeros(3 * n)
            row[3 * i : 3 * i + 3], row[3 * j : 3 * j + 3] = d, -d
            K += rng.random() * np.outer(row, row)
    held = np.arange(9)
    free = np.arange(9, 3 * n)
    eigenvalues, V = eigh(K[np.ix_(free, free)], M[np.ix_(free, free)])
    phi = np.zeros((3 * n, k))
    phi[free] = V[:, :k]
    assert held.size == 9
    return X, M, K, phi, np.sqrt(eigenvalues[:k])


def body_of(X, M, K, phi, omega):
    """The body of nodes X (n, 3) whose three translations have matrices M and K, in shapes phi."""
    dofs = np.stack(np.divmod(np.arange(3 * len(X)), 3), axis=1)
    structure = structure_from_matrices(Mesh(X, {}), dofs, sparse.csr_array(M), sparse.csr_array(K))
    return reduce_matrices(structure, ModeSet(phi, ("vibration",) * len(omega), omega)).body


@pytest.mark.parametrize("lumped", [False, True])
def test_moments_are_the_nodal_sums_of_the_mass_matrix(lumped):
    X, M, K, phi, omega = random_system(lumped=lumped)
    m = body_of(X, M, K, phi, omega).moments
    scalar, shapes = M[::3, ::3], [X, *(column.reshape(-1, 3) for column in phi.T)]
    assert m.mass == pytest.approx(scalar.sum())
    for A, za in enumerate(shapes):
        assert m.first[A] == pytest.approx(scalar.sum(axis=0) @ za)
        for B, zb in enumerate(shapes):
            assert m.second[A, :, B, :] == pytest.approx(za.T @ scalar @ zb)


def test_stiffness_frequencies_and_kinds():
    X, M, K, phi, omega = random_system()
    body = body_of(X, M, K, phi, omega)
    assert np.diag(body.strain.V1) == pytest.approx(omega**2)
    assert body.moments.elastic_mass() == pytest.approx(np.eye(4), abs=1e-12)
    assert body.kinds == ("vibration",) * 4 and np.array_equal(body.omega, omega)


SHEET = Material(7e10, 0.3, 2700.0)
PANEL = Material(2e9, 0.3, 100.0)


@pytest.fixture(scope="module", params=["plate", "solid"])
def structure_families(request):
    turn = [0.3, 0.4, 0.2]
    if request.param == "plate":
        mesh = rectangle(1.0, 1.0, 6, 6).rotated(turn).translated([2.0, -1.0, 0.5])
        return build_structure(mesh, [Member("surface", "plate", 0.01, SHEET)])
    mesh = box(3.0, 0.8, 0.1, 6, 2, 1, "hexahedron27").rotated(turn)
    return build_structure(mesh, [Member("volume", "solid", None, PANEL)])


def test_six_rigid_motions_cost_nothing(structure_families):
    R = rigid_shapes(structure_families)
    assert np.abs(stiffness_ratio(structure_families.K, R)).max() < 1e-16
    assert free_free_modes(structure_families, 3).n_modes >= 3
    total = sum(block.dm.sum() for block in structure_families.inertia)
    assert np.diag(R.T @ (structure_families.M @ R))[:3] == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize("make", [lambda s: cantilever_modes(s, "left", 5), lambda s: free_free_modes(s, 5)])
def test_moments_and_stiffness_are_those_of_the_modes(structure_families, make):
    modes = make(structure_families)
    body = reduce_structure(structure_families, modes)
    n = modes.n_modes
    assert np.abs(body.moments.elastic_mass() - np.eye(n)).max() < 1e-12
    for V1 in (body.strain.V1, strain_stiffness(structure_families.strain, structure_families.T @ modes.phi)):
        assert np.abs(V1 / np.outer(modes.omega, modes.omega) - np.eye(n)).max() < 1e-7


SHEET_FAMILIES = 2700.0 * 2.0 * 0.8 * 0.01
MESHES = {
    "solid": (lambda: box(2.0, 0.8, 0.4, 2, 1, 1), Member("volume", "solid", None, ALUMINIUM), 2700 * 0.64),
    "shell": (lambda: rectangle(2.0, 0.8, 3, 1, "quad"), Member("surface", "shell", 0.01, ALUMINIUM), SHEET_FAMILIES),
    "plate": (
        lambda: rectangle(2.0, 0.8, 3, 1, "triangle"),
        Member("surface", "plate", 0.01, ALUMINIUM),
        SHEET_FAMILIES,
    ),
    "plate_bfs": (
        lambda: rectangle(2.0, 0.8, 3, 1, "quad"),
        Member("surface", "plate_bfs", 0.01, ALUMINIUM),
        SHEET_FAMILIES,
    ),
    "beam": (
        lambda: line([[0, 0.4, 0], [2, 0.4, 0]], 3),
        Member("line", "beam", Rectangle(0.02, 0.03), ALUMINIUM, {"orientation": (0, 1, 0)}),
        2700 * 2 * 6e-4,
    ),
}


@pytest.mark.parametrize("family", MESHES)
def test_rigid_mesh_has_mass_and_centre_of_elements(family: str):
    mesh, member, mass = MESHES[family]
    structure = build_structure(mesh(), [member])
    body = reduce_structure(structure, rigid_set(structure.n_dof))
    assert body.n_modes == body.n_shapes == 0 and body.moments.mass == pytest.approx(mass)
    assert body.moments.center_of_mass()[:2] == pytest.approx([1.0, 0.4])
    across = body.moments.inertia()[1, 1] - mass * np.sum(body.moments.center_of_mass()[[0, 2]] ** 2)
    assert across == pytest.approx(mass * (4.0 + (0.16 if family == "solid" else 0.0)) / 12, rel=1e-3)
