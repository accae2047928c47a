"""Orders and limits of sequences whose law is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from femflex.studies import Law, extrapolated, mesh_trend, mode_trend, observed_order
from femflex.studies.convergence import within_tolerance

HALVED = 2.0 ** np.arange(5)
COUNTS = np.array([1, 2, 3, 4, 6, 8, 12, 16])


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0, 6.5])
@pytest.mark.parametrize("ladder", [HALVED, np.array([1.0, 2.0, 8.0, 16.0]), np.array([3.0, 4.0, 6.0, 11.0])])
def test_order_and_limit_of_a_power_law(order: float, ladder: np.ndarray):
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


def test_second_term_is_covered_by_the_uncertainty():
    trend = mesh_trend(HALVED, 1.0 + HALVED**-2 + 0.3 * HALVED**-3.0)
    assert trend.order == pytest.approx(2.0, abs=0.1)
    assert 0.01 < trend.scatter < 0.3
    assert abs(trend.limit - 1.0) < trend.spread < 1e-3


@pytest.mark.parametrize("rate", [1.0, 3.7, 8.0])
def test_algebraic_decay_over_modes(rate: float):
    trend = mode_trend(COUNTS, 2.0 + 0.3 * COUNTS**-rate)
    assert trend.law is not None and trend.law.kind == "algebraic"
    assert trend.order == pytest.approx(rate, rel=1e-7)
    assert trend.limit == pytest.approx(2.0, abs=1e-9)
    assert trend.law.error(4.0) == pytest.approx(0.3 * 4.0**-rate, rel=1e-6)


@pytest.mark.parametrize("factor", [0.9, 0.5, 0.2])
def test_geometric_decay_over_modes(factor: float):
    n = COUNTS[:6]
    trend = mode_trend(n, 2.0 - 0.3 * factor**n)
    if factor == 0.9:  # falls by half over the ladder: too little to speak of a limit
        assert trend.state == "unsettled"
        return
    assert trend.law is not None and trend.law.kind == "geometric"
    assert math.exp(-trend.order) == pytest.approx(factor, rel=1e-9)
    assert trend.limit == pytest.approx(2.0, abs=1e-12)


@pytest.mark.parametrize("follow", [mode_trend, mesh_trend])
@pytest.mark.parametrize("growth", [lambda x: x, np.log, lambda x: x**0.05, lambda x: -(x**2)])
def test_values_that_grow_have_no_limit(follow, growth):
    trend = follow(HALVED, growth(HALVED))
    assert trend.state == "unsettled" and math.isnan(trend.limit) and math.isnan(trend.order)


@pytest.mark.parametrize("follow", [mode_trend, mesh_trend])
def test_oscillating_values_are_not_extrapolated(follow):
    trend = follow(HALVED, 1.0 + (-0.2) ** np.arange(5))
    assert trend.state == "swinging" and trend.law is None
    assert abs(trend.limit - 1.0) <= trend.spread < 0.06


@pytest.mark.parametrize(
    ("values", "state"),
    [
        ([0.0283307084, 0.0283307084, 0.0283307385, 0.0283307393], "constant"),  # all within 1e-3
        ([1.64200, 1.64200, 1.63460, 1.63494], "settling"),  # the second mode takes no part
        ([1.0, 1.0, 1.1, 1.2], "unsettled"),
    ],
)
def test_change_below_the_tolerance_is_converged_whatever_came_before(values, state):
    v = np.array(values) + 1e-16 * np.arange(4)
    trend = within_tolerance(mode_trend([1, 2, 4, 8], v), v, 1e-3)
    assert trend.state == state


def test_rounding_ends_the_fit():
    rounding = np.array([0, 0, 0, 0, 2e-9, -3e-9, 1e-8])
    x = 2.0 ** np.arange(7)
    trend = mesh_trend(x, 1.0 + 1e-3 * x**-4 + rounding)
    assert trend.rounded == 6  # the change to level 5 is still mostly the law's
    assert trend.order == pytest.approx(4.0, abs=0.5)
    assert abs(trend.limit - 1.0) < trend.spread < 2e-8


@pytest.mark.parametrize("law", [Law("algebraic", 4.0, 1e-3, 8.0), Law("geometric", 0.7, 1e-3, 8.0)])
def test_law_and_its_inverse(law: Law):
    assert law.error(8.0) == 1e-3
    for error in (1e-1, 1e-3, 1e-7):
        assert law.error(law.reaches(error)) == pytest.approx(error)


def test_order_over_uneven_levels():
    for x in ([1.0, 1.5, 4.0], [2.0, 6.0, 7.0]):
        for p in (0.4, 2.3, 7.0):
            v = 3.0 + 0.2 * np.array(x) ** -p
            assert observed_order(x, v) == pytest.approx(p, rel=1e-9)
            assert extrapolated(x[1:], v[1:], p) == pytest.approx(3.0)
    assert observed_order([1, 2, 8], [0.0, 1.0, 3.0]) == 0.0  # in steps of the logarithm: no fall at all
    assert observed_order([1, 2, 8], [0.0, 1.0, 2.9]) > 0.0
    assert observed_order([1, 2, 4], [0.0, 1.0, 2.0]) == 0.0 and math.isnan(observed_order([1, 2, 4], [0.0, 1.0, 1.0]))
