"""Picture of a torque budget: torque of every source about each axis, and the momentum that they build up."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.results import Run
from femflex.view.plot import figure_of, finish, save_figure
from femflex.view.second_run import title_of
from femflex.view.theme import theme_of
from femflex.view.units import time_unit

SHADED = 0.5  # visible share of the sun, below which the background is dark
DASHES = ("-", "--", ":")  # of the curves, when their colours are used up


def plot_budget(
    run: Run,
    time: Array,
    torques: Mapping[str, Array],
    momentum: Array,
    path: str | Path,
    theme: str = "light",
    dpi: int = 150,
    force: bool = False,
) -> Path:
    """Path of a picture (.png or .svg): three axes of torques by source, and one of the momentum of their sum.

    time (n_t,) [s] of the budget; torques (n_t, 3) [N m] by source, the sum under "sum"; momentum (n_t, 3) of the sum,
    inertial axes [N m s]. Where the run reports a sun, times in eclipse have a darker background.
    """
    colours = theme_of(theme)
    figure, axes = figure_of(4, title_of(run), colours, sharex=True)
    seconds, unit = time_unit(float(np.ptp(time)))
    t = time / seconds
    limit = 1.1 * max(float(np.abs(torque).max()) for torque in torques.values()) or 1.0
    for k, axis in enumerate("xyz"):
        for i, (name, torque) in enumerate(torques.items()):
            style = (
                {"color": colours.text, "lw": 1.6}
                if name == "sum"
                else {
                    "color": colours.lines[i % len(colours.lines)],
                    "ls": DASHES[i // len(colours.lines) % len(DASHES)],
                }
            )
            axes[k].plot(t, torque[:, k], label=name.removeprefix("effectors/"), **style)
        axes[k].set_ylabel(f"torque {axis} [N m]")
        axes[k].set_ylim(-limit, limit)
    for k, axis in enumerate("XYZ"):
        axes[3].plot(t, momentum[:, k], color=colours.lines[k], label=axis)
    axes[3].set_ylabel("momentum [N m s]")
    axes[3].set_xlabel(f"time [{unit}]")
    dark = _shaded_spans(run, time)
    for ax in axes:
        for start, end in dark:
            ax.axvspan(start / seconds, end / seconds, color=colours.faint, alpha=0.3, lw=0)
        finish(ax, range(2), colours)
    return save_figure(figure, path, dpi, force)


def _shaded_spans(run: Run, time: Array) -> list[tuple[float, float]]:
    """First and last times [s] of the parts of the time (n_t,) in which the sun is behind the Earth."""
    channel = next((path for path in run if path.endswith("/visible")), None)
    if channel is None:
        return []
    dark = np.interp(time, run.time, run[channel]) < SHADED
    edges = np.flatnonzero(np.diff(np.concatenate([[False], dark, [False]]).astype(int)))
    return [(float(time[a]), float(time[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]
