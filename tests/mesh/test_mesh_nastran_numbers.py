"""Nastran decks in the less usual ways of writing them: every number against one worked out here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femflex.mesh import Mesh, box, read_mesh, rectangle, write_mesh
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.nastran_cards import read_deck
from femflex.mesh.quality import sizes
from femflex.warning import PhysicsWarning


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
