"""Axial force in deploying members along a run: the bending stiffness of beams, and where tethers go slack.

The force N(s) at the stations of a member changes the stiffness of its bend w = 1 - cos(pi s / 2 L) by

    gain = int N w'^2 ds / int EI w''^2 ds,

which is N over Euler's load of a cantilever where both are uniform. Linear strain leaves this out; condensed strain has
it, and a member that is compressed by a large part of that load has large deflections.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.limits import BUCKLING_FACTOR, FREQUENCY_CHANGE, SLACK
from femflex.arrays import Array
from femflex.deployment.sections import MemberSections
from femflex.dynamics import Model
from femflex.system import LengthTable
from femflex.system.length_table import Sections


@dataclass
class LargestForce:
    """The largest gain of a member so far, with the time, the length and the mean force over the bend then."""

    gain: float = 0.0
    time: float = 0.0
    length: float = 0.0
    force: float = 0.0


class AxialForceWatch:
    """Watches the axial force in deploying beams, and warns where it matters to their bending."""

    def __init__(self, model: Model) -> None:
        self._sections: dict[str, MemberSections] = {}
        for name, variation in model.system.varying.items():
            sections = variation.write.sections if isinstance(variation.write, LengthTable) else None
            if isinstance(sections, MemberSections) and sections.bends is not None and min(sections.stiffness) > 0.0:
                self._sections[name] = sections
        self._condensed = {name: model.system.bodies[name].condensed for name in self._sections}
        self.largest_tension = {name: LargestForce() for name in self._sections}
        self.largest_compression = {name: LargestForce() for name in self._sections}

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the largest gains over a block of rows (n_t, ...)."""
        for name, sections in self._sections.items():
            force, length = channels[f"bodies/{name}/tension"] - sections.support, channels[f"bodies/{name}/length"]
            gain = axial_gain(sections, force, length)
            for row, largest, sign in (
                (int(np.argmax(gain)), self.largest_tension[name], 1.0),
                (int(np.argmin(gain)), self.largest_compression[name], -1.0),
            ):
                if sign * gain[row] > sign * largest.gain:
                    largest.gain, largest.time = float(gain[row]), float(times[row])
                    largest.length, largest.force = float(length[row]), mean_force(sections, force[row])

    def doubts(self) -> Iterator[Advice]:
        """Warnings of linear members whose first frequency changes by FREQUENCY_CHANGE, and of others near buckling."""
        for name in self._sections:
            if self._condensed[name]:
                yield from self._compressed(name, self.largest_compression[name])
            else:
                yield from self._linear(name, self.largest_tension[name])
                yield from self._linear(name, self.largest_compression[name])

    def _linear(self, name: str, largest: LargestForce) -> Iterator[Advice]:
        change = float(np.sqrt(max(1.0 + largest.gain, 0.0))) - 1.0
        if abs(change) > FREQUENCY_CHANGE:
            verb = "raises" if change > 0.0 else "lowers"
            amount = "to zero" if largest.gain <= -1.0 else f"by {abs(change):.0%}"
            text = (
                f"body {name!r} carries {largest.force:.4g} N along its axis at t = {largest.time:.6g} s (length "
                f"{largest.length:.4g} m), which {verb} its first frequency {amount} (limit {FREQUENCY_CHANGE:.0%}); "
                "linear strain leaves this out. Give it strain = 'condensed'"
            )
            yield doubt(name, "stretch", text, abs(change), FREQUENCY_CHANGE)

    def _compressed(self, name: str, largest: LargestForce) -> Iterator[Advice]:
        if -largest.gain > 1.0 / BUCKLING_FACTOR:
            text = (
                f"body {name!r} is compressed by {-largest.force:.4g} N along its axis at t = {largest.time:.6g} s "
                f"(length {largest.length:.4g} m): {-largest.gain:.0%} of its buckling load as a cantilever of this "
                f"length (limit {1 / BUCKLING_FACTOR:.0%}). Its deflections are sensitive to small errors, and wrong "
                "beyond buckling. Lower the load, deploy more slowly, or give it more bending stiffness"
            )
            yield doubt(name, "compression", text, -largest.gain, 1.0 / BUCKLING_FACTOR)


def mean_force(sections: MemberSections, force: Array) -> float:
    """The uniform axial force [N] that has the same effect on bending as the forces (k,) [N] at the stations."""
    slope = np.sin(np.pi / 2.0 * sections.stations) ** 2
    return float(np.trapezoid(force * slope, sections.stations) / np.trapezoid(slope, sections.stations))


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


@dataclass
class LowestTension:
    """Lowest and largest tension of a member [N], the time of the lowest [s], and its position over the length."""

    value: float = np.inf
    time: float = 0.0
    relative_position: float = 0.0
    length: float = 0.0
    largest: float = 0.0


class SlackWatch:
    """Watches the tension of deploying tethers and membranes, and warns where it falls below zero."""

    def __init__(self, model: Model) -> None:
        self._sections: dict[str, Sections] = {}
        for name, variation in model.system.varying.items():
            table = variation.write
            if isinstance(table, LengthTable) and table.sections is not None and table.sections.slackens:
                self._sections[name] = table.sections
        self.lowest = {name: LowestTension() for name in self._sections}

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the lowest tension over a block of rows (n_t, ...)."""
        for name, lowest in self.lowest.items():
            tension = channels[f"bodies/{name}/tension"]
            lowest.largest = max(lowest.largest, float(np.abs(tension).max()))
            row, station = np.unravel_index(int(np.argmin(tension)), tension.shape)
            if (value := float(tension[row, station])) < lowest.value:
                lowest.value, lowest.time = value, float(times[row])
                lowest.relative_position = float(self._sections[name].stations[station])
                lowest.length = float(channels[f"bodies/{name}/length"][row])

    def doubts(self) -> Iterator[Advice]:
        """Warnings of members whose tension fell below zero, with time, position and value."""
        for name, lowest in self.lowest.items():
            if lowest.value < -SLACK * lowest.largest:
                text = (
                    f"body {name!r} went slack: at t = {lowest.time:.6g} s its tension is {lowest.value:.4g} N, "
                    f"{lowest.relative_position * lowest.length:.4g} m from the exit (length {lowest.length:.4g} m, "
                    f"largest tension {lowest.largest:.4g} N). A member without bending stiffness cannot carry "
                    "compression, but the model does: motion and loads after this time are wrong. Deploy more slowly, "
                    "brake earlier, or add tension"
                )
                yield doubt(name, "compression", text, lowest.value, SLACK * lowest.largest)
