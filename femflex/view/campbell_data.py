"""Interface of a Campbell diagram for its picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from femflex.arrays import Array, BoolArray


class BranchData(Protocol):
    """A branch; arrays (n,) run over the speeds."""

    @property
    def name(self) -> str:
        """Character at the first speed, and its number: "flap 1"."""

    @property
    def final_character(self) -> str:
        """Character at the last speed, if it differs."""

    @property
    def frequencies(self) -> Array:
        """Frequencies (n,) [Hz], nan where the branch is lost."""

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios (n,) [1]."""

    @property
    def growing(self) -> BoolArray:
        """Whether it grows at each speed (n,)."""


class CrossingData(Protocol):
    """A branch at a multiple of the spin."""

    @property
    def branch(self) -> str:
        """Name of the branch."""

    @property
    def order(self) -> int:
        """The multiple."""

    @property
    def speed(self) -> float:
        """[rad/s]."""

    @property
    def frequency(self) -> float:
        """Frequency [Hz]."""


class CampbellData(Protocol):
    """Interface of a Campbell diagram (femflex.studies.campbell.Campbell)."""

    @property
    def title(self) -> str:
        """Title of the craft's case."""

    @property
    def value(self) -> str:
        """Name of the value in place of the speed, "" for the speed."""

    @property
    def speeds(self) -> Array:
        """Speeds (n,) [rad/s], or the values."""

    @property
    def requested(self) -> BoolArray:
        """Whether each speed (n,) was requested."""

    @property
    def branches(self) -> Sequence[BranchData]:
        """Branches by rising frequency at the first speed."""

    @property
    def orders(self) -> Sequence[int]:
        """Multiples of the spin."""

    @property
    def crossings(self) -> Sequence[CrossingData]:
        """Crossings of the branches with the multiples."""
