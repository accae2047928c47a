"""Deploying lines whose section and density vary along the material: polynomials in the length, piece by piece.

A material point keeps its distance sigma = L - x from the tip, so what it is made of is a function of sigma. Integrals
over the deployed part then are no powers of the length any more. They are computed at Chebyshev points of each piece of
the length and interpolated; the number of pieces is doubled until the error between the points is small, and stated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from femflex.deployment.foreshortening import followers_of
from femflex.deployment.line import LineShapes
from femflex.deployment.material import Inertia, Places
from femflex.deployment.series import Series, at
from femflex.deployment.table import DeployingParts, MarkerSeries
from femflex.fem.eigen.canonical import canonical
from femflex.fem.eigen.modes import dense_modes
from femflex.reduction.beams.beam_functions import gauss, points_for

Array = NDArray[np.float64]

DEGREE = 9  # of the polynomials in the length
ENOUGH = 1e-8  # relative error of the interpolation that is aimed at
MOST_PIECES = 32


def one(sigma: Array) -> Array:
    """1 everywhere."""
    return np.ones_like(sigma)


@dataclass(frozen=True)
class MaterialTaper:
    """Factors (k,) on a line's mass per length, bending, axial and torsional stiffness, at sigma [m] from the tip.

    They are smooth; a step in a section wants a member of its own on the tip.
    """

    mass: Callable[[Array], Array] = one
    bending: Callable[[Array], Array] = one
    axial: Callable[[Array], Array] = one
    torsion: Callable[[Array], Array] = one


@dataclass(frozen=True, eq=False)
class TaperedLine:
    """A deploying line with columns of shapes, and everything of it at one length."""

    shapes: LineShapes
    taper: MaterialTaper
    stock: float
    damping: Array

    def __post_init__(self) -> None:
        mass = self.taper.mass(np.linspace(0.0, self.stock, 201))
        if not (np.isfinite(mass).all() and mass.min() > 0.0):
            raise ValueError(
                f"the density of a deploying member falls to {mass.min():g} of its mass_per_length; it must stay "
                "positive"
            )

    @cached_property
    def quadrature(self) -> tuple[Array, Array]:
        """Points and weights over the deployed part."""
        return gauss(points_for(self.shapes.most))

    @cached_property
    def places(self) -> tuple[Places, Places, Series, Series]:
        """Points of the deployed part and of the section at the drum, and the velocities of both per rate of lambda."""
        deployed, drum = self.shapes.places(*self.quadrature), self.shapes.places(np.zeros(1), np.ones(1))
        return deployed, drum, deployed.moved(False), drum.moved(False)

    @cached_property
    def curves(self) -> tuple[Array, Array]:
        """First and second derivatives by xi of the fields of the coordinates at the points."""
        xi, _ = self.quadrature
        return self.shapes.fields(xi, 1), self.shapes.fields(xi, 2)

    def deployed_mass(self, length: float) -> float:
        """Mass between the tip and the exit [kg]."""
        x, w = gauss(60)
        return float(self.shapes.line.mass_per_length * length * (w @ self.taper.mass(length * x)))

    def values(self, length: float) -> dict[str, Array]:
        """Moments, rates per rate of the length, stiffness, damping and markers at a length."""
        line, L0, s = self.shapes.line, self.shapes.reference, self.shapes
        ratio, (xi, weight) = length / L0, self.quadrature
        sigma = length * (1.0 - xi)
        places, drum, moved, leaving_velocity = self.places
        dm = places.share * np.repeat(self.taper.mass(sigma), len(line.sections[1])) * line.mass_per_length * length
        z, chi = at(places.values, ratio), at(moved, ratio) / L0
        z0, chi0 = at(drum.values, ratio), at(leaving_velocity, ratio) / L0
        stowed = (self.deployed_mass(self.stock) - self.deployed_mass(length)) * drum.share
        leaving = line.mass_per_length * float(self.taper.mass(np.array([length]))[0])

        def second(a: Array, b: Array, m: Array) -> Array:
            k, axes, shapes = a.shape
            flat = (m[:, None, None] * a).reshape(k, -1).T @ b.reshape(k, -1)
            return np.asarray(flat.reshape(axes, shapes, axes, shapes).transpose(1, 0, 3, 2))

        V1 = self.stiffness(xi, weight, length)
        out = {
            "first": np.einsum("k,kaA->Aa", dm, z) + np.einsum("k,kaA->Aa", stowed, z0),
            "second": second(z, z, dm) + second(z0, z0, stowed),
            "drift": np.einsum("k,kaA->Aa", dm, chi),
            "flow": second(z, chi, dm),
            "speed": second(chi, chi, dm),
            "pickup": leaving * np.einsum("k,kaA,kaB->AB", drum.share, chi0, chi0),
            "V1": V1,
        }
        Me = np.einsum("kaka->k", out["second"][1:, :, 1:, :])[: s.n]
        out["damping"] = np.diag(2.0 * self.damping * np.sqrt(np.maximum(np.diag(V1) * Me, 0.0)))
        return out

    def stiffness(self, xi: Array, weight: Array, length: float) -> Array:
        """V1 (n, n) at a length."""
        line, sigma, s = self.shapes.line, length * (1.0 - xi), self.shapes
        slope, bend = self.curves[0] / length, self.curves[1] / length**2
        dx = weight * length
        bending, axial, torsion = (f(sigma) for f in (self.taper.bending, self.taper.axial, self.taper.torsion))
        terms = (
            (dx * bending * line.EIz, bend[:, 1]), (dx * bending * line.EIy, bend[:, 2]),
            (dx * axial * line.EA, slope[:, 0]), (dx * torsion * line.GJ, slope[:, 3]),
            (dx * line.tension, slope[:, 1]), (dx * line.tension, slope[:, 2]),
        )  # fmt: skip
        V1 = sum(((f * w[:, None]).T @ f for w, f in terms), np.zeros((s.n, s.n)))
        return np.asarray((V1 + V1.T) / 2)


def tapered_line(
    shapes: LineShapes, taper: MaterialTaper, stock: float, condensed: bool, damping: float | Sequence[float]
) -> TaperedLine:
    """The line with its columns, orthonormal over the mass at the reference length, and followers."""
    ratio = np.asarray(damping, float)
    if shapes.functions is not None:
        raw = TaperedLine(replace(shapes, X=np.eye(shapes.functions.count)), taper, stock, np.zeros(1))
        values = raw.values(shapes.reference)
        M = np.einsum("kala->kl", values["second"][1:, :, 1:, :])
        X = canonical(*dense_modes(values["V1"], M)) if values["V1"].any() else np.linalg.inv(np.linalg.cholesky(M)).T
        shapes = replace(shapes, X=X)
        if condensed:
            xi, weight = raw.quadrature
            shapes = replace(shapes, followers=followers_of(*shapes.slopes(xi), xi, weight))
    return TaperedLine(shapes, taper, stock, np.broadcast_to(ratio, (shapes.n,)) if ratio.ndim == 0 else ratio)


def pieces_of(
    line: TaperedLine, bounds: tuple[float, float], markers: dict[str, float], exit_: MarkerSeries
) -> tuple[list[DeployingParts], float]:
    """Parts over pieces of the length between bounds [m], and the largest relative error of their numbers."""
    least, most = bounds
    most = max(most, least * (1.0 + 1e-6))
    count = 1
    while True:
        edges = np.linspace(least, most, count + 1)
        parts = [_piece(line, a, b, markers, exit_) for a, b in pairwise(edges)]
        error = max(_error(line, part) for part in parts)
        if error < ENOUGH or 2 * count > MOST_PIECES:
            return parts, error
        count *= 2


def _piece(line: TaperedLine, a: float, b: float, markers: dict[str, float], exit_: MarkerSeries) -> DeployingParts:
    nodes = (1.0 - np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))) / 2.0
    solve, scale = np.linalg.inv(np.vander(nodes, increasing=True)), b - a
    sampled = [line.values(a + scale * s) for s in nodes]
    n = line.shapes.n

    def fitted(values: Sequence[Array], factor: float = 1.0) -> Series:
        return dict(enumerate(factor * np.tensordot(solve, np.stack(values), axes=1)))

    def part(key: str, factor: float = 1.0) -> Series:
        return fitted([one[key] for one in sampled], factor)

    def marker(where: float) -> MarkerSeries:
        whole = line.shapes.marker(where)
        ratios = (a + scale * nodes) / line.shapes.reference
        parts = [fitted([at(series, r) for r in ratios]) for series in (whole.position, whole.phi, whole.psi)]
        return MarkerSeries(parts[0], parts[1], parts[2], whole.orientation, whole.axis)

    inertia = Inertia(
        mass=line.deployed_mass(line.stock), first=part("first"), second=part("second"), drift=part("drift", scale),
        flow=part("flow", scale), speed=part("speed", scale**2), pickup=part("pickup", scale**3),
    )  # fmt: skip
    followers = line.shapes.followers
    return DeployingParts(
        reference=scale,
        inertia=inertia,
        V1=part("V1") if n else {0: np.zeros((0, 0))},
        damping=part("damping") if n else {0: np.zeros((0, 0))},
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
        for key, series in (("second", part.inertia.second), ("V1", part.V1)):
            size = np.abs(exact[key]).max(initial=0.0)
            if size > 0.0:
                worst = max(worst, float(np.abs(at(series, s) - exact[key]).max() / size))
    return worst
