"""Deflections of spinning bodies: the error of condensed strain, whose foreshortening is of second order.

A body deflected by b of its size shortens by b^2 / 2 of it and b^4 / 8, of which condensed strain has the first. In a
spinning body centrifugal forces act on the omitted part. For cantilevers bent in the plane of rotation by a force at
the end, compared with all finite elements, the relative error of the tip deflection is c b^2, with
c = 0.42 (rate / first frequency)^2 up to about twice that frequency and 0.9 above. A wire, stiffened by the spin alone,
swings in the plane of the spin about the small lever r of its root: its mass appears b^4 L^2 / 4 farther out, and the
relative error of its stiffness is c b^2 with c = L / 2 r.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.deflections import DeflectionWatch, deflection_watches
from femflex.advice.limits import (
    FAST_RATIO,
    MAX_SPINNING_COEFFICIENT,
    SLOW_RATIO,
    SPINNING_COEFFICIENT,
    SPINNING_ERROR,
    division_remedy,
)
from femflex.advice.stiffening import attached_masses, body_rate, lowest_frequency
from femflex.arrays import Array, IntArray
from femflex.system import LengthTable

if TYPE_CHECKING:
    from femflex.dynamics import Model


@dataclass(frozen=True)
class SpinningDeflection:
    """A deflection at an instant: over the body's size, with the rate [rad/s] and the estimated relative error."""

    bend: float
    rate: float
    error: float


class SpinningDeflectionWatch:
    """Watches bodies with condensed strain for deflections under spin, and warns of their estimated error."""

    def __init__(self, model: Model) -> None:
        system = model.system
        self._system = system
        self._watches = [
            watch for watch in deflection_watches(model) if system.bodies[watch.name].strain_form == "condensed"
        ]
        attached = {watch.name: attached_masses(system, watch.name) for watch in self._watches}
        self._first = {name: lowest_frequency(system.bodies[name], masses) for name, masses in attached.items()}
        self._worst: dict[str, SpinningDeflection] = {}

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the largest error over a block of states (n_t, n_x) [SI] and its channels (n_t, ...)."""
        for body in self._watches:
            rate = np.linalg.norm(body_rate(channels, body.name), axis=1)
            rows = np.flatnonzero(rate > SLOW_RATIO * self._first[body.name])
            if not rows.size:
                continue
            bend = body.relative_displacements(states[rows])
            error = self._error_coefficient(body, rate[rows], rows, channels) * bend**2
            k = int(error.argmax())
            if body.name not in self._worst or error[k] > self._worst[body.name].error:
                self._worst[body.name] = SpinningDeflection(float(bend[k]), float(rate[rows[k]]), float(error[k]))

    def _error_coefficient(
        self, body: DeflectionWatch, rate: Array, rows: IntArray, channels: Mapping[str, Array]
    ) -> Array:
        """The coefficient c (k,) at the rates (k,) [rad/s] of some rows."""
        ratio = _rate_ratio(rate, self._first[body.name])
        free = self._system.joint_of(self._system.root).kind == "free"
        axis = channels["monitors/center_of_mass"][rows] if free else 0.0
        marker = "root" if body.name in self._system.varying else self._system.joint_of(body.name).child_marker
        position = channels.get(f"markers/{body.name}.{marker}/position", channels[f"bodies/{body.name}/position"])
        lever = np.linalg.norm(position[rows] - axis, axis=1)
        limit = np.where(
            ratio < FAST_RATIO,
            MAX_SPINNING_COEFFICIENT,
            np.maximum(MAX_SPINNING_COEFFICIENT, body.size / np.maximum(2.0 * lever, 1e-300)),
        )
        return np.minimum(SPINNING_COEFFICIENT * ratio**2, limit)

    def doubts(self) -> Iterator[Advice]:
        """Warnings of bodies whose deflection has an estimated error above SPINNING_ERROR."""
        for name, worst in self._worst.items():
            if worst.error > SPINNING_ERROR:
                ratio = float(_rate_ratio(np.array(worst.rate), self._first[name]))
                times = f"{ratio:.2g} times" if ratio < FAST_RATIO else f"over {FAST_RATIO:g} times"
                text = (
                    f"body {name!r}, bent by {worst.bend:.0%} of its size, turned at {worst.rate:.4g} rad/s, "
                    f"{times} its first frequency. Condensed strain is of second order in bends: the bend is "
                    f"up to about {worst.error:.1%} off (limit {SPINNING_ERROR:.0%}). {self._remedy(name)}"
                )
                yield doubt(name, "bend", text, worst.error, SPINNING_ERROR)

    def _remedy(self, name: str) -> str:
        table = self._system.varying[name].write if name in self._system.varying else None
        if isinstance(table, LengthTable) and table.sections is not None and table.sections.slackens:
            return (
                "To avoid this error, let a universal joint turn the member about its exit, with functions.straight = "
                "false or no functions"
            )
        if table is not None:
            return "A deploying member cannot be cut into segments: take its bend as an indication, unless it is small"
        return f"To reduce the error, {division_remedy(self._system.bodies[name])}"


def _rate_ratio(rate: Array, first: float) -> Array:
    """Ratio (n,) of rates (n,) to the first frequency, both [rad/s], at most FAST_RATIO."""
    return np.asarray(rate / np.maximum(first, np.maximum(rate, 1e-300) / FAST_RATIO))
