"""Forces in sections of deploying members: tension from the motion of the outboard part, moments from curvature.

What lies beyond a section moves with the accelerations of its material, so the section pulls it with

    S = int (a - f) dm + forces on what is attached there,      N = -S . t

t is the tangent of the bent member. The acceleration of material is the second derivative of Z(xi, lambda) y along it:
with chi of `material` and chi_2 = (1 - xi) dchi/dxi + d chi/dlambda,

    lambdadot^2 chi_2 y + lambdaddot chi y + 2 lambdadot chi dy/dt + Z d2y/dt2

Where the drum is at the tip, material that leaves it jumps in velocity, and the momentum flux counts as well. What
loads, springs, effectors and loops exert at markers of the member counts against S.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.deployment.intervals import gauss_between
from femflex.deployment.series import Series, evaluate
from femflex.deployment.shapes import MemberShapes
from femflex.reduction.beams.beam_functions import points_for

STATIONS = np.linspace(0.0, 1.0, 11)
TENSION = {"tension": ("N", "axial force, positive in tension")}
MOMENTS = {
    "moment_y": ("N m", "bending moment about the section's y axis, -EIy times its curvature w''"),
    "moment_z": ("N m", "bending moment about the section's z axis, EIz times its curvature v''"),
}


@dataclass(frozen=True, eq=False)
class MemberSections:
    """Sections of a deploying member (see `femflex.system.length_table.Sections`).

    stations, at_xi   (k,), (q,) where forces are reported, and points of mass
    weight            (q,) of the points in integrals over xi
    values, chi, chi2 p -> (q, 3, 1 + n) at the points, means over the section
    tip               the same of what is stowed at a drum at the tip, or None
    tangent           p -> (k, 3, 1 + n) derivatives by xi at the stations
    bends             (k, 2, n) second derivatives by xi of v and w at the stations, or None
    slopes            (k, 2, n) first derivatives, for the curvature in large deflections; zero for linear strain
    stiffness         (2,) EIz, EIy [N m^2]
    density           mass per length [kg/m] at sigma (see `tapered`); factor: of the bending stiffness there
    stock             length of the whole member [m], of which what is not deployed is stowed
    markers           name -> xi
    support           tension at the tip that supports react [N]
    """

    stations: Array
    at_xi: Array
    weight: Array
    values: Series
    chi: Series
    chi2: Series
    tip: tuple[Series, Series, Series, Series] | None
    tangent: Series
    bends: Array | None
    slopes: Array | None
    stiffness: tuple[float, float]
    density: Callable[[Array], Array]
    factor: Callable[[Array], Array]
    reference: float
    stock: float
    markers: Mapping[str, float]
    support: float
    slackens: bool

    @property
    def resultants(self) -> dict[str, tuple[str, str]]:
        """Return name -> unit and meaning of the reported resultants."""
        return TENSION if self.bends is None else TENSION | MOMENTS

    def report(
        self, length: tuple[float, float, float], motion: Any, attached: Sequence[tuple[str, Array]]
    ) -> dict[str, Array]:
        """Forces (k,) [N, N m] in the stations."""
        L, U, A = length
        ratio, rate, acceleration = L / self.reference, U / self.reference, A / self.reference
        outboard = self.at_xi[None, :] > self.stations[:, None]
        dm = self.weight * L * self.density(self._sigma(L, self.at_xi))
        a = _acceleration(motion, (self.values, self.chi, self.chi2), (ratio, rate, acceleration))
        S = outboard @ (dm[:, None] * a)
        if self.tip is not None:
            values, stowed_velocity, stowed_acceleration, jump = self.tip
            mass = self._mass_between(L, self.stock)
            density_at_drum = float(self.density(np.array([L]))[0])
            stowed_force = (
                mass
                * _acceleration(motion, (values, stowed_velocity, stowed_acceleration), (ratio, rate, acceleration))[0]
            )
            S += stowed_force + density_at_drum * abs(U) * np.sign(U) * rate * (evaluate(jump, ratio) @ motion.y)[0]
        for marker, force in attached:
            S[self.stations <= self.markers.get(marker, 0.0)] += force
        tangent = evaluate(self.tangent, ratio) @ motion.y
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        out = {"tension": -np.einsum("ka,ka->k", S, tangent) + self.support}
        if self.bends is not None and self.slopes is not None:
            delta = motion.y[1 : 1 + self.bends.shape[2]]
            bend, slope = self.bends @ delta / L**2, self.slopes @ delta / L
            curvature = bend + slope * np.sum(slope * bend, axis=1, keepdims=True) / 2
            EIz, EIy = np.array(self.stiffness)[:, None] * self.factor(self._sigma(L, self.stations))
            out |= {"moment_y": -EIy * curvature[:, 1], "moment_z": EIz * curvature[:, 0]}
        return out

    def _sigma(self, length: float, xi: Array) -> Array:
        return length * (1.0 - xi if self.tip is None else xi)

    def _mass_between(self, a: float, b: float) -> float:
        x, w = gauss_between(np.zeros(0), 40)
        return float((b - a) * (w @ self.density(a + (b - a) * x)))


def _acceleration(
    motion: Any, series_of_points: tuple[Series, Series, Series], length: tuple[float, float, float]
) -> Array:
    """Acceleration less gravity (q, 3) of material at places, body components."""
    ratio, rate, acceleration = length
    Z, chi, chi2 = (
        evaluate(series, ratio) if series else np.zeros((1, 3, len(motion.y))) for series in series_of_points
    )
    r = Z @ motion.y
    velocity = rate * (chi @ motion.y) + Z @ motion.dy
    material = rate**2 * (chi2 @ motion.y) + acceleration * (chi @ motion.y) + 2.0 * rate * (chi @ motion.dy)
    material = material + Z @ motion.ddy
    W = np.outer(motion.omega, motion.omega) - motion.omega @ motion.omega * np.eye(3) + motion.gradient
    return np.asarray(
        motion.a + np.cross(motion.alpha, r) + r @ W.T + 2.0 * np.cross(motion.omega, velocity) + material, float
    )


def sections_of(
    shapes: MemberShapes,
    stock: float,
    at_tip: bool,
    markers: Mapping[str, float],
    density: Callable[[Array], Array],
    factor: Callable[[Array], Array],
) -> MemberSections:
    """The sections of a member with its columns: mean shapes at k stations [1].

    stock: the whole length [m]. markers: their distance from the end that came out first [m]. density and factor:
    functions of sigma (k,) [m], over mass_per_length and the axial stiffness [1].
    """
    knots = np.unique(np.concatenate([STATIONS[1:-1], shapes.knots]))
    xi, weight = gauss_between(knots, points_for(shapes.max_count))
    mean = _means(shapes)
    series = [mean(xi, derivative) for derivative in range(3)]
    chi, chi2 = material_motion(xi, at_tip, *series)
    tip = None
    if at_tip:
        end = np.ones(1)
        end_series = [mean(end, derivative) for derivative in range(3)]
        material_velocity = material_motion(end, True, *end_series)[0]
        point_velocity = {p - 1: p * value for p, value in end_series[0].items() if p}
        point_acceleration = {p - 2: p * (p - 1) * value for p, value in end_series[0].items() if p * (p - 1)}
        jump = {p: material_velocity[p] - point_velocity.get(p, 0.0 * material_velocity[p]) for p in material_velocity}
        tip = (end_series[0], point_velocity, point_acceleration, jump)
    bends, slopes, stiffness, line = None, None, (0.0, 0.0), shapes.axes
    if hasattr(shapes, "fields") and getattr(line, "EIy", 0.0) + getattr(line, "EIz", 0.0) > 0.0:
        bends, slopes = (shapes.fields(STATIONS, derivative)[:, 1:3] for derivative in (2, 1))
        slopes = slopes if shapes.followers is not None else 0.0 * slopes
        stiffness = (float(line.EIz), float(line.EIy))  # type: ignore[attr-defined]
    stiff = getattr(line, "rod", False) or getattr(getattr(shapes, "strip", None), "bending", 0.0)
    return MemberSections(
        stations=STATIONS, at_xi=xi, weight=weight, values=series[0], chi=chi, chi2=chi2, tip=tip,
        tangent=mean(STATIONS, 1), bends=bends, slopes=slopes, stiffness=stiffness, density=density, factor=factor,
        reference=shapes.reference, stock=stock, markers={"tip": 1.0, **markers},
        support=float(line.tension), slackens=bends is None and not stiff,
    )  # fmt: skip


def _means(shapes: MemberShapes) -> Callable[[Array, int], Series]:
    """Means over the section of the position and shapes at xi, or their derivatives: p -> (k, 3, 1 + n)."""
    offsets, share = shapes.section

    def mean(xi: Array, derivative: int) -> Series:
        series = shapes.series(xi, offsets, derivative)
        return {
            p: np.einsum("m,kmaA->kaA", share, part.reshape(len(xi), len(share), 3, -1)) for p, part in series.items()
        }

    return mean


def material_motion(xi: Array, at_tip: bool, value: Series, slope: Series, bend: Series) -> tuple[Series, Series]:
    """chi and chi_2 of material at xi (k,), from Z (k, 3, 1 + n) and its first and second derivatives by xi."""
    xi_rate = (-xi if at_tip else 1.0 - xi)[:, None, None]
    chi = {p - 1: xi_rate * slope[p] + p * value[p] for p in value}
    chi2 = {
        p - 2: xi_rate * (-slope[p] + xi_rate * bend[p] + p * slope[p]) + (p - 1) * (xi_rate * slope[p] + p * value[p])
        for p in value
    }
    return chi, chi2
