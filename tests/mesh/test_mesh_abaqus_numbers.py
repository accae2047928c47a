"""Abaqus decks in the less usual ways of writing them: every number against one worked out here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femflex.mesh import box, read_mesh, write_mesh
from femflex.mesh.abaqus_elements import ELEMENTS, WRITTEN, cell_of
from femflex.mesh.abaqus_flat import read_flat
from femflex.mesh.abaqus_keywords import read_keywords
from femflex.mesh.cells import CELL_TYPES

BAR = "*ELEMENT, TYPE=T3D2, ELSET=bars\n1, 1, 2\n"


def flat(tmp_path: Path, text: str, name: str = "deck.inp"):
    path = tmp_path / name
    path.write_text(text)
    return read_flat(path)


def at(found, *numbers: int) -> np.ndarray:
    return np.array([found.nodes[number] for number in numbers])


def test_numbers_of_fortran_and_whole_numbers_written_as_reals_are_read(tmp_path: Path):
    text = "*NODE\n1., 1.D1, 2.5+2, -3.E-1\n2.0, 1d-2, -1.5-1, +4\n*ELEMENT, TYPE=T3D2\n7., 1, 2.0\n"
    found = flat(tmp_path, text)
    assert at(found, 1, 2) == pytest.approx(np.array([[10, 250, -0.3], [0.01, -0.15, 4]]))
    assert found.elements[7].nodes == (1, 2)
    with pytest.raises(ValueError, match=r"deck.inp, line 4: \*ELEMENT has '2.5' where the number of an element or a"):
        flat(tmp_path, "*NODE\n1\n*ELEMENT, TYPE=T3D2\n1, 1, 2.5\n")


def test_parameters_and_data_lines_keep_their_place_across_files(tmp_path: Path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "more.inp").write_text(
        '** c\n*NSET,\n NSET = "a, b" , INTERNAL\n3, 4\n*INCLUDE, INPUT=last.inp\n'
    )
    (tmp_path / "sub" / "last.inp").write_text("5,6\n")
    (tmp_path / "rows.txt").write_text("** c\n1, 0.\n\n2, 1.\n")
    path = tmp_path / "deck.inp"
    path.write_text("*Heading\nx\n*Include , input = sub\\more.inp\n*NODE, INPUT=rows.txt , Nset=N\n3, 3.\n")
    heading, nset, node = read_keywords(path)
    assert (heading.name, heading.lines, heading.place()) == ("HEADING", ["x"], "deck.inp, line 1")
    assert (nset.name, nset.parameter("nset"), nset.parameters["internal"]) == ("NSET", "a, b", None)
    assert nset.data == [["3", "4"], ["5", "6"]] and nset.place() == "more.inp, line 2"
    assert (nset.place(0), nset.place(1)) == ("more.inp, line 4", "last.inp, line 1")
    assert node.data == [["1", "0."], ["2", "1."], ["3", "3."]] and node.parameter("nset") == "N"
    assert [node.place(row) for row in range(3)] == ["rows.txt, line 2", "rows.txt, line 4", "deck.inp, line 5"]
    assert node.parameter("elset") == ""


@pytest.mark.parametrize(
    ("text", "other", "sentence"),
    [
        ("*NODE, INPUT=rows.txt\n", "1, 0.\n*ELEMENT\n", r"rows.txt, line 2: \*ELEMENT stands in a file of data lines, "
         r"which \*NODE, INPUT at deck.inp, line 1 names"),
        ("*NODE\n1\n*INCLUDE, INPUT=gone.inp\n", "", r"deck.inp, line 3: .*gone.inp is named by \*INCLUDE"),
        ("*INCLUDE, INPUT=rows.txt\n", "*INCLUDE, INPUT=rows.txt\n", r"rows.txt, line 1: .* is the 10th file within"),
    ],
)  # fmt: skip
def test_files_that_are_named_wrongly_are_reported_with_their_line(
    tmp_path: Path, text: str, other: str, sentence: str
):
    (tmp_path / "rows.txt").write_text(other)
    with pytest.raises(ValueError, match=sentence):
        flat(tmp_path, text)


def test_a_skew_arc_goes_by_equal_angles_the_shorter_way_about_its_centre(tmp_path: Path):
    """Centre as a node and as coordinates; increments of 2; a normal that is not along the axis of the ends alone."""
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    centre, radius, span = np.array([1.0, 2.0, -1.0]), 2.5, np.radians(100)
    arc = lambda angle: centre + radius * turn @ [np.cos(angle), np.sin(angle), 0]  # noqa: E731
    row = lambda number, x: f"{number}, " + ", ".join(f"{v:.15g}" for v in x) + "\n"  # noqa: E731
    ends = row(10, arc(0.0)) + row(18, arc(span)) + row(99, centre)
    place = ", ".join(f"{v:.15g}" for v in centre)
    for how in ("10, 18, 2, 99\n", f"10, 18, 2, , {place}\n"):
        found = flat(tmp_path, f"*NODE\n{ends}*NGEN, LINE=C, NSET=arc\n{how}*ELEMENT, TYPE=T3D2\n1, 10, 12\n")
        expected = np.array([arc(angle) for angle in np.linspace(0, span, 5)])
        assert at(found, 10, 12, 14, 16, 18) == pytest.approx(expected, abs=1e-12)
        assert found.nodes_of("ARC", "") == [10, 12, 14, 16, 18]
    normal = ", ".join(f"{v:.15g}" for v in -turn[:, 2])
    found = flat(
        tmp_path, f"*NODE\n{ends}*NGEN, LINE=C\n10, 18, 2, 99, , , , {normal}\n*ELEMENT, TYPE=T3D2\n1, 10, 12\n"
    )
    expected = np.array([arc(angle) for angle in np.linspace(0, span - 2 * np.pi, 5)])
    assert at(found, 10, 12, 14, 16, 18) == pytest.approx(expected, abs=1e-12)


def test_lines_of_nodes_between_two_sets_take_their_numbers_from_the_first(tmp_path: Path):
    text = """*NODE, NSET=low
