"""A run in memory with a few of its channels, from which studies take their numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.case import Case
from femflex.noun.problems import suggestion_text
from femflex.pipeline import prepare
from femflex.pipeline.guard import MotionGuard
from femflex.system import Channel, Part


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """Channels of a run in memory, as `measured_value` needs them; none where only bodies are measured.

    mean_motion  of the orbit [rad/s], None without one;  rtol  relative tolerance of the integration
    """

    bodies_by_name: Mapping[str, Any]
    time: Array = field(default_factory=lambda: np.zeros(0))
    values: Mapping[str, Array] = field(default_factory=dict)
    channels: Mapping[str, Channel] = field(default_factory=dict)
    mean_motion: float | None = None
    rtol: float = 0.0

    def __getitem__(self, path: str) -> Array:
        return self.values[path]

    def names(self, path: str) -> tuple[str, ...]:
        """Names of the entries of a channel."""
        return self.channels[path].names

    def unit(self, path: str) -> str:
        """Unit of a channel."""
        return self.channels[path].unit

    def bodies(self) -> Mapping[str, Any]:
        """The bodies by name."""
        return self.bodies_by_name


def recorded_run(
    case: Case,
    bodies: Mapping[str, Part] | None,
    paths: Sequence[str],
    progress: Callable[[float], object] = lambda part: None,
) -> RecordedRun:
    """The run of a case with these bodies (None: its own), with these of its channels.

    Raises KeyError for a channel that the run does not have, IntegrationError where the motion diverges.
    """
    prepared = prepare(case, bodies=bodies)
    model, times = prepared.model, prepared.times
    for path in paths:
        if path not in model.channels:
            raise KeyError(f"the run has no channel {path!r}; {suggestion_text(path, model.channels)}")
    rows: dict[str, list[Array]] = {path: [] for path in paths}
    guard = MotionGuard(model)
    for block in prepared.integrator.blocks(model, times, model.x0):
        if (error := guard.divergence(block)) is not None:
            raise error
        if len(block.times):
            observed = model.observation(block.times, block.states)
            for path in paths:
                rows[path].append(observed[path])
        progress((block.t - times[0]) / (times[-1] - times[0]))
    motion = None if prepared.system.orbit is None else prepared.system.orbit.mean_motion
    values = {path: np.concatenate(parts) for path, parts in rows.items()}
    rtol = float(getattr(prepared.integrator, "rtol", 0.0))
    return RecordedRun(prepared.system.bodies, times, values, model.channels, motion, rtol)
