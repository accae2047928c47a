"""Plates and membranes that roll out along one axis: rectangles on products of functions along and across."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

from femflex.deployment.foreshortening import Followers
from femflex.deployment.line import DeployingLine, clean, grid
from femflex.deployment.material import Places
from femflex.deployment.series import Series
from femflex.deployment.table import MarkerSeries

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class AlongFunctions(Protocol):
    """Functions of the deflection w along the member, rows 2 of `fields`."""

    @property
    def count(self) -> int:
        """Number of functions."""

    @property
    def most(self) -> int:
        """The largest number of functions of one field."""

    def fields(self, xi: Array, length: float, derivative: int = 0) -> Array:
        """Derivative by x of u, v, w, theta (len(xi), 4, count) at x = xi length."""


@dataclass(frozen=True, eq=False)
class DeployingStrip:
    """A rectangular plate or membrane of one thickness that rolls out of a drum along its length.

    mass_per_area       [kg/m^2]
    width               [m]
    bending             E h^3 / (12 (1 - nu^2)) [N m]; zero for a membrane
    poisson             of a plate
    tension             axial force at the tip that supports hold up, over the whole width [N]
    tension_across      per length [N/m]
    root, direction     middle of the exit [m] and where the strip points, body frame
    across              direction near that across the width; default as for beams
    """

    mass_per_area: float
    width: float
    bending: float = 0.0
    poisson: float = 0.0
    tension: float = 0.0
    tension_across: float = 0.0
    root: ArrayLike = (0.0, 0.0, 0.0)
    direction: ArrayLike = (1.0, 0.0, 0.0)
    across: ArrayLike | None = None

    def __post_init__(self) -> None:
        for name in ("mass_per_area", "width"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name} of a deploying strip is {getattr(self, name)}; it must be positive")
        for name in ("bending", "tension", "tension_across"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"{name} of a deploying strip is {getattr(self, name)}; it must be zero or positive")
        if not (self.bending or self.tension):
            raise ValueError("a deploying membrane has no tension, so it has no stiffness; give tension")

    @property
    def line(self) -> DeployingLine:
        """The line along its middle, of all its mass."""
        return DeployingLine(
            mass_per_length=self.mass_per_area * self.width,
            tension=self.tension,
            root=self.root,
            direction=self.direction,
            orientation=self.across,
        )


@dataclass(frozen=True, eq=False)
class StripFunctions:
    """Products X_i(x / L) Y_j(y / b) for the deflection out of the plane, Y_j Legendre polynomials.

    along   functions along: `BeamFunctions(z=n)` of a plate, `StringFunctions(z=n)` of a membrane
    across  number of functions across the width
    """

    along: AlongFunctions
    across: int = 1

    @property
    def count(self) -> int:
        """Number of functions."""
        return self.along.count * self.across

    @property
    def most(self) -> int:
        """The largest number of functions along."""
        return self.along.most

    def deflections(self, xi: Array, eta: Array, derivative: int = 0, crosswise: int = 0) -> Array:
        """Derivatives by xi and by eta = 2 y / b of w at (xi, eta), (len(xi), len(eta), count)."""
        X = self.along.fields(xi, 1.0, derivative)[:, 2]
        Y = legendre.legder(np.eye(self.across), crosswise) if crosswise else np.eye(self.across)
        across = legendre.legval(eta, Y).T.reshape(len(eta), self.across)
        return np.einsum("ki,mj->kmij", X, across).reshape(len(xi), len(eta), -1)


ETA, ETA_WEIGHT = np.polynomial.legendre.leggauss(12)  # points across, 2 y / b


@dataclass(frozen=True, eq=False)
class StripShapes:
    """The shapes of a deploying strip: columns X over its functions, then what follows them.

    In its plane the strip is rigid across: the mean over the width of w_x^2 draws it in.
    """

    strip: DeployingStrip
    functions: StripFunctions | None
    reference: float
    X: Array = field(default_factory=lambda: np.zeros((0, 0)))
    followers: Followers | None = None

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return int(self.X.shape[1])

    @property
    def n_shapes(self) -> int:
        """Number of shapes."""
        return self.n + (0 if self.followers is None else self.followers.n)

    @property
    def most(self) -> int:
        """The largest number of functions along."""
        return 0 if self.functions is None else self.functions.most

    @property
    def member_mass(self) -> float:
        """Mass of the reference length [kg]."""
        return self.strip.mass_per_area * self.strip.width * self.reference

    def deflections(self, xi: Array, eta: Array, derivative: int = 0, crosswise: int = 0) -> Array:
        """Derivatives by xi and by eta = 2 y / b of w of the coordinates, (len(xi), len(eta), n)."""
        if self.functions is None:
            return np.zeros((len(xi), len(eta), 0))
        return clean(lambda x: self._raw(x, eta, derivative, crosswise), xi)

    def _raw(self, xi: Array, eta: Array, derivative: int, crosswise: int) -> Array:
        assert self.functions is not None
        return np.asarray(self.functions.deflections(xi, eta, derivative, crosswise) @ self.X)

    def slopes(self, xi: Array) -> tuple[Array, Array]:
        """Slopes by xi of w at points across (len(xi), m, n), and how much of each counts (m,)."""
        return self.deflections(xi, ETA, 1), ETA_WEIGHT / 2

    def matrices(self, xi: Array, weight: Array) -> tuple[Array, Series]:
        """Mass matrix at the reference length and V1 as a series in lambda, over the functions."""
        s, L, b = self.strip, self.reference, self.strip.width
        w, functions = np.outer(weight, ETA_WEIGHT / 2).ravel(), self.functions
        assert functions is not None

        def field_of(along: int, across: int) -> Array:
            found = functions.deflections(xi, ETA, along, across)
            return np.asarray(found.reshape(len(w), -1) * (2.0 / b) ** across / L**along)

        def integral(f: Array, g: Array) -> Array:
            return np.asarray(L * b * ((f.T * w) @ g + (g.T * w) @ f) / 2)

        flat, xx, yy, xy = field_of(0, 0), field_of(2, 0), field_of(0, 2), field_of(1, 1)
        x, y, D, nu = field_of(1, 0), field_of(0, 1), s.bending, s.poisson
        V1 = {
            -3: D * integral(xx, xx),
            -1: D * (2 * nu * integral(xx, yy) + 2 * (1 - nu) * integral(xy, xy)) + s.tension / b * integral(x, x),
            1: D * integral(yy, yy) + s.tension_across * integral(y, y),
        }
        return s.mass_per_area * integral(flat, flat), V1

    def places(self, xi: Array, weight: Array) -> Places:
        """Points across the strip at xi (k,), which take the part weight (k,) of the mass."""
        parts = (self.series(xi, ETA, derivative) for derivative in range(2))
        return Places(np.repeat(xi, len(ETA)), np.outer(weight, ETA_WEIGHT / 2).ravel(), *parts)

    def series(self, xi: Array, eta: Array, derivative: int) -> Series:
        """Position and shapes, body frame, at (xi, eta), or their derivative by xi: p -> (k m, 3, 1 + n_shapes)."""
        line, k, m, n = self.line, len(xi), len(eta), self.n
        out: Series = {p: np.zeros((k, m, 3, 1 + self.n_shapes)) for p in (1, 0, -1)}
        out[1][:, :, 0, 0] = self.reference * (xi[:, None] if derivative == 0 else 1.0)
        if derivative == 0:
            out[0][:, :, 1, 0] = self.strip.width / 2 * eta
        out[0][:, :, 2, 1 : 1 + n] = self.deflections(xi, eta, derivative)
        if self.followers is not None:
            out[-1][:, :, 0, 1 + n :] = self.followers.values(xi, derivative)[:, None] / self.reference
        turned = {p: np.einsum("ba,kmbA->kmaA", line.frame, part).reshape(k * m, 3, -1) for p, part in out.items()}
        if derivative == 0:
            turned[0][:, :, 0] += np.asarray(line.root, float)
        return turned

    def marker(self, xi: float) -> MarkerSeries:
        """The middle of the section at xi."""
        line, where, middle = self.line, np.array([xi]), np.zeros(1)
        centre = self.series(where, middle, 0)
        turn = np.zeros((2, 3, self.n_shapes))
        turn[0, 0, : self.n] = self.deflections(where, middle, 0, 1)[0, 0] * 2.0 / self.strip.width
        turn[1, 1, : self.n] = -self.deflections(where, middle, 1)[0, 0] / self.reference
        return MarkerSeries(
            position={p: part[0, :, 0] for p, part in centre.items()},
            phi={p: part[0, :, 1:] for p, part in centre.items()},
            psi={0: line.frame.T @ turn[0], -1: line.frame.T @ turn[1]},
            orientation=line.frame.T,
            axis=line.frame[0] if self.followers is not None else np.zeros(3),
        )

    def drawn_series(self) -> tuple[Series, dict[str, Index]]:
        """Points and shapes of what is drawn of the deployed part, and its cells."""
        xi, eta = np.linspace(0.0, 1.0, 1 + 4 * max(5, self.most)), np.linspace(-1.0, 1.0, 5)
        return self.series(xi, eta, 0), {"quad": grid(len(xi), len(eta), closed=False)}

    @property
    def line(self) -> DeployingLine:
        """The line along its middle."""
        return self.strip.line

    @property
    def thickness(self) -> float:
        """Thickness of what is drawn [m]: none."""
        return 0.0
