"""Coarse curved shells: elements on known surfaces, and errors that warnings state."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from support.plate_models import frequencies
from support.shell_problems import hemisphere, pinched_cylinder, ratio

from femflex.fem import Material, Member, build_structure
from femflex.mesh import Mesh, annulus, rectangle
from femflex.mesh.raised import raised
from femflex.warning import PhysicsWarning

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


def test_coarse_four_node_elements_of_a_pinched_cylinder_are_warned_of_with_their_error():
    """8 x 8: 2 sqrt(R h) long, half as curved at the ends. The warning names 1.3 times the stiffness, 1.32 is found."""
    problem = pinched_cylinder("quad", 8)
    with pytest.warns(PhysicsWarning, match="48 of 64 four-node elements are longer than 1.5 sqrt") as given:
        found = ratio(problem)
    named = float(re.search(r"up to ([\d.]+) times as stiff", str(given[0].message))[1])
    assert named == pytest.approx(1 / found, rel=0.1)


@pytest.mark.parametrize(("cell", "n"), [("quad", 16), ("quad9", 4)])
def test_finer_and_second_order_elements_are_not_warned_of(cell, n):
    with warnings.catch_warnings():
        warnings.simplefilter("error", PhysicsWarning)
        ratio(pinched_cylinder(cell, n))


def test_low_modes_on_elements_of_twice_the_length_are_within_a_hundredth():
    """A quarter of a cylinder, R / h = 400, clamped at one curved edge, on elements of 2 sqrt(R h); at 4 it is off."""

    def hertz(cell: str, n: int):
        m = rectangle(1.6, np.pi / 2, n, n, cell)
        x, angle, _ = m.points.T
        m = Mesh(np.stack([x, np.cos(angle), np.sin(angle)], axis=1), m.cells, m.cell_groups, m.point_groups)
        s = build_structure(m, [Member("surface", "shell", 0.0025, Material(70e9, 0.3, 2700.0))])
        return frequencies(s, s.clamped_dofs("left"), 4)

    exact = hertz("quad9", 16)
    with pytest.warns(PhysicsWarning, match="low modes bend smoothly and are within 1 % up to 2 sqrt"):
        np.testing.assert_allclose(hertz("quad", 16), exact, rtol=0.012)
        assert np.abs(hertz("quad", 8) / exact - 1).max() > 0.05
