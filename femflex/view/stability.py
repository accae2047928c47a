"""Pictures of stability over values of a case: charts of two values, loci of poles or multipliers over one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from femflex.arrays import Array
from femflex.view.plot import PlotOptions, Sheet, finish, labelled, name_points
from femflex.view.theme import Theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes


SHADES = {0: ("trace", 0.16), 1: ("lines1", 0.30), 2: ("lines2", 0.30)}  # colour and strength of each kind
REGIONS = {
    -1: "no equilibrium, or no such body",
    0: "unstable",
    1: "stable by gyroscopic forces alone",
    2: "stable",
}


def plot_chart(
    chart: Any,
    path: str | Path,
    second: Any = None,
    left_out: Sequence[str] = (),
    reference_curves: Sequence[tuple[str, Array]] = (),
    **options: Unpack[PlotOptions],
) -> Path:
    """Path of a picture (.png or .svg) of the regions of a chart (femflex.studies.stability.Chart) and boundaries.

    second: the chart without the terms `left_out`, whose boundaries are dashed; reference_curves: names and points (k,
    2) of other curves, in the units of the chart's values, dotted.
    """
    from matplotlib.colors import to_rgba
    from matplotlib.patches import Patch

    sheet = Sheet(path, "Stability", **options)
    ax, colours = sheet.figure(8.6, 6.2).subplots(), sheet.colours
    shades = {
        kind: to_rgba((colours.trace if name == "trace" else colours.lines[int(name.removeprefix("lines"))]), alpha)
        for kind, (name, alpha) in SHADES.items()
    }
    shades[-1] = to_rgba(colours.faint, 0.45)
    picture = np.array([[shades[int(kind)] for kind in row] for row in chart.kinds.T])
    ax.imshow(picture, origin="lower", aspect="auto", extent=_extent(chart), interpolation="nearest", zorder=0)
    for _, _, points in chart.boundaries:
        ax.plot(*points.T, color=colours.text, linewidth=1.4, zorder=3)
    handles: list[Any] = [
        Patch(facecolor=shades[k], label=REGIONS[k]) for k in (2, 1, 0, -1) if (chart.kinds == k).any()
    ]
    if second is not None:
        style: dict[str, Any] = {"color": colours.lines[0], "linewidth": 1.4, "linestyle": (0, (4, 2))}
        lines = [ax.plot(*points.T, zorder=4, **style)[0] for _, _, points in second.boundaries]
        if lines:
            lines[0].set_label(f"dashed: without {', '.join(left_out)}")
            handles.append(lines[0])
    for k, (name, points) in enumerate(reference_curves):
        style = {"color": colours.lines[3], "linewidth": 1.6, "linestyle": (0, (1, 1.6))}
        handles += ax.plot(*points.T, zorder=5, label="dotted: " + name, **style) if k == 0 else []
        if k:
            ax.plot(*points.T, zorder=5, **style)
    ax.set(xlabel=labelled(chart.names[0], chart.units[0]), ylabel=labelled(chart.names[1], chart.units[1]))
    ax.set(xlim=chart.first_values[[0, -1]], ylim=chart.second_values[[0, -1]])
    finish(ax, (), colours)
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.11)}
    ax.legend(handles=handles, frameon=False, ncols=2, labelcolor=colours.text, **place)
    return sheet.save()


def plot_locus(
    locus: Any, path: str | Path, second: Any = None, left_out: Sequence[str] = (), **options: Unpack[PlotOptions]
) -> Path:
    """Path of a picture (.png or .svg) of a locus (femflex.studies.stability.Locus), in the plane and over the value.

    The plots over the value show frequency and growth of poles, or size and angle of multipliers. Values at which
    stability changes are marked. second: the locus without the terms `left_out`, dashed.
    """
    sheet = Sheet(path, "Stability", **options)
    axes, colours = sheet.figure(11.0, 6.0).subplot_mosaic("AB;AC"), sheet.colours
    for drawn_locus, dashed in ((locus, False), (second, True)):
        if drawn_locus is not None:
            _draw_branches(axes, drawn_locus, colours, dashed)
    plane, above, below = axes["A"], axes["B"], axes["C"]
    if locus.quantity == "poles":
        plane.axvline(0.0, color=colours.faint, linewidth=0.9)
        plane.set(xlabel="growth [1/s]", ylabel="frequency [Hz]")
        above.set_ylabel("frequency [Hz]")
        below.set_ylabel("growth [1/s]")
        below.axhline(0.0, color=colours.faint, linewidth=0.9)
    else:
        turn = np.linspace(0, 2 * np.pi, 200)
        plane.plot(np.cos(turn), np.sin(turn), color=colours.faint, linewidth=0.9)
        plane.set_aspect("equal", adjustable="datalim")
        plane.set(xlabel="real part", ylabel="imaginary part")
        above.set_ylabel("size")
        above.axhline(1.0, color=colours.faint, linewidth=0.9)
        below.set_ylabel("angle [deg]")
    below.set_xlabel(labelled(locus.name, locus.unit))
    above.sharex(below)
    below.set_xlim(locus.values[0], locus.values[-1])
    for ax in (above, below):
        for value in locus.critical:
            ax.axvline(value, color=colours.trace, linewidth=1.0, linestyle=(0, (4, 2)))
    for value in locus.critical:
        above.annotate(f"{value:.5g}", (value, 1.0), (3, -10), xycoords=("data", "axes fraction"),
                       textcoords="offset points", fontsize=8, color=colours.trace,
                       bbox={"facecolor": colours.background, "edgecolor": "none", "pad": 0.5})  # fmt: skip
    if second is not None:
        plane.plot([], [], color=colours.text, linestyle=(0, (4, 2)), label=f"dashed: without {', '.join(left_out)}")
        plane.legend(loc="lower left", frameon=False, fontsize=8, labelcolor=colours.text)
    for ax in axes.values():
        finish(ax, (), colours)
    return sheet.save()


def _draw_branches(axes: dict[str, Axes], locus: Any, colours: Theme, dashed: bool) -> None:
    """Draw the branches of a locus, without poles below the real axis; a ring at each start, a dot at each end."""
    poles = locus.quantity == "poles"
    labels: list[tuple[str, float, float, str]] = []
    columns = [k for k in range(locus.branches.shape[1]) if not poles or np.nanmax(locus.branches[:, k].imag) >= 0]
    for number, k in enumerate(columns):
        branch = locus.branches[:, k]
        style: dict[str, Any] = {"color": colours.lines[number % len(colours.lines)], "linewidth": 1.4}
        if dashed:
            style |= {"linestyle": (0, (4, 2)), "linewidth": 1.0}
        x, y = branch.real, branch.imag / (2 * np.pi if poles else 1.0)
        if poles:
            x, y = np.where(branch.imag >= 0, x, np.nan), np.where(branch.imag >= 0, y, np.nan)
        axes["A"].plot(x, y, **style)
        if not dashed:
            axes["A"].plot(x[:1], y[:1], "o", color=style["color"], markerfacecolor="none", markersize=5)
            axes["A"].plot(x[-1:], y[-1:], "o", color=style["color"], markersize=5)
        name = locus.names[k] if poles and locus.names else ""
        if name and not dashed and np.isfinite(y[0]) and y[0] > 0:
            labels.append((name, float(x[0]), float(y[0]), str(style["color"])))
        curves = (y, x) if poles else (np.abs(branch), np.degrees(np.angle(branch)))
        for ax, values in zip((axes["B"], axes["C"]), curves, strict=True):
            if poles or ax is axes["B"]:
                ax.plot(locus.values, values, **style)
            else:
                ax.plot(locus.values, values, ".", color=style["color"], markersize=3)
    name_points(axes["A"], labels, colours, 7.5)


def _extent(chart: Any) -> tuple[float, float, float, float]:
    """The grid's cells about its points."""
    (a, b), (c, d) = ((values[0], values[-1]) for values in (chart.first_values, chart.second_values))
    h, k = (b - a) / (len(chart.first_values) - 1) / 2, (d - c) / (len(chart.second_values) - 1) / 2
    return float(a - h), float(b + h), float(c - k), float(d + k)
