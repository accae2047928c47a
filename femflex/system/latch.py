"""Latches of joints: what locks a freedom at a place that it reaches."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Latch:
    """Locks freedom number `freedom` when its coordinate reaches `at`.

    Rigid (no stiffness): the rate becomes zero at once, an impact that keeps momentum and takes energy, and the freedom
    is locked from then on. Elastic: a spring and damper about `at` set in, and nothing is lost at once.

    With `opens` [s] it is the other way round: the freedom is locked from the start, and free from that time on. `at`
    is then the coordinate's initial value.
    """

    freedom: int = 0
    at: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    opens: float | None = None

    def __post_init__(self) -> None:
        if self.stiffness < 0 or self.damping < 0 or (self.damping and not self.stiffness):
            raise ValueError(
                f"a latch has stiffness {self.stiffness:g} and damping {self.damping:g}; they must not be negative, "
                "and damping needs a stiffness"
            )

        if self.opens is not None and (self.stiffness or not self.opens >= 0.0):
            raise ValueError(
                f"a latch opens at {self.opens:g} s with stiffness {self.stiffness:g}; one that opens is rigid, and "
                "opens at or after 0 s"
            )

    @property
    def rigid(self) -> bool:
        """Whether it locks by an impact."""
        return self.stiffness == 0.0
