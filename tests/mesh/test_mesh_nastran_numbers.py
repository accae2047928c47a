"""Nastran decks in the less usual ways of writing them: every number against one worked out here."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from femflex.mesh import Mesh, box, read_mesh, rectangle, write_mesh
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.nastran_cards import listed, read_deck
from femflex.mesh.nastran_write import _field
from femflex.mesh.numbers import Numbers
from femflex.mesh.quality import sizes
from femflex.warning import PhysicsWarning


def cards(tmp_path: Path, text: str) -> list[tuple[str, list[str]]]:
    path = tmp_path / "deck.bdf"
    path.write_text(text)
    return [(name, [word for word in fields if word]) for name, fields in read_deck(path).cards]


@pytest.mark.parametrize(
    ("words", "numbers"),
    [
        ("3 THRU 20 BY 4 30 2", [3, 7, 11, 15, 19, 30, 2]),
        ("5 thru 7 , 1", [5, 6, 7, 1]),
        ("1 THRU 9 EXCEPT 2 THRU 4 8", [1, 5, 6, 7, 9]),
        ("4 5 THRU 5", [4, 5]),
    ],
)
def test_lists_of_numbers_with_steps_and_exceptions(words: str, numbers: list[int]):
    assert listed(words.replace(",", "").split()).among(range(50)) == numbers


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("THRU 5", "the list THRU 5 has THRU without a number on both sides"),
        ("5 THRU", "the list 5 THRU has THRU without a number on both sides"),
        ("1 THRU 3 THRU 5", "the list 1 THRU 3 THRU 5 has THRU after a range; a number stands before it"),
    ],
)
def test_lists_that_make_no_sense_are_refused(words: str, sentence: str):
    with pytest.raises(ValueError, match=sentence):
        listed(words.split())


@pytest.mark.parametrize("seed", range(4))
def test_numbers_among_known_ones_and_within_them_are_those_of_the_lists_written_out(seed: int):
    rng = np.random.default_rng(seed)
    known = set(rng.choice(60, 25, replace=False).tolist())
    parts: list[int | range] = [int(rng.integers(60)), range(50, 3, -7), range(2, 58, 3), int(rng.integers(60))]
    parts += [range(0, 60), range(59, -1, -1), range(10, 14)]  # longer than what is known, and shorter
    without = Numbers((int(rng.integers(60)), range(20, 30)))
    written = [n for part in parts for n in ([part] if isinstance(part, int) else part)]
    less = {without.parts[0], *range(20, 30)}
    assert Numbers(tuple(parts)).among(known) == [n for n in written if n in known]
    assert Numbers(tuple(parts), without).among(known) == [n for n in written if n in known and n not in less]
    whole = set(range(60))
    assert Numbers(tuple(parts)).within(whole) and not Numbers(tuple(parts)).within(whole - {written[-1]})
    assert not Numbers((parts[0],)).within(whole - {parts[0]})
    assert Numbers(tuple(parts), without).within(whole - less) and not Numbers((70,), without).within(whole)
    assert Numbers((5,), Numbers((5,))).within(set()) and not Numbers((5, 6), Numbers((5,))).within(set())
    some = whole - {12}
    assert not Numbers(tuple(parts), without).within(some)


def test_repeated_cards_add_to_the_fields_that_say_so(tmp_path: Path):
    text = """BEGIN BULK
