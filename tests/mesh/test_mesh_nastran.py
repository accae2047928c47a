import numpy as np
import pytest

from femflex.mesh import read_mesh, write_mesh
from femflex.mesh.generators import rectangle
from femflex.warning import PhysicsWarning

DECK = """\
SOL 103
CEND
TITLE = A PANEL WITH EVERY FIELD FORMAT
SET 4 = 101, 104,
   107
SET 5 = 11 THRU 12 EXCEPT 99
SET 6 = ALL
DISPLACEMENT = 4
SUBCASE 1
begin bulk
$ small, large and free fields, continuations with and without marks
GRID    101             0.0     0.0     0.0
GRID    104             0.      1.      0.             123
GRID*   107                             0.              2.+0            +G1
*G1     0.
GRID,102,,1.,0.0,
GRID*,105,,1.0D+0,1.
*,0.
GRID    108             10.-1   .2E+1
GRID    103             2.      0.      0.
GRID    106             2.      1.      0.
GRID    109             2.      2.      0.
CQUAD4  11      1       101     102     105     104     45.0    0.01
CQUAD4  12      1       102     103     106     105
CTRIA3  21      2       104     105     107     30.
CTRIA3*               22               2             105             108
*                    107
CBAR    31      7       106     109     0.      0.      1.
CONM2   900     109     0       5.0
RBE2    901     109     123456  106
SET1    8       21      THRU    22
SET3    9       GRID    101     102     103
PSHELL  1       1       0.001
ENDDATA
GRID    999             9.      9.      9.
"""


def deck(tmp_path, text=DECK):
    path = tmp_path / "panel.bdf"
    path.write_text(text)
    return path


def read(path, **options):
    with pytest.warns(PhysicsWarning, match=r"left out: CONM2 \(1\), RBE2 \(1\); 5 are kept"):
        return read_mesh(path, **options)


def at(mesh, group):
    return sorted(mesh.points[mesh.group_points(group)][:, :2].tolist())


def test_every_field_format_is_read_with_properties_and_sets(tmp_path):
    mesh = read(deck(tmp_path))
    assert {c: len(n) for c, n in mesh.cells.items()} == {"line": 1, "quad": 2, "triangle": 2}
    assert len(mesh.points) == 9
    assert mesh.groups == ["pid_1", "pid_2", "pid_7", "set_4", "set_5", "set_8", "set_9"]
    assert at(mesh, "set_4") == [[0, 0], [0, 1], [0, 2]]
    assert at(mesh, "set_9") == [[0, 0], [1, 0], [2, 0]]
    assert at(mesh, "pid_7") == [[2, 1], [2, 2]]
    assert list(mesh.group_cells("set_5")) == ["quad"]  # no such grid points: a set of elements
    assert len(mesh.group_cells("set_8")["triangle"]) == 2
    corners = mesh.points[mesh.group_cells("set_8")["triangle"][1]][:, :2].tolist()
    assert corners == [[1, 1], [1, 2], [0, 2]]


def test_names_in_comments_of_preprocessors_are_used(tmp_path):
    names = '$HMSET        4        1 "root"\n$HMSET 5 2 "first row"\n$HMNAME PROP     1"panel"  4\n'
    femap = "$ Femap with NX Nastran Property 2 : corner plates\n"
    path = deck(tmp_path, DECK.replace("SOL 103\n", "SOL 103\n" + names).replace("PSHELL", femap + "PSHELL"))
    assert read(path).groups == ["corner plates", "first row", "panel", "pid_7", "root", "set_8", "set_9"]
    both = read(path, groups={"clamp": "SET 4", "skin": "panel"})
    assert {"clamp", "skin"} <= set(both.groups) and not {"root", "panel"} & set(both.groups)


def test_comments_and_continuations_of_every_form_are_read(tmp_path):
    """Marks that name their card from elsewhere, tabs, comments within lines, a free card of more than nine fields."""
    text = """\
  $ a comment that is indented
BEGIN BULK $ and one behind words
GRID,1,,0.,0.,0. $ another, with a number: 5
GRID\t2\t\t1.\t0.\t0.
GRID           3              1.      1.      0.
GRID           4              0.      1.      0.
+LATE          7       8
CHEXA          1       1       1       2       3       4       5       6+LATE
GRID           5              0.      0.      1.
grid,6,,1.,0.,1.
GRID,7,,1.,1.,1.
GRID*                  8                              0.              1.
*                     1.
CHEXA,2,1,1,2,3,4,5,6,+,7,8
CHEXA,3,1,1,2,3,4,5,6,
,7,8
CHEXA*                 4               1               1               2 *A
*A                     3               4               5               6 *B
*B                     7               8
ENDDATA
"""
    mesh = read_mesh(deck(tmp_path, text))
    assert mesh.cells["hexahedron"].tolist() == [list(range(8))] * 4
    assert mesh.points[7].tolist() == [0, 1, 1]


def test_missing_middle_nodes_are_put_in_the_middle_of_edges(tmp_path):
    """Two six-node triangles on a square: one lacks two of its middle nodes, of which its neighbour has one."""
    text = """\
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,2.,0.,0.
GRID,3,,2.,2.,0.
GRID,4,,0.,2.,0.
GRID,5,,1.,0.,0.
GRID,6,,2.,1.,0.
GRID,7,,1.,1.,0.
CTRIA6,1,1,1,2,3,5,6,7
CTRIA6,2,1,1,3,4,,,8
GRID,8,,0.,1.,0.
ENDDATA
"""
    with pytest.warns(PhysicsWarning, match=r"1 cells of second order have some middle nodes only; 1 nodes are added"):
        mesh = read_mesh(deck(tmp_path, text))
    first, second = mesh.cells["triangle6"]
    assert first[5] == second[3]
    assert mesh.points[second[4]].tolist() == [1, 2, 0]
    assert mesh.points[second[5]].tolist() == [0, 1, 0]


def test_long_sets_stay_within_a_card_and_come_back(tmp_path):
    mesh = rectangle(1, 1, 40, 40, "quad")
    mesh = mesh.with_groups(points={"every third": np.arange(0, len(mesh.points), 3)})
    path = tmp_path / "plate.bdf"
    write_mesh(path, mesh)
    assert max(len(line) for line in path.read_text().splitlines()) <= 80
    assert read_mesh(path).point_groups["every third"].tolist() == mesh.point_groups["every third"].tolist()
