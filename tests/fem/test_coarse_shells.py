"""Warnings of four-node shells that are too coarse on curved shells, against the error they name."""

from __future__ import annotations

import re
import warnings

import pytest
from shell_problems import pinched_cylinder, ratio

from femflex.warning import PhysicsWarning


def test_coarse_four_node_elements_of_a_pinched_cylinder_are_warned_of_with_their_error():
    """8 x 8: 2 sqrt(R h) long; the warning names 1.3 times the stiffness, 1.32 is found."""
    problem = pinched_cylinder("quad", 8)
    with pytest.warns(PhysicsWarning, match="64 of 64 four-node elements are longer than sqrt") as given:
        found = ratio(problem)
    named = float(re.search(r"up to ([\d.]+) times as stiff", str(given[0].message))[1])
    assert named == pytest.approx(1 / found, rel=0.1)


@pytest.mark.parametrize(("cell", "n"), [("quad", 16), ("quad9", 4)])
def test_finer_and_second_order_elements_are_not_warned_of(cell, n):
    with warnings.catch_warnings():
        warnings.simplefilter("error", PhysicsWarning)
        ratio(pinched_cylinder(cell, n))
