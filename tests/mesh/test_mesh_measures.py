"""Sizes, qualities and orders of distorted cells, against the divergence theorem, hulls and definitions."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import femflex.mesh.memory as memory
from femflex.mesh import Mesh, annulus, box, check, rectangle
from femflex.mesh.cells import CELL_TYPES, CORNERS, EDGES, FACES
from femflex.mesh.contents import Block, Contents, renamed, to_mesh
from femflex.mesh.curves import along_curve, along_polyline
from femflex.mesh.formats import meshio_speaking
from femflex.mesh.gmsh_counts import check_counts
from femflex.mesh.midside import with_middle_nodes
from femflex.mesh.quality import quadrature, qualities, sizes
from femflex.mesh.raised import raised
from femflex.mesh.refine import refined_values
from femflex.mesh.upright import upright
from femflex.warning import PhysicsWarning

UNIT = {
    "tetra": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "hexahedron": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    "wedge": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]],
    "pyramid": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]],
}


def distorted(shape: str, seed: int = 0, n: int = 3):
    """So many cells of a shape with corners moved at random, turned and shifted, each in its own place."""
    rng = np.random.default_rng(seed)
    unit = np.array(UNIT[shape], float)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    cells = [unit + rng.uniform(-0.12, 0.12, unit.shape) for _ in range(n)]
    points = np.concatenate([(1 + 0.3 * k) * cell @ turn.T + [5 * k, 2, -1] for k, cell in enumerate(cells)])
    return points, np.arange(len(points)).reshape(n, -1)


def flux(points, faces):
    """Volume inside bilinear faces: a third of the flux of x, by Gauss points of each."""
    total = 0.0
    g = (1 + np.array([-1, 1]) / np.sqrt(3)) / 2
    for face in faces:
        p = points[face if len(face) == 4 else [*face, face[-1]]]
        for u in g:
            for v in g:
                N = np.array([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])
                du = np.array([-(1 - v), 1 - v, v, -v])
                dv = np.array([-(1 - u), -u, u, 1 - u])
                total += (N @ p) @ np.cross(du @ p, dv @ p) / 4 / 3
    return total


@pytest.mark.parametrize("shape", UNIT)
@pytest.mark.parametrize("seed", [0, 1])
def test_volumes_of_distorted_solids_are_the_flux_through_their_faces(shape: str, seed: int):
    points, nodes = distorted(shape, seed)
    found = sizes(points, shape, nodes)
    assert found == pytest.approx([flux(points, [row[face] for face in FACES[shape]]) for row in nodes], rel=1e-9)
    assert (found > 0).all()
    mirror = sizes(points, shape, nodes[:, CELL_TYPES[shape].mirrored])
    assert mirror == pytest.approx(-found, rel=1e-9)


@pytest.mark.parametrize("cell", [name for name, kind in CELL_TYPES.items() if kind.dimension])
def test_cells_of_any_order_with_straight_edges_have_the_size_of_their_corners(cell: str):
    kind = CELL_TYPES[cell]
    rng = np.random.default_rng(3)
    corners = np.zeros((2, kind.n_corners, 3))
    for k in range(2):
        unit = np.array(UNIT.get(kind.shape, np.pad(kind.nodes[: kind.n_corners], ((0, 0), (0, 3 - kind.dimension)))))
        corners[k] = (unit + rng.uniform(-0.1, 0.1, unit.shape)) * (1 + k)
    weights = CELL_TYPES[kind.corner].interpolation(kind.nodes)
    points = np.einsum("nc,ecx->enx", weights, corners).reshape(-1, 3)
    nodes = np.arange(len(points)).reshape(2, -1)
    plain = sizes(corners.reshape(-1, 3), kind.corner, np.arange(2 * kind.n_corners).reshape(2, -1))
    if kind.dimension == 2 and kind.shape == "quad":
        assert sizes(points, cell, nodes) == pytest.approx(plain, rel=2e-2)  # of a twisted one: Gauss points
    else:
        assert sizes(points, cell, nodes) == pytest.approx(plain, rel=1e-9)
    assert qualities(points, cell, nodes) == pytest.approx(
        qualities(corners.reshape(-1, 3), kind.corner, np.arange(2 * kind.n_corners).reshape(2, -1)), rel=1e-6
    )


IDEAL = {
    "triangle": [[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0]],
    "quad": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    "tetra": [[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0], [0.5, np.sqrt(1 / 12), np.sqrt(2 / 3)]],
    "hexahedron": UNIT["hexahedron"],
    "wedge": [[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (0.5, np.sqrt(0.75)))],
    "pyramid": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, np.sqrt(0.5)]],
}


@pytest.mark.parametrize("shape", IDEAL)
def test_cells_with_equal_edges_have_quality_one_and_stretched_ones_the_mean_ratio(shape: str):
    """Stretched by s along z or x: d s^(2/d) / (d - 1 + s^2), exactly where the ideal Jacobian is a multiple of one."""
    ideal = np.array(IDEAL[shape], float)
    lengths = [np.linalg.norm(ideal[a] - ideal[b]) for a, b in EDGES[shape]]
    assert lengths == pytest.approx([1.0] * len(lengths))
    row = np.arange(len(ideal))[None]
    assert qualities(ideal, shape, row) == pytest.approx([1.0], rel=1e-9)
    assert qualities(7.3 * ideal @ np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]), shape, row) == pytest.approx([1.0])
    d, s = CELL_TYPES[shape].dimension, 2.5
    stretched = ideal * ([s, 1, 1] if d == 2 else [1, 1, s])
    assert qualities(stretched, shape, row) == pytest.approx([d * s ** (2 / d) / (d - 1 + s * s)], rel=1e-9)


def test_the_quality_of_a_cell_is_that_of_its_worst_corner_and_of_each_cell_its_own():
    good, bad = np.array(IDEAL["quad"]), np.array([[0, 0, 0], [1, 0, 0], [0.6, 0.55, 0], [0, 1, 0.0]])
    points = np.concatenate([good, bad + np.array([3, 0, 0])])
    found = qualities(points, "quad", np.array([[0, 1, 2, 3], [4, 5, 6, 7]]))
    each = []
    for k in range(4):
        a, b = bad[(k + 1) % 4] - bad[k], bad[k - 1] - bad[k]
        each.append(2 * np.linalg.norm(np.cross(a, b)) / (a @ a + b @ b))
    assert found == pytest.approx([1.0, min(each)])
    assert min(each) < 0.8 * np.mean(each)
    bent = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0, 0], [1.2, 0, 0.0]])
    assert qualities(bent, "line3", np.array([[0, 1, 2], [0, 1, 3]])).tolist() == [1.0, -1.0]
    assert qualities(bent, "vertex", np.array([[0], [1]])).tolist() == [1.0, 1.0]
    assert sizes(bent, "vertex", np.array([[0], [1]])).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("shape", ["triangle", "wedge", "tetra", "hexahedron"])
def test_quadrature_integrates_polynomials_over_the_unit_cells(shape: str):
    at, weight = quadrature(shape, 4)
    from math import factorial as f

    for a, b, c in ((0, 0, 0), (1, 2, 0), (2, 0, 1), (0, 3, 2), (2, 1, 1)):
        if shape == "triangle":
            exact = f(a) * f(b) / f(a + b + 2)
            found = weight @ (at[:, 0] ** a * at[:, 1] ** b)
        else:
            found = weight @ (at[:, 0] ** a * at[:, 1] ** b * at[:, 2] ** c)
            exact = {
                "tetra": f(a) * f(b) * f(c) / f(a + b + c + 3),
                "wedge": f(a) * f(b) / f(a + b + 2) / (c + 1),
                "hexahedron": 1 / ((a + 1) * (b + 1) * (c + 1)),
            }[shape]
        assert found == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("cell", CELL_TYPES)
def test_further_nodes_are_means_of_their_parents_in_the_order_of_vtk(cell: str):
    kind = CELL_TYPES[cell]
    edges = EDGES[kind.shape]
    assert kind.n_corners == CORNERS[kind.shape] and kind.order == (2 if len(kind.nodes) > kind.n_corners else 1)
    for edge, parents in zip(edges, kind.parents, strict=False):
        assert sorted(parents.tolist()) == sorted(edge)
    swapped = kind.nodes[kind.mirrored]
    if kind.dimension > 1:
        assert swapped == pytest.approx(kind.nodes[:, [1, 0, *range(2, kind.dimension)]])
    assert sorted(kind.mirrored.tolist()) == list(range(len(kind.nodes)))
    assert kind.interpolation(np.full((1, kind.dimension), 0.3)).sum() == pytest.approx(1.0)


def test_checks_name_number_and_place_of_the_first_bad_cell():
    points = [
        [0, 0, 0],
        [1, 0, 0],
        [0, 1, 0],
        [5, 5, 0],
        [6, 5, 0],
        [5.2, 5.2, 0],
        [5, 6, 0],
        [9, 9, 0],
        [9, 9.0, 1e-8],
    ]
    mesh = Mesh(points, {"quad": [[0, 1, 3, 2], [3, 4, 5, 6], [3, 4, 5, 6]], "line": [[7, 8], [0, 1], [2, 2]]})
    with pytest.raises(ValueError) as error:
        check(mesh, "plate")
    said = str(error.value)
    assert "2 of 3 cells of type quad are folded or turned inside out, the first is number 1 at (5.3, 5.3, 0) m" in said
    assert "1 of 3 cells of type line have no length, the first is number 2 at (0, 1, 0) m" in said
    with pytest.warns(PhysicsWarning) as caught:
        check(mesh, "plate", strict=False)
    assert {str(one.message).split(": ")[0] for one in caught} == {"plate"} and len(
        caught
    ) == 3  # two lie close together
    far = Mesh([[0, 0, 0], [-1e31, 0, 0], [0, 0, -2e30]], {"line": [[0, 1]]})
    with pytest.raises(ValueError, match=r"2 of 3 points have coordinates above 1e\+30 m, the first is number 1 at"):
        check(far)
    tiny = rectangle(1e-7, 1e-7, 1, 1, "triangle").merged(box(1e-7, 1e-7, 1e-7, 1, 1, 1, "tetra").moved([1, 0, 0]))
    long = Mesh([[0, 0, 0], [1e7, 0, 0], [0, 1e-3, 0]], {"triangle": [[0, 1, 2]]})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check(tiny)
        check(long)
    two = Mesh([[0, 0, 0], [3, 0, 0], [3, 4, 0], [3, 0, 0], [3, 4, 0], [8, 8, 0]], {"line": [[0, 1], [3, 2], [4, 0]]})
    with pytest.warns(PhysicsWarning) as caught:
        check(two.with_groups(points={"b": [1, 5], "a": [5], "c": [0]}), "x")
    texts = [str(one.message) for one in caught]
    assert any("1 of 6 points belong to no cell; some are in the point groups ['a', 'b']" in text for text in texts)
    assert any("2 pairs of points lie within 1.13e-08 m (the mesh is 11.3137 m across)" in text for text in texts)


def test_only_solids_that_are_regular_in_the_mirror_are_turned():
    cubes = [box(1, 1, 1, 1, 1, 1).moved([2.0 * k, 0, 0]) for k in range(4)]
    points = np.concatenate([cube.points for cube in cubes])
    nodes = np.array([cube.cells["hexahedron"][0] + k * 8 for k, cube in enumerate(cubes)])
    right = nodes.copy()
    nodes[1], nodes[3] = nodes[1, [1, 0, 3, 2, 5, 4, 7, 6]], nodes[3, [4, 5, 6, 7, 0, 1, 2, 3]]
    nodes[2, [0, 6]] = nodes[2, [6, 0]]  # folded either way
    mesh = Mesh(points, {"hexahedron": nodes, "triangle": [[0, 2, 1]]})
    with pytest.warns(
        PhysicsWarning, match=r"m: 2 of 4 cells of type hexahedron .* the first is number 1 at \(2.5, 0."
    ):
        found = upright(mesh, "m")
    assert sizes(points, "hexahedron", found.cells["hexahedron"])[[0, 1, 3]] == pytest.approx([1, 1, 1])
    assert found.cells["hexahedron"][0].tolist() == right[0].tolist()
    assert found.cells["hexahedron"][2].tolist() == nodes[2].tolist()
    assert found.cells["triangle"].tolist() == [[0, 2, 1]]
    with pytest.warns(
        PhysicsWarning, match=r"m: all 1 cells of type hexahedron are inside out \(their volumes are negat"
    ):
        upright(Mesh(points, {"hexahedron": nodes[1:2]}), "m")


def test_missing_middle_nodes_are_shared_by_all_blocks_and_named_by_number():
    points = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [2, 2, 0], [1.2, 1.2, 0], [0.9, 0, 0.1]])
    blocks = [
        Block("triangle6", np.array([[0, 1, 2, 5, -1, -1]])),
        Block("triangle6", np.array([[1, 3, 2, -1, -1, 4], [1, 3, 2, -1, -1, 4]])),
        Block("line3", np.array([[2, 0, -1]])),
        Block("line", np.array([[0, 1]])),
    ]
    with pytest.warns(
        PhysicsWarning, match=r"f: 4 cells of second order have some middle nodes only; 3 nodes are added"
    ):
        found = with_middle_nodes(Contents(points, blocks), "f")
    first, second, third, line = (block.nodes for block in found.blocks)
    assert first[0, 3] == 5 and first[0, 4] == 4 and first[0, 5] == third[0, 2]
    assert second[0].tolist() == second[1].tolist() and len(found.points) == 9
    assert found.points[second[0, 3]].tolist() == [2, 1, 0] and found.points[second[0, 4]].tolist() == [1, 2, 0]
    assert found.points[first[0, 5]].tolist() == [0, 1, 0] and line.tolist() == [[0, 1]]
    whole = Contents(points, blocks[3:])
    assert with_middle_nodes(whole, "f") is whole


def test_contents_become_a_mesh_with_blocks_joined_and_vertices_as_points():
    points = np.array([[0.0, 0], [1, 0], [0, 1], [1, 1], [5, 5], [7, 7]])
    blocks = [
        Block("triangle", np.array([[0, 1, 2]]), {"skin": np.array([0])}),
        Block("vertex", np.array([[3], [5]]), {"mark": np.array([1]), "skin": np.array([0])}),
        Block("triangle", np.array([[1, 3, 2], [0, 1, 3]]), {"skin": np.array([1]), "edge": np.array([0])}),
        Block("line", np.array([[0, 1]]), {"edge": np.array([0])}),
        Block("polygon", np.zeros((3, 7), int)),
    ]
    contents = Contents(points, blocks, {"mark": np.array([1])}, empty=("gone", "mark"), left_out={"MASS": 2})
    with pytest.warns(
        PhysicsWarning, match=r"f: elements not understood and left out: MASS \(2\), polygon \(3\); 6 are kept"
    ):
        mesh = to_mesh(contents, "f")
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [7, 7, 0]]
    assert mesh.cells["triangle"].tolist() == [[0, 1, 2], [1, 3, 2], [0, 1, 3]]
    assert mesh.cell_groups["skin"]["triangle"].tolist() == [0, 2]
    assert {kind: rows.tolist() for kind, rows in mesh.cell_groups["edge"].items()} == {"triangle": [1], "line": [0]}
    assert mesh.point_groups["mark"].tolist() == [1, 4] and mesh.point_groups["skin"].tolist() == [3]
    assert mesh.groups == ["edge", "gone", "mark", "skin"] and mesh.cell_groups["gone"] == {}
    assert "mark" not in mesh.cell_groups
    bad = Contents(points, [Block("line", np.array([[0, 1], [1, 6], [-1, 2]]))])
    with pytest.raises(
        ValueError, match=r"f: 2 elements of type line use nodes that the file does not define \(it defines 6"
    ):
        to_mesh(bad, "f")


def test_an_empty_group_of_cells_gives_way_to_the_points_of_its_name():
    points = np.eye(3)
    contents = Contents(points, [Block("line", np.array([[0, 1]]))], {"tip": np.array([2])}, empty=("tip", "gone"))
    mesh = to_mesh(contents, "f")
    assert mesh.cell_groups == {"gone": {}} and mesh.point_groups["tip"].tolist() == [2] and len(mesh.points) == 3


def test_what_meshio_prints_is_logged_with_the_name_of_the_file(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    with caplog.at_level("INFO"), meshio_speaking(tmp_path / "a.med", "MED") as said:
        print("cell  type\n unknown")
    assert caplog.messages == ["meshio on a.med: cell type unknown"] and said.getvalue().startswith("cell")
    caplog.clear()
    with caplog.at_level("INFO"), meshio_speaking(tmp_path / "a.med", "MED"):
        print(" ")
    assert caplog.messages == []
    wanted = (
        "a.med could not be written as MED: the format cannot hold this mesh. Another format may hold it: .msh, .vtu."
    )
    with pytest.raises(ValueError) as error, meshio_speaking(tmp_path / "a.med", "MED", "written"):
        raise SystemExit(3)
    assert str(error.value) == wanted
    with pytest.raises(ValueError, match=r"^a\.med could not be read as MED: .*\. Look elsewhere\.$"):
        with meshio_speaking(tmp_path / "a.med", "MED", hint="Look elsewhere."):
            raise KeyError("FAS")
    with pytest.raises(MemoryError), meshio_speaking(tmp_path / "a.med", "MED"):
        raise MemoryError


def test_groups_that_come_to_one_name_are_united():
    mesh = Mesh(
        np.eye(4, 3),
        {"line": [[0, 1], [1, 2], [2, 3]], "triangle": [[0, 1, 2]]},
        {"set_1": {"line": [0]}, "set_2": {"line": [2], "triangle": [0]}, "pid_7": {"line": [1]}},
        {"set_1": [3], "pts": [0], "more": [2]},
    )
    wanted = {"root": "SET 1", "also": "set 1", "both": "Pts", "wing": "Left Wing"}
    found = renamed(mesh, wanted, {"set_2": "left wing", "pid_7": "beam", "more": "both", "none": "gone"}, "f")
    assert {g: {k: r.tolist() for k, r in by.items()} for g, by in found.cell_groups.items()} == {
        "root": {"line": [0]},
        "also": {"line": [0]},
        "wing": {"line": [2], "triangle": [0]},
        "beam": {"line": [1]},
    }
    assert {g: r.tolist() for g, r in found.point_groups.items()} == {"root": [3], "also": [3], "both": [0, 2]}
    with pytest.raises(
        ValueError, match=r"f has no group 'x' to be named 'y'; it has \['more', 'pid_7', 'pts', 'set_1', "
    ):
        renamed(mesh, {"y": "x"}, {}, "f")


def test_raised_cells_keep_their_groups_and_share_nodes_with_neighbours():
    """A row of quads with lines on it: one quad raised, a line on its edge with it, one kept, one elsewhere not."""
    mesh = rectangle(3, 1, 3, 1, "quad")
    quads = mesh.cells["quad"]
    on, kept, other = [quads[1, 0], quads[1, 1]], [quads[1, 2], quads[1, 3]], [quads[0, 0], quads[0, 3]]
    mesh = Mesh(
        mesh.points,
        {"line": [on, kept, other], "quad": quads},
        {"mixed": {"quad": [0, 1], "line": [0, 2]}, "kept": {"line": [1]}, "whole": {"quad": [0, 1, 2]}},
        {"edge": on, "cell": quads[1], "ends": [quads[1, 0], quads[1, 2]]},
    )
    found = raised(mesh, {"quad": np.array([1])}, {"line": np.array([1])})
    assert {kind: len(rows) for kind, rows in found.cells.items()} == {"line": 2, "line3": 1, "quad": 2, "quad8": 1}
    x = found.points[found.cells["quad8"][0]]
    assert x[4:] == pytest.approx((x[:4] + np.roll(x[:4], -1, axis=0)) / 2)
    assert found.points[found.cells["line3"][0]] == pytest.approx(np.array([x[0], x[1], (x[0] + x[1]) / 2]))
    assert len(found.points) == len(mesh.points) + 4
    groups = {
        g: {k: found.cells[k][r].tolist() for k, r in by.items() if len(r)} for g, by in found.cell_groups.items()
    }
    assert groups["mixed"]["quad"] == [quads[0].tolist()] and len(groups["mixed"]["quad8"]) == 1
    assert groups["mixed"]["line"] == [other] and groups["mixed"]["line3"][0][:2] == on
    assert groups["kept"] == {"line": [kept]}
    assert groups["whole"]["quad"] == quads[[0, 2]].tolist()
    grown = {g: sorted(map(tuple, found.points[r].tolist())) for g, r in found.point_groups.items()}
    assert grown["edge"] == [(1, 0, 0), (1.5, 0, 0), (2, 0, 0)] and len(grown["cell"]) == 8 and len(grown["ends"]) == 2
    again = raised(found, {"quad": np.array([0])})
    shared = set(again.cells["quad8"][0]) & set(again.cells["quad8"][1])
    assert len(shared) == 3 and len(again.points) == len(found.points) + 3
    nine = raised(again, {"quad8": np.array([1])})
    assert nine.points[nine.cells["quad9"][0, 8]] == pytest.approx(nine.points[nine.cells["quad9"][0, :4]].mean(axis=0))
    assert raised(mesh, {"quad": np.zeros(0, int)}) is mesh
    ring = Mesh(
        [[0, 0, 0], [2, 0, 0], [1, 2, 0], [0, -1, 0], [2, -1, 0], [3, 1, 0], [2, 3, 0], [0, 3, 0], [-1, 1, 0]],
        {"triangle": [[0, 1, 2]], "quad": [[0, 3, 4, 1], [1, 5, 6, 2], [2, 7, 8, 0]]},
    )
    assert set(raised(ring, {"quad": np.arange(3)}).cells) == {"triangle", "quad8"}  # of no lower dimension


@pytest.mark.parametrize("cell", ["triangle6", "quad"])
@pytest.mark.parametrize("made", ["rectangle", "annulus"])
def test_boundaries_of_a_surface_go_round_it_counterclockwise(made: str, cell: str):
    """The cell on an edge lies to its left; middle nodes of points that are corners of lines stay further nodes."""
    mesh = rectangle(2, 1, 3, 2, cell) if made == "rectangle" else annulus(1, 2, 2, 7, cell)
    faces = mesh.cells[cell]
    for kind in ("line", "line3"):
        for edge in mesh.cells.get(kind, ()):
            (face,) = [f for f in faces if {edge[0], edge[1]} <= set(f)]
            a, b, inside = (mesh.points[k] for k in (edge[0], edge[1], face[: CELL_TYPES[cell].n_corners]))
            assert np.cross(b - a, inside.mean(axis=0) - a)[2] > 0
    further = sorted(set(faces[:, CELL_TYPES[cell].n_corners :].ravel().tolist()))
    assert mesh.midside_points().tolist() == further
    if further:
        ribs = Mesh(mesh.points, {"line": [[further[0], further[1]]], **mesh.cells})
        assert ribs.midside_points().tolist() == further[2:]


@pytest.mark.parametrize("cell", ["triangle", "quad", "line"])
def test_values_at_corners_of_refined_cells_are_those_of_a_linear_field(cell: str):
    mesh = rectangle(2, 1, 2, 1, "triangle" if cell == "line" else cell)
    field = lambda p: 1 + p @ [0.3, -2.0, 0.7]  # noqa: E731
    fine = mesh.refined()
    corners = mesh.points[mesh.cells[cell]]
    found = refined_values(cell, field(corners))
    assert found == pytest.approx(field(fine.points[fine.cells[cell]]))
    each = np.arange(float(len(corners)))
    assert refined_values(cell, each).tolist() == np.repeat(each, len(found) // len(corners)).tolist()


def test_points_along_a_polyline_and_a_curve_have_equal_steps():
    corners = np.array([[0.0, 0, 0], [3, 0, 0], [3, 1, 0], [3, 1, 7]])
    points = along_polyline(corners, 11, 1)
    legs = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert len(points) == 12 and legs == pytest.approx([1.0] * 11)
    second = along_polyline(corners, 5, 2)
    assert len(second) == 11 and np.diff(second[:, 2])[-6:] == pytest.approx([7 / 6] * 6)
    for bad, n, sentence in (
        (corners[:1], 3, r"a polyline is an array \(k, 3\) of at least 2 points \[m\]; got shape \(1, 3\)"),
        (corners[[0, 1, 1, 3]], 9, "points 1 and 2 of the polyline coincide"),
        (corners, 2, "a polyline of 3 legs needs at least as many cells; n is 2"),
    ):
        with pytest.raises(ValueError, match=sentence):
            along_polyline(bad, n, 1)
    arc = along_curve(lambda s: [2 * np.cos(3 * s * s), 2 * np.sin(3 * s * s), 1.0], 6)  # not by its arc length
    angles = np.unwrap(np.arctan2(arc[:, 1], arc[:, 0]))
    assert angles == pytest.approx(np.linspace(0, 3, 7), abs=1e-5) and arc[:, 2] == pytest.approx(np.ones(7))


def test_free_memory_is_the_least_of_the_system_and_its_group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(memory, "CGROUP", tmp_path)
    close = False
    for _ in range(50):  # other processes take and free memory meanwhile
        system = memory.free_memory()
        told = next(line for line in Path("/proc/meminfo").read_text().splitlines() if line.startswith("MemAvailable"))
        close |= system == pytest.approx(1024 * int(told.split()[1]), rel=3e-3)
    assert close
    (tmp_path / "memory.max").write_text("3000000\n")
    (tmp_path / "memory.current").write_text("1000000\n")
    assert memory.free_memory() == 2e6
    with pytest.raises(ValueError, match=r"deck: reading it takes about 0.0025 GB, and 0.002 GB are free; wait"):
        memory.require_memory(2.5e6, "deck: reading it", "wait")
    memory.require_memory(1.9e6, "deck: reading it", "wait")
    (tmp_path / "memory.current").write_text("4000000\n")
    assert memory.free_memory() == 0.0
    (tmp_path / "memory.max").write_text("max\n")
    assert memory.free_memory() == pytest.approx(system, rel=0.2)


def test_free_memory_comes_from_the_system_where_its_file_says_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Free pages times their size; without them there is no limit."""
    monkeypatch.setattr(memory, "CGROUP", tmp_path)
    pages = {"SC_AVPHYS_PAGES": 300_000, "SC_PAGE_SIZE": 4096}
    monkeypatch.setattr(memory.os, "sysconf", pages.__getitem__)
    for text in ("MemTotal: 5 kB\n", "MemAvailable:\n", "MemAvailable: x kB\n"):
        monkeypatch.setattr(Path, "read_text", lambda self, text=text: text)
        assert memory.free_memory() == 300_000 * 4096

    def lacking(name: str) -> int:
        raise ValueError(name)

    monkeypatch.setattr(memory.os, "sysconf", lacking)
    assert memory.free_memory() == np.inf


