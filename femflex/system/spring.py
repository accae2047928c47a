"""Springs between two markers: a force along the line that joins them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Spring:
    """A spring and damper along the line from marker P of the parent to marker Q of the body; parent None: base frame.

    stiffness [N/m], damping [N s/m], length at which the spring is free [m]
    """

    name: str
    body: str
    parent: str | None = None
    marker: str = "origin"
    parent_marker: str = "origin"
    stiffness: float = 0.0
    damping: float = 0.0
    length: float = 0.0

    def __post_init__(self) -> None:
        for key in ("stiffness", "damping", "length"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value >= 0.0):
                raise ValueError(f"{key} of spring {self.name!r} is {value}; it must not be negative")
