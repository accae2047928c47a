"""Quantities along a member: numbers, tables and formulas, and the sentences on bad ones."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem.along import along, varies
from femflex.fem.formula import formula

S = np.linspace(0.0, 4.0, 9)


def test_a_number_is_the_same_everywhere():
    assert np.array_equal(along(2.5, S, 4.0), np.full(9, 2.5))
    assert not varies(2.5)
    assert not varies(np.float64(2.5))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("3 - 0.5*s", 3 - 0.5 * S),
        ("2 * (1 - s/L)**3", 2 * (1 - S / 4) ** 3),
        ("-s + +1", 1 - S),
        ("exp(-s) * sin(pi * s / L)", np.exp(-S) * np.sin(np.pi * S / 4)),
        ("max(1, min(s, 2))", np.clip(S, 1, 2)),
        ("1e-3", np.full(9, 1e-3)),
    ],
)
def test_a_formula_is_its_arithmetic(text, expected):
    assert varies(text)
    assert along(text, S, 4.0) == pytest.approx(expected, rel=1e-15, abs=1e-16)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').getcwd()",
        "s.__class__",
        "[s for s in (1, 2)]",
        "(lambda: 1)()",
        "s if s else 1",
        "open('x')",
        "s[0]",
        "exp(s, s, s, s)",
        "x + 1",
        "True",
        "'a' * 3",
        "s @ s",
        "exp(x=s)",
        "1j * s",
        "s < 1",
        "s // 2",
        "~1",
        "s\n+1",
        "exp",
        "(s, s)",
    ],
)
def test_a_formula_runs_nothing_but_arithmetic(text):
    with pytest.raises(ValueError, match="formula"):
        along(text, S, 4.0)


def test_a_formula_names_what_it_may_use():
    with pytest.raises(ValueError, match=r"holds 'x'; it may use the names \['L', 'pi', 's'\]"):
        along("2 * x", S, 4.0)
    with pytest.raises(ValueError, match="cannot be read"):
        along("2 *", S, 4.0)


@pytest.mark.parametrize("text", ["1 / s", "log(s - 1)", "10.0 ** 999", "9**9**9**9"])
def test_a_value_that_is_not_finite_is_refused_with_its_place(text):
    with pytest.raises(ValueError, match="must be finite along the whole member"):
        along(text, S, 4.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("max(0.02, 0.03, 0.08 + 0*s)", np.full(9, 0.08)),
        ("min(s, 2, 1 + 0*s, 3)", np.minimum(S, 1)),
        ("max(s, 1, L)", np.full(9, 4.0)),
    ],
)
def test_least_and_largest_take_any_number_of_values(text, expected):
    assert np.array_equal(along(text, S, 4.0), expected)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("sqrt(s, s)", "sqrt takes 1 argument; found 2"),
        ("exp()", "exp takes 1 argument; found 0"),
        ("abs(s, 1, 2)", "abs takes 1 argument; found 3"),
        ("max(s)", "max takes 2 arguments or more; found 1"),
        ("min(*(s, 2))", "min takes 2 arguments or more; found 1"),
        ("sin(s, *(s, s))", "sin takes 1 argument; found 2"),
    ],
)
def test_a_wrong_number_of_arguments_is_refused_and_changes_nothing(text, sentence):
    """No second argument becomes the array that a function writes to."""
    s = S.copy()
    with pytest.raises(ValueError, match=sentence):
        along(text, s, 4.0)
    assert np.array_equal(s, S)


def test_the_value_of_a_formula_is_no_view_of_the_arc_lengths():
    s = S.copy()
    formula("s", s, 4.0)[:] = 7.0
    assert np.array_equal(s, S)


@pytest.mark.parametrize(
    ("text", "part", "at"),
    [
        ("1 + 1/(s - 2)", "'1/(s - 2)' is inf", "s = 2 m"),
        ("0 * exp(500*s)", "'exp(500*s)' is inf", "s = 1.5 m"),
        ("(0/0)**0 + s", "'0/0' is nan", "s = 0 m"),
        ("sqrt(1 - s)", "'sqrt(1 - s)' is nan", "s = 1.5 m"),
        ("min(1, 1/s)", "'1/s' is inf", "s = 0 m"),
        ("1e400 * s", "'1e400' is inf", "s = 0 m"),
        ("1" + 400 * "0", "is inf", "s = 0 m"),
    ],
)
def test_an_overflow_inside_a_formula_is_refused_with_its_part_and_place(text, part, at):
    with pytest.raises(ValueError) as error:
        along(text, S, 4.0)
    assert part in str(error.value) and at in str(error.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("+".join(["s"] * 5000), "9999 characters; at most 2000"),
        ("(" * 300 + "s" + ")" * 300, "too many nested parentheses"),
        ("s\0", "null bytes|source code string"),
        ("", "cannot be read"),
    ],
)
def test_a_formula_too_long_or_deep_is_refused(text, sentence):
    with pytest.raises(ValueError, match=sentence) as error:
        along(text, S, 4.0)
    assert len(str(error.value)) < 200


def test_a_formula_nests_as_deep_as_it_is_long():
    assert np.array_equal(along("-" * 900 + "s" + "+s" * 500, S, 4.0), 501 * S)
    assert np.array_equal(along("sqrt(" * 60 + "1+0*s" + ")" * 60, S, 4.0), np.ones(9))


def test_a_table_passes_through_its_points_and_is_linear_between_two():
    at, values = [0.0, 1.0, 2.5, 4.0], [1.0, 0.5, 0.4, 2.0]
    assert along((at, values), np.array(at), 4.0) == pytest.approx(values, rel=1e-15)
    assert along([[0, 4], [1, 3]], S, 4.0) == pytest.approx(1 + S / 2, rel=1e-15)
    assert varies([[0, 4], [1, 3]])


def test_a_positive_table_stays_positive_between_its_points():
    """Where a cubic spline would overshoot below zero."""
    values = along(([0.0, 1.0, 2.0, 4.0], [10.0, 0.01, 0.01, 10.0]), np.linspace(0, 4, 201), 4.0)
    assert values.min() == pytest.approx(0.01)


@pytest.mark.parametrize(("function", "order"), [(lambda s: np.exp(-s / 2), 3.0), (np.cos, 2.0)], ids=["taper", "wavy"])
def test_a_smooth_table_converges(function, order):
    """At third order where it is monotone (a taper), at second at extrema, which a monotone cubic keeps flat."""
    s, counts = np.linspace(0, 4, 3001), np.array([8, 16, 32, 64, 128])
    errors = []
    for n in counts:
        at = np.linspace(0, 4, n + 1)
        errors.append(np.abs(along((at, function(at)), s, 4.0) - function(s)).max())
    slope = np.polyfit(np.log(1 / counts), np.log(errors), deg=1)[0]
    assert slope == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        (([0, 4], [1, np.nan]), "not finite"),
        (([0, 4, 3], [1, 2, 3]), "must increase"),
        (([0, 3], [1, 2]), r"covers s = 0 to 3 m, but the member is used from 0 to 4 m"),
        (([0, 4], [1, 2, 3]), "two rows of equal length"),
        (([0, 4],), "two rows of equal length"),
        ([1.0, 2.0, 3.0], "two rows of equal length"),
        (([0], [1]), "at least 2"),
    ],
)
def test_a_bad_table_is_refused(table, sentence):
    with pytest.raises(ValueError, match=sentence):
        along(table, S, 4.0)
