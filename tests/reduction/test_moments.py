"""Mass moments and stiffness from the tables against M, K, closed forms and a cloud of points."""

from __future__ import annotations

import numpy as np
import pytest
from support.reduction_examples import ALUMINIUM, LENGTH, MASS, bent_boom, frame, slender_beam

from femflex.fem import Member, PointMass, build_structure, tables
from femflex.fem.sections import Tube
from femflex.mesh.generators import line
from femflex.reduction import cantilever_modes, reduce_structure, rigid_set
from femflex.reduction.inertia import moments
from femflex.reduction.inertia.mass_matrix import KnownMoments
from femflex.reduction.inertia.moments import linear_stiffness, mass_moments, point_moments, strain_stiffness


@pytest.fixture(scope="module", params=["boom", "frame"])
def structure(request):
    return {"boom": bent_boom, "frame": frame}[request.param]()


def random_shapes(structure, n, seed=0):
    phi = np.random.default_rng(seed).standard_normal((structure.n_dof, n))
    return phi


def test_elastic_mass_is_phi_m_phi_to_rounding(structure):
    phi = random_shapes(structure, 6)
    found = mass_moments(structure.inertia, structure.T @ phi).elastic_mass()
    expected = phi.T @ (structure.M @ phi)
    assert np.abs(found - expected).max() < 1e-13 * np.abs(expected).max()


def test_elastic_mass_of_modes_is_the_identity(structure):
    group = structure.mesh.groups[-1]
    phi = cantilever_modes(structure, "start" if "start" in structure.mesh.groups else "feet", 8).phi
    assert group and np.abs(mass_moments(structure.inertia, structure.T @ phi).elastic_mass() - np.eye(8)).max() < 1e-12


def test_stiffness_from_the_strain_table_is_phi_k_phi(structure):
    phi = random_shapes(structure, 5)
    expected = linear_stiffness(structure.K, phi)
    assert (
        np.abs(strain_stiffness(structure.strain, structure.T @ phi) - expected).max() < 1e-12 * np.abs(expected).max()
    )


def test_stiffness_of_modes_is_omega_squared(structure):
    modes = cantilever_modes(structure, "start" if "start" in structure.mesh.groups else "feet", 8)
    V1 = linear_stiffness(structure.K, modes.phi)
    assert np.abs(V1 / np.outer(modes.omega, modes.omega) - np.eye(8)).max() < 1e-9
    assert np.array_equal(V1, V1.T)


def test_chunks_of_elements_change_nothing_but_memory(structure, monkeypatch):
    phi = structure.T @ random_shapes(structure, 4)
    whole, V1 = mass_moments(structure.inertia, phi), strain_stiffness(structure.strain, phi)
    monkeypatch.setattr(tables, "CHUNK_VALUES", 3000)
    pieces = mass_moments(structure.inertia, phi)
    assert pieces.mass == pytest.approx(whole.mass, rel=1e-14)
    assert np.abs(pieces.second - whole.second).max() < 1e-13 * np.abs(whole.second).max()
    assert np.abs(strain_stiffness(structure.strain, phi) - V1).max() < 1e-13 * np.abs(V1).max()


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


def test_point_moments_take_any_points():
    rng = np.random.default_rng(5)
    dm, rho, shapes = rng.random(20), rng.standard_normal((20, 3)), rng.standard_normal((20, 3, 2))
    m = point_moments(dm, rho, shapes)
    z = np.concatenate([rho[:, None], shapes.transpose(0, 2, 1)], axis=1)  # point, shape, axis
    assert m.first == pytest.approx(np.einsum("p,pAa->Aa", dm, z))
    assert m.second == pytest.approx(np.einsum("p,pAa,pBb->AaBb", dm, z, z))


def test_a_body_too_large_for_memory_is_refused(monkeypatch):
    structure = bent_boom()
    monkeypatch.setattr(moments, "MOST_BYTES", 1e3)
    with pytest.raises(ValueError, match=r"mass moments of 5 shapes would take 2.59e-06 GB; a body may take 1e-06 GB"):
        mass_moments(structure.inertia, structure.T @ random_shapes(structure, 5))


def test_known_moments_of_dofs_are_those_of_the_points_in_any_shapes():
    """Sides count too: int r_i x r_j dm of two shapes, by which they turn each other, changes sign with their order."""
    rng = np.random.default_rng(3)
    dm, rho, rows = rng.uniform(0.5, 1.0, 4), rng.normal(size=(4, 3)), rng.normal(size=(4, 3, 5))
    phi = rng.normal(size=(5, 3))
    found = KnownMoments(point_moments(dm, rho, rows)).moments(phi)
    expected = point_moments(dm, rho, rows @ phi)
    assert found.mass == expected.mass
    np.testing.assert_allclose(found.first, expected.first, atol=1e-12)
    np.testing.assert_allclose(found.second, expected.second, atol=1e-12)
    assert abs(expected.second - expected.second.transpose(2, 1, 0, 3)).max() > 0.1
