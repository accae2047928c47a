"""Pictures of what drives a motion: terms on each coordinate, torques by source, and the energy account."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.results import Run
from femflex.view.curves import balance_of, has_balance, work_of
from femflex.view.plot import DASHES, HEIGHT, TITLE, WIDTH, PlotOptions, Sheet, finish, title_of, with_superscripts
from femflex.view.surroundings import shade_eclipses
from femflex.view.theme import Theme
from femflex.view.units import time_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST = 7  # contributions with their own names; the others are summed
SMALL = 2e-3  # of the mean magnitude of all contributions together: smaller ones are not named
CANCELLED = 0.5  # of the sum of the sizes of the inertia terms: if their sum is smaller they are drawn as one
RARE, SPIKE = 2.0, 2.5  # percent of the instants; spikes this many times beyond the other values are cut off
STRIP, TERMS = 0.5, 1.35  # heights of the strip of the motion and of the terms, in those of a plot's axes
SHARES = "share of mean magnitudes"  # of the percentages of the legend


@dataclass(frozen=True)
class CoordinateTerms:
    """A coordinate to explain: its index in u, name, unit of its generalised force, and its own part of the inertia."""

    index: int
    name: str
    unit: str
    own_source: str


def plot_terms(
    run: Run,
    time: Array,
    split_terms: Mapping[str, Array],
    coordinates: Sequence[CoordinateTerms],
    path: str | Path,
    **options: Unpack[PlotOptions],
) -> Path:
    """Path of a picture (.png or .svg): for each coordinate its motion, and below it the generalised forces on it.

    split_terms: name -> (n_t, n_u) at the instants `time` of the run, summing to zero, with their signs in
    M udot + h - Q = 0, and M udot whole or split as "inertia/<source>". A coordinate's own inertia times acceleration
    is the dark line; the others, on the other side of the equation, are a line each and add up to it.
    """
    sheet = Sheet(path, title_of(run), **options)
    colours = sheet.colours
    colours_of_terms = _term_colours(split_terms, coordinates, colours)
    height = (STRIP + TERMS) * HEIGHT * len(coordinates) + TITLE
    figure = sheet.figure(WIDTH + 1.0, height)
    ratios = [STRIP, TERMS] * len(coordinates)
    axes = figure.subplots(2 * len(coordinates), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    seconds, unit = time_unit(float(np.ptp(time)))
    rows = np.searchsorted(run.time, time).astype(np.int64)
    for strip, below, coordinate in zip(axes[::2], axes[1::2], coordinates, strict=True):
        _draw_coordinate(strip, run, rows, time / seconds, coordinate, colours)
        _draw_terms(below, time / seconds, split_terms, coordinate, colours_of_terms, colours)
    axes[-1].set_xlabel(f"time [{unit}]")
    return sheet.save()


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


def contributions(split_terms: Mapping[str, Array], coordinate: CoordinateTerms) -> tuple[Array, dict[str, Array]]:
    """Inertia times acceleration (n_t,), in its unit, and the other terms, strongest first: name -> (n_t,).

    The inertia is the coordinate's own, and inertia of other sources counts as a force. If the two nearly cancel, as
    for bodies with a common acceleration, the inertia of all sources is summed.
    """
    line = terms_of_line(split_terms, coordinate)
    pushes = {name: -rows[:, coordinate.index] for name, rows in split_terms.items() if name not in line}
    size = {name: _size(push) for name, push in pushes.items()}
    total = sum(size.values()) or 1.0
    ranked = sorted(pushes, key=lambda name: -size[name])
    named_terms = [name for name in ranked[:MOST] if size[name] > SMALL * total]
    named_pushes = {name: pushes[name] for name in named_terms}
    remainder = np.sum([pushes[name] for name in ranked if name not in named_terms], axis=0)
    if _size(remainder) > SMALL * total:
        named_pushes["others"] = remainder
    return np.sum([split_terms[name][:, coordinate.index] for name in line], axis=0), named_pushes


def terms_of_line(split_terms: Mapping[str, Array], coordinate: CoordinateTerms) -> list[str]:
    """Names of the terms that the line sums: own inertia, or that of all sources where most of it cancels."""
    inertia = [name for name in split_terms if name.startswith("inertia/")]
    total = np.sum([split_terms[name][:, coordinate.index] for name in inertia], axis=0) if inertia else np.zeros(0)
    sum_of_sizes = sum(_size(split_terms[name][:, coordinate.index]) for name in inertia)
    if coordinate.own_source in inertia and _size(total) < CANCELLED * sum_of_sizes:
        return inertia
    return [coordinate.own_source]


def _size(values: Array) -> float:
    """Mean magnitude, to which a short spike adds little."""
    return float(np.mean(np.abs(values)))


def _term_colours(
    split_terms: Mapping[str, Array], coordinates: Sequence[CoordinateTerms], colours: Theme
) -> dict[str, str]:
    """A colour for every contribution, the same for all coordinates; the strongest ones of each come first."""
    ranks = [list(contributions(split_terms, coordinate)[1]) for coordinate in coordinates]
    order = [rank[k] for k in range(MOST + 1) for rank in ranks if k < len(rank)]
    names = list(dict.fromkeys(name for name in order if name != "others"))
    return {name: colours.lines[k % len(colours.lines)] for k, name in enumerate(names)} | {"others": colours.faint}


def _draw_coordinate(
    ax: Axes, run: Run, rows: IntArray, time: Array, terms_of_coordinate: CoordinateTerms, colours: Theme
) -> None:
    """The coordinate itself where u is its rate, else the rate."""
    coordinate = terms_of_coordinate.name.removesuffix("_rate")
    path = "q" if coordinate in run.names("q") else "u"
    column = run.names(path).index(coordinate if path == "q" else terms_of_coordinate.name)
    values, unit = run[path][rows, column], run.units(path)[column]
    if unit in ("rad", "rad/s"):
        values, unit = np.rad2deg(values), unit.replace("rad", "deg")
    ax.plot(time, values, color=colours.text, linewidth=1.1)
    ax.set_ylabel(f"[{with_superscripts(unit)}]")
    title = coordinate if path == "q" else terms_of_coordinate.name
    ax.set_title(title, loc="left", fontsize=10, fontweight="bold", color=colours.text)
    finish(ax, [], colours)
    ax.margins(x=0)


def _draw_terms(
    ax: Axes,
    time: Array,
    split_terms: Mapping[str, Array],
    coordinate: CoordinateTerms,
    colours_of_terms: dict[str, str],
    colours: Theme,
) -> None:
    line, pushes = contributions(split_terms, coordinate)
    total = sum(map(_size, pushes.values())) or 1.0
    ax.axhline(0.0, color=colours.faint, linewidth=0.6)
    has_one_term = len(terms_of_line(split_terms, coordinate)) == 1
    sum_name = readable_name(coordinate.own_source) if has_one_term else "inertia"
    ax.plot(time, line, color=colours.text, linewidth=2.2, label=f"sum: {sum_name}")
    for name, push in pushes.items():
        share = _size(push) / total
        label = f"{readable_name(name)}  {100 * share:.{1 if share < 0.1 else 0}f} %"
        ax.plot(time, push, color=colours_of_terms[name], linewidth=1.2, label=label)
    force_text = {"N": "force", "N m": "moment"}.get(coordinate.unit, "generalised force")
    ax.set_ylabel(f"{force_text} [{with_superscripts(coordinate.unit)}]")
    finish(ax, list(pushes), colours)
    if (legend := ax.get_legend()) is not None:
        legend.set_title(SHARES)
        legend.get_title().set(fontsize=8, color=colours.text)
    ax.margins(x=0)
    curves = np.stack([line, *pushes.values()])
    _cut_spikes(ax, time, curves.max(axis=0), curves.min(axis=0), coordinate.unit, colours)


def _cut_spikes(ax: Axes, time: Array, high: Array, low: Array, unit: str, colours: Theme) -> None:
    """Scale the axes to all but a few instants, if these go far beyond the others, and state how far they go."""
    top, bottom = float(np.percentile(high, 100 - RARE)), float(np.percentile(low, RARE))
    span = top - bottom
    largest = max(float(high.max()) - top, bottom - float(low.min()))
    if not span > 0 or largest < SPIKE * span:
        return
    ax.set_ylim(bottom - 0.3 * span, top + 0.3 * span)
    largest_time = time[np.argmax(np.maximum(high - top, bottom - low))]
    text = (
        f"cut off: up to {high.max():.3g}, down to {low.min():.3g} {with_superscripts(unit)}, "
        f"the farthest at {largest_time:.3g}"
    )
    ax.annotate(text, (1, 1.01), xycoords="axes fraction", ha="right", va="bottom", fontsize=8, color=colours.text)


def plot_budget(
    run: Run,
    time: Array,
    torques: Mapping[str, Array],
    momentum: Array,
    path: str | Path,
    **options: Unpack[PlotOptions],
) -> Path:
    """Path of a picture (.png or .svg): three axes of torques by source, and one of the momentum of their sum.

    time (n_t,) [s] of the budget; torques (n_t, 3) [N m] by source, the sum under "sum"; momentum (n_t, 3) of the sum,
    inertial axes [N m s]. Where the run reports a sun, times in eclipse have a darker background.
    """
    sheet = Sheet(path, title_of(run), **options)
    axes, colours = sheet.rows(4), sheet.colours
    seconds, unit = time_unit(float(np.ptp(time)))
    t = time / seconds
    limit = 1.1 * max(float(np.abs(torque).max()) for torque in torques.values()) or 1.0
    count = len(colours.lines)
    for k, axis in enumerate("xyz"):
        for i, (name, torque) in enumerate(torques.items()):
            style: dict[str, Any] = {"color": colours.lines[i % count], "ls": DASHES[i // count % len(DASHES)]}
            if name == "sum":
                style = {"color": colours.text, "lw": 1.6}
            axes[k].plot(t, torque[:, k], label=name.removeprefix("effectors/"), **style)
        axes[k].set_ylabel(f"torque {axis} [N m]")
        axes[k].set_ylim(-limit, limit)
    for k, axis in enumerate("XYZ"):
        axes[3].plot(t, momentum[:, k], color=colours.lines[k], label=axis)
    axes[3].set_ylabel("momentum [N m s]")
    axes[3].set_xlabel(f"time [{unit}]")
    for ax in axes:
        ax.set_xlim(t[0], t[-1])
        shade_eclipses(ax, run, seconds, colours)
        finish(ax, range(2), colours)
    return sheet.save()


STORED = {
    "monitors/kinetic": "kinetic",
    "monitors/elastic": "strain",
    "monitors/spring": "springs",
    "monitors/gravity": "gravity",
    "monitors/load": "constant loads",
}
POWERS = {"monitors/drive_power": "specified motions", "monitors/variation_power": "varying bodies"}
VISIBLE = 1e-3  # of the largest: a smaller contributor is not drawn


def energy_account(run: Run) -> dict[str, Array]:
    """Contributor -> its energy since the start (n_t,) [J]; the sum of all of them is zero.

    Stored energy, also of each effector; energy dissipated by each effector, by laws of joints and structural damping
    together, and by latches; minus the work of each load, effector and specified motion. Work is the integral
    of power over the rows of the run (Simpson's rule): rows that are far apart add to the error. Raises ValueError
    where the energy is no balance, on a specified orbit.
    """
    if not has_balance(run) or "monitors/jacobi" in run:
        raise ValueError("energy is not conserved on a specified orbit; plot monitors/jacobi instead")
    out = {}
    for path, name in STORED.items():
        if path in run:
            out[f"stored: {name}"] = run.finite(path) - run.finite(path)[0]
    effectors = sorted(
        {path.split("/")[1] for path in run if path.startswith("effectors/") and path.endswith("/power")}
    )
    remaining_power = {
        "dissipation": _channel_or_zero(run, "monitors/dissipation"),
        "supplied": _channel_or_zero(run, "monitors/supplied"),
    }
    for name in effectors:
        stored = _channel_or_zero(run, f"effectors/{name}/energy")
        out[f"stored: {name}"] = stored - stored[0]
        for key, sign, word in (("dissipation", 1.0, "dissipated"), ("supplied", -1.0, "work")):
            power = _channel_or_zero(run, f"effectors/{name}/{key}")
            out[f"{word}: {name}"] = sign * work_of(run, power)
            remaining_power[key] = remaining_power[key] - power
    out["dissipated: joints and structures"] = work_of(run, remaining_power["dissipation"])
    out |= _work_of_loads(run, remaining_power["supplied"])
    for path, name in POWERS.items():
        out[f"work: {name}"] = -work_of(run, _channel_or_zero(run, path))
    for path in run:
        if path.startswith("latches/") and path.endswith("/loss"):
            out[f"dissipated: latch {path.split('/')[1]}"] = run.finite(path)
    return {name: values for name, values in out.items() if values.any()}


def _work_of_loads(run: Run, supplied: Array) -> dict[str, Array]:
    """Minus the work of loads, each by itself where all of them supply power."""
    names = [path.split("/")[1] for path in run if path.startswith("loads/") and path.endswith("/power")]
    powers = {name: run.finite(f"loads/{name}/power") for name in names}
    if "monitors/load" in run:  # the potential of some is stored
        return {"work: loads": -work_of(run, supplied)}
    return {f"work: {name}": -work_of(run, power) for name, power in powers.items()}


def _channel_or_zero(run: Run, path: str) -> Array:
    return run.finite(path) if path in run else np.zeros(len(run))


def plot_energy(run: Run, path: str | Path, **options: Unpack[PlotOptions]) -> Path:
    """Path of a picture (.png or .svg) of the energy account: contributors stacked, their sum as a line, and its error.

    Positive energies are stacked upwards, negative ones downwards, and the line is their sum at every instant.
    """
    account, sheet = energy_account(run), Sheet(path, title_of(run), **options)
    seconds, unit = time_unit(run.duration)
    t = run.time / seconds
    (ax, below), colours = sheet.rows(2), sheet.colours
    largest = max((float(np.abs(values).max()) for values in account.values()), default=0.0)
    visible = {name: values for name, values in account.items() if np.abs(values).max() >= VISIBLE * largest}
    up, down = np.zeros(len(t)), np.zeros(len(t))
    for k, (name, values) in enumerate(visible.items()):
        for base, increment in ((up, np.maximum(values, 0.0)), (down, np.minimum(values, 0.0))):
            label = name if base is up else None
            colour = colours.lines[k % len(colours.lines)]
            ax.fill_between(t, base, base + increment, color=colour, alpha=0.75, linewidth=0, label=label)
            base += increment
    ax.plot(t, sum(account.values(), np.zeros(len(t))), color=colours.text, linewidth=1.0, label="sum")
    ax.set_ylabel("energy since\nthe start [J]")
    error = balance_of(run).values
    below.plot(t, error, color=colours.text, linewidth=1.0)
    below.set_ylabel("sum [J]")
    below.set_xlabel(f"time [{unit}]")
    for axes_ in (ax, below):
        axes_.margins(x=0)
    finish(ax, list(visible), colours)
    finish(below, [], colours)
    return sheet.save()
