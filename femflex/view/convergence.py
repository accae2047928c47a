"""Picture of a convergence study: values towards their limit, and decreasing errors, as PNG or SVG."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.extras import require
from femflex.view.drawing import Drawing
from femflex.view.study_data import StudyData
from femflex.view.theme import Theme, theme_of
from femflex.writing import atomic_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes


VARIED = {"mesh": "finer meshes", "derivatives": "derivative shapes"}  # otherwise the word of the study
SIZE = (9.0, 7.2)  # inches
WIDTH = 126  # letters of a line of the verdict


def plot_convergence(
    study: StudyData,
    path: str | Path,
    theme: str = "light",
    title: str | None = None,
    dpi: int = 150,
    force: bool = False,
) -> Path:
    """Path of a picture (.png or .svg): values over the count above, relative errors with their law below."""
    check_kind(path)
    colours = theme_of(theme)
    heading = title or f"{study.title[0].upper()}{study.title[1:]} over {VARIED.get(study.over, study.over)}"
    figure = colours.figure(*SIZE, heading)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 3))
    draw_study(above, below, study, colours)
    for ax in (above, below):
        finish_study_axes(ax, colours)
    words = "\n".join(textwrap.wrap(study.verdict, WIDTH))
    figure.supxlabel(words, color=colours.text, fontsize=8.5, ha="left", x=0.02, linespacing=1.4)
    with atomic_file(path, force) as draft:
        figure.savefig(draft, format=Path(path).suffix.lower().lstrip("."), dpi=dpi)
    return Drawing(path)


def check_kind(path: str | Path) -> None:
    """Raise ValueError when the suffix is neither .png nor .svg, and MissingExtra where no plot can be drawn."""
    require("view", "plots")
    if Path(path).suffix.lower() not in (".png", ".svg"):
        raise ValueError(f"a plot is written as .png or .svg; {Path(path).name} is neither")


def draw_study(above: Axes, below: Axes, study: StudyData, colours: Theme) -> None:
    """Values into the upper axes, errors into the lower ones."""
    _values(above, study, colours)
    _errors(below, study, colours)


def abscissa(study: StudyData) -> IntArray:
    """The counts of coordinates (n,), or the levels where a level adds no coordinate to that before."""
    return study.counts if np.all(np.diff(study.counts) > 0) else study.levels


def _values(ax: Axes, study: StudyData, colours: Theme) -> None:
    """Values over the count, the limit, and the band of the tolerance about it."""
    ax.set_xscale("log" if abscissa(study).min() > 0 else "linear")
    if np.isfinite(study.estimate):
        band = study.tolerance * study.scale
        ax.axhspan(study.estimate - band, study.estimate + band, color=colours.lines[2], alpha=0.15, linewidth=0)
        ax.axhline(study.estimate, color=colours.lines[2], linewidth=1.2, label="limit")
        ax.fill_between([], [], color=colours.lines[2], alpha=0.15, label=f"tolerance {study.tolerance:g}")
        _frame(ax, study, band)
    ax.plot(abscissa(study), study.values, "o-", color=colours.lines[0], linewidth=1.2, markersize=5, label="value")
    _mark_recommended(ax, study, study.values, colours)
    ax.ticklabel_format(axis="y", useOffset=True, useMathText=True, scilimits=(-3, 4))
    ax.set_ylabel(f"value [{study.unit}]" if study.unit not in ("", "1") else "value")


def _frame(ax: Axes, study: StudyData, band: float) -> None:
    """Limits about the values, and about the tolerance where it is not much wider."""
    low, high = float(study.values.min()), float(study.values.max())
    low, high = min(low, study.estimate), max(high, study.estimate)
    if band < 3 * (high - low) or high == low:
        low, high = min(low, study.estimate - band), max(high, study.estimate + band)
    margin = 0.08 * (high - low) or abs(high) or 1.0
    ax.set_ylim(low - margin, high + margin)


def _errors(ax: Axes, study: StudyData, colours: Theme) -> None:
    """Relative errors over the count, the law through them, and the tolerance."""
    ax.set_xscale("log" if abscissa(study).min() > 0 else "linear")
    ax.set_yscale("log")
    estimated = np.isfinite(study.errors) & (study.errors > 0)
    counts, errors = abscissa(study)[estimated], study.errors[estimated] / study.scale
    resolved = estimated & (np.arange(len(estimated)) < study.n_resolved)
    if study.law is not None and resolved.any():
        x, abscissa_values = study.x[resolved], abscissa(study)[resolved].astype(float)
        fine = np.geomspace(x[0], x[-1], 200)
        ax.plot(
            np.exp(np.interp(np.log(fine), np.log(x), np.log(abscissa_values))),
            study.law.error(fine) / study.scale,
            color=colours.lines[1],
            linewidth=1.2,
            linestyle="--",
            label=f"errors fall\n{textwrap.fill(study.law_text, 24)}",
        )
    ax.axhline(study.tolerance, color=colours.lines[2], linewidth=1.2, label=f"tolerance {study.tolerance:g}")
    if counts.size:
        ax.plot(counts, errors, "o", color=colours.lines[0], markersize=5, label="estimated error")
    else:
        ax.text(0.5, 0.5, "no error can be estimated", transform=ax.transAxes, ha="center", color=colours.faint)
    _mark_recommended(ax, study, study.errors / study.scale, colours)
    with_levels = not np.array_equal(study.levels, abscissa(study))
    for level, count, error in zip(study.levels[estimated], counts, errors, strict=True):
        if with_levels:
            mark = ax.annotate(f"{level}", (count, error), (0, 8), textcoords="offset points", ha="center", fontsize=8)
            mark.set_color(colours.text)
    ax.margins(y=0.12)
    ax.set_ylabel("estimated relative error")
    abscissa_text = "degrees of freedom" if study.over == "mesh" else "elastic coordinates"
    abscissa_text = "shapes" if study.over == "derivatives" and study.followers.any() else abscissa_text
    numbers = "refinements of the mesh" if study.over == "mesh" else f"{VARIED.get(study.over, study.over)} per body"
    is_own_abscissa = np.array_equal(study.levels, abscissa(study)) and not np.array_equal(study.levels, study.counts)
    ax.set_xlabel(
        numbers if is_own_abscissa else f"{abscissa_text}   (at a point: {numbers})" if with_levels else abscissa_text
    )
    _count_ticks(ax, study)


def _mark_recommended(ax: Axes, study: StudyData, heights: Array, colours: Theme) -> None:
    """Draw a ring at the recommended level."""
    is_recommended = study.levels == study.recommended
    if study.recommended is not None and np.isfinite(heights[is_recommended]).all():
        position = abscissa(study)[is_recommended]
        (ring,) = ax.plot(
            position, heights[is_recommended], "o", color=colours.lines[6], markersize=12, label="to choose"
        )
        ring.set(markerfacecolor="none", markeredgewidth=1.5)


def _count_ticks(ax: Axes, study: StudyData) -> None:
    """Ticks at the counts themselves."""
    from matplotlib.ticker import FixedLocator, NullLocator

    ax.xaxis.set_major_locator(FixedLocator([float(count) for count in abscissa(study)]))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xticklabels([str(count) for count in abscissa(study)])


def finish_study_axes(ax: Axes, colours: Theme, inside: bool = False) -> None:
    """Format axes of a study; the legend is next to them or, where there is no space, inside."""
    ax.set_facecolor(colours.background)
    ax.grid(True, color=colours.faint, alpha=0.25, linewidth=0.6)
    ax.tick_params(colors=colours.text, which="both", labelsize=9)
    for text in (ax.yaxis.label, ax.xaxis.label, ax.yaxis.get_offset_text()):
        text.set_color(colours.text)
    for side, spine in ax.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(colours.faint)
    if not ax.get_legend_handles_labels()[0]:
        return
    location: dict[str, Any] = {"loc": "best"} if inside else {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
    legend = ax.legend(frameon=False, fontsize=9 - 1.5 * inside, **location)
    for text in legend.get_texts():
        text.set_color(colours.text)
