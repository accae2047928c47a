"""Diagrams of a pointing budget: cumulative rms, spectra, responses, and jitter over the speed of wheels and drives."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from femflex.arrays import Array
from femflex.view.plot import PlotOptions, Sheet, finish, labelled
from femflex.view.units import ARCSECOND, RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAMED = 6  # modes named in a diagram
LEAST = 1e-12  # of the largest value: smaller ones are not drawn
RANGE = 1e-9  # of the largest value, shown on a log axis


def plot_jitter(budget: Any, path: str | Path, show: str = "cumulative", **options: Unpack[PlotOptions]) -> Path:
    """Path of a picture (.png or .svg) of a femflex.studies.jitter.Budget, one pair of axes for each unit of outputs.

    show: "cumulative", "spectrum", "response", "speeds" or "waterfall". Raises ValueError where there is nothing
    to draw.
    """
    sheet = Sheet(path, "Pointing budget", **options)
    if show in ("speeds", "waterfall"):
        swept = {name: entry.scan for name, entry in budget.contributions.items() if entry.scan is not None}
        if not swept:
            raise ValueError("no source has a range of speeds; give a wheel `speeds`, or a drive `rates_between`")
        return _speeds(budget, swept, sheet) if show == "speeds" else _waterfall(budget, swept, sheet)
    groups = _groups(budget)
    sources = list(budget.contributions) if show == "response" else [""]
    pairs = [(unit, members, source) for source in sources for unit, members in groups.items()]
    axes, colours = sheet.rows(len(pairs), size=(9.0, 3.4 * len(pairs) + 0.5)), sheet.colours
    for ax, (unit, members, source) in zip(axes, pairs, strict=True):
        x, values = _curves(budget, show, source)
        values = _scaled(values[:, members], unit)
        for n, k in enumerate(members):
            ax.semilogx(x, values[:, n], label=budget.names[k], color=colours.lines[n % len(colours.lines)])
        if show == "cumulative":
            ax.set_ylim(bottom=0.0)
            ax.set_ylabel(labelled("rms up to the frequency", _unit(unit)))
            _name_modes(ax, budget, members, colours)
        else:
            ax.set_yscale("log")
            largest, least = float(values.max()), 0.5 * float(values[values > 0].min())
            ax.set_ylim(bottom=max(RANGE * largest, least), top=2.0 * largest)
            density = labelled("root of the density", f"{_unit(unit)}/Hz^1/2")
            ax.set_ylabel(f"{_unit(unit)} per unit of {source}" if source else density)
        ax.margins(x=0)
        finish(ax, members, colours)
    axes[-1].set_xlabel("frequency [Hz]")
    return sheet.save()


def _curves(budget: Any, show: str, source: str) -> tuple[Array, Array]:
    """Frequencies (n,) [Hz], and values (n, n_out) of the outputs over them."""
    if show == "cumulative":
        return budget.edges, np.sqrt(budget.cumulative())
    if show == "response":
        return budget.frequencies, np.linalg.norm(budget.plant.response(budget.frequencies, source), axis=2)
    density = np.sqrt(sum(entry.density for entry in budget.contributions.values()))
    if not density.any():
        text = "no source is random, so there is no spectral density to draw; --show cumulative has lines too"
        raise ValueError(text)
    return budget.frequencies, density


def _groups(budget: Any) -> dict[str, list[int]]:
    """Outputs that are not zero, by their unit."""
    rms = budget.rms
    groups: dict[str, list[int]] = {}
    for k, unit in enumerate(budget.units):
        if rms[k] > LEAST * max((rms[j] for j, other in enumerate(budget.units) if other == unit), default=0.0):
            groups.setdefault(unit, []).append(k)
    if not groups:
        raise ValueError("no output moves under these sources, so there is nothing to draw; give other outputs")
    return groups


def _scaled(values: Array, unit: str) -> Array:
    return values / ARCSECOND if unit == "rad" else values


def _unit(unit: str) -> str:
    return "arcsec" if unit == "rad" else unit


def _name_modes(ax: Axes, budget: Any, members: list[int], colours: Any) -> None:
    """Lines at the frequencies of the modes with the largest parts, named where names do not cover each other."""
    shares = np.abs(budget.by_mode[:-1, members] / budget.mean_squares[members]).max(axis=1, initial=0.0)
    named: list[float] = []
    for k in np.argsort(-shares, kind="stable")[:NAMED]:
        mode, width = budget.modes[k], np.log(budget.edges[-1] / budget.edges[0])
        if shares[k] < 0.01:
            break
        ax.axvline(mode.frequency, color=colours.faint, linewidth=0.8, linestyle=":")
        if all(abs(np.log(mode.frequency / other)) > 0.02 * width for other in named):
            named.append(mode.frequency)
            ax.annotate(
                f"{mode.name}, {mode.frequency:.3g} Hz", (mode.frequency, 0.03), xycoords=("data", "axes fraction"),
                xytext=(2, 0), textcoords="offset points", rotation=90, va="bottom", fontsize=7, color=colours.text,
            )  # fmt: skip


def _speeds(budget: Any, swept: Any, sheet: Sheet) -> Path:
    groups = _groups(budget)
    axes = sheet.rows(len(groups), size=(9.0, 3.4 * len(groups) + 0.5))
    for ax, (unit, members) in zip(axes, groups.items(), strict=True):
        for n, (source, k) in enumerate((source, k) for source in swept for k in members):
            scan = swept[source]
            values = _scaled(np.sqrt(scan.mean_squares[:, k]), unit)
            if values.max() > 0:
                label = f"{source}: {budget.names[k]}"
                ax.semilogy(
                    scan.speeds * RPM, values, label=label, color=sheet.colours.lines[n % len(sheet.colours.lines)]
                )
        ax.set_ylabel(labelled("rms", _unit(unit)))
        ax.margins(x=0)
        finish(ax, members, sheet.colours)
    axes[-1].set_xlabel("speed [rpm]")
    return sheet.save()


def _waterfall(budget: Any, swept: Any, sheet: Sheet) -> Path:
    """Lines over frequency and speed; colour is the root mean square of the largest output of each source."""
    axes = sheet.rows(len(swept), sharex=False, size=(9.0, 4.2 * len(swept) + 0.5))
    for ax, (source, scan) in zip(axes, swept.items(), strict=True):
        k = int(
            np.argmax(
                [scan.mean_squares[:, k].max() / (budget.mean_squares[k] or 1.0) for k in range(len(budget.names))]
            )
        )
        unit = budget.units[k]
        x = (scan.speeds[:, None] * scan.orders / (2.0 * np.pi)).ravel()
        y = np.repeat(scan.speeds * RPM, len(scan.orders))
        rms = _scaled(np.sqrt(scan.by_order[:, :, k]), unit).ravel()
        inside = rms > 1e-4 * rms.max()
        from matplotlib.colors import LogNorm

        order = np.argsort(rms[inside])
        points = ax.scatter(
            x[inside][order],
            y[inside][order],
            c=rms[inside][order],
            s=7.0,
            norm=LogNorm(),
            cmap="viridis",
            linewidths=0,
        )
        bar = ax.figure.colorbar(points, ax=ax)
        bar.set_label(labelled(f"rms of {budget.names[k]}", _unit(unit)), color=sheet.colours.text)
        bar.ax.tick_params(colors=sheet.colours.text, which="both", labelsize=8)
        for mode in budget.modes:
            if mode.frequency <= x.max():
                ax.axvline(mode.frequency, color=sheet.colours.faint, linewidth=0.6, linestyle=":")
        ax.set(xlabel="frequency [Hz]", ylabel=f"speed of {source} [rpm]")
        finish(ax, [], sheet.colours)
    return sheet.save()
