"""Models that cannot be analysed are refused with what is wrong, where, and what to do."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Distributing, Equation, Material, Member, Term, build_structure
from femflex.fem.sections import Circle, Rectangle
from femflex.mesh import Mesh, box, line, rectangle
from femflex.reduction import cantilever_modes

METAL = Material(70e9, 0.3, 2700.0)
BAR = line([[0, 0, 0], [1.0, 0, 0]], 2).with_groups(points={"tip": [2], "middle": [1]})
SHORT = Mesh([[0, 0, 0], [1.0, 0, 0], [1.0, 0, 0]], {"line": [[0, 1], [1, 2]]}, {"line": {"line": [0, 1]}})
SHEET = rectangle(1.0, 1.0, 2, 2, "quad")


def beam(mesh=BAR, section=None, connections=(), **options):
    chosen = Circle(0.01) if section is None else section
    return build_structure(mesh, [Member("line", "beam", chosen, METAL, options)], connections=connections)


def folded(cell: str) -> Mesh:
    """Two elements; the second has two nodes exchanged."""
    mesh = box(2.0, 1.0, 1.0, 2, 1, 1, cell) if cell == "hexahedron" else rectangle(2.0, 1.0, 2, 1, cell)
    rows = mesh.cells[cell].copy()
    rows[1, [1, 2]] = rows[1, [2, 1]]
    return Mesh(mesh.points, {cell: rows}, {"all": {cell: [0, 1]}})


def two_sheets() -> Mesh:
    far, n = SHEET.moved([3.0, 0, 0]), len(SHEET.points)
    rows = np.concatenate([SHEET.cells["quad"], SHEET.cells["quad"] + n])
    points = {"left": SHEET.group_points("left")}
    return Mesh(np.concatenate([SHEET.points, far.points]), {"quad": rows}, {"surface": {"quad": np.arange(8)}}, points)


WRONG = {
    "a cell of no length": (lambda: beam(SHORT), "1 line cells of no length, the first is cell 1 at (1, 0, 0) m; join"),
    "an orientation along the beam": (
        lambda: beam(section=Rectangle(0.1, 0.2), orientation=(1.0, 0, 0)),
        "is parallel to 2 of the 2 elements of group 'line'; give a vector that points across them",
    ),
    "a beam without section": (
        lambda: build_structure(BAR, [Member("line", "beam", None, METAL)]),
        "beam on group 'line' has no section; name one",
    ),
    "a section without material": (
        lambda: build_structure(BAR, [Member("line", "beam", Circle(0.01))]),
        "beam on group 'line': Circle needs a material; found none",
    ),
    "a taper that turns negative": (
        lambda: beam(section=Rectangle("0.1 - 0.2*s/L", 0.1)),
        "beam on group 'line': width of Rectangle is",
    ),
    "a shell without section": (
        lambda: build_structure(SHEET, [Member("surface", "shell", None, METAL)]),
        "shell on group 'surface' has the section None; give a plate section",
    ),
    "a solid without material": (
        lambda: build_structure(box(1, 1, 1, 1, 1, 1, "hexahedron27"), [Member("volume", "solid")]),
        "solid on group 'volume'",
    ),
    "parts that do not meet": (
        lambda: cantilever_modes(build_structure(two_sheets(), [Member("surface", "shell", 0.01, METAL)]), ["left"], 4),
        "It falls into 2 parts that share no node (in addition to the largest: 9 nodes about (3.5, 0.5, 0))",
    ),
    "a folded solid": (
        lambda: build_structure(folded("hexahedron"), [Member("all", "solid", material=METAL)]),
        "1 of 2 hexahedron20 elements are turned inside out or folded (element 1 at (1.5, 0.5, 0.5) m",
    ),
    "a folded shell": (
        lambda: build_structure(folded("quad"), [Member("all", "shell", 0.01, METAL)]),
        "1 of 2 quadrilaterals are warped by over 120 deg, or their sides cross",
    ),
    "two equations for one component": (
        lambda: beam(
            connections=[Equation((Term("tip", "x", 1.0), Term("middle", "x", factor))) for factor in (-1.0, -2.0)]
        ),
        "make the same node dependent",
    ),
    "a factor of zero": (
        lambda: beam(connections=[Equation((Term("tip", "x", 0.0), Term("middle", "x", -1.0)))]),
        "factor of group 'tip' in an equation is 0.0; give a number, not 0",
    ),
    "a distributing connection of nodes in a line": (
        lambda: beam(connections=[Distributing("line", (0.5, 0.2, 0.0), name="r")]),
        "its 3 nodes lie on a line or at one point, so their translations do not determine a rotation",
    ),
}


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_models_that_cannot_be_analysed_are_refused(name):
    make, words = WRONG[name]
    with pytest.raises(ValueError) as refusal:
        make()
    assert words in str(refusal.value)
