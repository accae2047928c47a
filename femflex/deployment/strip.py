"""Plates and membranes that roll out along one axis: rectangles on products of functions along and across."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Self

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from pydantic import model_validator

from femflex.arrays import Array
from femflex.deployment.line import DeployingMember, LineFunctions
from femflex.deployment.series import Series, added
from femflex.deployment.shapes import Drawing, MemberShapes, quadrilateral_grid, without_rounding
from femflex.noun.table import exactly_one, refuse
from femflex.noun.values import PositiveLength, Quantity
from femflex.reduction.beams.beam_strain import pairs, weighted_square
from femflex.reduction.strain.tensors import packed_quartic


class DeployingStrip(DeployingMember):
    """A rectangular plate or membrane of one thickness that rolls out along its length."""

    width: PositiveLength = None  # type: ignore[assignment]
    """Width of a plate or membrane."""
    bending_stiffness: Annotated[float, Quantity("N m", least=0.0)] = 0.0
    """Bending stiffness of a plate, E h^3 / (12 (1 - nu^2))."""
    poisson: Annotated[float, Quantity(least=-1.0, below=0.5)] = 0.0
    """Poisson's ratio of a plate."""
    tension_across: Annotated[float, Quantity("N/m", least=0.0)] = 0.0
    """Tension of a membrane across its width, per length."""

    @model_validator(mode="after")
    def _keys_fit(self) -> Self:
        for key in ("mass_per_length", "width"):
            exactly_one(self, (key,))
        if not (self.bending_stiffness or self.tension):
            refuse("found a membrane without tension; it has no stiffness then: give tension")
        return self


@dataclass(frozen=True, eq=False)
class StripFunctions:
    """Products X_i(x / L) Y_j(y / b) for the deflection out of the plane, Y_j Legendre polynomials.

    along   functions along: `BeamFunctions(z=n)` of a plate, `StringFunctions(z=n)` of a membrane
    across  number of functions across the width
    """

    along: LineFunctions
    across: int = 1

    @property
    def count(self) -> int:
        """Number of functions."""
        return self.along.count * self.across

    @property
    def max_count(self) -> int:
        """The largest number of functions along."""
        return self.along.max_count

    @property
    def knots(self) -> Array:
        """Inner ends of the elements along (k,), parts of the length [1]; empty without elements."""
        return np.asarray(getattr(self.along, "knots", ()), float)

    @property
    def blocks(self) -> list[tuple[NDArray[np.intp], int]] | None:
        """Numbers (k,) of the functions of elements, and number of modes kept; None for admissible functions."""
        if not hasattr(self.along, "blocks"):
            return None
        return [(np.arange(self.count), self.along.max_count * self.across)]

    def deflections(self, xi: Array, eta: Array, derivative: int = 0, crosswise: int = 0) -> Array:
        """Derivatives (n_xi, n_eta, n) of w [m] by xi and eta = 2 y / b at (xi, eta) [1], per coordinate."""
        X = self.along.fields(xi, 1.0, derivative)[:, 2]
        Y = legendre.legder(np.eye(self.across), crosswise) if crosswise else np.eye(self.across)
        Y_values = legendre.legval(eta, Y).T.reshape(len(eta), self.across)
        return np.einsum("ki,mj->kmij", X, Y_values).reshape(len(xi), len(eta), -1)


ETA, ETA_WEIGHT = np.polynomial.legendre.leggauss(12)  # points across, 2 y / b


