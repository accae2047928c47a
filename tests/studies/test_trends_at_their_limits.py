"""Trends of few values, at the last change that counts, and laws without an error."""

from __future__ import annotations

import math

import numpy as np
import pytest

from femflex.studies import Law, mesh_trend, mode_trend

HALVED = 2.0 ** np.arange(5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_one_order_alone_leaves_the_whole_extrapolation_as_its_uncertainty(sign: float):
    """Values that fall to their limit and values that rise to it."""
    trend = mesh_trend(HALVED[:3], sign * (1.0 + HALVED[:3] ** -2))
    assert (trend.state, trend.rounded) == ("law", None)
    assert trend.limit == pytest.approx(sign, rel=1e-12)
    assert trend.spread == pytest.approx(1 / 16, rel=1e-9)
    assert trend.law is not None and trend.law.size == pytest.approx(1 / 16, rel=1e-9)
    assert math.isnan(trend.scatter)


@pytest.mark.parametrize("last", [6e-9, -8e-9])
def test_a_faint_change_that_does_not_fall_or_turns_round_is_rounding(last: float):
    """Of 1, -1e-8 and the last change, which turns round or does not fall by 0.7: it counts no more."""
    values = np.cumsum([1.0, 1.0, -1e-8, last])
    trend = mesh_trend(HALVED[:4], values)
    assert (trend.state, trend.limit, trend.spread, trend.rounded) == ("swinging", values[2], 1.0, 3)


def test_a_faint_change_that_goes_on_falling_is_no_rounding():
    values = np.cumsum([1.0, 1.0, -1e-8, -6e-9])
    trend = mesh_trend(HALVED[:4], values)
    assert trend.rounded is None and trend.limit != values[2]


def test_a_law_without_an_error_reaches_any_before_its_first_value():
    assert Law("algebraic", 2.0, 0.0, 4.0).reaches(1e-3) == 0.0
    assert Law("geometric", 2.0, 0.0, 4.0).reaches(1e-3) == -math.inf


@pytest.mark.parametrize(("kind", "there"), [("algebraic", 12.0), ("geometric", 4.0 + math.log(9.0) / 2.0)])
def test_a_law_reaches_an_error_where_it_has_it(kind: str, there: float):
    law = Law(kind, 2.0, 0.009, 4.0)  # type: ignore[arg-type]
    assert law.reaches(0.001) == pytest.approx(there, rel=1e-12)
    assert law.error([4.0, there]) == pytest.approx([0.009, 0.001], rel=1e-12)


def test_two_counts_of_modes_are_too_few_and_their_difference_is_told():
    trend = mode_trend([3, 5], [2.5, 2.0])
    assert (trend.state, trend.limit, trend.spread, trend.law, trend.rounded) == ("few", 2.0, 0.5, None, None)
    one = mode_trend([3], [2.5])
    assert (one.state, one.limit) == ("one", 2.5) and math.isnan(one.spread)


def test_counts_that_differ_by_rounding_alone_have_no_trend():
    trend = mode_trend([2, 3, 4], [1.0, 1.5, 1.25], noise=[0.125, 0.0625, 0.125])
    assert (trend.state, trend.limit, trend.spread) == ("constant", 1.25, 0.25)
    told = mode_trend([2, 3, 4], [1.0, 1.5, 1.25], noise=[0.3, 0.2, 0.3])
    assert (told.state, told.limit, told.spread) == ("constant", 1.25, 0.3)


def test_values_on_both_sides_of_the_last_swing_where_the_last_changes_are_the_small_ones():
    values = [0.0, 4.0, 2.5, 3.25, 3.0]
    trend = mode_trend([1, 2, 3, 4, 5], values)
    assert (trend.state, trend.limit, trend.spread) == ("swinging", 3.0, 0.75)
    near = mode_trend([1, 2, 3], [0.0, 4.0, 2.5])
    assert near.state == "unsettled" and math.isnan(near.limit) and math.isnan(near.spread)
