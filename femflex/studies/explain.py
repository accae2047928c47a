"""What moves each coordinate of a run: the terms of eq. (9) along it, their sizes, and the telling coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.terms.by_source import INERTIA_OF, force_units, inertia_by_source, terms, velocity_slices

if TYPE_CHECKING:
    from femflex.dynamics import Model
    from femflex.results import Run


MANY = 16  # names listed in an error
TELLING = 3  # coordinates shown unless some are named
ROUNDING = 1e-9  # of the parts of the inertia: what is below it is none
NOTICEABLE = 1e-3  # of the energy through the coordinate that takes most
SWINGS = 24  # half oscillations that can be distinguished in a picture


@dataclass(frozen=True, eq=False)
class Explanation:
    """The terms of a run: time (n_t,) [s], name -> (n_t, n_u) with the signs of M udot + h - Q = 0, and M udot split.

    u              (n_t, n_u) quasi-velocities
    names, units   of the quasi-velocities and of the generalised forces on them (n_u)
    own            the source in `inertia` that each coordinate belongs to (n_u)
    """

    time: Array
    terms: dict[str, Array]
    inertia: dict[str, Array]
    u: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    own: tuple[str, ...]

    @property
    def parts(self) -> dict[str, Array]:
        """Terms (n_t, n_u) in `units`, which sum to zero; inertia is split by the acceleration that causes it."""
        return {**self.inertia, **{name: rows for name, rows in self.terms.items() if name != "inertia"}}

    @property
    def remainder(self) -> float:
        """Largest sum of the terms over the largest term of all."""
        largest = max(float(np.abs(rows).max(initial=0.0)) for rows in self.terms.values())
        return float(np.abs(sum(self.terms.values())).max(initial=0.0)) / (largest or 1.0)

    def until(self, last: float) -> Explanation:
        """The same up to that time [s]."""
        rows = self.time <= last
        cut = [{name: part[rows] for name, part in parts.items()} for parts in (self.terms, self.inertia)]
        return Explanation(self.time[rows], cut[0], cut[1], self.u[rows], self.names, self.units, self.own)

    def sizes(self, k: int) -> dict[str, tuple[float, float]]:
        """Peak (with its sign) and root mean square of every term on coordinate k, the inertia whole and split."""
        return {name: _size(rows[:, k]) for name, rows in {**self.terms, **self.inertia}.items()}

    def index(self, name: str) -> int:
        """Place of a coordinate by the name of its velocity, with or without "_rate", or its number from 1.

        Raises KeyError with the known names.
        """
        short = [own.removesuffix("_rate") for own in self.names]
        for known in (list(self.names), short):
            if name in known:
                return known.index(name)
        if name.isdigit() and 1 <= int(name) <= len(short):
            return int(name) - 1
        near = get_close_matches(name, short, n=3)
        more = f" and {len(short) - MANY} more" if len(short) > MANY else ""
        text = f"near it are {near}" if near else f"known are {short[:MANY]}{more}"
        raise KeyError(f"{name!r} is not a coordinate of the run; {text}")

    def dominant_coordinates(self) -> list[int]:
        """The coordinates that show most, at most three: through which most energy goes (see `energies`).

        The first two are of different units where there is such a pair.
        """
        energy = self.energies()
        ranked = [int(k) for k in np.argsort(-energy, kind="stable") if energy[k] > NOTICEABLE * energy.max()]
        other = [k for k in ranked if self.units[k] != self.units[ranked[0]]]
        return sorted(list(dict.fromkeys([*ranked[:1], *other[:1], *ranked]))[:TELLING]) or [0]

    def energies(self) -> Array:
        """How far the work int Q u dt of every term goes up and down along the run, summed over terms, (n_u,) [J].

        Reported for any coordinate in the same unit, and for slow motions as for fast ones.
        """
        both = self.terms, self.inertia
        whole, split = (sum(np.mean(np.abs(rows), axis=0) for rows in parts.values()) for parts in both)
        energy = sum(np.ptp(integral(self.time, rows * self.u), axis=0) for rows in self.terms.values())
        return np.where(whole > ROUNDING * split, energy, 0.0)  # parts of the inertia may cancel to nothing


def integral(time: Array, values: Array) -> Array:
    """Integral (n_t, n) [unit s] of values (n_t, n) from the first instant on, by the trapezoidal rule."""
    steps = 0.5 * np.diff(time)[:, None] * (values[1:] + values[:-1])
    return np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(steps, axis=0)])


def readable_span(found: Explanation, places: Sequence[int]) -> tuple[float, float]:
    """The first and last time [s] of a picture in which the one of these that tells most can be seen to swing."""
    leader = max(places, key=found.energies().__getitem__)
    moved = integral(found.time, found.u[:, [leader]])[:, 0]
    crossings = np.flatnonzero(np.diff(np.signbit(moved - np.mean(moved))))
    last = found.time[crossings[SWINGS]] if len(crossings) > 2 * SWINGS else found.time[-1]
    return float(found.time[0]), float(last)


def explain(run: Run, model: Model, span: tuple[float, float] | None = None) -> Explanation:
    """The terms of a run, or of a part of it from span[0] to span[1] [s], by the model that made it."""
    first, last = (run.time[0], run.time[-1]) if span is None else span
    rows = np.flatnonzero((run.time >= first) & (run.time <= last))
    if len(rows) < 2:
        raise ValueError(
            f"there are {len(rows)} instants from {first:g} to {last:g} s; "
            f"the run has them from {run.time[0]:g} to {run.time[-1]:g} s"
        )
    part = slice(int(rows[0]), int(rows[-1]) + 1)
    time, states = run.read("time", part), run.states(part)
    own = [""] * model.n_u
    for source, places in velocity_slices(model.system).items():
        own[places] = [INERTIA_OF + source] * (places.stop - places.start)
    names = tuple(name for name, _ in model.system.velocity_names())
    whole, split = terms(model, time, states), inertia_by_source(model, time, states)
    return Explanation(time, whole, split, model.parts(states)[1], names, tuple(force_units(model.system)), tuple(own))


def chosen(found: Explanation, names: Sequence[str]) -> list[int]:
    """Places of the named coordinates ("all" for every one), or of a default selection."""
    if list(names) == ["all"]:
        return list(range(len(found.names)))
    return [found.index(name) for name in names] or found.dominant_coordinates()


def _size(values: Array) -> tuple[float, float]:
    peak = float(values[np.argmax(np.abs(values))])
    return peak, float(np.sqrt(np.mean(values**2)))
