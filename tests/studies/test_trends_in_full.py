"""States, limits and uncertainties of sequences: rounding known and found, laws in part, changes without a law."""

from __future__ import annotations

import math

import numpy as np
import pytest

from femflex.studies import Law, Trend, extrapolated, mesh_trend, mode_trend, observed_order
from femflex.studies.decay import _fit


def test_orders_over_uneven_ladders_solve_their_equation():
    for x in ([1.0, 1.5, 4.0], [2.0, 6.0, 7.0]):
        for p in (0.4, 2.3, 7.0):
            v = 3.0 + 0.2 * np.array(x) ** -p
            assert observed_order(x, v) == pytest.approx(p, rel=1e-9)
            assert extrapolated(x[1:], v[1:], p) == pytest.approx(3.0)
    assert observed_order([1, 2, 8], [0.0, 1.0, 3.0]) == 0.0  # in steps of the logarithm: no fall at all
    assert observed_order([1, 2, 8], [0.0, 1.0, 2.9]) > 0.0
    assert observed_order([1, 2, 4], [0.0, 1.0, 2.0]) == 0.0 and math.isnan(observed_order([1, 2, 4], [0.0, 1.0, 1.0]))


def test_the_spread_and_scatter_of_a_law_are_of_the_last_levels_alone():
    """Orders 8, 2, 2.2, 2.1: the scatter is that of the last three; limits of the last two triples tell the spread."""
    x = 2.0 ** np.arange(6)
    ratios = [2.0**8, 2.0**2, 2.0**2.2, 2.0**2.1]
    v = np.cumsum([0.0, 1.0, *np.cumprod(1.0 / np.array(ratios))])
    found = mesh_trend(x, v)
    assert found.state == "law" and found.order == pytest.approx(2.1) and found.scatter == pytest.approx(0.1, rel=1e-6)
    last = v[-1] + (v[-1] - v[-2]) / (2**2.1 - 1)
    before = v[-2] + (v[-2] - v[-3]) / (2**2.2 - 1)
    assert found.limit == pytest.approx(last, rel=1e-14) and found.spread == pytest.approx(abs(last - before), rel=1e-6)
    assert found.law.size == pytest.approx(abs(last - v[-1]), rel=1e-6) and found.law.reference == 32.0
    assert found.law.kind == "algebraic" and found.rounded is None


def test_one_triple_is_uncertain_by_all_that_is_extrapolated():
    found = mesh_trend([1, 2, 4], [1.0, 0.5, 0.375])
    assert (
        found.limit == pytest.approx(1 / 3)
        and found.spread == pytest.approx(0.375 - 1 / 3)
        and math.isnan(found.scatter)
    )


@pytest.mark.parametrize(
    ("values", "state", "limit", "spread"),
    [
        ([0.0, 1.0, 1.9, 2.0], "settling", 2.0, 0.9),  # first triple: ratio 1.11, order 0.15
        ([0.0, 1.0, 0.5, 0.6, 0.58], "swinging", 0.58, 0.1),
        ([0.0, 1.0, 1.4, 1.3, 1.33, 1.335], "swinging", 1.335, 0.03),
    ],
)
def test_a_law_seen_once_against_values_that_deny_it_is_none(values, state, limit, spread):
    found = mesh_trend(2.0 ** np.arange(len(values)), values)
    assert (found.state, found.limit, found.law) == (state, limit, None) and found.spread == pytest.approx(spread)


def test_levels_beyond_rounding_are_left_out_and_their_changes_are_the_least_uncertainty():
    x = 2.0 ** np.arange(6)
    v = 1.0 + 0.1 * x**-4
    v[4:] = v[3] + np.array([3e-5, 1e-5])
    noise = np.array([1e-9, 1e-9, 1e-9, 1e-6, 2e-5, 4e-5])
    found = mesh_trend(x, v, noise)
    assert found.state == "law" and found.rounded == 4 and found.order == pytest.approx(4.0, rel=1e-3)
    assert found.spread == pytest.approx(3e-5)  # of the change to level 4, greater than rounding there
    louder = mesh_trend(x, v, np.array([1e-9, 1e-9, 1e-9, 5e-5, 2e-5, 4e-5]))
    assert louder.rounded == 4 and louder.spread == pytest.approx(5e-5)  # of rounding there
    few = mesh_trend(x[:3], [1.0, 2.0, 2.0 + 1e-6], 1e-6)
    assert (few.state, few.rounded, few.limit) == ("rounded", 2, 2.0) and few.spread == pytest.approx(1e-6)
    flat = mesh_trend(x[:3], [1.0, 1.0 + 2e-6, 1.0 - 1e-6], 3e-6)
    assert (flat.state, flat.limit, flat.rounded) == ("constant", 1.0, 1) and flat.spread == pytest.approx(3e-6)
    assert mesh_trend(x[:2], [1.0, 1.0 + 1e-6], 1e-6).state == "constant"


