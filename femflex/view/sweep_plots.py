"""Sweeps as pictures: scatter of outputs over inputs, and envelopes of histories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Unpack

import numpy as np

from femflex.arrays import Array
from femflex.view.plot import PlotOptions, Sheet, finish, labelled
from femflex.view.units import time_unit

MOST = 6  # rows and columns of a scatter matrix
CELL = 2.2  # inches


def plot_scatter(
    inputs: Mapping[str, Array],
    outputs: Mapping[str, Array],
    units: Mapping[str, str],
    path: str | Path,
    **options: Unpack[PlotOptions],
) -> Path:
    """Path of a picture (.png or .svg) of outputs (n,) over inputs (n,), one pair of axes for each pair.

    The last column is the distribution of each output. Raises ValueError without numbers to draw.
    """
    numeric = {name: values for name, values in inputs.items() if np.isfinite(values).any()}
    if not numeric or not outputs:
        raise ValueError("the sweep has no inputs that are numbers, or no outputs, so there is no scatter to draw")
    sheet = Sheet(path, "Sweep", **options)
    colours = sheet.colours
    columns, rows = list(numeric)[:MOST], list(outputs)[:MOST]
    figure = sheet.figure(CELL * (len(columns) + 1) + 1.0, CELL * len(rows) + 0.8)
    axes = figure.subplots(len(rows), len(columns) + 1, squeeze=False, sharex="col")
    for i, name in enumerate(rows):
        for j, key in enumerate(columns):
            axes[i, j].plot(numeric[key], outputs[name], ".", color=colours.lines[i % len(colours.lines)], markersize=4)
            finish(axes[i, j], (), colours)
        good = outputs[name][np.isfinite(outputs[name])]
        axes[i, -1].hist(good, bins="auto", orientation="horizontal", color=colours.lines[i % len(colours.lines)])
        finish(axes[i, -1], (), colours)
        axes[i, 0].set_ylabel(labelled(name, units.get(name, "")))
    for j, key in enumerate(columns):
        axes[-1, j].set_xlabel(labelled(key, units.get(key, "")), fontsize=8)
    axes[-1, -1].set_xlabel("runs", color=colours.text)
    return sheet.save()


def plot_envelopes(
    time: Array,
    histories: Mapping[str, Array],
    bands: Mapping[str, Array],
    percentiles: Array,
    path: str | Path,
    units: Mapping[str, str] | None = None,
    **options: Unpack[PlotOptions],
) -> Path:
    """Path of a picture (.png or .svg) of histories (n, n_t) over time (n_t,) [s]: percentiles (n_p, n_t), least and
    largest of all runs. units: of the histories, by their names."""
    if not histories:
        raise ValueError("the sweep kept no histories, so there is no envelope to draw; name some in `histories`")
    sheet = Sheet(path, "Sweep", **options)
    axes, colours = sheet.rows(len(histories)), sheet.colours
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
        ax.set_ylabel(labelled(name.split("/")[-1], (units or {}).get(name, "")))
        ax.set_title(name, fontsize=9, color=colours.text, loc="left")
        ax.margins(x=0)
        finish(ax, [name], colours)
    axes[-1].set_xlabel(f"time [{unit}]")
    return sheet.save()


def plot_indices(
    inputs: Sequence[str], indices: Mapping[str, Array], path: str | Path, **options: Unpack[PlotOptions]
) -> Path:
    """Path of a picture (.png or .svg) of first-order and total Sobol indices (n_inputs, 2) of each output, as bars."""
    if not indices:
        raise ValueError("the sweep has no Sobol indices; take design = 'sobol_indices'")
    sheet = Sheet(path, "Sobol indices", **options)
    axes, colours = sheet.rows(len(indices)), sheet.colours
    positions = np.arange(len(inputs))
    for ax, (name, values) in zip(axes, indices.items(), strict=True):
        for k, word in enumerate(("first order", "total")):
            ax.barh(positions + 0.2 - 0.4 * k, np.nan_to_num(values[:, k]), 0.36, color=colours.lines[k], label=word)
        ax.set_yticks(positions, list(inputs))
        ax.invert_yaxis()
        ax.set_title(name, fontsize=9, color=colours.text, loc="left")
        finish(ax, [name], colours)
    axes[-1].set_xlabel("share in the variance")
    return sheet.save()