@pytest.mark.parametrize(
    ("free", "need", "soft", "most"),
    [
        (5e9, 1e9, -1, 4096_000 + 3e9),  # 2 GB for libraries besides the need
        (5e9, 4e9, -1, 4096_000 + 5e9),  # no more than is free
        (np.inf, 1e30, -1, 4096_000 + 2.0**60),
        (5e9, 1e9, 4e9, 4096_000 + 3e9),
        (5e9, 1e9, 2e9, None),  # a limit that is lower already stays
    ],
)
def test_memory_is_limited_to_the_need_and_as_before_afterwards(
    monkeypatch: pytest.MonkeyPatch, free, need, soft, most
):
    resource = pytest.importorskip("resource")
    calls: list[tuple[int, tuple[int, int]]] = []
    before = int(soft) if soft > 0 else resource.RLIM_INFINITY
    monkeypatch.setattr(memory, "free_memory", lambda: free)
    monkeypatch.setattr(memory.os, "sysconf", {"SC_PAGE_SIZE": 4096}.__getitem__)
    monkeypatch.setattr(Path, "read_text", lambda self: "1000 7 7 7")
    monkeypatch.setattr(resource, "getrlimit", lambda which: (before, 77))
    monkeypatch.setattr(resource, "setrlimit", lambda which, limits: calls.append((which, limits)))
    with pytest.raises(KeyError), memory.limited_memory(need):
        assert calls == ([] if most is None else [(resource.RLIMIT_AS, (int(most), 77))])
        raise KeyError
    assert calls[1:] == ([] if most is None else [(resource.RLIMIT_AS, (before, 77))])


