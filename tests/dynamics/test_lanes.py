"""Lanes and formulas give compiled what plain Python gives."""

import numpy as np
import pytest
from numba import njit
from numba.core.errors import NumbaError

from femflex.dynamics.arithmetic import lanes as L
from femflex.dynamics.arithmetic.formula import formula

RNG = np.random.default_rng(1)


@formula
def sum_of_products(a, b):
    """A formula with a loop and an integer factor."""
    return sum(2 * a[k] * b[k] for k in range(len(a)))


@formula
def limited(a):
    """A formula that branches, which it must not."""
    return a if a > 0.0 else 0.0


def both(function, *arguments):
    """The compiled and the plain answer."""
    return function(*arguments), function.py_func(*arguments)


@njit
def reductions(a, out):
    rows = L.lane(a, 0), L.lane(a, 4), L.lane(a, 8), L.lane(a, 12)
    L.put(out, 0, L.totals(rows[0], rows[1], rows[2], rows[3]))
    L.put(out, 4, L.cross_lane(rows[0], rows[1]))
    columns = L.transposed(rows[0], rows[1], rows[2], rows[3])
    L.put(out, 8, 2.0 * columns[1] - columns[2] * columns[3])
    L.put(out, 12, L.with_last(L.lane_of(a[3], 0.0, a[1], 7.0), L.total(rows[2])) + L.nothing())
    out[16] = L.last(rows[3]) * sum_of_products((a[0], a[1]), (a[2], a[3]))


@njit
def entered_past(a, out):
    p = L.beyond(a, 3)
    L.start(out)[1] = p[2] + L.root(p[0]) + L.sine(p[1]) * L.cosine(p[1])


def test_lane_operations_agree_with_their_plain_forms():
    a = RNG.normal(size=16)
    compiled, plain = np.zeros(17), np.zeros(17)
    reductions(a, compiled)
    reductions.py_func(a, plain)
    rows = a.reshape(4, 4)
    expected = [*rows.sum(1), *np.cross(rows[0, :3], rows[1, :3]), 0.0, *(2 * rows[:, 1] - rows[:, 2] * rows[:, 3])]
    expected += [a[3], 0.0, a[1], rows[2].sum(), a[15] * 2 * (a[0] * a[2] + a[1] * a[3])]
    assert compiled == pytest.approx(expected, abs=1e-14)
    assert plain == pytest.approx(expected, abs=1e-14)


def test_pointers_reach_what_slices_reach():
    a = np.abs(RNG.normal(size=8))
    compiled, plain = np.zeros(2), np.zeros(2)
    entered_past(a, compiled)
    entered_past.py_func(a, plain)
    assert compiled == pytest.approx([0.0, a[5] + np.sqrt(a[3]) + np.sin(2 * a[4]) / 2], abs=1e-14)
    assert plain == pytest.approx(compiled, abs=1e-14)


@pytest.mark.parametrize(("pivot", "expected"), [(4.0, 0.25), (0.0, np.nan), (-1.0, np.nan), (np.nan, np.nan)])
def test_reciprocal_of_a_pivot_that_is_not_positive_is_not_a_number(pivot, expected):
    compiled = njit(lambda d: L.reciprocal(d))
    np.testing.assert_equal([compiled(pivot), L.reciprocal(pivot)], [expected, expected])


def test_rows_are_filled_up_to_whole_lanes():
    assert [L.padded(n) for n in (0, 1, 4, 5, 10)] == [0, 4, 4, 8, 12]


def test_a_formula_that_branches_is_refused_with_what_to_do():
    with pytest.raises((NumbaError, TypeError), match="a formula has no branches; compile the function with `inner`"):
        njit(lambda a: limited(a))(1.0)
