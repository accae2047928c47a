"""Nastran decks: fields of every format, properties, sets, and the node order of the manual."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femflex.mesh import read_mesh, write_mesh
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.nastran_cards import read_deck
from femflex.mesh.generators import rectangle
from femflex.mesh.quality import sizes
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


def read_panel(path, **options):
    with pytest.warns(PhysicsWarning, match=r"left out: CONM2 \(1\), RBE2 \(1\); 5 are kept"):
        return read_mesh(path, **options)


def group_coordinates(mesh, group):
    return sorted(mesh.points[mesh.group_points(group)][:, :2].tolist())


def test_every_field_format_is_read_with_properties_and_sets(tmp_path):
    mesh = read_panel(deck(tmp_path))
    assert {c: len(n) for c, n in mesh.cells.items()} == {"line": 1, "quad": 2, "triangle": 2}
    assert len(mesh.points) == 9
    assert mesh.groups == ["pid_1", "pid_2", "pid_7", "set_4", "set_5", "set_8", "set_9"]
    assert group_coordinates(mesh, "set_4") == [[0, 0], [0, 1], [0, 2]]
    assert group_coordinates(mesh, "set_9") == [[0, 0], [1, 0], [2, 0]]
    assert group_coordinates(mesh, "pid_7") == [[2, 1], [2, 2]]
    assert list(mesh.group_cells("set_5")) == ["quad"]  # no such grid points: a set of elements
    assert len(mesh.group_cells("set_8")["triangle"]) == 2
    corners = mesh.points[mesh.group_cells("set_8")["triangle"][1]][:, :2].tolist()
    assert corners == [[1, 1], [1, 2], [0, 2]]


def test_names_in_comments_of_preprocessors_are_used(tmp_path):
    names = '$HMSET        4        1 "root"\n$HMSET 5 2 "first row"\n$HMNAME PROP     1"panel"  4\n'
    femap = "$ Femap with NX Nastran Property 2 : corner plates\n"
    path = deck(tmp_path, DECK.replace("SOL 103\n", "SOL 103\n" + names).replace("PSHELL", femap + "PSHELL"))
    assert read_panel(path).groups == ["corner plates", "first row", "panel", "pid_7", "root", "set_8", "set_9"]
    both = read_panel(path, groups={"clamp": "SET 4", "skin": "panel"})
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


def test_long_sets_round_trip(tmp_path):
    mesh = rectangle(1, 1, 40, 40, "quad")
    mesh = mesh.with_groups(points={"every third": np.arange(0, len(mesh.points), 3)})
    path = tmp_path / "plate.bdf"
    write_mesh(path, mesh)
    assert max(len(line) for line in path.read_text().splitlines()) <= 80
    assert read_mesh(path).point_groups["every third"].tolist() == mesh.point_groups["every third"].tolist()


def cards(tmp_path: Path, text: str) -> list[tuple[str, list[str]]]:
    path = tmp_path / "deck.bdf"
    path.write_text(text)
    return [(name, [word for word in fields if word]) for name, fields in read_deck(path).cards]


ELEMENTS = """BEGIN BULK
GRDSET,,,,,,,456
GRID,1,,0.,0.,0.
GRID,2,,2.,0.,0.
GRID,3,,2.,3.,0.
GRID,4,,0.,3.,0.
GRID,5,,0.,0.,5.
CONROD,50,1,2,9,.1
CROD,51,,2,3
CTUBE,52,7,3,4
CSHEAR,60,8,1,2,3,4
CTRIAR,61,8,1,2,5
CPYRA,70,9,1,2,3,4,5
CTETRA,71,9,1,2,4,5
CQUAD8,62,8,1,2,3,4
SET1,20,60,THRU,62,SKIN
SET3,21,ELEMENT,50,THRU,71
SET3,22,GRID,2,4,99
SET3,23,POINT,2
CELAS2,90,5.,1,1
ENDDATA
"""


def test_groups_of_properties_and_sets(tmp_path: Path):
    path = tmp_path / "deck.bdf"
    path.write_text(ELEMENTS)
    with pytest.warns(PhysicsWarning, match=r"left out: CELAS2 \(1\); 8 are kept"):
        mesh = read_mesh(path)
    lines = {name: mesh.points[mesh.group_cells(name)["line"][0]].tolist() for name in ("pid_51", "pid_7")}
    assert lines == {"pid_51": [[2, 0, 0], [2, 3, 0]], "pid_7": [[2, 3, 0], [0, 3, 0]]}  # 51 names no property: its own
    assert {kind: len(rows) for kind, rows in mesh.group_cells("pid_9").items()} == {"pyramid": 1, "tetra": 1}
    assert {kind: len(rows) for kind, rows in mesh.group_cells("pid_8").items()} == {"quad": 2, "triangle": 1}
    assert sizes(mesh.points, "pyramid", mesh.cells["pyramid"]) == pytest.approx([10])
    assert sizes(mesh.points, "tetra", mesh.cells["tetra"]) == pytest.approx([5])
    assert {kind: len(rows) for kind, rows in mesh.group_cells("set_21").items()} == {
        "line": 3, "quad": 2, "triangle": 1, "pyramid": 1, "tetra": 1,
    }  # fmt: skip
    assert {kind: len(rows) for kind, rows in mesh.group_cells("set_20").items()} == {"quad": 2, "triangle": 1}
    assert mesh.points[mesh.point_groups["set_22"]].tolist() == [[2, 0, 0], [0, 3, 0]]
    assert not {"set_23", "pid_50", "pid_1", "pid_0"} & set(mesh.groups)  # a CONROD has a material only
    path.write_text(ELEMENTS.replace("GRDSET,,", "GRDSET,,3"))
    with pytest.raises(ValueError, match=r"deck.bdf: 5 GRID cards, the first is 1, are given in a local coordinate"):
        read_mesh(path)
    path.write_text(ELEMENTS.replace("GRDSET,,", "GRDSET,,3").replace("GRID,1,,", "GRID,1,0,"))
    with pytest.raises(ValueError, match=r"deck.bdf: 4 GRID cards, the first is 2, are given in a local coordinate"):
        read_mesh(path)


@pytest.mark.parametrize("cell", ["hexahedron20", "wedge15", "pyramid13", "tetra10", "quad8"])
def test_middle_nodes_follow_the_order_of_the_manual(tmp_path: Path, cell: str):
    """Of solids: edges of the lower face, upright edges, edges of the upper face (MSC Quick Reference Guide)."""
    kind = CELL_TYPES[cell]
    edges = {
        "hexahedron20": "12 23 34 41 15 26 37 48 56 67 78 85",
        "wedge15": "12 23 31 14 25 36 45 56 64",
        "pyramid13": "12 23 34 41 15 25 35 45",
        "tetra10": "12 23 31 14 24 34",
        "quad8": "12 23 34 41",
    }[cell].split()
    corners = np.random.default_rng(8).uniform(-0.1, 0.1, (kind.n_corners, 3))
    unit = kind.nodes[: kind.n_corners]
    flat = {"pyramid13": np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.4, 0.5, 1]])}.get(cell, unit)
    corners[:, : flat.shape[1]] += flat
    middles = [corners[[int(a) - 1, int(b) - 1]].mean(axis=0) for a, b in edges]
    rows = [*corners, *middles]
    lines = [f"GRID,{k},,{x:.9f},{y:.9f},{z:.9f}" for k, (x, y, z) in enumerate(rows, 11)]
    card = {"hexahedron20": "CHEXA", "wedge15": "CPENTA", "pyramid13": "CPYRAM", "tetra10": "CTETRA"}.get(
        cell, "CQUAD8"
    )
    words = [str(k) for k in range(11, 11 + len(rows))]
    card_lines, words = [f"{card},1,1,{','.join(words[:6])}"], words[6:]
    while words:
        card_lines.append("," + ",".join(words[:8]))
        words = words[8:]
    path = tmp_path / "deck.bdf"
    path.write_text("\n".join(["BEGIN BULK", *lines, *card_lines, "ENDDATA", ""]))
    mesh = read_mesh(path)
    computed = mesh.points[mesh.cells[cell][0]]
    for node, parents in enumerate(kind.parents, kind.n_corners):
        assert computed[node] == pytest.approx(computed[parents].mean(axis=0), abs=1e-8)
    assert computed[: kind.n_corners] == pytest.approx(corners, abs=1e-8)
