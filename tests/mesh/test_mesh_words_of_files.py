"""Files of a small mesh word by word, and lines of decks at the limits of what is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femflex.mesh import Mesh, write_mesh
from femflex.mesh.abaqus_flat import read_flat
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import sizes

SMALL = Mesh(
    np.array([[0, 0, 0], [1.5, 0, 0], [1.5, 1, 0.25], [0, 1, 0], [2.5, 0.5, 0]]),
    {"quad": [[0, 1, 2, 3]], "triangle": [[1, 4, 2]], "line": [[3, 0], [0, 1]]},
    {"sail": {"quad": [0]}, "sail1": {"quad": [0], "triangle": [0]}, "yard": {"line": [1]}, "yard1": {"line": [0]}},
    {"spot": [4], "spot1": [0, 3]},
)
NASTRAN = """\
CEND
$HMNAME PROP               1"sail"
$HMNAME PROP               2""
$HMNAME PROP               3"yard1"
$HMNAME PROP               4"yard"
$HMSET        1        1 "spot"
$HMSET        2        1 "spot1"
$HMSET        3        2 "sail1"
SET 1 = 5
SET 2 = 1, 4
SET 3 = 1, 2
BEGIN BULK
GRID*                  1                              0.              0.*
*                     0.
GRID*                  2                             1.5              0.*
*                     0.
GRID*                  3                             1.5              1.*
*                   0.25
GRID*                  4                              0.              1.*
*                     0.
GRID*                  5                             2.5             0.5*
*                     0.
CQUAD4  1       1       1       2       3       4       
CTRIA3  2       2       2       5       3       
CBAR    3       3       4       1       
CBAR    4       4       1       2       
ENDDATA
"""
ABAQUS = """\
*HEADING
 mesh written by femflex
*NODE
1, 0.0, 0.0, 0.0
2, 1.5, 0.0, 0.0
3, 1.5, 1.0, 0.25
4, 0.0, 1.0, 0.0
5, 2.5, 0.5, 0.0
*ELEMENT, TYPE=S4
1,1,2,3,4
*ELEMENT, TYPE=S3
2,2,5,3
*ELEMENT, TYPE=B31
3,4,1
4,1,2
*ELSET, ELSET=sail
1
*ELSET, ELSET=sail1
1, 2
*ELSET, ELSET=yard
4
*ELSET, ELSET=yard1
3
*NSET, NSET=spot
5
*NSET, NSET=spot1
1, 4
"""


@pytest.mark.parametrize(("suffix", "wanted"), [(".bdf", NASTRAN), (".inp", ABAQUS)])
def test_a_small_mesh_is_written_as_a_deck_with_its_groups(suffix: str, wanted: str, tmp_path: Path):
    path = tmp_path / f"small{suffix}"
    write_mesh(path, SMALL)
    assert path.read_text() == wanted


def test_the_children_of_a_wedge_are_eighths_of_it_on_the_lattice_of_its_middles():
    own = CELL_TYPES["wedge"]
    whole = Mesh(own.nodes, {"wedge": [np.arange(6)]})
    fine = whole.refined()
    volumes = sizes(fine.points, "wedge", fine.cells["wedge"])
    assert volumes == pytest.approx(np.full(8, 1 / 16))
    lattice = {(a / 2, b / 2, c / 2) for a in range(3) for b in range(3 - a) for c in range(3)}
    assert {tuple(x) for x in fine.points.tolist()} == lattice


@pytest.mark.parametrize(("rows", "named"), [([0, 7], 7), ([-2, 0], -2), ([-2, 7], -2)])
def test_a_group_beyond_the_mesh_names_the_number_that_is_none(rows: list[int], named: int):
    with pytest.raises(ValueError, match=rf"group 'far' names point {named}, but there are 5\."):
        SMALL.with_groups(points={"far": rows})
    with pytest.raises(ValueError, match=rf"group 'far' names cell of type quad {named}, but there are 1|{named}"):
        SMALL.with_groups(cells={"far": {"quad": rows}})


ROW = {1: [0, 0, 0], 2: [1, 0, 0], 4: [5, 0, 0], 6: [9, 0, 0]}


@pytest.mark.parametrize(
    ("text", "nodes", "elements", "sets"),
    [
        (  # nodes between neighbours are none, and both are in the set
            "6, 9., 0., 0.\n*NGEN, NSET=ROW\n1, 2\n2, 6, 2\n*ELEMENT, TYPE=T3D2, ELSET=E\n1, 1, 2\n",
            ROW, {1: (1, 2)}, {"ROW": [1, 2, 4, 6]},
        ),
        (  # elements of springs go on after a comma unless nothing follows
            "*ELEMENT, TYPE=SPRING2, ELSET=S\n11, 1,\n2\n12, 2, 1,\n*ELEMENT, TYPE=SPRING1, ELSET=S1\n13, 2\n",
            {1: ROW[1], 2: ROW[2]}, {11: (1, 2), 12: (2, 1), 13: (2,)}, {"S": [11, 12], "S1": [13]},
        ),
    ],
    ids=["nodes generated", "elements of springs"],
)  # fmt: skip
def test_nodes_elements_and_sets_are_those_of_the_lines(text, nodes, elements, sets, tmp_path: Path):
    path = tmp_path / "lines.inp"
    path.write_text("*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n" + text)
    flat = read_flat(path)
    assert {number: x.tolist() for number, x in flat.nodes.items()} == nodes
    assert {number: element.nodes for number, element in flat.elements.items()} == elements
    assert {name: flat.nodes_of(name, "") if name == "ROW" else flat.elements_of(name, "") for name in sets} == sets