7, 0., 0., 0.
5, 1., 0., 0.
*NODE, NSET=high
105, 1., 3., 6.
107, 0., 6., 3.
200, 9., 9., 9.
*NFILL, NSET=all
low, high, 3, 10
5, 200
"""
    found = flat(tmp_path, text + "*ELEMENT, TYPE=T3D2\n1, 5, 7\n")
    assert at(found, 15, 25) == pytest.approx(np.array([[1, 1, 2], [1, 2, 4]]))
    assert at(found, 17, 27) == pytest.approx(np.array([[0, 2, 1], [0, 4, 2]]))
    assert at(found, 105, 107, 200) == pytest.approx(np.array([[1, 3, 6], [0, 6, 3], [9, 9, 9]]))
    assert found.nodes_of("all", "") == [5, 15, 25, 105, 7, 17, 27, 107, 200]
    assert 6 not in found.nodes


def test_nodes_of_a_skew_system_stand_where_its_axes_put_them(tmp_path: Path):
    """Cylindrical nodes in a system by three points of which the third is not on its y axis."""
    a, b, c = np.array([1.0, 2.0, 3.0]), np.array([2.0, 4.0, 2.5]), np.array([0.5, 3.0, 4.0])
    x = (b - a) / np.linalg.norm(b - a)
    z = np.cross(x, c - a)
    z /= np.linalg.norm(z)
    axes = np.stack([x, np.cross(z, x), z], axis=1)
    system = ", ".join(map(str, [*a, *b])) + ",\n" + ", ".join(map(str, c)) + "\n"
    found = flat(
        tmp_path,
        f"*SYSTEM\n{system}*NODE, SYSTEM=C\n1, 2., 30., 1.5\n*NODE, SYSTEM=S\n2, 2., 30., 60.\n*NODE\n3, .1, .2, .3\n"
        + BAR,
    )
    local = [
        [2 * np.cos(np.pi / 6), 1.0, 1.5],
        [2 * np.cos(np.pi / 6) * 0.5, 2 * 0.5 * 0.5, 2 * np.sin(np.pi / 3)],
        [0.1, 0.2, 0.3],
    ]
    assert at(found, 1, 2, 3) == pytest.approx(a + np.array(local) @ axes.T, abs=1e-12)


INSTANCES = """*PART, NAME=Boom
*NODE, NSET=own
 1, 0.5, 0.25, 0.
 12, 2., 1., 0.5
*ELEMENT, TYPE=B31, ELSET=bars
 3, 1, 12
*NSET, NSET=Tip
 12
*END PART
*PART, NAME=Mast
*NODE
 1, 0., 0., 7.
 150, 0., 0., 8.
*ELEMENT, TYPE=B31, ELSET=bars
 1, 1, 150
*END PART
*ASSEMBLY, NAME=A
*INSTANCE, NAME=First, PART=boom
*END INSTANCE
*INSTANCE, NAME=Second, PART=MAST
 10., 20., 30.
