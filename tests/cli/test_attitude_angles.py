"""The line after a run whose attitude came near the singularity of its angles."""

import numpy as np
import pytest

from femflex.cli.attitude_angles import angle_lines
from femflex.rotations import angles_from_dcm, dcm_from_angles

T = np.linspace(0, 1, 101)


class Rows(dict):
    """A run of attitude angles (n_t, 3) [rad]."""

    def names(self, path):
        return ("a", "b", "c")


def seen(C, sequence):
    return angle_lines(Rows({"attitude/angles": angles_from_dcm(C, sequence)}), sequence)


def spun(axis):
    """A turn and a half about an axis, tilted by 3 deg about another."""
    order = axis + "xyz".replace(axis, "")
    return dcm_from_angles(np.stack([3 * np.pi * T, np.radians(3) * T, 0 * T], axis=1), order)


@pytest.mark.parametrize(("axis", "sequence"), [("z", "xzy"), ("x", "zxy"), ("y", "xyx"), ("z", "extrinsic yzx")])
def test_a_spin_about_the_middle_axis_is_answered_with_a_sequence_that_begins_with_it(axis, sequence):
    (line,) = seen(spun(axis), sequence)
    named = line.split('sequence = "')[1][:3]
    assert named[0] == axis and "where a and c are not unique" in line
    assert seen(spun(axis), named) == []


def test_a_tumble_that_no_sequence_avoids_is_answered_with_euler_parameters():
    turns = [dcm_from_angles(np.stack([2 * np.pi * T, 0 * T, 0 * T], axis=1), order) for order in ("xyz", "yzx", "zxy")]
    (line,) = seen(np.concatenate(turns), "xzy")
    assert "Every sequence" in line and "Euler parameters" in line


def test_an_attitude_that_stays_at_the_singularity_or_clear_of_it_has_no_line():
    assert seen(dcm_from_angles(np.tile([0.1, np.pi / 2, 0.0], (5, 1)), "xzy"), "xzy") == []
    assert seen(spun("x"), "xzy") == []
