"""Forces and torques on markers, constant or tabulated in time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array

LOAD_FRAMES = ("body", "marker", "inertial", "orbital")


@dataclass(frozen=True, eq=False)
class Load:
    """A force [N] and torque [N m] at a marker of a body; components in the named frame.

    force, torque (3,) when constant, else (n_times, 3) at `times` (n_times,) [s], linear between the
    times, zero before the first and after the last. A repeated time is a jump.
    """

    name: str
    body: str
    marker: str = "origin"
    frame: str = "body"
    force: Array = field(default_factory=lambda: np.zeros(3))
    torque: Array = field(default_factory=lambda: np.zeros(3))
    times: Array | None = None

    def __post_init__(self) -> None:
        if self.frame not in LOAD_FRAMES:
            raise ValueError(f"frame {self.frame!r} of load {self.name!r} is not known; known are {list(LOAD_FRAMES)}")
        shape = (3,) if self.times is None else (len(self.times), 3)
        for key in ("force", "torque"):
            value = np.asarray(getattr(self, key), float)
            if self.times is not None and value.shape == (3,) and not value.any():
                value = np.zeros(shape)
            if value.shape != shape:
                raise ValueError(f"{key} of load {self.name!r} has shape {value.shape}; expected {shape}")
            if not np.all(np.isfinite(value)):
                raise ValueError(f"{key} of load {self.name!r} holds a value that is not finite")
            object.__setattr__(self, key, value)
        if self.times is not None:
            times = np.asarray(self.times, float)
            if len(times) < 2 or not np.all(np.isfinite(times)) or np.any(np.diff(times) < 0):
                raise ValueError(
                    f"times of load {self.name!r} must be finite, at least two, and not decreasing: {times.tolist()}"
                )
            object.__setattr__(self, "times", times)

    @property
    def conservative(self) -> bool:
        """Whether it is a force alone, constant in inertial axes, such as a weight."""
        return self.times is None and self.frame == "inertial" and not self.torque.any()
