"""Natural motions of a craft at rest: which of them bend bodies, and which of those are looked at."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.dynamics.equilibria.rest_modes import RestModes, rest_modes
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import System, free, revolute, weld

BEAM = UniformBeam(1.0, EA=1e4, EIy=10.0, EIz=1.0, GJ=10.0, mass_per_length=1.0, rotary_inertia=False)


def test_a_rigid_arm_on_a_spring_swings_without_being_an_elastic_mode():
    """sqrt(k / J) about its hinge, far below the boom's 3.516."""
    boom = beam_body(BEAM, BeamFunctions(y=4, z=0))
    arm = rigid_body(1.0, np.eye(3))
    hinge = revolute("arm", axis=(0, 0, 1), stiffness=0.25)
    found = rest_modes(System({"boom": boom, "arm": arm}, (weld("boom", child_marker="root"), hinge)))
    assert found.omega[:2] == pytest.approx([0.5, 3.516015], rel=1e-5)
    assert found.elastic.tolist() == [False, *[True] * 4]


def test_a_free_craft_has_six_motions_of_frequency_zero_that_are_not_elastic():
    hub = rigid_body(0.5, 0.1 * np.eye(3), markers={"rim": Marker.rigid(np.array([0.1, 0.0, 0.0]))})
    boom = beam_body(BEAM, BeamFunctions(y=4, z=0))
    joints = (free("hub"), weld("boom", "hub", parent_marker="rim", child_marker="root"))
    found = rest_modes(System({"hub": hub, "boom": boom}, joints))
    assert not found.omega[:6].any() and not found.elastic[:6].any() and found.elastic[6:].all()


@pytest.mark.parametrize(
    ("count", "band", "numbers"),
    [(1, 0.0, [1]), (2, 0.0, [1, 3, 4]), (1, 5.0, [1, 3, 4, 5]), (1, 4.0, [1, 3, 4]), (9, 0.0, [1, 3, 4, 5, 6])],
)
def test_the_lowest_elastic_modes_are_those_counted_with_a_close_pair_whole_and_all_below_a_band(count, band, numbers):
    hertz = np.array([0.0, 1.0, 2.0, 3.0, 3.02, 4.5, 20.0])
    elastic = np.array([False, True, False, True, True, True, True])
    assert RestModes(2 * np.pi * hertz, elastic, {}).lowest_elastic(count, band).tolist() == numbers
