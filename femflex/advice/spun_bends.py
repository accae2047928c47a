"""Bends that turn: what strain of second order leaves out of how far a bent body comes in from where it would reach.

A body bent by b of its size comes in by b^2 / 2 of it and b^4 / 8, of which condensed strain holds the first. Where
it turns, centrifugal forces act on what is left out. Of cantilevers bent in the plane of rotation, with the force at
the end and all finite elements as reference, the tip is c b^2 of itself off: c = 0.42 (rate / first frequency)^2 up to
about twice that frequency, 0.9 above. What only the spin holds, as a wire, swings in the plane of the spin about the
small lever r of its root: its mass seems b^4 L^2 / 4 farther out, and of the stiffness c b^2 is lost, c = L / 2 r.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.deflections import DeflectionWatch, deflection_watches
from femflex.advice.limits import BENT_TURNING
from femflex.advice.remedies import division_remedy
from femflex.advice.stiffening import attached_masses, lowest_frequency
from femflex.arrays import Array, IntArray
from femflex.system import LengthTable
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.dynamics import Model


SLOPE, MOST = 0.42, 0.9  # c over (rate / first frequency)^2, and at most
FAST = 10.0  # times the first frequency; that of a wire which only its spin pulls tight is 0. c is then SLOPE FAST^2
SLOW = 0.15  # of the first frequency: no bend that is meant turns slowly enough to matter there


@dataclass(frozen=True)
class SpunBend:
    """A bend at an instant: its size over the body's, the rate [rad/s], and the estimated part of it that is wrong."""

    bend: float
    rate: float
    error: float


class SpunBends:
    """Watches bodies with condensed strain, row by row, for bends that turn, and warns of what is left out of them."""

    def __init__(self, model: Model) -> None:
        system = model.system
        self._system = system
        self._watches = [one for one in deflection_watches(model) if system.bodies[one.name].strain_form == "condensed"]
        carried = {one.name: attached_masses(system, one.name) for one in self._watches}
        self._first = {name: lowest_frequency(system.bodies[name], masses) for name, masses in carried.items()}
        self._worst: dict[str, SpunBend] = {}

    def watch(self, states: Array, channels: Mapping[str, Array]) -> None:
        """Take note of a block of states (n_t, n_x) [SI] and its channels (n_t, ...)."""
        for one in self._watches:
            rate = np.linalg.norm(channels[f"bodies/{one.name}/rate"], axis=1)
            rows = np.flatnonzero(rate > SLOW * self._first[one.name])
            if not rows.size:
                continue
            bend = one.over(states[rows])
            error = self._lost(one, rate[rows], rows, channels) * bend**2
            k = int(error.argmax())
            if one.name not in self._worst or error[k] > self._worst[one.name].error:
                self._worst[one.name] = SpunBend(float(bend[k]), float(rate[rows[k]]), float(error[k]))

    def _lost(self, one: DeflectionWatch, rate: Array, rows: IntArray, channels: Mapping[str, Array]) -> Array:
        """c at the rates (k,) [rad/s] of some rows."""
        ratio = _ratio(rate, self._first[one.name])
        free = self._system.joint_of(self._system.root).kind == "free"
        axis = channels["monitors/center_of_mass"][rows] if free else 0.0
        marker = "root" if one.name in self._system.varying else self._system.joint_of(one.name).child_marker
        place = channels.get(f"markers/{one.name}.{marker}/position", channels[f"bodies/{one.name}/position"])
        lever = np.linalg.norm(place[rows] - axis, axis=1)
        loose = np.where(ratio < FAST, MOST, np.maximum(MOST, one.size / np.maximum(2.0 * lever, 1e-300)))
        return np.minimum(SLOPE * ratio**2, loose)

    def warn(self) -> None:
        """Warn of bodies of which BENT_TURNING or more of a bend is left out, with the estimate."""
        for name, worst in self._worst.items():
            if worst.error > BENT_TURNING:
                ratio = float(_ratio(np.array(worst.rate), self._first[name]))
                times = f"{ratio:.2g} times" if ratio < FAST else f"over {FAST:g} times"
                warnings.warn(
                    f"body {name!r}, bent by {worst.bend:.0%} of its size, turned at {worst.rate:.4g} rad/s, "
                    f"{times} its first frequency. Condensed strain is of second order in bends: the bend is "
                    f"up to about {worst.error:.1%} off (limit {BENT_TURNING:.0%}). {self._remedy(name)}",
                    PhysicsWarning,
                    stacklevel=3,
                )

    def _remedy(self, name: str) -> str:
        table = self._system.varying[name].write if name in self._system.varying else None
        if isinstance(table, LengthTable) and table.sections is not None and table.sections.slackens:
            return (
                "For none, let a universal joint turn the member about its exit, with functions.straight = false or no "
                "functions"
            )
        if table is not None:
            return "A member that deploys cannot be cut into segments: it is an indication, unless its bend stays small"
        return f"For less, {division_remedy(self._system.bodies[name])}"


def _ratio(rate: Array, first: float) -> Array:
    """Rates (n,) over the first frequency [rad/s], at most FAST."""
    return np.asarray(rate / np.maximum(first, np.maximum(rate, 1e-300) / FAST))
