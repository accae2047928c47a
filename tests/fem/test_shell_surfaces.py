"""Shells on surfaces that are known: nodes and directors on them, and published answers on the same meshes."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import frequencies
from support.shell_problems import hemisphere, pinched_cylinder, ratio

from femflex.fem import Material, Member, build_structure
from femflex.mesh import Mesh, annulus
from femflex.mesh.raised import raised

CYLINDER, SPHERE = "y**2 + z**2 - 300**2", "x**2 + y**2 + z**2 - 100"
METAL = Material(70e9, 0.3, 2700.0)


@pytest.mark.sampled(2)
@pytest.mark.filterwarnings("ignore:.*four-node elements are longer:femflex.warning.PhysicsWarning")
@pytest.mark.parametrize("cell", ["quad", "quad9", "triangle6"])
@pytest.mark.parametrize(
    ("problem", "surface", "abs"), [(pinched_cylinder, CYLINDER, 0.08), (hemisphere, SPHERE, 0.02)]
)
def test_published_answers_with_the_normals_of_the_surface(problem, surface, abs, cell):
    given = problem(cell, 16 if cell != "quad9" else 8)
    with_normals, without = ratio(given, surface=surface), ratio(given)
    assert with_normals == pytest.approx(1.0, abs=abs if cell == "quad" else 0.02)
    assert with_normals == pytest.approx(without, abs=0.03)


def dish(n: int, cell: str, lift) -> Mesh:
    """A paraboloid of F = 1 m between radii 0.2 and 1 m."""
    flat = annulus(0.2, 1.0, n, 6 * n, cell)
    x, y, _ = flat.points.T
    return Mesh(np.stack([x, y, lift(x, y)], axis=1), flat.cells, flat.cell_groups, flat.point_groups)


def test_frequencies_of_a_reflector_meshed_by_facets():
    """Second-order elements with middle nodes on chords, laid onto the surface, against exact middle nodes."""
    member = {"surface": "x**2 + y**2 - 4 * z"}

    def hertz(mesh, **options):
        s = build_structure(mesh, [Member("surface", "shell", 0.002, METAL, options)])
        return s, frequencies(s, s.clamped_dofs("inner"), 3)

    exact = hertz(dish(4, "quad9", lambda x, y: (x * x + y * y) / 4))[1]
    flat = dish(4, "quad", lambda x, y: (x * x + y * y) / 4)
    facets = raised(flat, {"quad": np.arange(len(flat.cells["quad"]))})
    s, laid = hertz(facets, **member)
    n = len(s.mesh.points)
    off = n - len(flat.points)  # all but the corners
    assert f"{off} of {n} nodes of shell on group 'surface' are moved onto its surface" in s.notes[1]
    x, y, z = s.mesh.points.T
    np.testing.assert_allclose(z, (x * x + y * y) / 4, atol=1e-10)
    np.testing.assert_allclose(laid, exact, rtol=0.02)
    assert np.abs(hertz(facets)[1] / exact - 1).min() > 0.15
