"""Shapes of a deploying member over xi = x / L, whatever its family: columns over its functions, and slaved shapes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.deployment.foreshortening import SlavedShapes
from femflex.deployment.intervals import gauss_between
from femflex.deployment.material import MaterialPoints
from femflex.deployment.series import Series
from femflex.deployment.table import MarkerSeries
from femflex.reduction.beams.beam_functions import points_for

ROUNDING = 1e-13  # of the largest value of a function, below which it vanishes


class ShapeFunctions(Protocol):
    """Functions of a member over 0 <= xi <= 1.

    A set of elements has also `knots`, the inner ends of its elements, and `blocks`: pairs of the functions (k,) of a
    field and how many of its vibration modes are kept.
    """

    @property
    def count(self) -> int:
        """Number of functions."""

    @property
    def max_count(self) -> int:
        """The largest number of functions of one field."""


class MemberAxes(Protocol):
    """Position and axes of a member in its body (at the exit), and the tension at its tip that supports carry."""

    @property
    def root(self) -> Any:
        """The exit [m], body frame."""

    @property
    def tension(self) -> float:
        """Axial force at the tip [N]."""

    @property
    def frame(self) -> Array:
        """Member axes in the body frame, rows x, y, z (3, 3)."""


class Drawing(NamedTuple):
    """Points xi (k,) and offsets (m, 3), member axes, that are drawn, and cells over points (k, m)."""

    xi: Array
    offsets: Array
    cells: dict[str, IntArray]


@dataclass(frozen=True, eq=False)
class MemberShapes(ABC):
    """The shapes of a deploying member.

    functions   admissible functions or elements; None: the member stays straight
    reference   length at which the columns are mass-normalised [m]
    X           columns (functions, n)
    followers   shapes slaved to the columns, or None
    """

    functions: Any
    reference: float
    X: Array = field(default_factory=lambda: np.zeros((0, 0)))
    followers: SlavedShapes | None = None

    @property
    @abstractmethod
    def axes(self) -> MemberAxes:
        """Exit and axes of the member."""

    @property
    @abstractmethod
    def member_mass(self) -> float:
        """Mass of the reference length [kg]."""

    @property
    @abstractmethod
    def section(self) -> tuple[Array, Array]:
        """Offsets (m, 3) of points of a section, member axes, and their shares of its mass (m,)."""

    @property
    @abstractmethod
    def thickness(self) -> float:
        """Return the radius for drawing [m]; 0 for a line or a sheet."""

    @property
    @abstractmethod
    def half_width(self) -> float | None:
        """Half of the width of its drum [m]; None where it has no width of its own."""

    @abstractmethod
    def displacements(self, xi: Array, offsets: Array, derivative: int) -> Series:
        """Shapes of the columns at offsets (m, 3), member axes, or their derivative by xi: p -> (k, m, 3, n)."""

    @abstractmethod
    def turns(self, xi: Array) -> Array:
        """Twist, -dw/dx and dv/dx (k, 3, n) [rad per coordinate] of the columns at xi and the reference length."""

    @abstractmethod
    def slopes(self, xi: Array) -> tuple[Array, Array]:
        """Slopes by xi of transverse displacements (k, m, n), and how much of each counts (m,)."""

    @abstractmethod
    def matrices(self, xi: Array, weight: Array) -> tuple[Array, Series]:
        """Mass matrix (n, n) [kg] at the reference length, and V1 (n, n) [N/m] as a series in lambda, over the
        functions."""

    @abstractmethod
    def quartic(self, xi: Array, weight: Array) -> Series:
        """Packed V3 (k,) [SI] of the curvature of large bends over the columns, as a series in lambda.

        xi (q,), weight (q,) [1]: points over the deployed part.
        """

    @abstractmethod
    def drawing(self) -> Drawing:
        """Return the lines and surfaces that draw the deployed part."""

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return int(self.X.shape[1])

    @property
    def n_shapes(self) -> int:
        """Number of shapes."""
        return self.n + (0 if self.followers is None else self.followers.n)

    @property
    def max_count(self) -> int:
        """The largest number of functions of one field."""
        return 0 if self.functions is None else int(self.functions.max_count)

    @property
    def knots(self) -> Array:
        """Places (k,) [1] between 0 and 1 where derivatives of the functions jump, ascending."""
        return np.asarray(getattr(self.functions, "knots", ()), float)

    @property
    def quadrature(self) -> tuple[Array, Array]:
        """Points (q,) and weights (q,) [1] over the deployed part."""
        return gauss_between(self.knots, points_for(self.max_count))

    def series(self, xi: Array, offsets: Array, derivative: int = 0) -> Series:
        """Position and shapes, body frame, of points at xi and offsets (m, 3), or their derivative by xi.

        p -> (k m, 3, 1 + n_shapes).
        """
        k, m, n = len(xi), len(offsets), self.n
        out: Series = {p: np.zeros((k, m, 3, 1 + self.n_shapes)) for p in (1, 0, -1)}
        out[1][:, :, 0, 0] = self.reference * (xi[:, None] if derivative == 0 else float(derivative == 1))
        if derivative == 0:
            out[0][:, :, :, 0] = offsets
        for p, part in self.displacements(xi, offsets, derivative).items():
            out[p][:, :, :, 1 : 1 + n] = part
        if self.followers is not None:
            out[-1][:, :, 0, 1 + n :] = self.followers.values(xi, derivative)[:, None] / self.reference
        frame = self.axes.frame
        in_body_frame = {p: np.einsum("ba,kmbA->kmaA", frame, part).reshape(k * m, 3, -1) for p, part in out.items()}
        if derivative == 0:
            in_body_frame[0][:, :, 0] += np.asarray(self.axes.root, float)
        return in_body_frame

    def material_points(self, xi: Array, weight: Array) -> MaterialPoints:
        """Points [m] of sections at xi (k,), which take the part weight (k,) of the mass."""
        offsets, share = self.section
        parts = (self.series(xi, offsets, derivative) for derivative in range(2))
        return MaterialPoints(np.repeat(xi, len(offsets)), np.outer(weight, share).ravel(), *parts)

    def marker(self, xi: float) -> MarkerSeries:
        """The middle of the section at xi."""
        where, frame = np.array([xi]), self.axes.frame
        centre = self.series(where, np.zeros((1, 3)))
        turn = np.zeros((2, 3, self.n_shapes))
        turns = self.turns(where)[0]
        turn[0, 0, : self.n], turn[1, 1:, : self.n] = turns[0], turns[1:]
        return MarkerSeries(
            position={p: part[0, :, 0] for p, part in centre.items()},
            phi={p: part[0, :, 1:] for p, part in centre.items()},
            psi={0: frame.T @ turn[0], -1: frame.T @ turn[1]},
            orientation=frame.T,
            axis=frame[0] if self.followers is not None else np.zeros(3),
        )

    def drawn_series(self) -> tuple[Series, dict[str, IntArray]]:
        """Points (p, 3) [m] and shapes of the surface of the deployed part as series, and its cells (e, k), point
        numbers."""
        xi, offsets, cells = self.drawing()
        return self.series(xi, offsets), cells


def without_rounding(function: Callable[[Array], Array], xi: Array) -> Array:
    """Values (n_xi, ...) at xi [1] without rounding: a clamped end does not move at all."""
    places = np.concatenate([xi, np.linspace(0.0, 1.0, 33)])
    values = function(places)
    values, size = values[: len(xi)], np.abs(values[len(xi) :]).max(initial=0.0)
    return np.where(np.abs(values) > ROUNDING * size, values, 0.0)


def quadrilateral_grid(n: int, m: int, closed: bool) -> IntArray:
    """Quadrilaterals between neighbours of points (n, m); closed: the last of each row is next to the first."""
    row, side = np.meshgrid(np.arange(n - 1), np.arange(m if closed else m - 1), indexing="ij")
    ring = np.stack([row, row + 1, row + 1, row], axis=-1) * m
    column = np.stack([side, side, (side + 1) % m, (side + 1) % m], axis=-1)
    return np.asarray((ring + column).reshape(-1, 4), np.int64)
