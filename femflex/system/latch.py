"""Latches of joints, which lock a freedom at a place that it reaches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic.json_schema import SkipJsonSchema

from femflex.noun.table import refuse
from femflex.system.law import LATCHED, ByCoordinate, JointLaw, Piece


@dataclass(frozen=True)
class Threshold:
    """A channel of one number that rises above, or falls below, a value in its unit.

    channel  such as "effectors/gyro/z"; above, below: exactly one of them
    """

    channel: str
    above: float | None = None
    below: float | None = None

    def __post_init__(self) -> None:
        if (self.above is None) == (self.below is None):
            raise ValueError(
                f"the threshold of {self.channel!r} has above = {self.above} and below = {self.below}; give one of them"
            )

    def __str__(self) -> str:
        side, value = ("above", self.above) if self.above is not None else ("below", self.below)
        return f"{self.channel} {side} {value:g}"

    def distance(self, value: float) -> float:
        """Return the distance of the channel from the threshold; zero or less beyond it."""
        return self.above - value if self.above is not None else value - (self.below or 0.0)


class Latch(JointLaw):
    """Locks its coordinate when this reaches `at`.

    Rigid (no stiffness): the rate becomes zero at once, an impact that keeps momentum and takes energy, and the
    coordinate is locked from then on. Elastic: a spring and damper about `at` set in, and nothing is lost at once.
    """

    kind: Literal["latch"] = "latch"
    """Selects this law: a latch that locks the coordinate."""
    at: Annotated[float, ByCoordinate("m")]
    """Value of the coordinate at which it locks."""
    stiffness: Annotated[float, ByCoordinate("N/m", least=0.0)] = 0.0
    """Stiffness after locking. Default: the latch is rigid and locks by an impact."""
    damping: Annotated[float, ByCoordinate("N s/m", least=0.0)] = 0.0
    """Damping coefficient after locking."""
    opens: SkipJsonSchema[float | Threshold | None] = Field(None, exclude=True)
    """From Python: time [s] or Threshold at which it opens. It locks from the start, where the coordinate then is."""

    @model_validator(mode="after")
    def _values_fit(self) -> Latch:
        if self.damping and not self.stiffness:
            refuse(f"a latch has damping {self.damping:g} without stiffness; damping needs a stiffness")
        early = not isinstance(self.opens, Threshold) and self.opens is not None and not self.opens >= 0.0
        if self.opens is not None and (self.stiffness or early):
            refuse(
                f"a latch opens at {self.opens} s with stiffness {self.stiffness:g}; one that opens is rigid, and "
                "opens at or after 0 s"
            )
        return self

    @property
    def rigid(self) -> bool:
        """Whether it locks by an impact."""
        return self.stiffness == 0.0

    @property
    def stiffest(self) -> float:
        """Its stiffness once it has locked."""
        return self.stiffness

    def pieces(self) -> list[Piece]:
        """Stiffness, damping and place."""
        return [(LATCHED, np.array([self.stiffness, self.damping, self.at]))]
