"""Tension of deploying tethers and membranes along a run: where and when they go slack."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.limits import SLACK
from femflex.arrays import Array
from femflex.dynamics import Model
from femflex.system import LengthTable
from femflex.system.length_table import Sections


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
