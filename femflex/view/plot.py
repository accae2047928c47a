"""Time histories and spectra of a run, as PNG or SVG (the only module that imports matplotlib's figures)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.results import Run
from femflex.view.curves import BALANCE, ROUNDED, Curve, curves_of
from femflex.view.drawing import Drawing
from femflex.view.second_run import (
    dashed_style,
    difference_text,
    fit_limits,
    mark_end,
    name_second,
    omission_text,
    title_of,
)
from femflex.view.spectrum import WINDOW, amplitude_spectrum
from femflex.view.surroundings import shade_eclipses
from femflex.view.theme import Theme, theme_of
from femflex.view.units import time_unit
from femflex.writing import atomic_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, HEIGHT, TITLE = 9.0, 2.5, 0.5  # inches: of the figure, of one pair of axes, of the title
LEGEND_ROWS = 8  # more curves than this are named in several columns
DEPTH = 3e-5  # a spectrum is shown down to this part of its highest peak
SMALLEST = 5e-3  # of the highest peak; smaller ones have no label
LABEL = 0.05, 0.25  # width of a label as a part of the axis, and height in decades


def plot_histories(
    run: Run,
    path: str | Path,
    channels: Sequence[str] | None = None,
    degrees: bool = True,
    theme: str = "light",
    title: str | None = None,
    dpi: int = 150,
    force: bool = False,
    second_run: Run | None = None,
) -> Path:
    """Path of a picture (.png or .svg) of channels over time, one pair of axes for every unit.

    channels as in `curves_of`; by default attitude angles, largest deflections and energy minus work.
    second_run: a second run, drawn over the first in thin dashed lines of the same colours.
    """
    groups, colours = curves_of(run, channels, degrees, second_run), theme_of(theme)
    figure, axes = figure_of(len(groups), _title(run, second_run) if title is None else title, colours, sharex=True)
    seconds, unit = time_unit(max(run.duration, 0.0 if second_run is None else second_run.duration))
    for ax, group in zip(axes, groups, strict=True):
        for curve, style in _styled(group, colours):
            ax.plot(curve.time / seconds, curve.values, **style)
        ax.set_ylabel(_ordinate(group))
        ax.margins(x=0)
        fit_limits(ax, group)
        shade_eclipses(ax, run, seconds, colours)
        if second_run is not None:
            name_second(ax, group, run, second_run, colours)
            mark_end(ax, group, second_run, (seconds, unit), colours)
        finish(ax, group, colours)
    axes[-1].set_xlabel(f"time [{unit}]")
    return save_figure(figure, path, dpi, force)


def plot_spectra(
    run: Run,
    path: str | Path,
    channels: Sequence[str] | None = None,
    degrees: bool = True,
    theme: str = "light",
    title: str | None = None,
    dpi: int = 150,
    highest: float | None = None,
    force: bool = False,
    second_run: Run | None = None,
) -> Path:
    """Path of a picture (.png or .svg) of amplitude spectra of channels, with their peaks named.

    A sine of amplitude a makes a peak of height a. highest is the last frequency shown [Hz]; by default every pair of
    axes goes a little beyond its last peak. second_run: a second run, drawn over the first in thin dashed lines.
    """
    if highest is not None and not highest > 0:
        raise ValueError(f"the last frequency shown is {highest:g} Hz; give one above 0")
    colours = theme_of(theme)
    groups = curves_of(run, channels, degrees, second_run, least=ROUNDED)
    if channels is None:
        groups = [group for group in groups if group[0].quantity != BALANCE] or groups
    figure, axes = figure_of(len(groups), _title(run, second_run) if title is None else title, colours, sharex=False)
    for ax, group in zip(axes, groups, strict=True):
        spectra = [amplitude_spectrum(curve.time, curve.values) for curve in group]
        peaks = [peak for spectrum in spectra for peak in spectrum.peaks() if highest is None or peak[0] <= highest]
        nyquist = float(spectra[0].frequency[-1])
        last_frequency = highest or min(nyquist, 1.3 * max((frequency for frequency, _ in peaks), default=nyquist))
        factor, unit = (1e3, "mHz") if last_frequency < 0.5 else (1.0, "Hz")
        top = max(float(spectrum.amplitude.max()) for spectrum in spectra)
        drawn_curves = []
        for (curve, style), spectrum in zip(_styled(group, colours), spectra, strict=True):
            if (
                spectrum.amplitude[spectrum.frequency <= last_frequency].max(initial=0.0) < DEPTH * top
                and len(group) > 1
            ):
                continue  # below the axes, as a motion that is not excited
            ax.semilogy(spectrum.frequency * factor, np.maximum(spectrum.amplitude, 1e-300), **style)
            drawn_curves.append(curve)
        if second_run is not None:
            name_second(ax, drawn_curves, run, second_run, colours)
        ax.set_ylim(DEPTH * (top or 1.0), 10 * (top or 1.0))
        ax.set_xlim(0, last_frequency * factor)
        _label_peaks(ax, [(frequency * factor, amplitude) for frequency, amplitude in peaks], colours)
        ax.set_ylabel("amplitude of\n" + _ordinate(group))
        ax.set_xlabel(f"frequency [{unit}]")
        finish(ax, drawn_curves, colours)
    axes[-1].set_xlabel(f"{axes[-1].get_xlabel()}   ({WINDOW}, trend removed)")
    return save_figure(figure, path, dpi, force)


def _label_peaks(ax: Axes, peaks: list[tuple[float, float]], colours: Theme) -> None:
    """Write the frequency above each peak, beside it where another one stands, the highest first; else not at all."""
    width = LABEL[0] * ax.get_xlim()[1]
    corners: list[tuple[float, float]] = []  # lower left ones of labels
    least = SMALLEST * max((amplitude for _, amplitude in peaks), default=0.0)
    for frequency, amplitude in sorted((p for p in peaks if p[1] > least), key=lambda peak: -peak[1]):
        height = float(np.log10(amplitude))
        for side, part in (("center", 0.5), ("left", 0.0), ("right", 1.0)):
            left = frequency - part * width
            if left >= 0.0 and all(abs(left - x) > width or abs(height - y) > LABEL[1] for x, y in corners):
                corners.append((left, height))
                style: dict[str, Any] = {"textcoords": "offset points", "fontsize": 8, "color": colours.text}
                ax.annotate(f"{frequency:#.4g}", (frequency, amplitude), (0, 4), ha=side, **style)
                break


def _ordinate(group: list[Curve]) -> str:
    """Quantities and unit of the ordinate."""
    quantities, unit = ", ".join(dict.fromkeys(curve.quantity for curve in group)), group[0].unit
    return quantities if unit in ("1", "") else f"{quantities} [{with_superscripts(unit)}]"


def with_superscripts(unit: str) -> str:
    """A unit with its exponents as superscripts."""
    return re.sub(r"\^(-?[\d/]+)", r"$^{\1}$", unit)


def _styled(group: list[Curve], colours: Theme) -> list[tuple[Curve, dict[str, Any]]]:
    """The curves with colour, line and name; those of a second run dashed, in the colours of the first, unnamed."""
    order = list(dict.fromkeys(curve.label for curve in group))
    return [
        (
            curve,
            {
                "color": colours.lines[order.index(curve.label) % len(colours.lines)],
                **(dashed_style() if curve.second else {"linewidth": 1.2, "label": curve.label}),
            },
        )
        for curve in group
    ]


def _title(run: Run, second_run: Run | None) -> str:
    """Title of one run, or of two with their difference."""
    if second_run is None:
        return title_of(run)
    if run.title != second_run.title:
        return f"{title_of(run)}\ndashed: {title_of(second_run)}"
    return f"{run.title}\n{omission_text(run)}; dashed: {difference_text(second_run, run)}"


def figure_of(count: int, title: str, colours: Theme, sharex: bool) -> tuple[Figure, list[Axes]]:
    """A figure with so many axes above each other."""
    figure = colours.figure(WIDTH, HEIGHT * count + TITLE, title)
    axes = [ax for row in figure.subplots(count, 1, sharex=sharex, squeeze=False) for ax in row]
    return figure, axes


def finish(ax: Axes, group: Sequence[object], colours: Theme) -> None:
    """Give axes the theme's colours, and a legend of the group next to them."""
    ax.set_facecolor(colours.background)
    ax.grid(True, color=colours.faint, alpha=0.25, linewidth=0.6)
    ax.tick_params(colors=colours.text, which="both", labelsize=9)
    ax.yaxis.label.set_color(colours.text)
    ax.xaxis.label.set_color(colours.text)
    for side, spine in ax.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(colours.faint)
    if not group:
        return
    columns = -(-len(ax.get_legend_handles_labels()[1]) // LEGEND_ROWS)
    legend = ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=9, ncols=columns)
    for text in legend.get_texts():
        text.set_color(colours.text)


def save_figure(figure: Figure, path: str | Path, dpi: int, force: bool) -> Path:
    """Path of the figure as a file, .png or .svg."""
    path = Path(path)
    kind = path.suffix.lower().lstrip(".")
    if kind not in ("png", "svg"):
        raise ValueError(f"a plot is written as .png or .svg; {path.name} is neither")
    with atomic_file(path, force) as draft:
        figure.savefig(draft, format=kind, dpi=dpi)
    return Drawing(path)
