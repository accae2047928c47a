"""Plates on second-order cells have straight sides, and say how far that is from the mesh."""

from __future__ import annotations

import re

import numpy as np
import pytest
from support.plate_models import METAL

from femflex.fem import Member, build_structure
from femflex.mesh import Mesh, rectangle
from femflex.warning import PhysicsWarning

PLATE = [Member("surface", "plate", 0.01, METAL)]


def cylinder() -> Mesh:
    """A quarter of a cylinder of radius 1 and length 0.8, three six-node cells round."""
    flat = rectangle(np.pi / 2, 0.8, 3, 2, "triangle6")
    a, y, _ = flat.points.T
    return Mesh(np.stack([np.cos(a), y, np.sin(a)], axis=1), flat.cells, flat.cell_groups)


def mass(structure) -> float:
    return float(sum(block.dm.sum() for block in structure.inertia))


def test_curved_sides_are_told_with_the_sagitta_of_their_arcs():
    """Arcs of 30 degrees on a cylinder: sagitta over chord is tan(7.5 degrees) / 2, and the mass that of the chords."""
    mesh = cylinder()
    ratio = np.tan(np.radians(7.5)) / 2
    with pytest.warns(PhysicsWarning, match=r"plate on group 'surface'.*Refine the mesh: refine = 1") as caught:
        structure = build_structure(mesh, PLATE)
    assert len(caught) == 1
    told = float(re.search(r"\(([\d.]+)%;", str(caught[0].message))[1]) / 100
    assert told == pytest.approx(ratio, abs=1e-4)
    chords = 3 * 2 * np.sin(np.radians(15))
    assert mass(structure) == pytest.approx(chords * 0.8 * 0.01 * METAL.density, rel=1e-9)


def test_refinement_makes_corners_of_the_middle_nodes():
    """The distance falls to a quarter, as the warning says."""
    told = []
    for times in (0, 1):
        with pytest.warns(PhysicsWarning, match="sides of its second-order cells are curved") as caught:
            build_structure(cylinder().refined(times), PLATE)
        told.append(float(re.search(r"lies ([\d.e-]+) m", str(caught[0].message))[1]))
    assert told[1] == pytest.approx(told[0] / 4, rel=0.01)


@pytest.mark.parametrize(("cell", "family"), [("quad8", "plate_bfs"), ("quad9", "plate_bfs")])
def test_bulging_rectangles_are_told_of(cell, family):
    flat = rectangle(1.0, 1.0, 2, 2, cell)
    x, y, _ = flat.points.T
    lifted = np.stack([x, y, 0.01 * np.sin(np.pi * 2 * x) ** 2], axis=1)
    with pytest.warns(PhysicsWarning, match=r"plate_bfs on group 'surface'.*lies 0.01 m off a side of 0.5 m \(2.00%"):
        build_structure(Mesh(lifted, flat.cells, flat.cell_groups), [Member("surface", family, 0.01, METAL)])


def test_straight_second_order_cells_are_silent():
    for cell, family in (("triangle6", "plate"), ("quad8", "plate_bfs"), ("quad9", "plate_bfs")):
        build_structure(rectangle(1.0, 1.0, 2, 2, cell), [Member("surface", family, 0.01, METAL)])
