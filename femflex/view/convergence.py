"""Pictures of studies over levels and options, side by side, and of sweeps: scatter, envelopes, indices."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.view.plot import PlotOptions, Sheet, finish, labelled
from femflex.view.theme import Theme
from femflex.view.units import time_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

VARIED = {"mesh": "finer meshes", "derivatives": "derivative shapes"}  # otherwise the word of the study
WIDE, COLUMN, HEIGHT = 9.0, 5.2, 7.2  # inches: width of a single study, of a column of several, height
LETTERS = 14.2  # of a line of text, in an inch
COMPARED = ("strain", "functions")  # studies that compare options
LEAST = 1e-12  # relative difference below which it is rounding and is not drawn


def plot_studies(studies: Sequence[Any], path: str | Path, words: str = "", **options: Unpack[PlotOptions]) -> Path:
    """Path of a picture (.png or .svg) with a column for each study: values above, errors or costs below.

    studies are of `femflex.studies` (Convergence, Comparison); words are set below several, and the
    verdict below a single one.
    """
    single = len(studies) == 1 and studies[0].over not in COMPARED
    heading = f"{studies[0].title[0].upper()}{studies[0].title[1:]}"
    if single:
        heading += f" over {VARIED.get(studies[0].over, studies[0].over)}"
    sheet, width = Sheet(path, heading, **options), WIDE if single else max(COLUMN * len(studies), 7.0)
    figure, colours = sheet.figure(width, HEIGHT), sheet.colours
    axes = figure.subplots(2, len(studies), height_ratios=(2, 3), squeeze=False, sharex="col")
    for (above, below), study in zip(axes.T, studies, strict=True):
        if study.over in COMPARED:
            _draw_options(above, below, study, colours)
        else:
            _draw_values(above, study, colours)
            _draw_errors(below, study, colours)
        if not single:
            above.set_title(f"over {VARIED.get(study.over, study.over)}", color=colours.text, fontsize=10)
        for ax in (above, below):
            finish(ax, ax.get_legend_handles_labels()[0], colours, inside=not single)
    text = words if len(studies) > 1 else studies[0].verdict
    wrapped = "\n".join(textwrap.wrap(text, int(LETTERS * width)))
    figure.supxlabel(wrapped, color=colours.text, fontsize=8.5, ha="left", x=0.02, linespacing=1.4)
    return sheet.save()


def abscissa(study: Any) -> IntArray:
    """The counts of coordinates (n,), or the levels where a level adds no coordinate to that before."""
    counts: IntArray = study.counts if np.all(np.diff(study.counts) > 0) else study.levels
    return counts


def _draw_values(ax: Axes, study: Any, colours: Theme) -> None:
    """Values over the count, the limit, and the band of the tolerance about it."""
    ax.set_xscale("log" if abscissa(study).min() > 0 else "linear")
    if np.isfinite(study.estimate):
        band = study.tolerance * study.scale
        ax.axhspan(study.estimate - band, study.estimate + band, color=colours.lines[2], alpha=0.15, linewidth=0)
        ax.axhline(study.estimate, color=colours.lines[2], linewidth=1.2, label="limit")
        ax.fill_between([], [], color=colours.lines[2], alpha=0.15, label=f"tolerance {study.tolerance:g}")
        low, high = min(float(study.values.min()), study.estimate), max(float(study.values.max()), study.estimate)
        if band < 3 * (high - low) or high == low:  # the tolerance is not much wider than the values
            low, high = min(low, study.estimate - band), max(high, study.estimate + band)
        margin = 0.08 * (high - low) or abs(high) or 1.0
        ax.set_ylim(low - margin, high + margin)
    ax.plot(abscissa(study), study.values, "o-", color=colours.lines[0], linewidth=1.2, markersize=5, label="value")
    _mark_recommended(ax, study, study.values, colours)
    ax.ticklabel_format(axis="y", useOffset=True, useMathText=True, scilimits=(-3, 4))
    ax.set_ylabel(labelled("value", study.unit))


def _draw_errors(ax: Axes, study: Any, colours: Theme) -> None:
    """Relative errors over the count, the law through them, and the tolerance."""
    ax.set_xscale("log" if abscissa(study).min() > 0 else "linear")
    ax.set_yscale("log")
    estimated = np.isfinite(study.errors) & (study.errors > 0)
    counts, errors = abscissa(study)[estimated], study.errors[estimated] / study.scale
    resolved = estimated & (np.arange(len(estimated)) < study.n_resolved)
    if study.law is not None and resolved.any():
        x, abscissa_values = study.x[resolved], abscissa(study)[resolved].astype(float)
        fine = np.geomspace(x[0], x[-1], 200)
        drawn = np.exp(np.interp(np.log(fine), np.log(x), np.log(abscissa_values)))
        label = f"errors fall\n{textwrap.fill(study.law_text, 24)}"
        style: dict[str, Any] = {"color": colours.lines[1], "linewidth": 1.2, "linestyle": "--", "label": label}
        ax.plot(drawn, study.law.error(fine) / study.scale, **style)
    ax.axhline(study.tolerance, color=colours.lines[2], linewidth=1.2, label=f"tolerance {study.tolerance:g}")
    if counts.size:
        ax.plot(counts, errors, "o", color=colours.lines[0], markersize=5, label="estimated error")
    else:
        box = {"facecolor": colours.background, "edgecolor": "none"}  # the line of the tolerance stays off the text
        style = {"ha": "center", "color": colours.faint, "bbox": box, "zorder": 5}
        ax.text(0.5, 0.5, "no error can be estimated", transform=ax.transAxes, **style)
    _mark_recommended(ax, study, study.errors / study.scale, colours)
    with_levels = not np.array_equal(study.levels, abscissa(study))
    for level, count, error in zip(study.levels[estimated], counts, errors, strict=True) if with_levels else ():
        mark = ax.annotate(f"{level}", (count, error), (0, 8), textcoords="offset points", ha="center", fontsize=8)
        mark.set_color(colours.text)
    ax.margins(y=0.12)
    ax.set_ylabel("estimated relative error")
    text = "degrees of freedom" if study.over == "mesh" else "elastic coordinates"
    text = "shapes" if study.over == "derivatives" and study.followers.any() else text
    numbers = "refinements of the mesh" if study.over == "mesh" else f"{VARIED.get(study.over, study.over)} per body"
    is_own_abscissa = not with_levels and not np.array_equal(study.levels, study.counts)
    ax.set_xlabel(numbers if is_own_abscissa else f"{text}   (at a point: {numbers})" if with_levels else text)
    ax.set_xticks(abscissa(study).astype(float), [str(count) for count in abscissa(study)])
    ax.set_xticks([], minor=True)


def _mark_recommended(ax: Axes, study: Any, heights: Array, colours: Theme) -> None:
    """Draw a ring at the recommended level."""
    at = study.levels == study.recommended
    if study.recommended is not None and np.isfinite(heights[at]).all():
        (ring,) = ax.plot(abscissa(study)[at], heights[at], "o", color=colours.lines[6], markersize=12)
        ring.set(markerfacecolor="none", markeredgewidth=1.5, label="to choose")


def _draw_options(above: Axes, below: Axes, study: Any, colours: Theme) -> None:
    """Values of forms of strain or types of functions over the coordinates; under them the differences."""
    from matplotlib.ticker import MaxNLocator

    below.set_yscale("log")
    for k, option in enumerate(study.with_values):
        label = option.name if study.over == "functions" else f"{option.name}, {option.seconds:.3g} s"
        style: dict[str, Any] = {"color": colours.lines[k % len(colours.lines)], "linewidth": 1.2, "label": label}
        above.plot(option.counts, option.values, "o-", markersize=4, **style)
        differences = study.differences(option)
        visible = differences > LEAST
        below.plot(option.counts[visible], differences[visible], "o-", markersize=4, **style)
    style = {"color": colours.text, "linewidth": 1.0, "linestyle": "--"}
    below.axhline(study.tolerance, label=f"tolerance {study.tolerance:g}", **style)
    above.set_ylabel(labelled("value", study.unit))
    below.set_ylabel("relative difference")
    below.set_xlabel("elastic coordinates")
    below.xaxis.set_major_locator(MaxNLocator(integer=True))


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
