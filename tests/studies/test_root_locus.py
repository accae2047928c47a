"""The root locus of a damped hinge against its closed form."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.case import CaseError
from femflex.case.read import parse_case
from femflex.studies.linear.root_locus import root_locus

HINGE = """
title = "a wheel on a sprung axle"
[run]
duration = "1 s"
[bodies.wheel]
kind = "rigid"
mass = 3
inertia = [2, 2, 2]
[[joints]]
kind = "revolute"
child = "wheel"
name = "axle"
stiffness = 8
damping = 1
"""


def test_poles_move_along_a_circle_as_the_damping_grows():
    """s = -d / 2 J +- i sqrt(k / J - (d / 2 J)^2): |s| stays at 2 rad/s."""
    dampings = [0.0, 1.0, 2.0, 4.0, 6.0]
    found = root_locus(parse_case(HINGE), "joints.0.damping", dampings)
    real = -np.array(dampings) / 4.0
    for branch, side in zip(found.poles.T, (1.0, -1.0) if found.poles[0, 0].imag > 0 else (-1.0, 1.0), strict=True):
        assert branch == pytest.approx(real + side * 1j * np.sqrt(4.0 - real**2), abs=1e-8)
    assert found.path == "joints.0.damping" and found.values == tuple(dampings)


def test_a_path_that_is_not_in_the_case_is_refused():
    with pytest.raises(CaseError, match="joints is a list of 1"):
        root_locus(parse_case(HINGE), "joints.3.damping", [1.0])


def test_a_locus_over_no_values_is_refused():
    with pytest.raises(ValueError, match=r"a root locus over joints\.0\.damping got no values; give it at least one"):
        root_locus(parse_case(HINGE), "joints.0.damping", [])
