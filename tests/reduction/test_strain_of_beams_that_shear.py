"""Nonlinear strain and initial stress of beams that shear: their energies, and slender ones as without shear."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import FullSection, Rectangle
from femflex.mesh import line
from femflex.reduction import cantilever_modes, relaxed, strain_tensors
from femflex.reduction.strain.initial_stress import largest_strain, stress_energy

METAL = Material(70e9, 0.3, 2700.0)
WALLS = ("start", "end")


def coupled_section():
    """A section whose bending and twist are coupled to shear."""
    C = np.diag([4e6, 2e6, 1.5e6, 900.0, 1200.0, 1500.0])
    for i, j, share in ((1, 5, 0.3), (2, 4, -0.2), (0, 2, 0.1), (1, 3, 0.25), (0, 3, 0.15)):
        C[i, j] = C[j, i] = share * np.sqrt(C[i, i] * C[j, j])
    return FullSection(C, np.diag([1.2, 1.2, 1.2, 0.03, 0.01, 0.02]))


def beam(section, n=3, **options):
    mesh = line([[0, 0, 0], [1.0, 0.2, -0.1]], n)
    return build_structure(mesh, [Member("line", "beam", section, METAL, {"orientation": (0, 1, 0), **options})])


@pytest.mark.parametrize(
    ("section", "options"),
    [
        (Rectangle(0.05, 0.03), {"shear": True}),
        (Rectangle(0.05, 0.03), {"offset": (0.01, 0.02), "shear_centre": (0.0, -0.01)}),
        (coupled_section(), {}),
    ],
)
def test_strain_tensors_hold_the_whole_energy(section, options):
    structure = beam(section, **options)
    phi = 1e-2 * np.random.default_rng(3).normal(size=(structure.n_dof, 4))
    tensors, V = strain_tensors(structure, phi), structure.internal_force
    for d in np.random.default_rng(4).normal(size=(3, 4)):
        assert tensors.energy(d) == pytest.approx(V.energy(phi @ d), rel=1e-9)
        force = phi.T @ V.force(phi @ d)
        assert tensors.force(d) == pytest.approx(force, rel=1e-8, abs=1e-8 * np.abs(force).max())


def test_the_energy_of_coupled_strains_is_that_of_all_of_them_at_every_point():
    """int eps.C eps / 2 with the full matrix C, of displacements so small that strain is quadratic in them."""
    structure = beam(coupled_section())
    x = 1e-3 * np.random.default_rng(5).normal(size=structure.n_dof)
    whole = 0.0
    for block in structure.strain:
        part = block.sampled(slice(None))
        g = part.gradients((structure.T @ x)[:, None], slice(None))[..., 0]
        eps = g @ part.linear_map.T + np.einsum("eqg,sgh,eqh->eqs", g, part.quadratic_map, g) / 2
        whole += np.einsum("eq,eqs,eqst,eqt->", part.weight, eps, part.elastic, eps) / 2
    assert structure.internal_force.energy(x) == pytest.approx(whole, rel=1e-9)


def test_a_slender_beam_under_tension_is_as_without_shear():
    both = [beam(Rectangle(0.012, 0.01), shear=shear, prestress=300.0) for shear in (False, True)]
    plain, sheared = (cantilever_modes(structure, WALLS, 4).omega for structure in both)
    np.testing.assert_allclose(sheared, plain, rtol=3e-3)
    assert (sheared < plain).all()
    slack = cantilever_modes(beam(Rectangle(0.012, 0.01), shear=True), WALLS, 1).omega[0]
    assert sheared[0] > 1.03 * slack


def test_energy_and_strain_of_a_prestress_are_those_of_its_axial_force():
    EA, pull = 70e9 * 0.05 * 0.03, 4e3
    given = beam(Rectangle(0.05, 0.03), shear=True, prestress=pull)
    left = relaxed(given, WALLS)
    length = np.sqrt(1.05)
    assert stress_energy(given) == pytest.approx(pull**2 * length / (2 * EA), rel=1e-12)
    assert stress_energy(left) == pytest.approx(pull**2 * length / (2 * EA), rel=1e-9)
    assert largest_strain(given, left) == pytest.approx(pull / EA, rel=1e-9)


def test_a_clamped_beam_bent_far_stores_as_much_as_without_shear():
    """The energy of five times its thickness, most of it that of the stretch."""
    energies = []
    for shear in (False, True):
        structure = beam(Rectangle(0.02, 0.01), n=4, shear=shear, order=6)
        phi = cantilever_modes(structure, WALLS, 1).phi
        bend = phi / np.linalg.norm((structure.translation @ phi).reshape(-1, 3), axis=1).max()
        energies.append(strain_tensors(structure, bend).energy(np.array([0.05])))
    assert energies[1] == pytest.approx(energies[0], rel=5e-3)
