"""Latches of joints, which lock a freedom at a place that it reaches."""

from __future__ import annotations

from dataclasses import dataclass


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


@dataclass(frozen=True)
class Latch:
    """Locks freedom number `freedom` when its coordinate reaches `at`.

    Rigid (no stiffness): the rate becomes zero at once, an impact that keeps momentum and takes energy, and the freedom
    is locked from then on. Elastic: a spring and damper about `at` set in, and nothing is lost at once.

    With `opens` it is the other way round: the freedom is locked from the start, and free from that time [s] on, or
    from when a Threshold is crossed. `at` is then the coordinate's initial value.
    """

    freedom: int = 0
    at: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    opens: float | Threshold | None = None

    def __post_init__(self) -> None:
        if self.stiffness < 0 or self.damping < 0 or (self.damping and not self.stiffness):
            raise ValueError(
                f"a latch has stiffness {self.stiffness:g} and damping {self.damping:g}; they must not be negative, "
                "and damping needs a stiffness"
            )

        early = not isinstance(self.opens, Threshold) and self.opens is not None and not self.opens >= 0.0
        if self.opens is not None and (self.stiffness or early):
            raise ValueError(
                f"a latch opens at {self.opens} s with stiffness {self.stiffness:g}; one that opens is rigid, and "
                "opens at or after 0 s"
            )

    @property
    def rigid(self) -> bool:
        """Whether it locks by an impact."""
        return self.stiffness == 0.0