GRID,101,17,1.0,10.5,,17,3456
=,*(1),=,*(0.2),==
=(3)
=,*1,18,=,*(-.5+0),=
CORD2R,1,,1.,2.,3.,4.,5.,6.
,7.,8.,9.
=,*(2),==
"""
    found = cards(tmp_path, text)
    grids = [fields for name, fields in found if name == "GRID"]
    assert [int(fields[0]) for fields in grids] == [101, 102, 103, 104, 105, 106]
    assert [float(fields[2]) for fields in grids] == pytest.approx([1.0, 1.2, 1.4, 1.6, 1.8, 1.8])
    assert [fields[1] for fields in grids] == ["17"] * 5 + ["18"]
    assert [float(fields[3]) for fields in grids] == pytest.approx([10.5] * 5 + [10.0])
    assert [fields[4:] for fields in grids] == [["17", "3456"]] * 5 + [[]]
    systems = [fields for name, fields in found if name == "CORD2R"]
    assert systems[1] == ["3", *systems[0][1:]] and len(systems[0]) == 10
    wanted = r"deck.bdf:2: the line repeats FORCE with \*\(1\), =, \*2, where a number is added to what is none; write "
    with pytest.raises(ValueError, match=wanted):
        cards(tmp_path, "FORCE,a,1\n=,*(1),,=,*2\n")


def test_a_continuation_goes_back_to_the_card_with_its_mark_and_so_does_the_next(tmp_path: Path):
    """Lines of two cards alternate; a card that follows is a card of its own."""
    line = lambda *words: "".join(f"{word:<8}" for word in words)  # noqa: E731
    blank = [""] * 6
    text = "\n".join(
        [
            line("PSHELL", "1", "11", *blank, "+A1"), line("PCOMP", "2", "22", *blank, "+B1"),
            line("+B1", "23", "24", *blank, "+B2"), line("+A1", "12", "13", *blank, "+A2"),
            line("+B2", "25"), line("+A2", "14"), line("GRID", "7"), line("+ZZ", "8"),
        ]
    )  # fmt: skip
    found = {name: [word for word in fields if word] for name, fields in cards(tmp_path, text + "\n")}
    assert found == {
        "PSHELL": ["1", "11", "12", "13", "14"],
        "PCOMP": ["2", "22", "23", "24", "25"],
        "GRID": ["7", "8"],
    }


def test_fields_of_every_width_and_marks_of_continuations_are_joined(tmp_path: Path):
    wide = "PBEAML* " + "".join(f"{word:>16}" for word in ("7", "8", "", "TUBE")) + "*A\n"
    wide += "*A      " + "".join(f"{word:>16}" for word in (".1", ".08", "", "YES")) + "\n"
    text = f"""ID a,b
SOL 101
CEND
SET 3 = 1,2,
 3
