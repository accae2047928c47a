import numpy as np
import pytest

from femflex.mesh import read_mesh
from femflex.mesh.quality import sizes
from femflex.warning import PhysicsWarning

DECK = """\
*Heading
 an arm on a plate
** a comment
*Node, nset=plate nodes
 10, 0., 0.
 20, 1., 0., 0.
 30, 1., 1., 0.
 40, 0., 1., 0.
*NODE, NSET=ARM
 1000, 1., 1., 1.
 2000, 1., 1., 2.
 1001, 1., 1., .5
 2001, 1., 1., 1.5
 7777, 9., 9., 9.
*Element, type=s4r, elset=Skin
 1, 10, 20, 30, 40
*ELEMENT, TYPE=B32, ELSET=Arm
 500, 30, 1001, 1000
*ELEMENT,
 TYPE=B32, ELSET=ARM
 501, 1000, 2001, 2000, 7777
*Element, type=MASS, elset=lump
 900, 2000
*Element, type=CONN3D2
 901, 10, 2000
*Nset, nset=Root, generate
 20, 10, -10
*Nset, nset=Root
 40
*NSET, NSET="all of it"
 Root, Arm
 "plate nodes"
*NSET, NSET=from elements, ELSET=Arm
*Elset, elset=everything
 SKIN, arm,
*Elset, elset=few, internal, instance=Panel-1
 1, 501
*Elset, elset=gone
 900,
*Beam section, elset=Arm
"""


def deck(tmp_path, text=DECK):
    path = tmp_path / "arm.inp"
    path.write_text(text)
    return path


@pytest.fixture
def mesh(tmp_path):
    with pytest.warns(PhysicsWarning) as caught:
        computed = read_mesh(deck(tmp_path))
    texts = [str(w.message) for w in caught]
    assert any("left out: CONN3D2 (1), MASS (1); 3 are kept" in text for text in texts)
    assert any("1 of 9 points belong to no cell; some are in the point groups ['ARM', 'all of it']" in t for t in texts)
    return computed


def heights(mesh, group):
    return sorted(mesh.points[mesh.point_groups[group]][:, 2].tolist())


def test_all_node_and_element_blocks_are_read(mesh):
    assert {c: len(n) for c, n in mesh.cells.items()} == {"quad": 1, "line3": 2}
    assert len(mesh.points) == 9


def test_middle_node_of_quadratic_beam(mesh):
    assert mesh.points[mesh.cells["line3"]][:, :, 2].tolist() == [[0, 1, 0.5], [1, 2, 1.5]]
    assert sizes(mesh.points, "line3", mesh.cells["line3"]) == pytest.approx([1, 1])


def test_sets_of_all_kinds_are_read(mesh):
    assert sorted(mesh.cell_groups) == ["Arm", "Skin", "everything", "few", "gone", "lump"]
    assert len(mesh.group_cells("Arm")["line3"]) == 2  # from two *ELEMENT blocks, in capitals or not
    assert {c: len(n) for c, n in mesh.group_cells("everything").items()} == {"quad": 1, "line3": 2}
    assert {c: len(n) for c, n in mesh.group_cells("few").items()} == {"quad": 1, "line3": 1}
    assert heights(mesh, "ARM") == [0.5, 1, 1.5, 2, 9]
    assert mesh.points[mesh.group_points("Root")][:, :2].tolist() == [[0, 0], [1, 0], [0, 1]]
    assert heights(mesh, "all of it") == [0, 0, 0, 0, 0.5, 1, 1.5, 2, 9]
    assert heights(mesh, "from elements") == [0, 0.5, 1, 1.5, 2]


def test_positions_of_instances(tmp_path):
    """Two instances of a part, one moved and one moved and turned by 90 degrees about an upright axis."""
    text = """\
*PART, NAME=Boom
*NODE
 1, 0., 0., 0.
 2, 2., 0., 0.
*ELEMENT, TYPE=B31, ELSET=All
 1, 1, 2
*NSET, NSET=Tip
 2
*END PART
*ASSEMBLY, NAME=A
*INSTANCE, NAME=East, PART=Boom
 1., 0., 0.
*END INSTANCE
*INSTANCE, NAME=North, PART=Boom
 0., 1., 0.
 0., 1., 0., 0., 1., 1., 90.
*END INSTANCE
*NODE
 1, 5., 5., 5.
*NSET, NSET=Tips
 East.Tip, North.2
*ELSET, ELSET=Northern, INSTANCE=North
 1,
*NSET, NSET=Reference
 1
*END ASSEMBLY
"""
    with pytest.warns(PhysicsWarning, match=r"1 of 5 points belong to no cell; some are in the point groups \['Ref"):
        mesh = read_mesh(deck(tmp_path, text))
    assert mesh.points[mesh.point_groups["Tips"]] == pytest.approx(np.array([[3, 0, 0], [0, 3, 0]]))
    assert mesh.points[mesh.point_groups["North.Tip"]] == pytest.approx(np.array([[0, 3, 0]]))
    assert mesh.points[mesh.point_groups["Reference"]] == pytest.approx(np.array([[5, 5, 5]]))
    assert mesh.points[mesh.group_cells("Northern")["line"][0]] == pytest.approx(np.array([[0, 1, 0], [0, 3, 0]]))
    assert sorted(mesh.cell_groups) == ["East.All", "North.All", "Northern"]