def test_changes_known_to_lie_within_the_rounding_of_both_levels_are_none():
    """Changes count from three times the sum of the roundings of either level on."""
    x = 2.0 ** np.arange(3)
    for noise, state in (([1.0, 0.0, 0.0], "rounded"), ([0.0, 0.0, 1.0], "rounded"), ([0.0, 0.0, 0.9], "law")):
        found = mesh_trend(x, [0.0, 4.9, 7.8], np.array(noise))
        assert found.state == state or noise[0] > 0
    assert mesh_trend(x, [0.0, 2.9, 3.9], np.array([1.0, 0.0, 0.0])).rounded is None
    assert mesh_trend(x, [0.0, 9.0, 11.9], np.array([0.0, 0.5, 0.5])).rounded == 2


def test_small_changes_that_do_not_fall_are_rounding_and_small_ones_that_fall_are_not():
    x = 2.0 ** np.arange(6)
    falling = 1.0 + 1e-7 * x**-2
    assert mesh_trend(x, falling).rounded is None and mesh_trend(x, falling).order == pytest.approx(2.0, rel=1e-3)
    stuck = np.array([1.0, 1.1, 1.12, 1.12 + 2e-7, 1.12 + 3.8e-7])
    assert mesh_trend(x[:5], stuck).rounded == 4
    back = np.array([1.0, 1.1, 1.12, 1.12 + 2e-7, 1.12 + 1.5e-7])
    assert mesh_trend(x[:5], back).rounded == 4
    large = np.array([1.0, 1.1, 1.12, 1.12 + 2e-3, 1.12 + 3.8e-3])
    assert mesh_trend(x[:5], large).rounded is None
    one_small = np.array([1.0, 1.1, 1.1 + 5e-7, 1.2, 1.22])  # a small change beside a large one is no rounding
    assert mesh_trend(x[:5], one_small).rounded is None


def test_differences_within_the_rounding_of_both_are_no_decay():
    n, noise = [1, 2, 3, 4], np.array([1e-3, 1e-3, 1e-3, 1e-3])
    found = mode_trend(n, [1.004, 0.997, 1.005, 1.0], noise)
    assert found.state == "constant" and found.spread == pytest.approx(5e-3) and found.limit == 1.0
    assert mode_trend(n, [1.008, 0.997, 1.005, 1.0], noise).state != "constant"
    lone = mode_trend([1, 2, 3], [1.004, 1.004, 1.0], np.array([2e-3, 0.0, 0.0]))
    assert lone.state != "constant"  # the second is beyond three times its own
    assert mode_trend([1, 2], [1.0, 1.5], 1e-3).state == "few"


def test_the_better_of_two_laws_is_taken_and_the_cautious_one_where_both_fit():
    n = np.arange(1.0, 9.0)
    sharp = mode_trend(n, 3.0 + np.exp(-0.8 * n))
    assert sharp.law.kind == "geometric" and sharp.spread < 1e-6
    flat = mode_trend(n, 3.0 + n**-3.0)
    assert flat.law.kind == "algebraic" and flat.spread < 1e-6
    laws = [_fit(kind, n[:3], 4.0, np.abs(np.array([1.0, 0.5, 0.2]))) for kind in ("algebraic", "geometric")]
    assert laws[0].law.size > laws[1].law.size  # a power leaves more


def test_only_the_last_counts_above_rounding_are_fitted():
    n = np.arange(1.0, 13.0)
    v = 3.0 + n**-4.0
    v[:4] = 3.0 + np.array([0.3, 0.28, 0.27, 0.2])  # follow no law yet
    found = mode_trend(n, v)
    assert found.law is not None and found.law.kind == "algebraic" and found.order == pytest.approx(4.0, rel=0.3)


def test_leaps_that_end_small_are_uncertain_by_the_last_two_changes():
    n = np.arange(1.0, 9.0)
    v = 2.0 + np.array([1.0, 0.9, 0.8, 1e-5, 0.9e-5, 0.85e-5, 0.4e-5, 0.0])
    found = mode_trend(n, v)
    assert found.state == "settling" and found.spread == pytest.approx(0.45e-5, rel=1e-5) and found.limit == 2.0
    signs = mode_trend(n, 2.0 + np.array([1.0, -0.9, 0.8, 1e-3, -0.9e-3, 1e-4, 2e-4, 0.0]))
    assert signs.state == "swinging" and signs.spread == pytest.approx(2e-4)
    large = mode_trend(n, 2.0 + np.array([1.0, -0.9, 0.8, 1e-3, -0.9e-3, 1e-4, 1.0, 0.0]))
    assert large.state == "unsettled" and math.isnan(large.limit)
    louder = mode_trend(n, 2.0 + np.array([1.0, -0.9, 0.8, 1e-3, -0.9e-3, 1e-4, 2e-4, 0.0]), 1e-5 * np.arange(8))
    assert louder.spread == pytest.approx(2e-4)


def test_a_law_says_its_error_and_where_it_reaches_one():
    power, exponential = Law("algebraic", 2.0, 0.3, 4.0), Law("geometric", 0.5, 0.3, 4.0)
    assert power.error([2.0, 8.0]) == pytest.approx([1.2, 0.075])
    assert exponential.error([2.0, 8.0]) == pytest.approx([0.3 * math.e, 0.3 * math.exp(-2)])
    assert power.reaches(0.075) == pytest.approx(8.0) and exponential.reaches(0.3 * math.exp(-2)) == pytest.approx(8.0)
    assert Law("algebraic", 2.0, 0.0, 4.0).reaches(0.1) == 0.0 and math.isnan(Trend("one", 1.0, 0.0).order)
