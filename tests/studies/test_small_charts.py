"""Charts of a few points: a rigid craft over its inertia ratios, by equilibria and by motions."""

from __future__ import annotations

import numpy as np
import pytest
from support.rigid_stability import rigid_kind
from support.small_cases import HUB_AND_BAR

from femflex.case import CaseError
from femflex.case.read import parse_case
from femflex.studies.stability import case_stability

ORBITER = (
    HUB_AND_BAR
    + """{more}
vary.k_yaw = {{ between = [-0.5, 0.4], points = 2 }}
vary.k_roll = {{ between = [-0.3, 0.7], points = 3 }}
"""
)
YAW, ROLL = (-0.5, 0.4), (-0.3, 0.2, 0.7)


ROD = """
[bodies.rod]
kind = "analytic"
length = 6
mass = 0.1
EA = 1e5
EIy = {EI}
EIz = {EI}
GJ = 10
functions = {{ y = 1, z = 1 }}
strain = "linear"
[[joints]]
kind = "weld"
parent = "hub"
child = "rod"
"""


def test_a_second_chart_leaves_flexibility_out_and_progress_goes_over_both():
    """A rod as soft as its weight in the orbit bends for good; stiffened the craft is the rigid one."""
    done: list[float] = []
    text = ORBITER.format(more='without = ["flexibility"]').replace("points = 3", "points = 2")
    case = parse_case(text + ROD.format(EI=1e-7))
    found = case_stability(case, done.append)
    assert found.ratios and found.left_out == ("flexibility",)
    assert found.found.names == ("k_yaw", "k_roll") and found.second.units == ("", "")
    assert found.second.kinds.tolist() == [[rigid_kind(roll, yaw) for roll in ROLL[::2]] for yaw in YAW]
    assert found.found.kinds.shape == (2, 2) and not (found.found.kinds > 0).any()
    assert done == pytest.approx(np.arange(1, 9) / 8)


def test_motions_over_the_ratios_grow_where_the_equilibrium_does():
    """Over an orbit of its own period; where it is stable all multipliers lie on the unit circle."""
    more = 'of = "motion"'
    text = ORBITER.format(more=more).replace("points = 3", "points = 2").replace("[-0.5, 0.4]", "[-0.5, 0.2]")
    found = case_stability(parse_case(text)).found
    wanted = [[rigid_kind(roll, yaw) > 0 for roll in (-0.3, 0.7)] for yaw in (-0.5, 0.2)]
    assert (found.kinds > 0).tolist() == wanted and not (found.kinds == -1).any()
    assert np.abs(found.growth[np.array(wanted)]).max(initial=0.0) < 1e-9
    assert (found.growth[~np.array(wanted)] > 1e-5).all()


def test_a_craft_without_an_orbit_has_no_inertia_ratios():
    text = ORBITER.format(more="").replace('[orbit]\nkind = "specified"\nperigee_altitude = "600 km"\n', "")
    with pytest.raises((CaseError, ValueError), match="inertia ratios are those of a craft in the orbital frame"):
        case_stability(parse_case(text.replace("orbits = 1", "duration = 1")))
