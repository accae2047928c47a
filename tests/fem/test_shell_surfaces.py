"""Shells on surfaces that are known: nodes and directors on them, and published answers on the same meshes."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import frequencies
from support.shell_problems import hemisphere, mapped, pinched_cylinder, ratio

from femflex.fem import Material, Member, build_structure
from femflex.mesh import Mesh, annulus, rectangle
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


@pytest.mark.filterwarnings("ignore:.*four-node elements are longer:femflex.warning.PhysicsWarning")
def test_directors_are_exact_at_edges_and_shared():
    """A cylinder of few elements: normals at all nodes are radial, where facets are half an element off at the edge."""
    flat = rectangle(2.0, np.pi / 2, 2, 3, "quad")
    mesh = mapped(flat, lambda p: np.stack([p[:, 0], np.cos(p[:, 1]), np.sin(p[:, 1])], axis=1))
    for surface, off in (("y**2 + z**2 - 1", 1e-9), (None, np.radians(15) * 0.9)):
        s = build_structure(mesh, [Member("surface", "shell", 0.01, METAL, {"surface": surface})])
        V = s.inertia[0].V.reshape(-1, 3)
        radial = s.mesh.points[mesh.cells["quad"].ravel()] * [0, 1, 1]
        angle = np.arccos(np.clip(np.abs(np.sum(V * radial, axis=1)), 0, 1)).max()
        assert angle <= 3e-8 if surface else angle > off


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


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        ("y**2 + z**2 - 4", "8 of 8 nodes lie off the surface .* by 1 m, over 10% of its element's side"),
        ("y**2 + z**2 - R**2", "surface: formula .* holds 'R'; it may use the names"),
        ("1 + 0 * x", "has no normal at .* where its gradient is zero"),
        (3.0, "give a formula of x, y and z that is zero on the surface"),
    ],
)
def test_surfaces_that_are_not_there_are_refused(surface, words):
    flat = rectangle(2.0, np.pi / 2, 1, 3, "quad")
    mesh = mapped(flat, lambda p: np.stack([p[:, 0], np.cos(p[:, 1]), np.sin(p[:, 1])], axis=1))
    with pytest.raises(ValueError, match=words):
        build_structure(mesh, [Member("surface", "shell", 0.01, METAL, {"surface": surface})])


def two_cells(heights) -> Mesh:
    """Cells of 2 x 2 m and 0.5 x 2 m side by side, with heights of the nodes (x, y)."""
    points = [(x, y, heights.get((x, y), 0.0)) for x in (0.0, 2.0, 2.5) for y in (0.0, 2.0)]
    cells = {"quad": np.array([[0, 2, 3, 1], [2, 4, 5, 3]])}
    return Mesh(points, cells, {"surface": {"quad": [0, 1]}})


def on_surface(mesh, surface):
    return build_structure(mesh, [Member("surface", "shell", 0.01, METAL, {"surface": surface})])


def test_nodes_that_are_moved_are_counted_with_the_largest_distance():
    s = on_surface(two_cells({(0.0, 2.0): 0.15, (2.5, 0.0): -0.04}), "3 * z - 0.06 * x")
    x, _, z = s.mesh.points.T
    np.testing.assert_allclose(z, 0.02 * x, atol=1e-12)
    most = 0.15 / np.hypot(1, 0.02)
    assert s.notes == (f"5 of 6 nodes of shell on group 'surface' are moved onto its surface, by up to {most:.3g} m",)


def test_nodes_off_the_surface_are_judged_by_the_longest_side_they_have():
    """Every node has a side of 2 m: 0.19 m passes, 0.21 m does not; the worst is named with its place."""
    assert on_surface(two_cells({(2.5, 0.0): 0.19}), "z").notes[0].endswith("by up to 0.19 m")
    with pytest.raises(ValueError) as refusal:
        on_surface(two_cells({(0.0, 2.0): 0.21, (2.5, 0.0): -0.25, (2.0, 0.0): 0.1}), "z")
    assert str(refusal.value) == (
        "shell on group 'surface': 2 of 6 nodes lie off the surface 'z', the node at (2.5, 0, -0.25) m by 0.25 m, over "
        "10% of its element's side; correct the formula or leave it out"
    )
    small = rectangle(1.0, 0.25, 4, 1, "quad")
    points = np.concatenate([small.points, [[2.0, 0, 0.3], [2.0, 1.0, 0]]])
    points[small.nearest_point([0, 0, 0]), 2] = 0.06  # more of its side than the higher node has
    near, far = small.nearest_point([1.0, 0, 0]), small.nearest_point([1.0, 0.25, 0])
    cells = np.concatenate([small.cells["quad"], [[near, len(points) - 2, len(points) - 1, far]]])
    mesh = Mesh(points, {"quad": cells}, {"surface": {"quad": np.arange(5)}})
    with pytest.raises(ValueError, match=r"2 of 12 nodes lie off .* the node at \(2, 0, 0.3\) m by 0.3 m"):
        on_surface(mesh, "z")
    points[-2, 2] = 0.15
    mesh = Mesh(points, {"quad": cells}, {"surface": {"quad": np.arange(5)}})
    with pytest.raises(ValueError, match=r"2 of 12 nodes lie off .* the node at \(0, 0, 0.06\) m by 0.06 m"):
        on_surface(mesh, "z")


def test_a_surface_that_is_nowhere_is_left_after_one_extent_of_the_mesh():
    """exp(-z) is zero nowhere; every step of Newton rises by 1 m, and four pass the diagonal of sqrt(10.25) = 3.2 m."""
    with pytest.raises(ValueError, match=r"6 of 6 nodes lie off the surface 'exp\(-z\)', .* m by 4 m, over 10%"):
        on_surface(two_cells({}), "exp(-z)")


def test_the_place_without_a_normal_is_named():
    with pytest.raises(ValueError) as refusal:
        on_surface(two_cells({}), "x**2 + y**2 + z**2")
    assert str(refusal.value) == (
        "shell on group 'surface': surface 'x**2 + y**2 + z**2' has no normal at (0, 0, 0) m, where its gradient "
        "is zero; rewrite it"
    )
