"""Sun and magnetic field of a run for its pictures: their directions, and the spans of time in the Earth's shadow."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.results import Run
from femflex.view.theme import Theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes

KINDS = {"sun": "sun", "magnetic field": "field"}  # of an effector in its channels' descriptions; word beside its arrow
RESOLVED = 3  # rows inside an eclipse from which on it is shaded; with fewer, some eclipses fall between rows
WORD = 0.06  # of the time axis: a span that is wider has its word
SHADED = 0.5  # visible share of the sun's disc below which a plot is shaded


def directions_of(run: Run) -> dict[str, str]:
    """Word beside the arrow of each sun and magnetic field of a run, by the first part of its channels' paths."""
    paths = (path for path in run if path.startswith("effectors/") and path.endswith("/x"))
    kinds = {path.removesuffix("/x"): run.channels[path].description.removeprefix("x of ") for path in paths}
    return {
        path: word for path, text in kinds.items() for kind, word in KINDS.items() if text.startswith(f"{kind} ")
    }  # fmt: skip


def sun_of(run: Run) -> str | None:
    """The first part of the paths of the channels of a run's sun; None where it has none."""
    return next((head for head, word in reversed(directions_of(run).items()) if word == "sun"), None)


def shade_eclipses(ax: Axes, run: Run, seconds: float, colours: Theme) -> None:
    """Shade the spans of time in which the Earth hides over half of the sun; seconds: unit of the time axis [s]."""
    for path in (f"{head}/visible" for head, word in directions_of(run).items() if word == "sun"):
        for start, end in spans_below(run.time, run[path], SHADED):
            if np.count_nonzero((run.time > start) & (run.time < end)) < RESOLVED:
                continue
            ax.axvspan(start / seconds, end / seconds, color=colours.faint, alpha=0.18, linewidth=0, zorder=0)
            middle, top = 0.5 * (start + end) / seconds, ("data", "axes fraction")
            if end - start < WORD * run.duration:
                continue
            ax.annotate("eclipse", (middle, 0.97), xycoords=top, ha="center", va="top", fontsize=7, color=colours.faint)


def spans_below(time: Array, values: Array, limit: float) -> list[tuple[float, float]]:
    """Spans (start, end) of time [s] in which values (n_t,) are below the limit, crossings interpolated.

    >>> spans_below(np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.0, 0.0, 0.0, 1.0]), 0.5)
    [(0.5, 2.5)]
    """
    below = np.concatenate([[False], values < limit, [False]])
    edges = np.flatnonzero(below[1:] != below[:-1])
    ends = []
    for k in edges.tolist():
        if k in (0, len(time)):
            ends.append(float(time[min(k, len(time) - 1)]))
        else:
            share = (limit - values[k - 1]) / (values[k] - values[k - 1])
            ends.append(float(time[k - 1] + share * (time[k] - time[k - 1])))
    return [(ends[k], ends[k + 1]) for k in range(0, len(ends), 2)]
