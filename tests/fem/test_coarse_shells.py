"""Warnings of four-node shells that are too coarse on curved shells, against the error they name."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from support.plate_models import frequencies
from support.shell_problems import pinched_cylinder, ratio

from femflex.fem import Material, Member, build_structure
from femflex.mesh import Mesh, rectangle
from femflex.warning import PhysicsWarning


def test_coarse_four_node_elements_of_a_pinched_cylinder_are_warned_of_with_their_error():
    """8 x 8: 2 sqrt(R h) long, half as curved at the ends. The warning names 1.3 times the stiffness, 1.32 is found."""
    problem = pinched_cylinder("quad", 8)
    with pytest.warns(PhysicsWarning, match="48 of 64 four-node elements are longer than 1.5 sqrt") as given:
        found = ratio(problem)
    named = float(re.search(r"up to ([\d.]+) times as stiff", str(given[0].message))[1])
    assert named == pytest.approx(1 / found, rel=0.1)


@pytest.mark.parametrize(("cell", "n"), [("quad", 16), ("quad9", 4)])
def test_finer_and_second_order_elements_are_not_warned_of(cell, n):
    with warnings.catch_warnings():
        warnings.simplefilter("error", PhysicsWarning)
        ratio(pinched_cylinder(cell, n))


def test_low_modes_on_elements_of_twice_the_length_are_within_a_hundredth():
    """A quarter of a cylinder, R / h = 400, clamped at one curved edge, on elements of 2 sqrt(R h); at 4 it is off."""

    def hertz(cell: str, n: int):
        m = rectangle(1.6, np.pi / 2, n, n, cell)
        x, angle, _ = m.points.T
        m = Mesh(np.stack([x, np.cos(angle), np.sin(angle)], axis=1), m.cells, m.cell_groups, m.point_groups)
        s = build_structure(m, [Member("surface", "shell", 0.0025, Material(70e9, 0.3, 2700.0))])
        return frequencies(s, s.clamped_dofs("left"), 4)

    exact = hertz("quad9", 16)
    with pytest.warns(PhysicsWarning, match="low modes bend smoothly and are within 1 % up to 2 sqrt"):
        np.testing.assert_allclose(hertz("quad", 16), exact, rtol=0.012)
        assert np.abs(hertz("quad", 8) / exact - 1).max() > 0.05
