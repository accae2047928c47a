"""Latches of joints: what locks a freedom at a place that it reaches."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Latch:
    """Locks freedom number `freedom` when its coordinate reaches `at`.

    Rigid (no stiffness): the rate becomes zero at once, an impact that keeps momentum and takes energy, and the freedom
    is locked from then on. Elastic: a spring and damper about `at` set in, and nothing is lost at once.
    """

    freedom: int = 0
    at: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        if self.stiffness < 0 or self.damping < 0 or (self.damping and not self.stiffness):
            raise ValueError(
                f"a latch has stiffness {self.stiffness:g} and damping {self.damping:g}; they must not be negative, "
                "and damping needs a stiffness"
            )

    @property
    def rigid(self) -> bool:
        """Whether it locks by an impact."""
        return self.stiffness == 0.0
