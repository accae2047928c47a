"""The picture that explains a motion: what pushes each coordinate, stacked, and the acceleration it adds up to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.results import Run
from femflex.view.plot import HEIGHT, TITLE, WIDTH, finish, raised, saved
from femflex.view.second_run import title_of
from femflex.view.theme import Theme, theme_of
from femflex.view.units import time_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


MOST = 7  # contributions named one by one; the others go together
SMALL = 2e-3  # of all contributions together, mean magnitude: below it, one is not named
CANCELLED = 0.5  # the inertia of all below this part of the sum of its sizes is drawn as one
CHUNKS, QUIET = 30, 10.0  # of the run, in each of which the largest counts; percent of them that are quiet
WIDE = 10.0  # times the quiet: what goes farther is drawn to a logarithmic scale beyond the quiet
RARE, SPIKE = 2.0, 2.5  # percent of the instants; what goes this many times beyond all the others is cut off
STRIP, STACK = 0.5, 1.35  # heights of the strip of the motion and of the stack, in those of a plot's axes


@dataclass(frozen=True)
class CoordinateTerms:
    """A coordinate to explain: its place in u, name, unit of its generalised force, and its own part of the inertia."""

    index: int
    name: str
    unit: str
    own: str


def plot_terms(
    run: Run,
    time: Array,
    parts: Mapping[str, Array],
    coordinates: Sequence[CoordinateTerms],
    path: str | Path,
    theme: str = "light",
    title: str | None = None,
    dpi: int = 150,
    force: bool = False,
) -> Path:
    """Path of a picture (.png or .svg): per coordinate its motion, and under it what pushes it.

    parts: name -> (n_t, n_u) at the instants `time` of the run, summing to zero, with their signs in M udot + h - Q = 0
    and M udot whole or split as "inertia/<source>". A coordinate's own inertia times acceleration is the line; all else
    stands on the other side of the equation, positive contributions stacked upwards and negative ones downwards.
    """
    from matplotlib.figure import Figure

    colours = theme_of(theme)
    named = _colours(parts, coordinates, colours)
    height = (STRIP + STACK) * HEIGHT * len(coordinates) + TITLE
    figure = Figure(figsize=(WIDTH + 1.0, height), layout="constrained", facecolor=colours.background)
    ratios = [STRIP, STACK] * len(coordinates)
    axes = figure.subplots(2 * len(coordinates), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    figure.suptitle(title_of(run) if title is None else title, color=colours.text, fontsize=12, fontweight="bold")
    seconds, unit = time_unit(float(np.ptp(time)))
    rows = np.searchsorted(run.time, time).astype(np.int64)
    for strip, stack, one in zip(axes[::2], axes[1::2], coordinates, strict=True):
        _draw_motion(strip, run, rows, time / seconds, one, colours)
        _draw_stack(stack, time / seconds, parts, one, named, colours)
    axes[-1].set_xlabel(f"time [{unit}]")
    return saved(figure, path, dpi, force)


def readable_name(name: str) -> str:
    """A term as a reader calls it.

    >>> readable_name("loads/slew"), readable_name("inertia/tip_arm"), readable_name("gravity_gradient")
    ('load slew', 'inertia of tip_arm', 'gravity gradient')
    """
    if name.startswith("loads/"):
        return f"load {name.removeprefix('loads/')}"
    if name.startswith("inertia/"):
        return f"inertia of {name.removeprefix('inertia/')}"
    return name.replace("_", " ")


def contributions(parts: Mapping[str, Array], one: CoordinateTerms) -> tuple[Array, dict[str, Array]]:
    """Inertia times acceleration (n_t,), in its unit, and the other terms, strongest first: name -> (n_t,).

    The inertia is the coordinate's own, and that of other sources pushes; where most of the two cancels, as of bodies
    that share an acceleration, the inertia of all is one.
    """
    line = drawn_as_lines(parts, one)
    pushes = {name: -rows[:, one.index] for name, rows in parts.items() if name not in line}
    size = {name: _size(push) for name, push in pushes.items()}
    total = sum(size.values()) or 1.0
    ranked = sorted(pushes, key=lambda name: -size[name])
    kept = [name for name in ranked[:MOST] if size[name] > SMALL * total]
    found = {name: pushes[name] for name in kept}
    rest = np.sum([pushes[name] for name in ranked if name not in kept], axis=0)
    if _size(rest) > SMALL * total:
        found["others"] = rest
    return np.sum([parts[name][:, one.index] for name in line], axis=0), found


def drawn_as_lines(parts: Mapping[str, Array], one: CoordinateTerms) -> list[str]:
    """The parts (n_t, n_u) that the line adds up: own inertia, or that of all coordinates where most of it cancels
    [SI]."""
    inertia = [name for name in parts if name.startswith("inertia/")]
    whole = np.sum([parts[name][:, one.index] for name in inertia], axis=0) if inertia else np.zeros(0)
    apart = sum(_size(parts[name][:, one.index]) for name in inertia)
    if one.own in inertia and _size(whole) < CANCELLED * apart:
        return inertia
    return [one.own]


def _size(values: Array) -> float:
    """Mean magnitude, to which a short spike adds little."""
    return float(np.mean(np.abs(values)))


def _colours(parts: Mapping[str, Array], coordinates: Sequence[CoordinateTerms], colours: Theme) -> dict[str, str]:
    """One colour for every contribution, the same for all coordinates; the strongest of each choose first."""
    ranks = [list(contributions(parts, one)[1]) for one in coordinates]
    order = [rank[k] for k in range(MOST + 1) for rank in ranks if k < len(rank)]
    named = list(dict.fromkeys(name for name in order if name != "others"))
    return {name: colours.lines[k % len(colours.lines)] for k, name in enumerate(named)} | {"others": colours.faint}


def _draw_motion(ax: Axes, run: Run, rows: IntArray, time: Array, one: CoordinateTerms, colours: Theme) -> None:
    """The coordinate itself where u is its rate, else the rate."""
    coordinate = one.name.removesuffix("_rate")
    path = "q" if coordinate in run.names("q") else "u"
    column = run.names(path).index(coordinate if path == "q" else one.name)
    values, unit = run[path][rows, column], run.units(path)[column]
    if unit in ("rad", "rad/s"):
        values, unit = np.rad2deg(values), unit.replace("rad", "deg")
    ax.plot(time, values, color=colours.text, linewidth=1.1)
    ax.set_ylabel(f"[{raised(unit)}]")
    shown = coordinate if path == "q" else one.name
    ax.set_title(shown, loc="left", fontsize=10, fontweight="bold", color=colours.text)
    finish(ax, [], colours)
    ax.margins(x=0)


def _draw_stack(
    ax: Axes, time: Array, parts: Mapping[str, Array], one: CoordinateTerms, named: dict[str, str], colours: Theme
) -> None:
    own, pushes = contributions(parts, one)
    total = sum(map(_size, pushes.values())) or 1.0
    up, down = np.zeros(len(time)), np.zeros(len(time))
    for name, push in pushes.items():
        share = _size(push) / total
        label = f"{readable_name(name)}  {100 * share:.{1 if share < 0.1 else 0}f} %"
        higher, lower = up + np.maximum(push, 0.0), down + np.minimum(push, 0.0)
        style: dict[str, Any] = {"color": named[name], "alpha": 0.75, "linewidth": 0.0}
        ax.fill_between(time, up, higher, label=label, **style)
        ax.fill_between(time, down, lower, **style)
        up, down = higher, lower
    ax.axhline(0.0, color=colours.faint, linewidth=0.6)
    ax.plot(time, own, color=colours.background, linewidth=3.0)
    ax.plot(
        time,
        own,
        color=colours.text,
        linewidth=1.3,
        label=f"sum: {readable_name(one.own) if len(drawn_as_lines(parts, one)) == 1 else 'inertia'}",
    )
    what = {"N": "force", "N m": "moment"}.get(one.unit, "generalised force")
    ax.set_ylabel(f"{what} [{raised(one.unit)}]")
    finish(ax, list(pushes), colours)
    ax.margins(x=0)
    high, low = np.maximum(up, own), np.minimum(down, own)
    if not _widened(ax, high, low, one.unit, colours):
        _cut_spikes(ax, time, high, low, one.unit, colours)


def _widened(ax: Axes, high: Array, low: Array, unit: str, colours: Theme) -> bool:
    """Whether the scale is made logarithmic: where a good part of the run goes far beyond another good part."""
    reach = np.maximum(high, -low)
    swings = [float(part.max()) for part in np.array_split(reach, min(CHUNKS, len(reach)))]
    quiet, most = float(np.percentile(swings, QUIET)), float(np.percentile(reach, 100 - RARE))
    if not most > WIDE * quiet > 0:
        return False
    start = float(f"{quiet:.0e}")
    ax.set_yscale("symlog", linthresh=start)
    _note(ax, f"scale linear to {start:g} {raised(unit)}, logarithmic beyond", colours)
    return True


def _note(ax: Axes, text: str, colours: Theme) -> None:
    ax.annotate(text, (1.0, 1.01), xycoords="axes fraction", ha="right", va="bottom", fontsize=8, color=colours.text)


def _cut_spikes(ax: Axes, time: Array, high: Array, low: Array, unit: str, colours: Theme) -> None:
    """Where a few instants go far beyond all others, scale the axes to these and say how far the others go."""
    top, bottom = float(np.percentile(high, 100 - RARE)), float(np.percentile(low, RARE))
    span = top - bottom
    largest = max(float(high.max()) - top, bottom - float(low.min()))
    if not span > 0 or largest < SPIKE * span:
        return
    ax.set_ylim(bottom - 0.3 * span, top + 0.3 * span)
    at = time[np.argmax(np.maximum(high - top, bottom - low))]
    text = f"cut off: up to {high.max():.3g}, down to {low.min():.3g} {raised(unit)}, the farthest at {at:.3g}"
    _note(ax, text, colours)
