"""Quantities along a member: numbers, tables and formulas, and the sentences on bad ones."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem.line.along import along, varies

S = np.linspace(0.0, 4.0, 9)


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