@dataclass(frozen=True, eq=False)
class StripShapes(MemberShapes):
    """The shapes of a deploying strip.

    In its plane the strip is rigid across: the mean over the width of w_x^2 draws it in.
    """

    strip: DeployingStrip = field(kw_only=True)

    @property
    def axes(self) -> DeployingMember:
        """The line along its middle."""
        return self.strip

    @property
    def member_mass(self) -> float:
        """Mass of the reference length [kg]."""
        return self.strip.mass_per_length * self.reference

    @property
    def section(self) -> tuple[Array, Array]:
        """Offsets (m, 3) of points across, member axes, and their shares of the mass (m,)."""
        return self._transverse_offsets(ETA), ETA_WEIGHT / 2

    @property
    def thickness(self) -> float:
        """Return the thickness for drawing [m]: none."""
        return 0.0

    @property
    def half_width(self) -> float:
        """Half of its width [m]."""
        return self.strip.width / 2

    def _transverse_offsets(self, eta: Array) -> Array:
        """Offsets (m, 3), member axes, of points at eta = 2 y / b."""
        return np.outer(eta, [0.0, self.strip.width / 2, 0.0])

    def deflections(self, xi: Array, eta: Array, derivative: int = 0, crosswise: int = 0) -> Array:
        """Derivatives (n_xi, n_eta, n) of w [m per coordinate] by xi and by eta = 2 y / b."""
        if self.functions is None:
            return np.zeros((len(xi), len(eta), 0))
        functions = self.functions
        return without_rounding(lambda x: np.asarray(functions.deflections(x, eta, derivative, crosswise) @ self.X), xi)

    def slopes(self, xi: Array) -> tuple[Array, Array]:
        """Slopes by xi of w at points across (len(xi), m, n), and how much of each counts (m,)."""
        return self.deflections(xi, ETA, 1), ETA_WEIGHT / 2

    def turns(self, xi: Array) -> Array:
        """Twist, -dw/dx and dv/dx (k, 3, n) [rad per coordinate] of the columns in the middle, at the reference
        length."""
        middle = np.zeros(1)
        twist = self.deflections(xi, middle, 0, 1)[:, 0] * 2.0 / self.strip.width
        bend = -self.deflections(xi, middle, 1)[:, 0] / self.reference
        return np.stack([twist, bend, np.zeros_like(bend)], axis=1)

    def matrices(self, xi: Array, weight: Array) -> tuple[Array, Series]:
        """Mass matrix (n, n) [kg] at the reference length, and V1 (n, n) [N/m] as a series in lambda, over the
        functions."""
        s, L, b = self.strip, self.reference, self.strip.width
        w, functions = np.outer(weight, ETA_WEIGHT / 2).ravel(), self.functions
        assert functions is not None

        def field_of(along: int, across: int) -> Array:
            values = functions.deflections(xi, ETA, along, across)
            return np.asarray(values.reshape(len(w), -1) * (2.0 / b) ** across / L**along)

        def integral(f: Array, g: Array) -> Array:
            return np.asarray(L * b * ((f.T * w) @ g + (g.T * w) @ f) / 2)

        flat, xx, yy, xy = field_of(0, 0), field_of(2, 0), field_of(0, 2), field_of(1, 1)
        x, y, D, nu = field_of(1, 0), field_of(0, 1), s.bending_stiffness, s.poisson
        V1 = {
            -3: D * integral(xx, xx),
            -1: D * (2 * nu * integral(xx, yy) + 2 * (1 - nu) * integral(xy, xy)) + s.tension / b * integral(x, x),
            1: D * integral(yy, yy) + s.tension_across * integral(y, y),
        }
        return s.mass_per_length / b * integral(flat, flat), V1

    def quartic(self, xi: Array, weight: Array) -> Series:
        """Packed V3 (k,) [SI] of the curvature of large bends over the columns, as a series in lambda.

        A sheet that keeps its lengths has the curvatures w,ab (1 + |grad w|^2 / 2) to third order, so that
        V_4 = 1/2 int |grad w|^2 D(w,ab) dA, D the form of V1 (`femflex.fem.plate.strain`).
        """
        s, L, b, n = self.strip, self.reference, self.strip.width, self.n
        dA = L * b * np.outer(weight, ETA_WEIGHT / 2).ravel()

        def field_of(along: int, across: int) -> Array:
            values = self.deflections(xi, ETA, along, across).reshape(-1, 1, n)
            return np.asarray(values * (2.0 / b) ** across / L**along)

        parts: list[Series] = []
        bends = {(2, 0): field_of(2, 0), (0, 2): field_of(0, 2), (1, 1): field_of(1, 1)}
        for along, across in ((1, 0), (0, 1)):
            slope = field_of(along, across)
            xx, yy, xy = (pairs(slope, bends[key]) for key in ((2, 0), (0, 2), (1, 1)))
            mixed = weighted_square(xx + yy, dA) - weighted_square(xx, dA) - weighted_square(yy, dA)
            twist = 2 * (1 - s.poisson) * weighted_square(xy, dA)
            squares = {-4: weighted_square(xx, dA), -2: s.poisson * mixed + twist, 0: weighted_square(yy, dA)}
            parts += [{p + 1 - 2 * along: s.bending_stiffness * packed_quartic(part, n)} for p, part in squares.items()]
        return added(*parts)

    def displacements(self, xi: Array, offsets: Array, derivative: int) -> Series:
        """Shapes of the columns at offsets (m, 3), member axes, or their derivative by xi: p -> (k, m, 3, n)."""
        out = np.zeros((len(xi), len(offsets), 3, self.n))
        out[:, :, 2] = self.deflections(xi, offsets[:, 1] * (2.0 / self.strip.width), derivative)
        return {0: out}

    def drawing(self) -> Drawing:
        """The sheet."""
        xi, eta = np.linspace(0.0, 1.0, 1 + 4 * max(5, self.max_count)), np.linspace(-1.0, 1.0, 5)
        return Drawing(xi, self._transverse_offsets(eta), {"quad": quadrilateral_grid(len(xi), len(eta), closed=False)})
