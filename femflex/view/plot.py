"""Time histories of a run, with those of a second one dashed; figures of the theme, as PNG or SVG."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np

from femflex.extras import require
from femflex.results import Run
from femflex.view.curves import Curve, curves_of
from femflex.view.surroundings import shade_eclipses
from femflex.view.theme import Theme, theme_of
from femflex.view.units import time_unit
from femflex.view.window import Drawing
from femflex.writing import atomic_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
WIDTH, HEIGHT, TITLE = 9.0, 2.5, 0.5  # inches: of the figure, of one pair of axes, of the title
DASHES = ("-", "--", ":")  # of the curves, when their colours are used up
LEGEND_ROWS = 8  # more curves than this are named in several columns
AWAY = 3.0  # times the range of the first run by which a second may exceed it and still be shown completely
SHOWN = 1.0  # of that range, shown beyond it if the second run exceeds that limit
SIDES = ((0, 8), (6, 7), (-6, 7), (6, -7), (-6, -7), (0, -10), (12, 14), (-12, 14))  # points, of names from theirs
FRAME = 0.87  # of the sides of the axes, which remain when the figure is laid out
INSTEAD = {"nonlinear strain": "linear strain"}  # the model that remains when a term is omitted


class PlotOptions(TypedDict, total=False):
    """Keywords of every plot: its theme, title (None: its own), dots per inch, and whether it replaces a file."""

    theme: str
    title: str | None
    dpi: int
    force: bool


class Sheet:
    """A figure in the colours of a theme, and the file as which it is saved.

    Raises ValueError where the file is neither .png nor .svg, and MissingExtra where no plot can be drawn.
    """

    def __init__(self, path: str | Path, default_title: str, **options: Unpack[PlotOptions]) -> None:
        """default_title: where the options have none."""
        require("view", "plots")
        self._path, self._kind = path, Path(path).suffix.lower().lstrip(".")
        if self._kind not in ("png", "svg"):
            raise ValueError(f"a plot is written as .png or .svg; {Path(path).name} is neither")
        self.colours, self._options = theme_of(options.get("theme", "light")), options
        requested = options.get("title")
        self._title = default_title if requested is None else requested

    def figure(self, width: float, height: float) -> Figure:
        """The figure of that size [inches], with its title."""
        self._figure = self.colours.figure(width, height, self._title)
        return self._figure

    def rows(self, count: int, sharex: bool = True, size: tuple[float, float] | None = None) -> list[Axes]:
        """So many axes above each other."""
        figure = self.figure(*(size or (WIDTH, HEIGHT * count + TITLE)))
        return [ax for row in figure.subplots(count, 1, sharex=sharex, squeeze=False) for ax in row]

    def save(self) -> Path:
        """Path of the figure as a file."""
        with atomic_file(self._path, self._options.get("force", False)) as draft:
            self._figure.savefig(draft, format=self._kind, dpi=self._options.get("dpi", 150))
        return Drawing(self._path)


def plot_histories(
    run: Run,
    path: str | Path,
    channels: Sequence[str] | None = None,
    degrees: bool = True,
    second_run: Run | None = None,
    **options: Unpack[PlotOptions],
) -> Path:
    """Path of a picture (.png or .svg) of channels over time, one pair of axes for every unit.

    channels as in `curves_of`; by default attitude angles, largest deflections and energy minus work. Without several
    curves on any axes their names stand at the ordinates.
    second_run: a second run, drawn over the first in thin dashed lines of the same colours.
    """
    groups, sheet = curves_of(run, channels, degrees, second_run), Sheet(path, title_of(run, second_run), **options)
    axes, colours = sheet.rows(len(groups)), sheet.colours
    seconds, unit = time_unit(max(run.duration, 0.0 if second_run is None else second_run.duration))
    single = second_run is None and all(len(group) == 1 for group in groups)  # the ordinate names the curve
    for ax, group in zip(axes, groups, strict=True):
        for curve, style in styled(group, colours):
            ax.plot(curve.time / seconds, curve.values, **style)
        name = group[0].label if single and group[0].label != group[0].quantity else ""
        ax.set_ylabel(f"{name}\n{ordinate(group)}".strip())
        ax.margins(x=0)
        fit_limits(ax, group)
        shade_eclipses(ax, run, seconds, colours)
        if second_run is not None:
            name_second(ax, group, run, second_run, colours)
            mark_end(ax, group, second_run, (seconds, unit), colours)
        finish(ax, [] if single else group, colours)
    axes[-1].set_xlabel(f"time [{unit}]")
    return sheet.save()


def ordinate(group: list[Curve]) -> str:
    """Quantities and unit of the ordinate."""
    return labelled(", ".join(dict.fromkeys(curve.quantity for curve in group)), group[0].unit)


def labelled(name: str, unit: str) -> str:
    """A name with its unit in brackets, if it has one."""
    return name if unit in ("1", "") else f"{name} [{with_superscripts(unit)}]"


def with_superscripts(unit: str) -> str:
    """A unit with its exponents as superscripts."""
    return re.sub(r"\^(-?[\d/]+)", r"$^{\1}$", unit)


def styled(group: list[Curve], colours: Theme) -> list[tuple[Curve, dict[str, Any]]]:
    """The curves with colour, line and name; those of a second run dashed, in the colours of the first, unnamed.

    Without a second run, further curves have other dashes where the colours are used up.
    """
    order, count = list(dict.fromkeys(curve.label for curve in group)), len(colours.lines)
    dashes = ("-",) if any(curve.second for curve in group) else DASHES
    pairs = []
    for curve in group:
        k = order.index(curve.label)
        line = {"linewidth": 1.2, "label": curve.label, "linestyle": dashes[k // count % len(dashes)]}
        pairs.append((curve, {"color": colours.lines[k % count], **(dashed_style() if curve.second else line)}))
    return pairs


def finish(ax: Axes, group: Sequence[object], colours: Theme, inside: bool = False) -> None:
    """Give axes the theme's colours, and a legend of the group next to them or, where there is no space, inside."""
    ax.set_facecolor(colours.background)
    ax.grid(True, color=colours.faint, alpha=0.25, linewidth=0.6)
    ax.tick_params(colors=colours.text, which="both", labelsize=9)
    for text in (ax.yaxis.label, ax.xaxis.label, ax.yaxis.get_offset_text()):
        text.set_color(colours.text)
    for side, spine in ax.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(colours.faint)
    if not group:
        return
    columns = -(-len(ax.get_legend_handles_labels()[1]) // LEGEND_ROWS)
    place: dict[str, Any] = {"loc": "best"} if inside else {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
    ax.legend(frameon=False, fontsize=9 - 1.5 * inside, ncols=columns, labelcolor=colours.text, **place)


def name_points(ax: Axes, names: Sequence[tuple[str, float, float, str]], colours: Theme, size: float = 8.0) -> None:
    """Write names (text, x, y, colour) beside points of axes, clear of the points and of the names before.

    A name without space on any side is left out.
    """
    places = (
        FRAME * 72.0 / ax.figure.dpi * ax.transData.transform(np.array([name[1:3] for name in names]).reshape(-1, 2))
    )
    used = [(place, np.full(2, 3.0)) for place in places]
    for (text, x, y, colour), place in zip(names, places, strict=True):
        half = np.array([0.31 * size * len(text), 0.6 * size])
        for side in SIDES:
            middle = place + side + [np.sign(side[0]) * half[0], 0.0]
            if all((np.abs(middle - centre) >= half + reach).any() for centre, reach in used):
                used.append((middle, half))
                style: dict[str, Any] = {"fontsize": size, "color": colour, "va": "center", "zorder": 5}
                style["ha"] = ("right", "center", "left")[int(np.sign(side[0])) + 1]
                box = {"facecolor": colours.background, "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
                ax.annotate(text, (x, y), side, textcoords="offset points", bbox=box, **style)
                break


def title_of(run: Run, second_run: Run | None = None) -> str:
    """Title of a run, with what was switched off in it, or of two with their difference."""
    if second_run is not None and run.title == second_run.title:
        return f"{run.title}\n{omission_text(run)}; dashed: {difference_text(second_run, run)}"
    if second_run is not None:
        return f"{title_of(run)}\ndashed: {title_of(second_run)}"
    if run.linearised:
        return f"{run.title} (linearised)"
    left_out = _omitted_terms(run)
    return f"{run.title} (without {', '.join(left_out)})" if left_out else run.title


def difference_text(run: Run, reference: Run) -> str:
    """Difference of a run from another, in words: its title, the omitted terms, or the name of its file."""
    if run.title != reference.title:
        return title_of(run)
    has_same_terms = _omitted_terms(run) == _omitted_terms(reference) and run.linearised == reference.linearised
    return run.path.name if has_same_terms else omission_text(run)


def omission_text(run: Run) -> str:
    """Omitted terms of a run in words, or the model that replaces them."""
    texts = [INSTEAD.get(name, f"without {name}") for name in _omitted_terms(run)]
    texts += ["linearised"] * run.linearised
    return ", ".join(texts) or "in full"


def dashed_style() -> dict[str, Any]:
    """Style of a second run's curves; the legend names them all together."""
    return {"linewidth": 1.0, "linestyle": (0, (4, 1.6)), "alpha": 0.85}


def name_second(ax: Axes, group: Sequence[Curve], run: Run, second_run: Run, colours: Theme) -> None:
    """Name the dashed curves of a group in the legend, where there are any."""
    if any(curve.second for curve in group):
        ax.plot([], [], color=colours.text, label=f"dashed: {difference_text(second_run, run)}", **dashed_style())


def mark_end(ax: Axes, group: Sequence[Curve], second_run: Run, unit: tuple[float, str], colours: Theme) -> None:
    """Mark the end of the curves of an unfinished run by a cross, at the border if they left the axes, and its time."""
    second = [curve for curve in group if curve.second and len(curve.time)]
    if second_run.complete or not second:
        return
    end, (low, high) = float(second[0].time[-1]) / unit[0], ax.get_ylim()
    label: str | None = f"stopped at {end:.4g} {unit[1]}"
    for height in sorted({min(max(float(curve.values[-1]), low), high) for curve in second}):
        style = {"marker": "x", "markersize": 8, "markeredgewidth": 2, "linestyle": "none", "clip_on": False}
        ax.plot([end], [height], color=colours.text, label=label, zorder=5, **style)  # type: ignore[arg-type]
        label = None
    ax.set_ylim(low, high)


def fit_limits(ax: Axes, group: Sequence[Curve]) -> None:
    """Set limits that show the first run, if a second one exceeds its range by far, as when it diverges."""
    first_values, second_values = ([c.values for c in group if c.second == which] for which in (False, True))
    if not first_values or not second_values:
        return
    low, high = min(v.min() for v in first_values), max(v.max() for v in first_values)
    span = (high - low) or 1.0
    if (
        max(v.max() for v in second_values) > high + AWAY * span
        or min(v.min() for v in second_values) < low - AWAY * span
    ):
        ax.set_ylim(low - SHOWN * span, high + SHOWN * span)


def _omitted_terms(run: Run) -> list[str]:
    return [name.replace("_", " ").removeprefix("loads/") for name in run.without]
