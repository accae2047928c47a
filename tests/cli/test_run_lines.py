"""Lines after a run on wheels at their limits and on joints that were released."""

import numpy as np

from femflex.cli.run_report import latch_lines, wheel_lines


class Rows(dict):
    """Channels by path, as a run has them."""

    time = np.array([0.0, 1.0, 2.0, 3.0])


def test_a_saturated_wheel_is_named_with_the_part_of_the_rows_and_the_times():
    run = Rows({"effectors/x/saturated": np.array([0.0, 1.0, 1.0, 0.0]), "effectors/y/saturated": np.zeros(4)})
    assert wheel_lines(run) == ["wheel       x was saturated in 50% of the rows, first at t = 1 s, last at t = 2 s"]


def test_a_released_joint_is_named_with_the_time_of_its_release_between_two_rows():
    run = Rows({"latches/rail.slide/time": np.array([0.0, 0.0, -3.25, -3.25])})
    assert latch_lines(run) == ["latch       rail.slide was released at t = 1.25 s"]
