"""Figures of plotly as plain data."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.view.curves import Curve
from femflex.view.plot import with_superscripts
from femflex.view.theme import THEMES
from femflex.view.units import time_unit

MOST = 4000  # points of a curve; a longer one keeps the least and the largest of each of half as many stretches


def history(group: Sequence[Curve], duration: float) -> dict[str, Any]:
    """Curves of one ordinate over time; duration [s] chooses the unit of time."""
    seconds, unit = time_unit(duration)
    curves = [(curve.label, curve.time / seconds, curve.values) for curve in group]
    quantity = f"{group[0].quantity} [{with_superscripts(group[0].unit)}]"
    return lines(curves, f"time [{unit}]", quantity)


def lines(
    curves: Iterable[tuple[str, Array, Array]], x: str, y: str, marks: bool = False, **axes: Any
) -> dict[str, Any]:
    """A figure of curves (name, x (n,), y (n,)), and titles of its axes with units.

    marks: with their points;  axes: settings of `yaxis`
    """
    colours = THEMES["light"].lines
    data = []
    for k, (name, abscissa, ordinate) in enumerate(curves):
        abscissa, ordinate = fewer(np.asarray(abscissa, float), np.asarray(ordinate, float))
        data.append(
            {
                "type": "scatter",
                "mode": "lines+markers" if marks else "lines",
                "name": name,
                "x": plain(abscissa),
                "y": plain(ordinate),
                "line": {"width": 1.6, "color": colours[k % len(colours)]},
            }
        )
    return {"data": data, "layout": layout(x, y, len(data) > 1, **axes)}


def layout(x: str, y: str, legend: bool, **yaxis: Any) -> dict[str, Any]:
    """The layout that all figures share."""
    grid = {"gridcolor": "#e6eaef", "zerolinecolor": "#c3ccd6", "automargin": True}
    return {
        "margin": {"l": 60, "r": 12, "t": 12, "b": 44},
        "xaxis": {"title": {"text": x}, **grid},
        "yaxis": {"title": {"text": y}, "exponentformat": "power", **grid, **yaxis},
        "font": {"size": 13, "color": THEMES["light"].text},
        "plot_bgcolor": "#ffffff",
        "paper_bgcolor": "#ffffff",
        "showlegend": legend,
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
        "hovermode": "x unified",
    }


def fewer(x: Array, y: Array) -> tuple[Array, Array]:
    """At most MOST points (n,) of a curve, in its units, with the least and the largest value of every stretch."""
    if len(x) <= MOST or not np.isfinite(y).all():
        return x, y
    edges = np.linspace(0, len(x), MOST // 2 + 1).astype(np.int64)
    kept = np.array([a + k for a, b in pairwise(edges) for k in _ends(y[a:b])])
    kept = np.unique(np.concatenate([kept, [0, len(x) - 1]]))
    return x[kept], y[kept]


def _ends(part: Array) -> tuple[int, int]:
    return int(np.argmin(part)), int(np.argmax(part))


def plain(values: Array) -> list[float | None]:
    """Numbers of six digits, None where they are not finite."""
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