def test_ngen_nfill_and_elgen(tmp_path):
    text = """\
*NODE, SYSTEM=C
 1, 1., 0.
 5, 1., 90.
*NGEN, LINE=C, NSET=inner
 1, 5, 1, , 0., 0., 0.
*NODE, SYSTEM=C
 201, 3., 0.
 205, 3., 90.
*NGEN, LINE=C, NSET=outer
 201, 205, 1, , 0., 0., 0.
*NFILL
 inner, outer, 2, 100
*ELEMENT, TYPE=S4, ELSET=sector
 1, 1, 101, 102, 2
*ELGEN, ELSET=sector
 1, 4, 1, 1, 2, 100, 100
"""
    mesh = read_mesh(deck(tmp_path, text))
    radius = np.linalg.norm(mesh.points, axis=1)
    assert sorted(np.round(radius, 9)) == [1] * 5 + [2] * 5 + [3] * 5
    assert len(mesh.group_cells("sector")["quad"]) == 8
    assert np.abs(sizes(mesh.points, "quad", mesh.cells["quad"])).sum() == pytest.approx(
        8 * 4 * np.sin(np.pi / 16) * np.cos(np.pi / 16)
    )  # trapezia in an eighth of the circle each


CHAIN = "*ELEMENT, TYPE=T3D2\n1, 1, 2\n2, 2, 3\n"


def by_chain(path):
    """Points along the elements of a deck, one after the other."""
    mesh = read_mesh(path)
    return mesh.points[np.append(mesh.cells["line"][:, 0], mesh.cells["line"][-1, 1])]


@pytest.mark.parametrize(
    ("system", "points"),
    [
        ("*SYSTEM\n1., 2., 3.\n", [[1, 2, 3], [2, 2, 3], [1, 3, 4]]),
        ("*SYSTEM\n1., 2., 3., 1., 4., 3.\n", [[1, 2, 3], [1, 3, 3], [0, 2, 4]]),  # x along y, z stays
        ("*SYSTEM\n1., 0., 0., 1., 0., 2.,\n1., 5., 3.\n", [[1, 0, 0], [1, 0, 1], [0, 1, 0]]),  # x along z, y along y
        ("*SYSTEM\n1., 2., 3.\n*SYSTEM\n", [[0, 0, 0], [1, 0, 0], [0, 1, 1]]),
    ],
)
def test_nodes_of_preceding_coordinate_system(tmp_path, system, points):
    """Nodes 1, 2, 3 at (0, 0, 0), (1, 0, 0), (0, 1, 1) of it."""
    mesh = read_mesh(deck(tmp_path, f"{system}*NODE\n1\n2, 1.\n3, 0., 1., 1.\n{CHAIN}"))
    assert mesh.points == pytest.approx(np.array(points, float), abs=1e-12)


def test_spherical_nodes_and_nodes_along_a_line(tmp_path):
    """Radius, longitude, latitude; *NGEN without LINE goes straight."""
    text = "*NODE, SYSTEM=S\n1, 2., 0., 0.\n3, 2., 90., 30.\n*NGEN\n1, 3, 1\n" + CHAIN
    ends = np.array([[2.0, 0, 0], [0, np.sqrt(3), 1.0]])
    assert by_chain(deck(tmp_path, text)) == pytest.approx(np.array([ends[0], ends.mean(axis=0), ends[1]]))


def test_ngen_arc_with_normal(tmp_path):
    text = "*NODE\n1, 1.\n7, 0., 1.\n*NGEN, LINE=C\n1, 7, 1, , 0., 0., 0., 0., 0., -1.\n*ELEMENT, TYPE=T3D2\n"
    text += "".join(f"{k}, {k}, {k + 1}\n" for k in range(1, 7))
    angles = -np.linspace(0, 270, 7)  # the longer way round, clockwise
    around = np.stack([np.cos(np.radians(angles)), np.sin(np.radians(angles))], axis=1)
    assert by_chain(deck(tmp_path, text))[:, :2] == pytest.approx(around, abs=1e-12)
