import warnings

import numpy as np
import pytest

from femflex.mesh import Mesh, box, check, describe, line, rectangle
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import quadrature, qualities, sizes
from femflex.warning import PhysicsWarning


@pytest.mark.parametrize("name", CELL_TYPES)
def test_shape_functions_are_one_at_their_node_and_differentiate_rightly(name):
    kind = CELL_TYPES[name]
    assert kind.interpolation(kind.nodes) == pytest.approx(np.eye(len(kind.nodes)), abs=1e-12)
    rng = np.random.default_rng(2)
    at = rng.uniform(0.1, 0.3, (5, kind.dimension))
    h = 1e-6
    for axis in range(kind.dimension):
        step = h * np.eye(kind.dimension)[axis]
        slope = (kind.interpolation(at + step) - kind.interpolation(at - step)) / (2 * h)
        assert kind.gradients(at)[..., axis] == pytest.approx(slope, abs=1e-8)


def test_quadrature_is_exact_for_the_volume_and_moments_of_the_unit_cells():
    for shape, volume in {
        "line": 1,
        "triangle": 1 / 2,
        "quad": 1,
        "tetra": 1 / 6,
        "hexahedron": 1,
        "wedge": 1 / 2,
    }.items():
        assert quadrature(shape, 3)[1].sum() == pytest.approx(volume, rel=1e-14)
    at, weight = quadrature("tetra", 3)
    assert weight @ (at[:, 0] * at[:, 1] * at[:, 2]) == pytest.approx(1 / 720, rel=1e-13)  # a! b! c! / (a+b+c+3)!


def test_quality_is_one_for_equal_edges_and_the_closed_form_for_a_stretched_cell():
    equilateral = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0]])
    assert qualities(equilateral, "triangle", np.array([[0, 1, 2]]))[0] == pytest.approx(1, rel=1e-14)
    stretched = rectangle(3, 1, 1, 1, "quad")
    assert qualities(stretched.points, "quad", stretched.cells["quad"])[0] == pytest.approx(2 * 3 / (9 + 1))
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    q = qualities(regular, "tetra", np.array([[0, 1, 2, 3], [0, 2, 1, 3]]))
    assert sorted(q) == pytest.approx([-1, 1], rel=1e-14)  # one of the two is inside out


def test_cells_without_size_are_refused_with_their_place():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], {"triangle": [[0, 1, 3], [0, 1, 2]], "line": [[0, 0]]})
    with pytest.raises(ValueError) as error:
        check(mesh, "panel.msh")
    text = str(error.value)
    assert text.startswith(
        "panel.msh: 1 of 2 cells of type triangle have no area, the first is number 1 at (1, 0, 0) m"
    )
    assert "1 of 1 cells of type line have no length" in text


def test_coordinates_that_overflow_are_refused_with_their_place():
    mesh = Mesh(np.array([[0, 0, 0], [1e160, 0, 0]]), {"line": np.array([[0, 1]])})
    with pytest.raises(ValueError, match=r"x: 1 of 2 points have coordinates above 1e\+30 m, the first is number 1 at"):
        check(mesh, "x", strict=False)


def test_the_size_that_counts_as_none_is_relative():
    small = rectangle(1e-6, 1e-6, 1, 1, "quad")
    check(small)
    needle = Mesh([[0, 0, 0], [1, 0, 0], [0.5, 1e-13, 0]], {"triangle": [[0, 1, 2]]})
    with pytest.raises(ValueError, match="have no area"):
        check(needle)


def test_solids_turned_inside_out_and_folded_quadrilaterals_are_refused():
    good = box(1, 1, 1, 1, 1, 1)
    nodes = good.cells["hexahedron"][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    with pytest.raises(ValueError, match="1 of 1 cells of type hexahedron are folded or turned inside out") as said:
        check(Mesh(good.points, {"hexahedron": nodes}))
    assert "have no volume" not in str(said.value)
    dart = Mesh([[0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0]], {"quad": [[0, 1, 2, 3]]})
    with pytest.raises(ValueError, match="1 of 1 cells of type quad are folded"):
        check(dart)


def test_loose_and_coincident_points_are_warned_of_with_both_numbers():
    mesh = line([[0, 0, 0], [3, 0, 0]], 3)
    loose = Mesh([*mesh.points, [9, 9, 9]], mesh.cells, point_groups={"beacon": [4]})
    with pytest.warns(
        PhysicsWarning, match=r"1 of 5 points belong to no cell; some are in the point groups \['beacon'\]"
    ):
        check(loose)
    other = line([[3, 0, 0], [3, 1, 0]], 1)
    with pytest.warns(
        PhysicsWarning, match=r"1 pairs of points lie within 3.16e-09 m .*3.16228 m across.*\(3, 0, 0\) m"
    ):
        check(mesh.merged(other))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check(mesh.merged(other, tolerance=1e-6))


def test_the_summary_tells_points_extent_cells_quality_and_groups():
    mesh = rectangle(3, 1, 1, 1, "quad").with_groups(cells={"nothing": {}})
    text = describe(mesh)
    assert text == mesh.summary()
    lines = {" ".join(row.split()) for row in text.splitlines()}
    assert "points 4" in lines
    assert "extent x 0 .. 3 m y 0 .. 1 m z 0 .. 0 m" in lines
    assert "quad 1 area 3 m^2, each 3 .. 3; quality 0.60, worst 0.60 at (1.5, 0.5, 0)" in lines
    assert "line 4 length 8 m, each 1 .. 3" in lines
    assert "left 1 line (length 1 m), 2 points" in lines
    assert "nothing empty" in lines
    assert "top_right 1 point at (3, 1, 0) m" in lines


def test_sizes_of_curved_cells_come_from_their_shape_functions():
    arc = line(lambda s: [np.cos(s), np.sin(s), 0], 4, "line3")
    assert sizes(arc.points, "line3", arc.cells["line3"]).sum() == pytest.approx(1, rel=1e-5)  # chords: 3e-3