*END INSTANCE
*INSTANCE, NAME=Third, PART=Boom
 1., -2., 3.
 1., 1., 0., 2., 3., -1., 35.
*END INSTANCE
*NODE
 4, 5., 6., 7.
*ELEMENT, TYPE=CONN3D2, ELSET=links
 9, First.12, 4
*NSET, NSET=late
 early, Third.Tip, Second.150
*NSET, NSET=early, INSTANCE=First
 12
*NSET, NSET=through, ELSET=bars, INSTANCE=Third
*ELSET, ELSET=every
 First.bars, Second.bars, Third.3
*NSET, NSET=range, INSTANCE=Third, GENERATE
 1, 23, 11
*END ASSEMBLY
"""


def test_instances_are_moved_and_turned_about_their_own_axis(tmp_path: Path):
    found = flat(tmp_path, INSTANCES)
    own = np.array([[0.5, 0.25, 0.0], [2.0, 1.0, 0.5]])
    a, b = np.array([1.0, 1.0, 0.0]), np.array([2.0, 3.0, -1.0])
    turn = Rotation.from_rotvec(np.radians(35) * (b - a) / np.linalg.norm(b - a))
    third = a + turn.apply(own + np.array([1.0, -2.0, 3.0]) - a)
    first, second, last, whole = (found.shifts[name] for name in ("FIRST", "SECOND", "THIRD", ""))
    assert (first, second, last, whole) == (0, 100, 1000, 1100)  # behind 12, 250 and 1012, by powers of ten
    assert at(found, 1, 12) == pytest.approx(own)
    assert at(found, second + 1, second + 150) == pytest.approx(np.array([[10, 20, 37], [10, 20, 38.0]]))
    assert at(found, last + 1, last + 12) == pytest.approx(third, abs=1e-12)
    assert at(found, whole + 4) == pytest.approx(np.array([[5, 6, 7.0]]))
    assert len(found.nodes) == 7
    link = found.elements[whole + 9]
    assert (link.kind, link.cell, link.nodes) == ("CONN3D2", "", (12, whole + 4))
    nodes = {name: numbers.among(found.nodes) for name, numbers in found.nsets.members().items()}
    assert nodes["late"] == [12, last + 12, second + 150] and nodes["early"] == [12]
    assert nodes["through"] == [last + 1, last + 12] and nodes["range"] == [last + 1, last + 12]
    assert nodes["Third.own"] == [last + 1, last + 12] and nodes["First.Tip"] == [12]
    cells = {name: numbers.among(found.elements) for name, numbers in found.elsets.members().items()}
    assert cells["every"] == [3, second + 1, last + 3] and cells["Second.bars"] == [second + 1]
    assert found.nodes_of("12", "Third") == [last + 12] and found.nodes_of("TIP", "First") == [12]
    assert found.elements_of("third.BARS", "") == [last + 3] and found.elements_of("1", "second") == [second + 1]
    assert found.nsets.knows("Third.12", "") and found.nsets.knows("-3", "") and not found.nsets.knows("Third.no", "")
    with pytest.raises(ValueError, match=r"here: NSET 'Second.late' is used but not defined"):
        found.nodes_of("Second.late", "", "here")  # a set of the assembly, not of the instance


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("PART=MAST", "PART=Mst", r"deck.inp, line 20: instance 'Second' is of part 'Mst', which is not in the "
         r"deck; its parts are \['BOOM', 'MAST'\]"),
        ("-1., 35.", "-1.", r"deck.inp, line 25: a rotation of an instance has two points and an angle; give 7"),
        ("First.12, 4", "First.x, 4", "deck.inp, line 30: element 9 has 'First.x' where the number of a node belongs"),
        ("early, Third.Tip", "erly, Third.Tip", r"deck.inp, line 32: NSET 'erly' is used but not defined; known are "
         r"\['Tip', 'early', 'late', 'own', 'range', 'through'\]"),
        (" 1, 23, 11", " 1, 23, 0", r"deck.inp, line 39: \*NSET, GENERATE has a step of 0"),
        (" 1, 23, 11", " 1", r"deck.inp, line 39: \*NSET, GENERATE needs first, last and step; got \['1'\]"),
    ],
)  # fmt: skip
def test_assemblies_that_do_not_fit_together_are_refused_with_their_line(
    tmp_path: Path, old: str, new: str, sentence: str
):
    assert INSTANCES.count(old) == 1
    with pytest.raises(ValueError, match=sentence):
        flat(tmp_path, INSTANCES.replace(old, new))


def test_parts_alone_stand_in_place_and_one_of_them_has_the_numbers_of_the_deck(tmp_path: Path):
    parts = INSTANCES.split("*ASSEMBLY")[0]
    found = flat(tmp_path, parts)
    assert len(found.nodes) == 4 and sorted(found.placements) == ["BOOM", "MAST"]
    by = found.shifts["MAST"]
    assert by > 12 and at(found, by + 150) == pytest.approx(np.array([[0, 0, 8.0]]))
    single = flat(tmp_path, parts.split("*PART, NAME=Mast")[0])
    assert single.shifts == {"": 0} and sorted(single.elsets.members()) == ["bars"]
    assert single.nodes_of("Boom.Tip", "") == [12]  # as written for the part


def test_names_of_sets_of_one_instance_are_bare_unless_the_deck_has_them_too(tmp_path: Path):
    head = (
        INSTANCES.split("*PART, NAME=Mast")[0] + "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=Only, PART=Boom\n*END INSTANCE\n"
    )
    assert sorted(flat(tmp_path, head).nsets.members()) == ["Tip", "own"]
    both = flat(tmp_path, head + "*NSET, NSET=TIP\n Only.1\n").nsets.members()
    assert {name: numbers.among(range(99)) for name, numbers in both.items()} == {
        "own": [1, 12],
        "Only.Tip": [12],
        "TIP": [1],
    }


def test_copies_of_an_element_go_in_three_directions_with_their_own_steps(tmp_path: Path):
    nodes = "".join(
        f"{1 + i + 10 * j + 100 * k}, {i}, {j}, {k}\n" for k in range(3) for j in range(4) for i in range(3)
    )
    text = f"*NODE\n{nodes}*ELEMENT, TYPE=C3D8\n5, 1, 2, 12, 11, 101, 102, 112, 111\n"
    found = flat(tmp_path, text + "*ELGEN, ELSET=all\n5, 2, , , 3, 10, 20, 2, 100, 300\n")
    assert sorted(found.elements) == sorted(
        5 + i + 20 * j + 300 * k for i in range(2) for j in range(3) for k in range(2)
    )
    for i in range(2):
        for j in range(3):
            for k in range(2):
                own = found.elements[5 + i + 20 * j + 300 * k]
                assert own.nodes == tuple(n + i + 10 * j + 100 * k for n in (1, 2, 12, 11, 101, 102, 112, 111))
    assert len(found.elements_of("ALL", "")) == 11  # the first has no set
    with pytest.raises(ValueError, match=r"deck.inp, line 41: \*ELGEN copies element 6, which is not defined before"):
        flat(tmp_path, text + "*ELGEN\n6, 2\n")


def test_a_beam_may_name_a_node_for_its_orientation_and_springs_may_go_on(tmp_path: Path):
    text = """*NODE
