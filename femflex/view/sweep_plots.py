"""Sweeps as pictures: scatter of outputs over inputs, and envelopes of histories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.view.convergence import check_kind
from femflex.view.plot import figure_of, finish, save_figure, with_superscripts
from femflex.view.theme import theme_of
from femflex.view.units import time_unit

MOST = 6  # rows and columns of a scatter matrix
CELL = 2.2  # inches


def plot_scatter(
    inputs: Mapping[str, Array],
    outputs: Mapping[str, Array],
    units: Mapping[str, str],
    path: str | Path,
    theme: str = "light",
    title: str = "Sweep",
    dpi: int = 150,
    force: bool = False,
) -> Path:
    """Path of a picture (.png or .svg) of outputs (n,) over inputs (n,), one pair of axes for each pair.

    The last column is the distribution of each output. Raises ValueError without numbers to draw.
    """
    check_kind(path)
    numeric = {name: values for name, values in inputs.items() if np.isfinite(values).any()}
    if not numeric or not outputs:
        raise ValueError("the sweep has no inputs that are numbers, or no outputs, so there is no scatter to draw")
    colours = theme_of(theme)
    columns, rows = list(numeric)[:MOST], list(outputs)[:MOST]
    figure = colours.figure(CELL * (len(columns) + 1) + 1.0, CELL * len(rows) + 0.8, title)
    axes = figure.subplots(len(rows), len(columns) + 1, squeeze=False, sharex="col")
    for i, name in enumerate(rows):
        for j, key in enumerate(columns):
            axes[i, j].plot(numeric[key], outputs[name], ".", color=colours.lines[i % len(colours.lines)], markersize=4)
            finish(axes[i, j], (), colours)
        good = outputs[name][np.isfinite(outputs[name])]
        axes[i, -1].hist(good, bins="auto", orientation="horizontal", color=colours.lines[i % len(colours.lines)])
        finish(axes[i, -1], (), colours)
        axes[i, 0].set_ylabel(_labelled(name, units))
    for j, key in enumerate(columns):
        axes[-1, j].set_xlabel(_labelled(key, units), fontsize=8)
    axes[-1, -1].set_xlabel("runs", color=colours.text)
    axes[-1, -1].xaxis.label.set_color(colours.text)
    return save_figure(figure, path, dpi, force)


def plot_envelopes(
    time: Array,
    histories: Mapping[str, Array],
    bands: Mapping[str, Array],
    percentiles: Array,
    path: str | Path,
    theme: str = "light",
    title: str = "Sweep",
    dpi: int = 150,
    force: bool = False,
    units: Mapping[str, str] | None = None,
) -> Path:
    """Path of a picture (.png or .svg) of histories (n, n_t) over time (n_t,) [s]: percentiles (n_p, n_t), least and
    largest of all runs. units: of the histories, by their names."""
    check_kind(path)
    if not histories:
        raise ValueError("the sweep kept no histories, so there is no envelope to draw; name some in `histories`")
    colours = theme_of(theme)
    figure, axes = figure_of(len(histories), title, colours, sharex=True)
    seconds, unit = time_unit(float(time[-1] - time[0]))
    for k, (ax, (name, values)) in enumerate(zip(axes, histories.items(), strict=True)):
        good, colour = values[~np.isnan(values).any(axis=1)], colours.lines[k % len(colours.lines)]
        ax.fill_between(time / seconds, good.min(axis=0), good.max(axis=0), color=colour, alpha=0.15, label="all runs")
        order = np.argsort(percentiles)
        if len(order) > 1:
            low, high = bands[name][order[0]], bands[name][order[-1]]
            text = f"{percentiles[order[0]]:g} to {percentiles[order[-1]]:g} %"
            ax.fill_between(time / seconds, low, high, color=colour, alpha=0.35, label=text)
        middle = int(np.argmin(np.abs(percentiles - 50.0)))
        ax.plot(time / seconds, bands[name][middle], color=colour, linewidth=1.2, label=f"{percentiles[middle]:g} %")
        history_unit = (units or {}).get(name, "")
        ax.set_ylabel(name.split("/")[-1] + (f" [{with_superscripts(history_unit)}]" if history_unit else ""))
        ax.set_title(name, fontsize=9, color=colours.text, loc="left")
        ax.margins(x=0)
        finish(ax, [name], colours)
    axes[-1].set_xlabel(f"time [{unit}]")
    return save_figure(figure, path, dpi, force)


def plot_indices(
    inputs: Sequence[str],
    indices: Mapping[str, Array],
    path: str | Path,
    theme: str = "light",
    title: str = "Sobol indices",
    dpi: int = 150,
    force: bool = False,
) -> Path:
    """Path of a picture (.png or .svg) of first-order and total Sobol indices (n_inputs, 2) of each output, as bars."""
    check_kind(path)
    if not indices:
        raise ValueError("the sweep has no Sobol indices; take design = 'sobol_indices'")
    colours = theme_of(theme)
    figure, axes = figure_of(len(indices), title, colours, sharex=True)
    positions = np.arange(len(inputs))
    for ax, (name, values) in zip(axes, indices.items(), strict=True):
        for k, word in enumerate(("first order", "total")):
            ax.barh(positions + 0.2 - 0.4 * k, np.nan_to_num(values[:, k]), 0.36, color=colours.lines[k], label=word)
        ax.set_yticks(positions, list(inputs))
        ax.invert_yaxis()
        ax.set_title(name, fontsize=9, color=colours.text, loc="left")
        finish(ax, [name], colours)
    axes[-1].set_xlabel("share in the variance")
    return save_figure(figure, path, dpi, force)


def _labelled(name: str, units: Mapping[str, str]) -> str:
    unit = units.get(name, "")
    return f"{name} [{with_superscripts(unit)}]" if unit not in ("", "1") else name
