"""Orders, limits and states of made-up sequences whose law is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from femflex.studies import Law, extrapolated, mesh_trend, mode_trend, observed_order

HALVED = 2.0 ** np.arange(5)
COUNTS = np.array([1, 2, 3, 4, 6, 8, 12, 16])


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0, 6.5])
@pytest.mark.parametrize("ladder", [HALVED, np.array([1.0, 2.0, 8.0, 16.0]), np.array([3.0, 4.0, 6.0, 11.0])])
def test_order_and_limit_of_a_power_of_the_cell_size_are_recovered(order: float, ladder: np.ndarray):
    trend = mesh_trend(ladder, 5.0 - 0.01 * (ladder / ladder[0]) ** -order)
    assert trend.state == "law"
    assert trend.order == pytest.approx(order, rel=1e-6)
    assert trend.scatter < 1e-5
    assert trend.limit == pytest.approx(5.0, abs=1e-12)
    assert trend.spread < 1e-11
    assert trend.law is not None
    np.testing.assert_allclose(trend.law.error(ladder), 0.01 * (ladder / ladder[0]) ** -order, rtol=1e-5)


def test_three_values_give_the_textbook_order():
    assert observed_order([1, 2, 4], [1.0, 0.5, 0.375]) == pytest.approx(math.log(0.5 / 0.125) / math.log(2))
    assert extrapolated([1, 2], [1.0, 0.25], 2.0) == 0.0
    assert math.isnan(observed_order([1, 2, 4], [1.0, 0.5, 0.75]))
    assert observed_order([1, 2, 4], [1.0, 0.5, -0.5]) == 0.0


def test_a_second_term_shows_as_scatter_and_is_covered_by_the_uncertainty():
    trend = mesh_trend(HALVED, 1.0 + HALVED**-2 + 0.3 * HALVED**-3.0)
    assert trend.order == pytest.approx(2.0, abs=0.1)
    assert 0.01 < trend.scatter < 0.3
    assert abs(trend.limit - 1.0) < trend.spread < 1e-3


def test_the_spread_is_what_the_limit_moved_by_with_the_last_level():
    x, values = HALVED[:4], 1.0 + HALVED[:4] ** -2 + 0.3 * HALVED[:4] ** -3.0
    limits = [
        extrapolated(x[k : k + 2], values[k : k + 2], observed_order(x[k - 1 : k + 2], values[k - 1 : k + 2]))
        for k in (1, 2)
    ]
    assert mesh_trend(x, values).spread == pytest.approx(abs(limits[1] - limits[0]), rel=1e-12)


@pytest.mark.parametrize("rate", [1.0, 3.7, 8.0])
def test_an_algebraic_decay_over_modes_is_recovered(rate: float):
    trend = mode_trend(COUNTS, 2.0 + 0.3 * COUNTS**-rate)
    assert trend.law is not None and trend.law.kind == "algebraic"
    assert trend.order == pytest.approx(rate, rel=1e-7)
    assert trend.limit == pytest.approx(2.0, abs=1e-9)
    assert trend.law.error(4.0) == pytest.approx(0.3 * 4.0**-rate, rel=1e-6)


@pytest.mark.parametrize("factor", [0.9, 0.5, 0.2])
def test_a_geometric_decay_over_modes_is_recovered(factor: float):
    n = COUNTS[:6]
    trend = mode_trend(n, 2.0 - 0.3 * factor**n)
    if factor == 0.9:  # falls by half over the ladder: too little to speak of a limit
        assert trend.state == "unsettled"
        return
    assert trend.law is not None and trend.law.kind == "geometric"
    assert math.exp(-trend.order) == pytest.approx(factor, rel=1e-9)
    assert trend.limit == pytest.approx(2.0, abs=1e-12)


def test_modes_that_take_no_part_do_not_hide_the_decay():
    used = np.array([1, 1, 3, 3, 5, 7, 11, 15])  # only odd modes count
    trend = mode_trend(COUNTS, 1.0 + used**-4.0)
    assert trend.law is not None and 3.0 < trend.order < 6.0
    assert abs(trend.limit - 1.0) < 1e-5


def test_errors_that_fall_in_leaps_follow_no_law():
    """Two leaps by a hundred thousand: no power and no exponential is within a factor e of them all."""
    errors = np.array([1.0, 0.9, 0.8, 1e-5, 0.9e-5, 0.8e-5, 1e-10, 0.0])
    trend = mode_trend(COUNTS, 2.0 + errors)
    assert trend.state == "settling" and trend.law is None
    assert trend.limit == 2.0 and trend.spread > 0.7e-5


def test_three_counts_cannot_tell_the_law_and_the_cautious_one_is_taken():
    trend = mode_trend([1, 2, 4], 1.0 + 0.1 ** np.array([1, 2, 4]))
    assert trend.law is not None and trend.law.kind == "algebraic"
    assert math.isnan(trend.scatter)
    assert trend.spread == trend.law.size


@pytest.mark.parametrize("follow", [mode_trend, mesh_trend])
@pytest.mark.parametrize("growth", [lambda x: x, np.log, lambda x: x**0.05, lambda x: -(x**2)])
def test_values_that_grow_have_no_limit(follow, growth):
    trend = follow(HALVED, growth(HALVED))
    assert trend.state == "unsettled" and math.isnan(trend.limit) and math.isnan(trend.order)


@pytest.mark.slow
@pytest.mark.parametrize("follow", [mode_trend, mesh_trend])
def test_values_without_any_trend_are_given_a_law_by_rare_chance_alone(follow):
    """Of seven numbers drawn at random 4 (over modes) and 8 (over meshes) in a thousand lie on a power law."""
    rng = np.random.default_rng(3)
    drawn = 1.0 + 0.1 * rng.standard_normal((500, 7))
    trends = [follow(2.0 ** np.arange(7), v) for v in drawn]
    assert sum(trend.state == "law" for trend in trends) <= 12
    lawless = [(trend, v) for trend, v in zip(trends, drawn, strict=True) if trend.state in ("settling", "swinging")]
    assert len(lawless) > 50
    for trend, v in lawless:
        assert trend.law is None and trend.limit == v[-1]
        assert trend.spread >= abs(v[-1] - v[-2])  # what it still moves by
    for trend in trends:
        if trend.state == "unsettled":
            assert math.isnan(trend.limit) and math.isnan(trend.spread)


@pytest.mark.parametrize("follow", [mode_trend, mesh_trend])
def test_values_that_swing_towards_their_limit_are_not_extrapolated(follow):
    trend = follow(HALVED, 1.0 + (-0.2) ** np.arange(5))
    assert trend.state == "swinging" and trend.law is None
    assert abs(trend.limit - 1.0) <= trend.spread < 0.06


@pytest.mark.parametrize("follow", [mode_trend, mesh_trend])
def test_few_values_are_called_few(follow):
    assert follow([1.0], [3.0]).state == "one"
    two = follow([1.0, 2.0], [3.0, 3.5])
    assert (two.state, two.limit, two.spread) == ("few", 3.5, 0.5)


@pytest.mark.parametrize("follow", [mode_trend, mesh_trend])
def test_equal_values_are_constant(follow):
    trend = follow(HALVED, np.full(5, 0.3) + 1e-16 * np.arange(5), 1e-15)
    assert trend.state == "constant" and trend.limit == pytest.approx(0.3) and trend.spread <= 1e-15


def test_rounding_is_met_where_changes_stop_falling():
    rounding = np.array([0, 0, 0, 0, 2e-9, -3e-9, 1e-8])
    x = 2.0 ** np.arange(7)
    trend = mesh_trend(x, 1.0 + 1e-3 * x**-4 + rounding)
    assert trend.rounded == 6  # the change to level 5 is still mostly the law's
    assert trend.order == pytest.approx(4.0, abs=0.5)
    assert abs(trend.limit - 1.0) < trend.spread < 2e-8


def test_rounding_is_met_where_changes_fall_below_what_is_known_of_it():
    x = 2.0 ** np.arange(5)
    v = 1.0 + 1e-3 * x**-4
    assert mesh_trend(x, v).rounded is None
    noise = 1e-9 * x**2
    told = mesh_trend(x, v, noise)
    assert told.rounded == 4 and told.spread >= noise[3]
    assert mesh_trend(x, v, 1e-6).state == "law"
    assert mesh_trend(x, v, 1e-5).state == "rounded"
    assert mesh_trend(x, v, 1e-3).state == "constant"


@pytest.mark.parametrize("law", [Law("algebraic", 4.0, 1e-3, 8.0), Law("geometric", 0.7, 1e-3, 8.0)])
def test_a_law_reaches_the_error_where_it_has_that_error(law: Law):
    assert law.error(8.0) == 1e-3
    for error in (1e-1, 1e-3, 1e-7):
        assert law.error(law.reaches(error)) == pytest.approx(error)
