"""Energy account of a run: stored and dissipated energy, and work of loads and actuators, each contributor by name."""

from __future__ import annotations

from pathlib import Path
from typing import Unpack

import numpy as np

from femflex.arrays import Array
from femflex.results import Run
from femflex.view.curves import balance_of, has_balance, work_of
from femflex.view.plot import PlotOptions, Sheet, finish, title_of
from femflex.view.units import time_unit

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
