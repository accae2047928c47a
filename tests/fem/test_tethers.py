"""The tether family: strings, strain energy to fourth order, large rotations, and what it refuses."""

import numpy as np
import pytest

from femflex.fem import Material, Member, build_structure
from femflex.fem.deflected import deflected
from femflex.fem.sections import CableSection, Circle
from femflex.mesh import line
from femflex.reduction import cantilever_modes, reduce_structure
from femflex.warning import PhysicsWarning

CORD = CableSection(1e6, 0.3)
METAL = Material(7e10, 0.3, 2700.0)
EDGES = ("start", "end")


def string(tension=50.0, n=8, section=CORD, cell="line", **options):
    """A string of 2 m along x."""
    mesh = line([[0, 0, 0], [2, 0, 0]], n, cell)
    return build_structure(mesh, [Member("line", "tether", section, METAL, {"prestress": tension, **options})])


@pytest.mark.parametrize("cell", ["line", "line3"])
def test_frequencies_of_a_string_are_those_of_waves_at_the_root_of_tension_over_mass(cell):
    found = cantilever_modes(string(cell=cell), EDGES, 6).omega
    assert found == pytest.approx(np.repeat([1, 2, 3], 2) * np.pi / 2 * np.sqrt(50 / 0.3), rel=1e-7)


def test_a_round_bar_counts_by_its_axial_stiffness_and_mass():
    bar = string(section=Circle(1e-3))
    assert bar.inertia[0].dm.sum() == pytest.approx(2 * 2700 * np.pi * 1e-6)
    stretch = cantilever_modes(bar, EDGES, 90).omega
    first = np.pi / 2 * np.sqrt((7e10 + 50 / np.pi / 1e-6) / 2700)  # tension adds to the stiffness along, too
    assert np.abs(stretch / first - 1).min() < 1e-9


def test_sections_may_vary_along_it():
    mesh = line([[0, 0, 0], [2, 0, 0]], 10)
    member = Member("line", "tether", CableSection("1e6 * (1 + s/L)", "0.3 * (1 + s/L)"), None, {"prestress": 50.0})
    structure = build_structure(mesh, [member])
    assert structure.inertia[0].dm.sum() == pytest.approx(0.3 * 2 * 1.5)
    x, weight = np.polynomial.legendre.leggauss(60)
    x, weight = x + 1, weight
    functions = np.array([np.sin(k * np.pi * x / 2) for k in range(1, 21)])  # Ritz, of the ends' sines
    M = np.einsum("kq,lq,q->kl", functions, functions, weight * 0.3 * (1 + x / 2))
    K = np.diag([50 * (k * np.pi / 2) ** 2 for k in range(1, 21)])
    exact = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real))
    assert cantilever_modes(structure, EDGES, 4).omega[::2] == pytest.approx(exact[:2], rel=1e-7)


def test_points_and_centre_of_mass_of_a_deflected_tether_are_where_it_is():
    """A rope drawn aside by half its length: nodes moved along y, ends kept, the centre by the trapezoidal rule."""
    structure = string(tension=0.0, n=16)
    aside = np.zeros(structure.mesh.points.shape)
    aside[:, 1] = np.sin(np.pi * structure.mesh.points[:, 0] / 2)
    x = structure.translation.T @ aside.ravel()
    moved = deflected(structure, x)
    np.testing.assert_allclose(moved.mesh.points, structure.mesh.points + aside, atol=1e-14)
    with pytest.warns(PhysicsWarning, match="leaves .* N unbalanced"):  # its shape is given, not found
        body = reduce_structure(moved, cantilever_modes(moved, EDGES, 1), turning=())
    y = aside[np.argsort(structure.mesh.points[:, 0]), 1]
    assert body.moments.mass == pytest.approx(0.6, rel=1e-12)
    assert body.moments.first[0, 1] == pytest.approx(0.6 * (y[:-1] + y[1:]).sum() / 32, rel=1e-12)
