"""Strain tensors and strain fields against full finite elements."""

from __future__ import annotations

import numpy as np
import pytest
from support.nonlinear_models import STRUCTURES, bent_beam, bfs, folded_plate, plate, solid, tapered_beam

from femflex.body import StrainTensors
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import FullSection, Rectangle
from femflex.fem.sections.laminates import Lamina, Ply, isotropic, sandwich
from femflex.mesh import line, rectangle
from femflex.reduction import cantilever_modes, free_free_modes, strain_tensors
from femflex.reduction.beams.strain_points import strain_field
from femflex.reduction.mode_warnings import frequency_errors

N = 6


@pytest.fixture(scope="module", params=STRUCTURES)
def reduced(request):
    """A structure, random shapes of a metre each, and their tensors."""
    structure = STRUCTURES[request.param]()
    phi = np.random.default_rng(1).normal(size=(structure.n_dof, N))
    phi /= np.abs(structure.translation @ phi).max(axis=0)
    return structure, phi, strain_tensors(structure, phi)


@pytest.mark.parametrize("size", [1e-4, 0.1, 30.0])
def test_elastic_force_is_projected_force_of_full_elements(reduced, size):
    structure, phi, tensors = reduced
    elastic = structure.internal_force
    d = size * np.random.default_rng(2).normal(size=N)
    force, tangent = phi.T @ elastic.force(phi @ d), phi.T @ (elastic.tangent(phi @ d) @ phi)
    np.testing.assert_allclose(tensors.force(d), force, atol=1e-13 * np.abs(force).max(), rtol=1e-10)
    np.testing.assert_allclose(tensors.tangent(d), tangent, atol=1e-12 * np.abs(tangent).max(), rtol=1e-10)
    assert tensors.energy(d) == pytest.approx(elastic.energy(phi @ d), rel=1e-12)


def test_the_elastic_force_is_the_difference_of_the_full_energy(reduced):
    structure, phi, tensors = reduced
    elastic, h = structure.internal_force, 1e-3
    d = np.random.default_rng(3).normal(size=N)
    at, weight = np.array([-2, -1, 1, 2]) * h, np.array([1, -8, 8, -1]) / (12 * h)
    slope = [weight @ [elastic.energy(phi @ (d + t * way)) for t in at] for way in np.eye(N)]
    force = tensors.force(d)
    np.testing.assert_allclose(force, slope, atol=1e-8 * np.abs(force).max())


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


def test_a_clamped_beam_bent_far_stores_as_much_as_without_shear():
    """The energy of five times its thickness, most of it that of the stretch."""
    energies = []
    for shear in (False, True):
        structure = beam(Rectangle(0.02, 0.01), n=4, shear=shear, order=6)
        phi = cantilever_modes(structure, WALLS, 1).phi
        bend = phi / np.linalg.norm((structure.translation @ phi).reshape(-1, 3), axis=1).max()
        energies.append(strain_tensors(structure, bend).energy(np.array([0.05])))
    assert energies[1] == pytest.approx(energies[0], rel=5e-3)


FAMILIES = {
    "beam": bent_beam,
    "tapered": tapered_beam,
    "plate": plate,
    "folded": folded_plate,
    "bfs": bfs,
    "solid": solid,
}


def energy(parts, y):
    return sum(float(part.energy(y)[0] @ part.weight) for part in parts)


def smooth_shapes(structure, n=3):
    """Answers to random loads, of largest displacement 1 m."""
    load = np.random.default_rng(4).standard_normal((structure.n_dof, n))
    K, M = structure.K.toarray(), structure.M.toarray()
    soft = K + 1e-3 * K.diagonal().max() / M.diagonal().max() * M
    phi = np.linalg.solve(soft, structure.M @ load)
    return phi / np.abs(structure.translation @ phi).max(axis=0)


@pytest.mark.parametrize("family", FAMILIES)
def test_energy_density_integrates_to_the_strain_energy(family):
    structure = FAMILIES[family]()
    phi, y = smooth_shapes(structure), np.array([0.03, -0.02, 0.05])
    tensors = strain_tensors(structure, phi)
    linear = StrainTensors.linear(tensors.V1)
    assert energy(strain_field(structure, phi, False), y) == pytest.approx(linear.energy(y), rel=1e-6)
    assert tensors.energy(y) > 1.5 * linear.energy(y)
    rel = 2e-4 if family == "bfs" else 1e-6  # its bending is seen where its stretch is sampled, at 2 x 2 points
    assert energy(strain_field(structure, phi, True), y) == pytest.approx(tensors.energy(y), rel=rel)


def test_rigid_rotation_of_solid_strains_only_with_linear_strain():
    structure = solid()
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    u = structure.mesh.points @ (turn - np.eye(3)).T
    phi = np.linalg.lstsq(structure.translation.toarray(), u.reshape(-1, 1), rcond=None)[0]
    (whole,), (linear,) = strain_field(structure, phi, True), strain_field(structure, phi, False)
    assert np.abs(whole.strains(np.ones(1))).max() < 1e-6
    assert linear.strains(np.ones(1))[0, :, 0] == pytest.approx(np.cos(angle) - 1, rel=1e-5)


METAL_SHEAR = Material(70e9, 0.3, 2700.0)
SANDWICH = sandwich(Ply(Lamina.isotropic(METAL_SHEAR), 0.0005), 0.02, Lamina.core(50.0, 30e6))
ELEMENTS = {"dkt": ("plate", "triangle", {"element": "dkt"}), "bfs": ("plate_bfs", "quad", {})}
HARD = {"left": ("x", "y", "z", "rx"), "right": ("z", "rx"), "bottom": ("y", "z", "ry"), "top": ("z", "ry")}


def plate(section, element: str, n: int, width: float = 0.8):
    family, cell, options = ELEMENTS.get(element, ("plate", "triangle", {}))
    return build_structure(rectangle(1.0, width, n, n, cell), [Member("surface", family, section, None, options)])


@pytest.mark.parametrize(("element", "n", "within"), [("dkt", 16, 0.15), ("bfs", 12, 0.05)])
def test_simply_supported_sandwich_in_closed_form(element, n, within):
    """w^2 = D k^4 / (m (1 + D k^2 / S)), without rotary inertia: thin plates are sqrt(1 + D k^2 / S) high."""
    structure = plate(SANDWICH, element, n)
    errors, which = frequency_errors(structure, cantilever_modes(structure, HARD, 4))
    k2 = np.sort([np.pi**2 * (i**2 + (j / 0.8) ** 2) for i in (1, 2) for j in (1, 2)])[:3]
    expected = np.sqrt(1 + SANDWICH.D[0, 0] * k2 / SANDWICH.S[0, 0]) - 1
    assert which.tolist() == [0, 1, 2]
    np.testing.assert_allclose(errors, expected, rtol=within)


def test_torsion_of_a_thick_free_strip():
    """St. Venant: the torsion of a strip is softer by 0.630 h / b, its frequency of a free plate by half of that."""
    h, b = 0.02, 0.2
    structure = plate(isotropic(h, METAL_SHEAR), "bfs", 12, b)
    modes = free_free_modes(structure, 3)
    errors, which = frequency_errors(structure, modes)
    twists = [np.abs(structure.rotation[::3] @ modes.phi[:, k]).max() for k in which]
    ends = [np.abs(structure.rotation[1::3] @ modes.phi[:, k]).max() for k in which]
    torsion = int(np.argmax(np.array(twists) / ends))
    assert errors[torsion] == pytest.approx(1 / np.sqrt(1 - 0.63 * h / b) - 1, rel=0.2)