def test_memory_is_not_limited_where_the_system_does_not_say_what_is_used(monkeypatch: pytest.MonkeyPatch):
    resource = pytest.importorskip("resource")
    calls: list[object] = []
    monkeypatch.setattr(resource, "setrlimit", lambda *limits: calls.append(limits))
    monkeypatch.setattr(Path, "read_text", lambda self: "x 1")
    with memory.limited_memory(1.0):
        assert not calls
    assert not calls


def test_counts_of_a_gmsh_file_are_compared_with_its_bytes():
    nodes = b"2 3 1 40\n2 1 0 1\n7\n0 0 0\n1 5 0 2\n40\n12\n1 0 0\n0 1 0\n"
    check_counts(nodes, b"1 2 1 2\n1 1 1 2\n1 7 40\n2 40 12\n", ("4.1", False, 8), "x.msh")
    wrong = nodes.replace(b"1 5 0 2", b"1 5 0 3") + b"99\n2 2 2\n"
    with pytest.raises(ValueError, match=r"x.msh claims 3 nodes, and the blocks of its section hold 4"):
        check_counts(wrong, b"1 0 1 2\n", ("4.1", False, 8), "x.msh")
    with pytest.raises(ValueError, match="its nodes have parametric coordinates; write it again without"):
        check_counts(nodes.replace(b"1 5 0 2", b"1 5 1 2"), b"1 0 1 2\n", ("4.1", False, 8), "x.msh")
    for kind, body, most in (
        (("2.2", False, 8), b"9\n" + b"1 0 0 0\n" * 8, 8),
        (("2.2", True, 8), b"3\n" + bytes(56), 2),
        (("4.1", False, 8), b"1 99 1 9\n" + bytes(71), 10),
        (("4.1", True, 8), np.array([1, 5, 1, 5], "<u8").tobytes() + bytes(96), 4),
    ):
        claimed = {"9": 9, "3": 3}.get(body[:1].decode(errors="ignore"), 99 if kind == ("4.1", False, 8) else 5)
        with pytest.raises(
            ValueError, match=rf"x claims {claimed} nodes, and its section of {len(body)} bytes holds at most {most};"
        ):
            check_counts(body, b"0\n" if kind[0] == "2.2" else bytes(32), kind, "x")
    for width in (4, 8):
        size = f"<u{width}"
        parts = [np.array([2, 3, 1, 40], size).tobytes()]
        for entity, tags in ((1, [7]), (5, [40, 12])):
            parts += [np.array([1, entity, 0], "<i4").tobytes(), np.array([len(tags)], size).tobytes()]
            parts += [np.array(tags, size).tobytes(), bytes(24 * len(tags))]
        body = b"".join(parts)
        check_counts(body, np.array([0, 0, 0, 0], size).tobytes(), ("4.1", True, width), "x")
        with pytest.raises(ValueError, match="x claims 2 nodes, and the blocks of its section hold 3"):
            check_counts(
                np.array([2, 2], size).tobytes() + body[2 * width :], bytes(4 * width), ("4.1", True, width), "x"
            )
