"""Which coordinates of a run are reported, and how much of it fits a picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femflex.studies.explain import Explanation, chosen, readable_span

TIME = np.linspace(0.0, 100.0, 4001)
NAMES = ("base-hub.omega_x", "base-hub.omega_y", "base-hub.slide_rate", "boom.delta1_rate", "boom.delta2_rate")
UNITS = ("N m", "N m", "N", "kg^1/2 m/s^2", "kg^1/2 m/s^2")


@pytest.fixture
def found() -> Explanation:
    """Forces of known size on five coordinates; those on the slide are two halves of inertia that cancel."""
    push = np.outer(np.cos(2.0 * np.pi * TIME), [0.0, 5.0, 0.0, 1e-5, 2.0])
    push[:, 0] = 3.0 * np.cos(0.2 * TIME)
    half = push.copy()
    half[:, 2] = 50.0 * np.cos(TIME)
    inertia = {"inertia/base-hub": -half, "inertia/boom": half - push}
    own = ("inertia/base-hub",) * 3 + ("inertia/base-hub",) * 2
    u = np.outer(np.sin(2.0 * np.pi * TIME), [0.0, 1.0, 1.0, 1.0, 0.5])
    u[:, 0] = 0.01 * np.sin(0.2 * TIME)
    return Explanation(TIME, {"inertia": -push, "loads/push": push}, inertia, u, NAMES, UNITS, own)


def test_the_coordinates_through_which_most_energy_goes_are_told_of(found):
    assert found.dominant_coordinates() == [
        0,
        1,
        4,
    ]  # not the slide, whose parts cancel, nor boom.delta1
    still = replace(found, u=found.u * [1.0, 0.0, 1.0, 1.0, 1.0])
    assert still.dominant_coordinates() == [0, 4]  # what does not move takes no energy, however hard it is pushed


def test_a_short_spike_does_not_make_a_coordinate_telling(found):
    spiked = {name: rows.copy() for name, rows in found.terms.items()}
    spiked["loads/push"][0, 3], spiked["inertia"][0, 3] = 1e3, -1e3
    assert replace(found, terms=spiked).dominant_coordinates() == [0, 1, 4]


def test_sizes_are_peaks_with_their_sign_and_root_mean_squares(found):
    sizes = found.sizes(1)
    assert sizes["inertia"][0] == -5.0 and sizes["loads/push"][1] == pytest.approx(5 / np.sqrt(2), rel=1e-3)
    assert set(sizes) == {"inertia", "loads/push", "inertia/base-hub", "inertia/boom"}
    assert found.remainder == 0.0 and set(found.parts) == {"loads/push", "inertia/base-hub", "inertia/boom"}


def test_what_lies_until_an_instant_has_that_instant_too(found):
    short = found.until(float(TIME[7]))
    assert np.array_equal(short.time, TIME[:8]) and np.array_equal(short.u, found.u[:8])
    assert all(len(rows) == 8 for rows in (*short.terms.values(), *short.inertia.values()))


def test_a_picture_ends_where_swings_can_still_be_told_apart(found):
    assert readable_span(found, [0]) == (0.0, 100.0)  # three periods
    first, last = readable_span(found, [0, 1])  # one hundred
    assert first == 0.0 and last == pytest.approx(12.25, abs=0.05)  # after 24 half periods and the first quarter


def test_coordinates_go_by_name_by_short_name_and_by_number(found):
    assert chosen(found, ["boom.delta2_rate", "boom.delta1", "2"]) == [4, 3, 1]
    assert chosen(found, ["all"]) == [0, 1, 2, 3, 4] and chosen(found, []) == [0, 1, 4]
    with pytest.raises(KeyError, match=r"'pitch' is not a coordinate of the run; known are \['base-hub.omega_x'"):
        found.index("pitch")
    with pytest.raises(KeyError, match="'6' is not a coordinate"):
        found.index("6")


def test_the_energy_of_a_coordinate_is_the_work_that_goes_to_and_fro(found):
    """5 cos(2 pi t) sin(2 pi t) swings its work by 5 / (4 pi) in each of two terms; pushed slowly far more comes by."""
    assert found.energies()[1] == pytest.approx(
        2 * 5 / (4 * np.pi), rel=1e-2
    )  # of the trapezoidal rule: (4 pi h)^2 / 12
    assert found.energies()[0] == pytest.approx(2 * 0.01 * 3 / 0.4, rel=3e-3)


def test_the_remainder_is_a_share_of_the_largest_term_and_zero_at_rest(found):
    push = found.terms["loads/push"]
    assert replace(found, terms={"inertia": -0.9 * push, "loads/push": push}).remainder == pytest.approx(0.1)
    assert replace(found, terms={"inertia": 0.0 * push, "loads/push": 0.0 * push}).remainder == 0.0