SET 12 = 5.0, 6.0
DISP = 3
BEGIN BULK
{wide}pcomp,5,,,,,,sym,,+x,1,.1,0.,yes,2,.2,90.,no
MAT1    1       7.+10           .3      2700.   1.-5            .02     +M1
+M2     9
+M1     1.      2.                                                      +M2
PBAR 1 11 .785
PBAR, 2 11 .785, 4 , a b
PARAM,GRDPNT,0 $ ,9
ENDDATA
GRID,1
"""
    path = tmp_path / "deck.bdf"
    path.write_text(text)
    deck = read_deck(path)
    found = [(name, [word for word in fields if word]) for name, fields in deck.cards]
    assert found[0] == ("PBEAML", ["7", "8", "TUBE", ".1", ".08", "YES"])
    assert deck.raw[0].fields[2] == "" and deck.raw[0].fields[6] == "" and deck.raw[0].line == 9
    assert found[1] == ("PCOMP", ["5", "sym", "1", ".1", "0.", "yes", "2", ".2", "90.", "no"])
    assert found[2] == ("MAT1", ["1", "7.+10", ".3", "2700.", "1.-5", ".02", "1.", "2.", "9"])
    assert found[4] == ("PBAR", ["2", "11", ".785", "4", "a", "b"]) and found[5] == ("PARAM", ["GRDPNT", "0"])
    assert [line.text for line in deck.control] == ["ID a,b", "SOL 101", "CEND", "DISP = 3"]
    assert deck.control[-1].number == 7
    assert {number: numbers.among(range(9)) for number, numbers in deck.sets.items()} == {3: [1, 2, 3]}
    assert len(found) == 6


def test_included_files_are_found_beside_their_includer_or_the_deck_in_any_case(tmp_path: Path):
    (tmp_path / "sub" / "deep").mkdir(parents=True)
    (tmp_path / "sub" / "Grids.BDF").write_text("GRID,1,,0.\nINCLUDE 'deep/\nmore.bdf' $ c\nGRID,3,,2.\n")
    (tmp_path / "sub" / "deep" / "more.bdf").write_text('include "last.bdf"\n')
    (tmp_path / "last.bdf").write_text("GRID,2,,1.\n")
    path = tmp_path / "deck.bdf"
    path.write_text("INCLUDE 'assign.txt'\nCEND\nBEGIN BULK\ninclude sub\\grids.bdf $ c\nCROD,5,9,1,2\nENDDATA\n")
    deck = read_deck(path)
    assert [(card.name, card.fields[0], card.file, card.line) for card in deck.raw] == [
        ("GRID", "1", "Grids.BDF", 1),
        ("GRID", "2", "last.bdf", 1),
        ("GRID", "3", "Grids.BDF", 4),
        ("CROD", "5", "deck.bdf", 5),
    ]
    (tmp_path / "sub" / "deep" / "last.bdf").write_text("GRID,2,,7.\n\nINCLUDE 'gone.bdf'\n")  # the nearer of two
    folders = f"{tmp_path / 'sub' / 'deep'} or {tmp_path}"
    sentence = f"last.bdf:3: the file 'gone.bdf' that is included does not exist in {folders}."
    with pytest.raises(ValueError, match=re.escape(sentence)):
        read_deck(path)
    path.write_text("BEGIN BULK\nINCLUDE 'deck.bdf'\n")
    with pytest.raises(ValueError, match=r"deck.bdf:2: files include each other more than 10 deep"):
        read_deck(path)
    path.write_text("BEGIN BULK\n\nINCLUDE 'gone.bdf'\n")
    with pytest.raises(ValueError, match=r"deck.bdf:3: the file 'gone.bdf' that is included does not exist in "):
        read_deck(path)


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


def test_elements_go_to_their_property_and_sets_to_points_or_elements(tmp_path: Path):
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
    found = mesh.points[mesh.cells[cell][0]]
    for node, parents in enumerate(kind.parents, kind.n_corners):
        assert found[node] == pytest.approx(found[parents].mean(axis=0), abs=1e-8)
    assert found[: kind.n_corners] == pytest.approx(corners, abs=1e-8)


@pytest.mark.parametrize(
    "value", [1 / 3, -1 / 3, 1e300 / 7, -1e-300 / 7, 12345678901234.5, -0.00001234567890123, 5.0, 0.0, -1e22, 1e5]
)
def test_a_coordinate_fits_its_field_with_as_many_digits_as_go_in(value: float):
    text = _field(value)
    assert len(text) <= 16 and "." in text
    mantissa, _, exponent = text.partition("E")
    read = float(f"{mantissa}e{exponent or 0}")
    assert read == pytest.approx(value, rel=1e-8) and (abs(value) != 5.0 or read == 5.0)


def test_a_written_deck_keeps_overlapping_groups_of_several_cells(tmp_path: Path):
    mesh = box(2, 1, 1, 2, 1, 1, "hexahedron20").merged(rectangle(1, 1, 2, 1, "quad8").moved([0, 0, 5]))
    solid, plate = mesh.cells["hexahedron20"], mesh.cells["quad8"]
    mesh = Mesh(mesh.points, {"hexahedron20": solid, "quad8": plate})
    mesh = mesh.with_groups(
        {
            "a": {"quad8": [1, 2, 3]},
            "b": {"quad8": [3, 4], "hexahedron20": [1]},
            "same": {"quad8": [1, 2, 3]},
            "gone": {},
        },
        {"first": [0], "more": [2, 3, 4, 8, 9, 11, 12, 13]},
    )
    path = tmp_path / "both.bdf"
    write_mesh(path, mesh)
    back = read_mesh(path)
    assert np.array_equal(back.cells["quad8"], mesh.cells["quad8"]) and np.array_equal(
        back.cells["hexahedron20"], solid
    )
    for group in ("a", "b", "same"):
        found = {kind: rows.tolist() for kind, rows in back.cell_groups[group].items()}
        assert found == {kind: rows.tolist() for kind, rows in mesh.cell_groups[group].items()}
    assert {name: rows.tolist() for name, rows in back.point_groups.items()} == {
        name: rows.tolist() for name, rows in mesh.point_groups.items()
    }
    assert back.points == pytest.approx(mesh.points, rel=1e-9)
    text = path.read_text()
    assert "SET 2 = 3 THRU 5, 9, 10, 12 THRU 14" in text and "SET 1 = 1\n" in text
    assert not any(name.startswith("pid") for name in back.groups)
    with pytest.raises(
        ValueError, match=r"Nastran has no element for cells of type \['line3', 'quad9'\]; write x.msh or .vtu"
    ):
        write_mesh(tmp_path / "x.bdf", rectangle(1, 1, 1, 1, "quad9"))
