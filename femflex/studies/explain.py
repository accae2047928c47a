"""Balance of terms on each coordinate of a run: the terms of eq. (9), their sizes, and the dominant coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import cumulative_trapezoid

from femflex.arrays import Array
from femflex.dynamics.ledger.by_source import INERTIA_OF, force_units, inertia_by_source, terms, velocity_slices

if TYPE_CHECKING:
    from femflex.dynamics import Model
    from femflex.results import Run


MANY = 16  # names listed in an error
SHOWN = 3  # coordinates shown by default
ROUNDING = 1e-9  # of the parts of the inertia: smaller inertia counts as zero
NOTICEABLE = 1e-3  # of the energy through the coordinate with the most
SWINGS = 24  # half oscillations that can be distinguished in a picture


@dataclass(frozen=True, eq=False)
class Explanation:
    """The terms of a run: time (n_t,) [s], name -> (n_t, n_u) with the signs of M udot + h - Q = 0, and M udot split.

    u              (n_t, n_u) quasi-velocities
    names, units   of the quasi-velocities and of the generalised forces on them (n_u)
    own_sources    the source in `inertia` to which each coordinate belongs (n_u)
    """

    time: Array
    terms: dict[str, Array]
    inertia: dict[str, Array]
    u: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    own_sources: tuple[str, ...]

    @property
    def parts(self) -> dict[str, Array]:
        """Terms (n_t, n_u) in `units`, which sum to zero; inertia is split by the acceleration that causes it."""
        return {**self.inertia, **{name: rows for name, rows in self.terms.items() if name != "inertia"}}

    @property
    def remainder(self) -> float:
        """Largest sum of the terms over the largest term of all."""
        largest = max(float(np.abs(rows).max(initial=0.0)) for rows in self.terms.values())
        return float(np.abs(sum(self.terms.values())).max(initial=0.0)) / (largest or 1.0)

    def up_to(self, end: float) -> Explanation:
        """The explanation up to that time [s]."""
        selected = self.time <= end
        cut = [
            {name: rows_of_term[selected] for name, rows_of_term in term_rows.items()}
            for term_rows in (self.terms, self.inertia)
        ]
        return Explanation(
            self.time[selected], cut[0], cut[1], self.u[selected], self.names, self.units, self.own_sources
        )

    def sizes(self, k: int) -> dict[str, tuple[float, float]]:
        """Peak (with its sign) and root mean square of every term on coordinate k, the inertia whole and split."""
        return {name: _size(rows[:, k]) for name, rows in {**self.terms, **self.inertia}.items()}

    def index(self, name: str) -> int:
        """Index of a coordinate by the name of its velocity, with or without "_rate", or by its number from 1.

        Raises KeyError with the known names.
        """
        labels = [velocity.removesuffix("_rate") for velocity in self.names]
        for candidates in (list(self.names), labels):
            if name in candidates:
                return candidates.index(name)
        if name.isdigit() and 1 <= int(name) <= len(labels):
            return int(name) - 1
        matches = get_close_matches(name, labels, n=3)
        rest_text = f" and {len(labels) - MANY} more" if len(labels) > MANY else ""
        text = f"near it are {matches}" if matches else f"known are {labels[:MANY]}{rest_text}"
        raise KeyError(f"{name!r} is not a coordinate of the run; {text}")

    def dominant_coordinates(self) -> list[int]:
        """The coordinates with the most energy through them (see `energies`), at most three.

        The first two are of different units where there is such a pair.
        """
        energy = self.energies()
        ranked = [int(k) for k in np.argsort(-energy, kind="stable") if energy[k] > NOTICEABLE * energy.max()]
        of_other_unit = [k for k in ranked if self.units[k] != self.units[ranked[0]]]
        return sorted(list(dict.fromkeys([*ranked[:1], *of_other_unit[:1], *ranked]))[:SHOWN]) or [0]

    def energies(self) -> Array:
        """Range of the work int Q u dt of every term along the run, summed over terms, (n_u,) [J].

        It has the same unit for every coordinate, and does not depend on how fast the motion is.
        """
        splits = self.terms, self.inertia
        total, split = (sum(np.mean(np.abs(rows), axis=0) for rows in term_rows.values()) for term_rows in splits)
        energy = sum(
            np.ptp(cumulative_trapezoid(rows * self.u, self.time, axis=0, initial=0), axis=0)
            for rows in self.terms.values()
        )
        return np.where(total > ROUNDING * split, energy, 0.0)  # parts of the inertia may cancel to nothing


def readable_span(explanation: Explanation, coordinates: Sequence[int]) -> tuple[float, float]:
    """First and last time [s] of a picture in which the oscillations of the dominant coordinate are visible."""
    leader = max(coordinates, key=explanation.energies().__getitem__)
    displacement = cumulative_trapezoid(explanation.u[:, leader], explanation.time, initial=0)
    crossings = np.flatnonzero(np.diff(np.signbit(displacement - np.mean(displacement))))
    end = explanation.time[crossings[SWINGS]] if len(crossings) > 2 * SWINGS else explanation.time[-1]
    return float(explanation.time[0]), float(end)


def explain(run: Run, model: Model, span: tuple[float, float] | None = None) -> Explanation:
    """The terms of a run, or of a part of it from span[0] to span[1] [s], by the model of that run."""
    start, end = (run.time[0], run.time[-1]) if span is None else span
    rows = np.flatnonzero((run.time >= start) & (run.time <= end))
    if len(rows) < 2:
        raise ValueError(
            f"there are {len(rows)} instants from {start:g} to {end:g} s; "
            f"the run has them from {run.time[0]:g} to {run.time[-1]:g} s"
        )
    rows_of_span = slice(int(rows[0]), int(rows[-1]) + 1)
    time, states = run.read("time", rows_of_span), run.states(rows_of_span)
    own_sources = [""] * model.n_u
    for source, columns in velocity_slices(model.system).items():
        own_sources[columns] = [INERTIA_OF + source] * (columns.stop - columns.start)
    names = tuple(name for name, _ in model.system.velocity_names())
    total, split = terms(model, time, states), inertia_by_source(model, time, states)
    return Explanation(
        time, total, split, model.parts(states)[1], names, tuple(force_units(model.system)), tuple(own_sources)
    )


def selected_coordinates(explanation: Explanation, names: Sequence[str]) -> list[int]:
    """Indices of the named coordinates ("all" for every one), or of a default selection."""
    if list(names) == ["all"]:
        return list(range(len(explanation.names)))
    return [explanation.index(name) for name in names] or explanation.dominant_coordinates()


def _size(values: Array) -> tuple[float, float]:
    peak = float(values[np.argmax(np.abs(values))])
    return peak, float(np.sqrt(np.mean(values**2)))
