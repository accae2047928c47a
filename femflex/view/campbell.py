"""The Campbell diagram as a picture: frequencies over the speed of spin, with the multiples of it, as PNG or SVG."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from femflex.arrays import Array
from femflex.view.plot import PlotOptions, Sheet, finish, labelled, name_points
from femflex.view.theme import Theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes


WIDTH, HEIGHT, LOWER = 9.0, 6.0, 1.8  # inches: of the figure, of the frequencies, of the damping below
FINE = 12  # points drawn between two speeds
PRINTED = 1e-6  # damping ratio below which there is none to draw
LETTER = 7.5  # points: size of the speeds at crossings
APART = 0.032  # of the axes' height, between two names
WORDS = ("flap", "lag", "torsion", "stretch", "chordwise")  # in the order of the theme's colours


def plot_campbell(
    diagram: Any, path: str | Path, scale: float = 1.0, unit: str = "rad/s", **options: Unpack[PlotOptions]
) -> Path:
    """Path of a picture (.png or .svg) of a diagram (femflex.studies.campbell.Campbell).

    Speeds are in a unit that is `scale` rad/s, values as they are.

    Crossings with multiples of the spin are marked by rings; growing branches are wide and red. Damping ratios are
    drawn below, if there are any.
    """
    sheet = Sheet(path, diagram.title or "Campbell diagram", **options)
    colours = sheet.colours
    damped = any(np.nanmax(np.abs(b.damping_ratios), initial=0.0) > PRINTED for b in diagram.branches)
    figure = sheet.figure(WIDTH, HEIGHT + LOWER * damped)
    ratios = (HEIGHT, LOWER) if damped else (1,)
    axes = figure.subplots(len(ratios), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    axes[0].set_xlim(diagram.speeds[0] / scale, diagram.speeds[-1] / scale)
    _frequencies(axes[0], diagram, colours, scale)
    axes[0].set_ylabel("frequency [Hz]" if diagram.value else "frequency in the spinning frame [Hz]")
    if damped:
        _damping(axes[1], diagram, colours, scale)
    for ax in axes:
        finish(ax, (), colours)
    axes[-1].set_xlabel(labelled(diagram.value or "speed of spin", unit))
    return sheet.save()


def _frequencies(ax: Axes, diagram: Any, colours: Theme, scale: float) -> None:
    """Draw branches with their names, multiples of the spin, and their crossings."""
    top = 1.06 * max(float(np.nanmax(b.frequencies)) for b in diagram.branches) or 1.0
    ax.set_ylim(0, top)
    _orders(ax, diagram, colours, scale, top)
    ends = []
    for branch in diagram.branches:
        speeds, frequencies, style = diagram.speeds / scale, branch.frequencies, _style(branch, colours)
        ax.plot(*((speeds, frequencies) if diagram.value else _interpolated(speeds, frequencies)), zorder=3, **style)
        dots: dict[str, Any] = {"color": style["color"], "markersize": 3.5, "zorder": 3}
        ax.plot(speeds[diagram.requested], frequencies[diagram.requested], ".", **dots)
        ax.plot(speeds, np.where(branch.growing, frequencies, np.nan), color=colours.trace, linewidth=5, alpha=0.6)
        if np.isfinite(frequencies[-1]):
            text = f"{branch.name} → {branch.final_character}" if branch.final_character else branch.name
            ends.append((float(frequencies[-1]), text, style["color"]))
    _names(ax, sorted(ends), top)
    _crossings(ax, diagram, colours, scale)


def _crossings(ax: Axes, diagram: Any, colours: Theme, scale: float) -> None:
    """Draw a ring at each crossing, with its speed where there is space."""
    met = [(f"{c.speed / scale:.4g}", c.speed / scale, c.frequency, colours.text) for c in diagram.crossings]
    for _, *point, colour in met:
        ax.plot(*point, "o", color=colour, markerfacecolor=colours.background, markersize=5.5, zorder=4)
    name_points(ax, met, colours, LETTER)


def _orders(ax: Axes, diagram: Any, colours: Theme, scale: float, top: float) -> None:
    """Draw the multiples of the spin as thin lines, each labelled where it leaves the axes."""
    start, end = (float(v) / scale for v in (diagram.speeds[0], diagram.speeds[-1]))
    for order in diagram.orders:
        slope = order * scale / (2 * np.pi)
        ax.plot([start, end], [slope * start, slope * end], color=colours.faint, linewidth=0.9, linestyle=(0, (4, 3)))
        label_speed = min(0.97 * end, 0.97 * top / slope)
        if label_speed > start:
            style: dict[str, Any] = {
                "fontsize": 8,
                "color": colours.faint,
                "ha": "right",
                "va": "center",
                "zorder": 3.5,
            }
            box = {"facecolor": colours.background, "edgecolor": "none", "alpha": 0.85, "pad": 1.0}
            ax.annotate(f"{order}/rev", (label_speed, slope * label_speed), bbox=box, **style)


def _names(ax: Axes, ends: list[tuple[float, str, str]], top: float) -> None:
    """Write names next to the ends of the branches, moved apart where they would overlap."""
    heights = [height / top for height, _, _ in ends]
    for _ in range(200):
        changed = False
        for k in range(len(heights) - 1):
            if (overlap := APART - (heights[k + 1] - heights[k])) > 1e-9:
                heights[k], changed = max(heights[k] - overlap / 2, 0.0), True
                heights[k + 1] += overlap / 2
        if not changed:
            break
    for label_height, (_, name, colour) in zip(heights, ends, strict=True):
        ax.text(1.012, label_height, name, transform=ax.transAxes, va="center", fontsize=9, color=colour)


def _damping(ax: Axes, diagram: Any, colours: Theme, scale: float) -> None:
    """Damping ratios of the branches."""
    for branch in diagram.branches:
        ax.plot(diagram.speeds / scale, 100 * branch.damping_ratios, **_style(branch, colours))
    ax.axhline(0, color=colours.faint, linewidth=0.8)
    ax.set_ylabel("damping [% of critical]")


def _style(branch: Any, colours: Theme) -> dict[str, Any]:
    """Colour by the kind of motion."""
    word = branch.name.partition(" ")[0]
    kind = WORDS.index(word) if word in WORDS else len(WORDS)
    return {"color": colours.lines[kind], "linewidth": 1.5}


def _interpolated(speeds: Array, frequencies: Array) -> tuple[Array, Array]:
    """Interpolated points: with centrifugal stiffening f^2 is nearly linear in the square of the speed."""
    steps = np.arange(len(speeds) - 1)[:, None] + np.linspace(0, 1, FINE, endpoint=False)
    fine = np.concatenate([np.interp(steps.ravel(), np.arange(len(speeds)), speeds), speeds[-1:]])
    return fine, np.sqrt(np.interp(fine**2, speeds**2, frequencies**2))