1
2, 1.
3, 2.
4, 0., 1.
*ELEMENT, TYPE=B31
1, 1, 2, 4
*ELEMENT, TYPE=B32
2, 1, 2,
3, 4
*ELEMENT, TYPE=MASS, ELSET=m
8, 4
*ELEMENT, TYPE=SPRINGA, ELSET=s
9, 1,
4
10, 2, 3
"""
    found = flat(tmp_path, text)
    assert (found.elements[1].nodes, found.elements[1].extra) == ((1, 2), (4,))
    assert (found.elements[2].nodes, found.elements[2].extra) == ((1, 3, 2), (4,))
    assert found.elements[2].place == "deck.inp, line 9"
    assert [(k, found.elements[k].kind, found.elements[k].nodes) for k in (8, 10)] == [
        (8, "MASS", (4,)),
        (10, "SPRINGA", (2, 3)),
    ]
    with pytest.raises(ValueError, match="line 7: element 1 of type B31 has 4 nodes; it needs 2"):
        flat(tmp_path, text.replace("1, 1, 2, 4", "1, 1, 2, 4, 3"))


def test_a_block_may_end_in_a_comma_whatever_its_nodes_are(tmp_path: Path):
    """The last element goes on in no other line; its nodes are numbers, or those of instances."""
    part = "*PART, NAME=P\n*NODE\n1, 0.\n2, 1.\n*END PART\n*ASSEMBLY, NAME=A\n"
    text = part + "".join(f"*INSTANCE, NAME={name}, PART=P\n*END INSTANCE\n" for name in ("I", "J"))
    text += "*NODE\n7, 5.\n*ELEMENT, TYPE=SPRINGA, ELSET=s\n9, I.1, 7\n10, I.2,\nJ.1,\n*END ASSEMBLY\n"
    found = flat(tmp_path, text)
    second, whole = found.shifts["J"], found.shifts[""]
    assert second == 10 and whole == 20
    assert found.elements[whole + 9].nodes == (1, whole + 7)
    assert found.elements[whole + 10].nodes == (2, second + 1)
    assert found.elements[whole + 10].place == "deck.inp, line 15"
    assert found.elements_of("s", "") == [whole + 9, whole + 10]
    assert found.elements_of("s", "J") == [whole + 9, whole + 10]  # a set of the assembly, as an instance sees it


def test_all_keywords_that_make_nodes_or_elements_are_named_in_order(tmp_path: Path):
    text = "*NODE\n1, 0.\n*NMAP, NSET=a\n*ELCOPY, OLD SET=b\n*NCOPY, OLD SET=c\n"
    wanted = (
        r"deck\.inp makes nodes or elements by \*ELCOPY, \*NCOPY, \*NMAP; only those written out, and \*NGEN, \*NFILL"
    )
    with pytest.raises(ValueError, match=wanted):
        flat(tmp_path, text)


def test_sets_that_name_one_another_hold_what_each_of_them_lists(tmp_path: Path):
    text = "*NODE\n1\n2\n3\n4\n*NSET, NSET=a\n1, b\n*NSET, NSET=b\n2, a\n*NSET, NSET=c\n3\n*NSET, NSET=d\n4, c\n"
    found = flat(tmp_path, text)
    assert 1 in found.nodes_of("a", "") and 2 in found.nodes_of("b", "") and 1 in found.nodes_of("b", "")
    assert sorted(found.nodes_of("d", "")) == [3, 4] and found.nodes_of("c", "") == [3]


@pytest.mark.parametrize("pattern", ELEMENTS, ids=lambda entry: entry[1])
def test_element_types_have_the_nodes_of_their_cell(pattern):
    _, cell, count = pattern
    assert count == len(CELL_TYPES[cell].nodes)


@pytest.mark.parametrize(
    ("kind", "cell"),
    [
        ("B31OSH", "line"), ("PIPE22", "line3"), ("STRI3", "triangle"), ("CPS6M", "triangle6"), ("S4RSW", "quad"),
        ("S8R5", "quad8"), ("M3D9R", "quad9"), ("C3D4H", "tetra"), ("C3D10HS", "tetra10"), ("C3D6", "wedge"),
        ("C3D15V", "wedge15"), ("C3D5", "pyramid"), ("C3D8IH", "hexahedron"), ("C3D20RH", "hexahedron20"),
        ("SC8R", "hexahedron"), ("C3D27", ""), ("MASS", ""), ("S4X", ""), ("CONN3D2", ""), ("B34", ""),
    ],
)  # fmt: skip
def test_element_types_are_the_cells_of_the_manual(kind: str, cell: str):
    assert cell_of(kind) == (cell, len(CELL_TYPES[cell].nodes) if cell else 0)
    assert all(cell_of(written)[0] == own for own, written in WRITTEN.items())


def test_a_written_deck_lists_nodes_elements_and_sets_by_number(tmp_path: Path):
    mesh = box(1, 2, 3, 2, 1, 1, "hexahedron20")
    mesh = mesh.with_groups(
        {"some": {"quad8": [3, 7], "hexahedron20": [1]}, "2nd": {"quad8": [0]}}, {"pts": [4, 0, 19]}
    )
    path = tmp_path / "box.inp"
    write_mesh(path, mesh)
    found = read_flat(path)
    assert list(found.nodes) == list(range(1, len(mesh.points) + 1))
    np.testing.assert_array_equal(np.array(list(found.nodes.values())), mesh.points)
    bricks = [found.elements[k].nodes for k in (1, 2)]
    np.testing.assert_array_equal(bricks, mesh.cells["hexahedron20"] + 1)
    assert found.elements_of("some", "") == [6, 10, 2] and found.elements_of("2nd", "") == [3]
    assert found.nodes_of("pts", "") == [1, 5, 20]
    assert max(len(line.split(",")) for line in path.read_text().splitlines()) <= 17
    back = read_mesh(path)
    assert back.cell_groups["some"]["quad8"].tolist() == [3, 7] and back.cell_groups["some"][
        "hexahedron20"
    ].tolist() == [1]
    assert np.array_equal(back.points, mesh.points)
