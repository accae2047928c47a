"""Deploying lines whose section and density vary along the material: polynomials in the length, piece by piece.

A material point keeps its distance sigma from the end that came out first: sigma = L - x from the tip where the drum is
at the root, sigma = x from the root where it is at the tip. What it is made of is a function of sigma. Integrals over
the deployed part then are no powers of the length any more. They are computed at Chebyshev points of each piece of the
length and interpolated; the number of pieces is doubled until the error between the points is small, and stated.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.deployment.intervals import gauss_between
from femflex.deployment.line import LineShapes
from femflex.deployment.material import Inertia
from femflex.deployment.parts import columns_of, with_columns
from femflex.deployment.series import Series, added, evaluate, scaled
from femflex.deployment.table import DeployingParts, MarkerSeries
from femflex.noun.table import Table, refuse
from femflex.noun.values import Quantity
from femflex.reduction.beams.beam_functions import points_for
from femflex.warning import PhysicsWarning

DEGREE = 9  # of the polynomials in the length
ERROR_GOAL = 1e-8  # relative error of the interpolation that is aimed at
MAX_PIECES = 32


def unit_factor(sigma: Array) -> Array:
    """1 at every sigma (k,) [m]."""
    return np.ones_like(sigma)


@dataclass(frozen=True)
class MaterialTaper:
    """Factors (k,) on a line's mass per length, bending, axial and torsional stiffness, at sigma [m].

    sigma is the distance from the end that came out first: the tip if the drum is at the root. Between `knots` [m] the
    factors are smooth, and at them they do not jump: a step in a section needs a second member at the tip of the first.
    """

    mass: Callable[[Array], Array] = unit_factor
    bending: Callable[[Array], Array] = unit_factor
    axial: Callable[[Array], Array] = unit_factor
    torsion: Callable[[Array], Array] = unit_factor
    knots: tuple[float, ...] = ()
    covered: float = math.inf
    """Distance [m] up to which the factors are given."""

    @classmethod
    def table(cls, sigma: Sequence[float], **factors: Sequence[float]) -> MaterialTaper:
        """Factors that are straight between points sigma [m] and constant beyond them; those left out are 1.

        Raises ValueError for points that do not ascend, or other numbers of factors.
        """
        check_points(sigma, factors)
        points = np.asarray(sigma, float)
        if points[0] > 0.0:
            warnings.warn(
                f"the taper of a deploying member begins {points[0]:g} m from the end that comes out first, and those "
                f"{points[0]:g} m have its first factors; begin the taper at 0",
                PhysicsWarning,
                stacklevel=2,
            )
        functions = {name: partial(_straight, points, np.asarray(values, float)) for name, values in factors.items()}
        return cls(**functions, knots=tuple(float(x) for x in points if x > 0.0), covered=float(points[-1]))


def check_points(sigma: Sequence[float], factors: Mapping[str, Sequence[float]]) -> None:
    """Raise ValueError for points that do not ascend, or other numbers of factors."""
    points = np.asarray(sigma, float)
    if len(points) < 2 or np.any(np.diff(points) <= 0.0) or points[0] < 0.0:
        raise ValueError(
            f"the points of a taper are {list(sigma)}; give at least two distances from the end that comes out "
            "first, ascending from zero or more"
        )
    for name, values in factors.items():
        if len(values) != len(points):
            raise ValueError(f"{len(values)} factors on {name} are given at {len(points)} points; give one at each")


class Taper(Table):
    """Section and density that vary along the material: factors at points, straight between them."""

    along: Annotated[tuple[float, ...], Quantity("m", (None,), least=0.0)]
    """Distances of the points from the end that comes out first: the tip where the drum is at the root, the root where
    it is at the tip. Ascending, at least two; the factors stay constant beyond the last one."""
    mass: Annotated[tuple[float, ...] | None, Quantity("", (None,), above=0.0)] = None
    """Factors on the mass per length. Default: 1."""
    bending: Annotated[tuple[float, ...] | None, Quantity("", (None,), least=0.0)] = None
    """Factors on EIy and EIz. Default: 1."""
    axial: Annotated[tuple[float, ...] | None, Quantity("", (None,), least=0.0)] = None
    """Factors on EA. Default: 1."""
    torsion: Annotated[tuple[float, ...] | None, Quantity("", (None,), least=0.0)] = None
    """Factors on GJ. Default: 1."""

    def factors(self) -> dict[str, tuple[float, ...]]:
        """The factors that the table has, by key."""
        all_factors = {key: getattr(self, key) for key in ("mass", "bending", "axial", "torsion")}
        return {key: values for key, values in all_factors.items() if values is not None}

    def material(self) -> MaterialTaper:
        """The factors as functions along the material."""
        return MaterialTaper.table(self.along, **self.factors())

    @model_validator(mode="after")
    def _keys_fit(self) -> Taper:
        if not self.factors():
            refuse("found a taper without factors; give mass, bending, axial or torsion")
        try:
            check_points(self.along, self.factors())
        except ValueError as error:
            refuse(str(error))
        return self


def _straight(points: Array, values: Array, sigma: Array) -> Array:
    return np.interp(sigma, points, values)


@dataclass(frozen=True, eq=False)
class TaperedLine:
    """A deploying line with columns of shapes, and everything of it at one length."""

    shapes: LineShapes
    taper: MaterialTaper
    stock: float
    damping: Array
    at_tip: bool = False

    def __post_init__(self) -> None:
        sigma = np.unique([*np.linspace(0.0, self.stock, 201), *(x for x in self.taper.knots if x < self.stock)])
        mass = self.taper.mass(sigma)
        if not (np.isfinite(mass).all() and mass.min() > 0.0):
            raise ValueError(
                f"the density of a deploying member falls to {mass.min():g} of its mass_per_length; it must stay "
                "positive"
            )
        for name in ("bending", "axial", "torsion"):
            factor = getattr(self.taper, name)(sigma)
            if not (np.isfinite(factor).all() and factor.min() >= 0.0):
                raise ValueError(
                    f"the factor of a deploying member's taper on its {name} falls to {factor.min():g}; it must not be "
                    "negative"
                )

    def quadrature(self, length: float) -> tuple[Array, Array]:
        """Points (q,) and weights (q,) [1] over the deployed part, between all places where anything has a kink."""
        inside = np.array([x for x in self.taper.knots if x < length * (1.0 - 1e-9)])
        kinks = inside / length if self.at_tip else 1.0 - inside / length
        knots = self.shapes.knots
        distinct = [x for x in kinks if not len(knots) or np.abs(knots - x).min() > 1e-9]
        return gauss_between(np.unique([*knots, *distinct]), points_for(self.shapes.max_count))

    def material(self, length: float, xi: Array) -> Array:
        """sigma (k,) [m] at xi (k,)."""
        return length * (xi if self.at_tip else 1.0 - xi)

    def deployed_mass(self, length: float) -> float:
        """Mass between the exit and the end that came out first [kg]."""
        knots = np.array([x for x in self.taper.knots if x < length * (1.0 - 1e-9)]) / length
        x, w = gauss_between(knots, 60)
        return float(self.shapes.line.mass_per_length * length * (w @ self.taper.mass(length * x)))

    @cached_property
    def drum(self) -> tuple[Array, Series, Series, Series]:
        """The section at the drum, p points: shares, values, velocities of the stowed mass there, and jumps.

        Shares (p,) [1]; positions and shapes (p, 3, 1 + n) [m, 1]; velocities per rate of lambda, and those by which
        material jumps as it is picked up, both (p, 3, 1 + n) [m, 1].
        """
        points = self.shapes.material_points(np.array([1.0 if self.at_tip else 0.0]), np.ones(1))
        point_velocity = points.section_velocities() if self.at_tip else {}
        return (
            points.share,
            points.values,
            point_velocity,
            added(points.velocities(self.at_tip), scaled(point_velocity, -1.0)),
        )

    def values(self, length: float) -> dict[str, Array]:
        """Moments, rates per rate of the length, stiffness, damping and markers at a length [m]; shapes as in
        `Variation`."""
        line, L0, s = self.shapes.line, self.shapes.reference, self.shapes
        ratio, (xi, weight) = length / L0, self.quadrature(length)
        sigma = self.material(length, xi)
        points = s.material_points(xi, weight)
        dm = points.share * np.repeat(self.taper.mass(sigma), len(line.sections[1])) * line.mass_per_length * length
        z, chi = evaluate(points.values, ratio), evaluate(points.velocities(self.at_tip), ratio) / L0
        share, values0, point_velocity, jump = self.drum
        z0, velocity_jump = evaluate(values0, ratio), evaluate(jump, ratio) / L0
        chi0 = evaluate(point_velocity, ratio) / L0 if point_velocity else np.zeros_like(z0)
        stowed = (self.deployed_mass(self.stock) - self.deployed_mass(length)) * share
        density_at_drum = line.mass_per_length * float(self.taper.mass(np.array([length]))[0])

        def second_moment(a: Array, b: Array, m: Array) -> Array:
            k, axes, shapes = a.shape
            flat = (m[:, None, None] * a).reshape(k, -1).T @ b.reshape(k, -1)
            return np.asarray(flat.reshape(axes, shapes, axes, shapes).transpose(1, 0, 3, 2))

        V1 = self.stiffness(xi, weight, length)
        out = {
            "first": np.einsum("k,kaA->Aa", dm, z) + np.einsum("k,kaA->Aa", stowed, z0),
            "second": second_moment(z, z, dm) + second_moment(z0, z0, stowed),
            "drift": np.einsum("k,kaA->Aa", dm, chi) + np.einsum("k,kaA->Aa", stowed, chi0),
            "flow": second_moment(z, chi, dm) + second_moment(z0, chi0, stowed),
            "speed": second_moment(chi, chi, dm) + second_moment(chi0, chi0, stowed),
            "pickup": density_at_drum * np.einsum("k,kaA,kaB->AB", share, velocity_jump, velocity_jump),
            "V1": V1,
            "V3": self.quartic(xi, weight, length),
        }
        Me = np.einsum("kaka->k", out["second"][1:, :, 1:, :])[: s.n]
        out["damping"] = np.diag(2.0 * self.damping * np.sqrt(np.maximum(np.diag(V1) * Me, 0.0)))
        return out

    def stiffness(self, xi: Array, weight: Array, length: float) -> Array:
        """V1 (n, n) [1/s^2] at a length."""
        line, sigma, s = self.shapes.line, self.material(length, xi), self.shapes
        slope, bend = s.fields(xi, 1) / length, s.fields(xi, 2) / length**2
        dx = weight * length
        bending, axial, torsion = (f(sigma) for f in (self.taper.bending, self.taper.axial, self.taper.torsion))
        terms = (
            (dx * bending * line.EIz, bend[:, 1]), (dx * bending * line.EIy, bend[:, 2]),
            (dx * axial * line.EA, slope[:, 0]), (dx * torsion * line.GJ, slope[:, 3]),
            (dx * line.tension, slope[:, 1]), (dx * line.tension, slope[:, 2]),
        )  # fmt: skip
        V1 = sum(((f * w[:, None]).T @ f for w, f in terms), np.zeros((s.n, s.n)))
        return np.asarray((V1 + V1.T) / 2)

    def quartic(self, xi: Array, weight: Array, length: float) -> Array:
        """Packed V3 (k,) [SI] at a length; empty of linear strain."""
        if self.shapes.followers is None:
            return np.zeros(0)
        factor = self.taper.bending(self.material(length, xi))
        return evaluate(self.shapes.quartic(xi, weight * factor), length / self.shapes.reference)


def tapered_line(
    shapes: LineShapes,
    taper: MaterialTaper,
    stock: float,
    condensed: bool,
    damping: float | Sequence[float],
    at_tip: bool = False,
) -> TaperedLine:
    """The line with its columns, orthonormal over the mass at the reference length, and followers."""
    ratio = np.asarray(damping, float)
    if shapes.functions is not None:
        raw = TaperedLine(replace(shapes, X=np.eye(shapes.functions.count)), taper, stock, np.zeros(1), at_tip)
        values = raw.values(shapes.reference)
        M = np.einsum("kala->kl", values["second"][1:, :, 1:, :])
        with_modes = with_columns(shapes, columns_of(shapes.functions, M, values["V1"]), condensed)
        assert isinstance(with_modes, LineShapes)
        shapes = with_modes
    return TaperedLine(shapes, taper, stock, np.broadcast_to(ratio, (shapes.n,)) if ratio.ndim == 0 else ratio, at_tip)


def pieces_of(
    line: TaperedLine, bounds: tuple[float, float], markers: dict[str, float], exit_: MarkerSeries
) -> tuple[list[DeployingParts], float]:
    """Parts over pieces of the length between bounds [m], and the largest relative error of their numbers.

    A piece ends where a kink of the taper comes out.
    """
    smallest, largest = bounds
    largest = max(largest, smallest * (1.0 + 1e-6))
    inner = [x for x in line.taper.knots if smallest * (1.0 + 1e-6) < x < largest * (1.0 - 1e-6)]
    ends = np.array([smallest, *inner, largest])
    count, limit = 1, max(1, MAX_PIECES // (len(ends) - 1))
    while True:
        edges = np.unique(np.concatenate([np.linspace(a, b, count + 1) for a, b in pairwise(ends)]))
        parts = [_piece(line, a, b, markers, exit_) for a, b in pairwise(edges)]
        error = max(_error(line, part) for part in parts)
        if error < ERROR_GOAL or 2 * count > limit:
            return parts, error
        count *= 2


def _piece(line: TaperedLine, a: float, b: float, markers: dict[str, float], exit_: MarkerSeries) -> DeployingParts:
    nodes = (1.0 - np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))) / 2.0
    solve, scale = np.linalg.inv(np.vander(nodes, increasing=True)), b - a
    sampled = [line.values(a + scale * s) for s in nodes]
    n = line.shapes.n

    def fitted(values: Sequence[Array], factor: float = 1.0) -> Series:
        return dict(enumerate(factor * np.tensordot(solve, np.stack(values), axes=1)))

    def part_series(key: str, factor: float = 1.0) -> Series:
        return fitted([values[key] for values in sampled], factor)

    def marker(where: float) -> MarkerSeries:
        series_of_marker = line.shapes.marker(where)
        ratios = (a + scale * nodes) / line.shapes.reference
        parts = [
            fitted([evaluate(series, r) for r in ratios])
            for series in (series_of_marker.position, series_of_marker.phi, series_of_marker.psi)
        ]
        return MarkerSeries(parts[0], parts[1], parts[2], series_of_marker.orientation, series_of_marker.axis)

    inertia = Inertia(
        mass=line.deployed_mass(line.stock),
        first=part_series("first"),
        second=part_series("second"),
        drift=part_series("drift", scale),
        flow=part_series("flow", scale),
        speed=part_series("speed", scale**2),
        pickup=part_series("pickup", scale**3),
    )
    followers = line.shapes.followers
    return DeployingParts(
        reference=scale,
        inertia=inertia,
        V1=part_series("V1") if n else {0: np.zeros((0, 0))},
        V3=part_series("V3") if followers is not None else {},
        damping=part_series("damping") if n else {0: np.zeros((0, 0))},
        markers={"root": exit_, **{name: marker(where) for name, where in markers.items()}},
        slaves=np.zeros((0, n, n)) if followers is None else followers.slaves,
        kinds=("admissible",) * n + ("derivative",) * (line.shapes.n_shapes - n),
        origin=a,
    )


def _error(line: TaperedLine, part: DeployingParts) -> float:
    """Largest difference between the points, relative to the size of each kind of numbers."""
    worst = 0.0
    for s in np.linspace(0.03, 0.97, 5):
        exact = line.values(part.origin + s * part.reference)
        for key, series in (("second", part.inertia.second), ("V1", part.V1), ("V3", part.V3)):
            size = np.abs(exact[key]).max(initial=0.0)
            if size > 0.0:
                worst = max(worst, float(np.abs(evaluate(series, s) - exact[key]).max() / size))
    return worst
