"""Interface of a convergence study for its picture."""

from __future__ import annotations

from typing import Protocol

from femflex.arrays import Array, IntArray


class Curve(Protocol):
    """A law by which errors fall."""

    def error(self, x: Array) -> Array:
        """The error (...) at x (...), in the unit of the quantity."""


class StudyData(Protocol):
    """Interface of a study (femflex.studies.Convergence); arrays (n,) run over its levels, coarse to fine."""

    @property
    def title(self) -> str:
        """The quantity in words."""

    @property
    def unit(self) -> str:
        """Unit of the quantity."""

    @property
    def over(self) -> str:
        """Varied property: modes, mesh or derivatives."""

    @property
    def levels(self) -> IntArray:
        """Numbers (n,) of modes a body, or of refinements."""

    @property
    def counts(self) -> IntArray:
        """Numbers (n,) of elastic coordinates, or of dofs."""

    @property
    def followers(self) -> IntArray:
        """Numbers (n,) of dependent derivative shapes."""

    @property
    def values(self) -> Array:
        """The quantity (n,), in its unit."""

    @property
    def errors(self) -> Array:
        """Estimated errors (n,), absolute, in the unit of the quantity."""

    @property
    def tolerance(self) -> float:
        """Largest relative error that counts as converged."""

    @property
    def x(self) -> Array:
        """Resolution (n,) [1] of the law."""

    @property
    def n_resolved(self) -> int:
        """Number of levels before rounding."""

    @property
    def law(self) -> Curve | None:
        """The law of the errors."""

    @property
    def law_text(self) -> str:
        """The law in words."""

    @property
    def estimate(self) -> float:
        """The limit, nan without one."""

    @property
    def scale(self) -> float:
        """Reference of relative errors."""

    @property
    def recommended(self) -> int | None:
        """The level to choose."""

    @property
    def verdict(self) -> str:
        """Conclusions, in sentences."""
