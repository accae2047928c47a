"""Quantities that vary along a member: numbers, tables or formulas of the arc length s."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from femflex.arrays import Array
from femflex.fem.formula import formula

Variation = float | str | Sequence[ArrayLike] | Array  # a number, a formula of s and L, or a table (s, values)


def varies(value: Variation) -> bool:
    """Whether the quantity is a table or a formula rather than a number."""
    return not isinstance(value, (int, float, np.number))


def evaluate_variation(value: Variation, s: Array, length: Array | float) -> Array:
    """The quantity at arc lengths s [m] of a member whose whole arc length is `length` [m], in the shape of s.

    A table (s, values) is interpolated by a monotone cubic (PCHIP): through its points, C1, without overshoot, linear
    between two points; error O(h^3) for smooth data, O(h^2) at its extrema. A formula is
    arithmetic of s, L (the whole arc length) and pi (see `femflex.fem.formula`).
    Raises ValueError on a formula or table that is not understood, is short of s, or is not finite.
    """
    if isinstance(value, str):
        values = formula(value, s, length)
    elif isinstance(value, (int, float, np.number)):
        values = np.asarray(value, float)
    else:
        values = interpolate_table(value, s)
    values = np.broadcast_to(values, s.shape)
    bad = ~np.isfinite(values)
    if bad.any():
        position, bad_value = s[bad].flat[0], values[bad].flat[0]
        raise ValueError(f"{value!r} is {bad_value} at s = {position:.6g} m; it must be finite along the whole member")
    return values


def interpolate_table(rows: Sequence[ArrayLike] | Array, s: Array) -> Array:
    """Values (...) at s (...) [m] of a table (s, values) by monotone cubic interpolation."""
    if len(rows) != 2 or np.shape(rows[0]) != np.shape(rows[1]) or np.ndim(rows[0]) != 1 or np.size(rows[0]) < 2:
        raise ValueError(f"a table along a member is (s, values), two rows of equal length, at least 2; got {rows!r}")
    s_table, values = np.asarray(rows[0], float), np.asarray(rows[1], float)
    if not (np.isfinite(s_table).all() and np.isfinite(values).all()):
        raise ValueError(
            f"a table along a member holds numbers that are not finite: s {s_table.tolist()}, {values.tolist()}"
        )
    if not (np.diff(s_table) > 0).all():
        raise ValueError(f"arc lengths of a table along a member must increase; got {s_table.tolist()} m")
    slack = 1e-9 * (s_table[-1] - s_table[0])
    if s.min() < s_table[0] - slack or s.max() > s_table[-1] + slack:
        raise ValueError(
            f"a table covers s = {s_table[0]:g} to {s_table[-1]:g} m, but the member is used from {s.min():.6g} to "
            f"{s.max():.6g} m; extend the table over the whole arc length"
        )
    return np.asarray(PchipInterpolator(s_table, values)(np.clip(s, s_table[0], s_table[-1])), float)
