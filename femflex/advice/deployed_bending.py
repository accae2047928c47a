"""Axial force in deploying members along a run: the bending stiffness of beams, and where tethers go slack.

The force N(s) at the stations of a member changes the stiffness of its bend w = 1 - cos(pi s / 2 L) by

    gain = int N w'^2 ds / int EI w''^2 ds,

which is N over Euler's load of a cantilever where both are uniform. Linear strain leaves this out; condensed strain has
it, and a member that is compressed by a large part of that load has large deflections.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from femflex.advice.advice import Advice, WorstRow, doubt
from femflex.advice.limits import BUCKLING_FACTOR, FREQUENCY_CHANGE, SLACK
from femflex.arrays import Array
from femflex.deployment.sections import MemberSections
from femflex.dynamics import Model
from femflex.system import LengthTable
from femflex.system.length_table import Sections


class AxialForceWatch:
    """Watches the axial force in deploying beams, and warns where it matters to their bending."""

    def __init__(self, model: Model) -> None:
        self._sections: dict[str, MemberSections] = {}
        for name, variation in model.system.varying.items():
            sections = variation.write.sections if isinstance(variation.write, LengthTable) else None
            if isinstance(sections, MemberSections) and sections.bends is not None and min(sections.stiffness) > 0.0:
                self._sections[name] = sections
        self._condensed = {name: model.system.bodies[name].condensed for name in self._sections}
        self._largest = {(name, sign): WorstRow() for name in self._sections for sign in (1.0, -1.0)}

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the largest gains over a block of rows (n_t, ...)."""
        for name, sections in self._sections.items():
            force, length = channels[f"bodies/{name}/tension"] - sections.support, channels[f"bodies/{name}/length"]
            gain = axial_gain(sections, force, length)
            mean = mean_force(sections, force)
            for sign in (1.0, -1.0):
                self._largest[name, sign].record(sign * gain, time=times, length=length, force=mean)

    def doubts(self) -> Iterator[Advice]:
        """Warnings of linear members whose first frequency changes by FREQUENCY_CHANGE, and of others near buckling."""
        for (name, sign), largest in self._largest.items():
            gain = sign * max(largest.measure, 0.0)
            if not largest.values:
                continue
            if not self._condensed[name]:
                yield from self._linear(name, gain, **largest.values)
            elif sign < 0.0:
                yield from self._compressed(name, gain, **largest.values)

    def _linear(self, name: str, gain: float, time: float, length: float, force: float) -> Iterator[Advice]:
        change = float(np.sqrt(max(1.0 + gain, 0.0))) - 1.0
        if abs(change) > FREQUENCY_CHANGE:
            verb = "raises" if change > 0.0 else "lowers"
            amount = "to zero" if gain <= -1.0 else f"by {abs(change):.0%}"
            text = (
                f"body {name!r} carries {force:.4g} N along its axis at t = {time:.6g} s (length "
                f"{length:.4g} m), which {verb} its first frequency {amount} (limit {FREQUENCY_CHANGE:.0%}); "
                "linear strain leaves this out. Give it strain = 'condensed'"
            )
            yield doubt(name, "stretch", text, abs(change), FREQUENCY_CHANGE)

    def _compressed(self, name: str, gain: float, time: float, length: float, force: float) -> Iterator[Advice]:
        if -gain > 1.0 / BUCKLING_FACTOR:
            text = (
                f"body {name!r} is compressed by {-force:.4g} N along its axis at t = {time:.6g} s "
                f"(length {length:.4g} m): {-gain:.0%} of its buckling load as a cantilever of this "
                f"length (limit {1 / BUCKLING_FACTOR:.0%}). Its deflections are sensitive to small errors, and wrong "
                "beyond buckling. Lower the load, deploy more slowly, or give it more bending stiffness"
            )
            yield doubt(name, "compression", text, -gain, 1.0 / BUCKLING_FACTOR)


def mean_force(sections: MemberSections, force: Array) -> Array:
    """The uniform axial forces (n_t,) [N] with the same effect on bending as those (n_t, k) [N] at the stations."""
    slope = np.sin(np.pi / 2.0 * sections.stations) ** 2
    return np.asarray(np.trapezoid(force * slope, sections.stations) / np.trapezoid(slope, sections.stations))


def axial_gain(sections: MemberSections, force: Array, length: Array) -> Array:
    """Relative change (n_t,) of the bending stiffness by axial forces (n_t, k) [N] at lengths (n_t,) [m]."""
    s = sections.stations
    slope = np.sin(np.pi / 2.0 * s) ** 2
    curvature = np.cos(np.pi / 2.0 * s) ** 2
    weak = min(sections.stiffness)
    out = np.empty(len(length))
    for row, (N, L) in enumerate(zip(force, length, strict=True)):
        factor = sections.factor(L * (1.0 - s if sections.tip is None else s))
        bending = weak * np.trapezoid(factor * curvature, s) * (np.pi / (2.0 * L)) ** 2
        out[row] = np.trapezoid(N * slope, s) / bending
    return out


class SlackWatch:
    """Watches the tension of deploying tethers and membranes, and warns where it falls below zero."""

    def __init__(self, model: Model) -> None:
        self._sections: dict[str, Sections] = {}
        for name, variation in model.system.varying.items():
            table = variation.write
            if isinstance(table, LengthTable) and table.sections is not None and table.sections.slackens:
                self._sections[name] = table.sections
        self._lowest = {name: WorstRow() for name in self._sections}
        self._largest = dict.fromkeys(self._sections, 0.0)

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the lowest tension over a block of rows (n_t, ...)."""
        for name, lowest in self._lowest.items():
            tension, length = channels[f"bodies/{name}/tension"], channels[f"bodies/{name}/length"]
            self._largest[name] = max(self._largest[name], float(np.abs(tension).max()))
            position = length * self._sections[name].stations[tension.argmin(axis=1)]
            lowest.record(-tension.min(axis=1), time=times, length=length, position=position)

    def doubts(self) -> Iterator[Advice]:
        """Warnings of members whose tension fell below zero, with time, position and value."""
        for name, lowest in self._lowest.items():
            largest = self._largest[name]
            if lowest.measure > SLACK * largest:
                at = lowest.values
                text = (
                    f"body {name!r} went slack: at t = {at['time']:.6g} s its tension is {-lowest.measure:.4g} N, "
                    f"{at['position']:.4g} m from the exit (length {at['length']:.4g} m, "
                    f"largest tension {largest:.4g} N). A member without bending stiffness cannot carry "
                    "compression, but the model does: motion and loads after this time are wrong. Deploy more slowly, "
                    "brake earlier, or add tension"
                )
                yield doubt(name, "compression", text, -lowest.measure, SLACK * largest)
