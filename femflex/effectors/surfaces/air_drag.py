"""Free-molecular pressure and shear of the air on surfaces (THEORY section 8; Schaaf and Chambre; Sentman).

V is the velocity of the air relative to the facet, whose own rate counts, so that it damps. With theta between V and
the inward normal of a side, speed ratio s = V / sqrt(2 R T / M), s_n = s cos theta, and accommodation sigma_n, sigma_t,
pressure and shear over rho V^2 / 2 are

    p   = [ ((2 - sigma_n) s_n / sqrt(pi) + sigma_n/2 sqrt(T_w/T)) exp(-s_n^2)
            + ((2 - sigma_n)(s_n^2 + 1/2) + sigma_n/2 sqrt(pi T_w/T) s_n)(1 + erf s_n) ] / s^2
    tau = sigma_t sin theta [ exp(-s_n^2) + sqrt(pi) s_n (1 + erf s_n) ] / (s sqrt(pi))

on both sides of a sheet, on the outside of closed bodies, and at 2 AROUND places of a tube's circumference. Parts of a
craft do not shield one another.
"""

from __future__ import annotations

import math
from typing import Annotated

from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.effectors.surfaces.forces import (
    CENTRE,
    COUNT,
    FACETS,
    FORM,
    HEAD,
    NORMAL,
    REST,
    SIZE,
    SurfaceForce,
    inputs_of,
)
from femflex.effectors.surfaces.surface import Facet
from femflex.effectors.surroundings.atmosphere import GAS_CONSTANT, Air
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import ZERO, Vector, add, cross, dot, load3, load9, scale, store3, sub, turn, turn_back
from femflex.noun.values import Quantity
from femflex.system.acting import Context
from femflex.system.orbit import ORBIT_SIGNALS

AROUND = 16  # places of half a circumference: 1.4e-5 of the drag at a speed ratio of 7, exponentially less below
WIDTH = REST + 1  # whether the back is exposed
ALONG_NORMAL, ALONG_SURFACE, WALL = HEAD, HEAD + 1, HEAD + 2  # accommodation, temperature


class AirDrag(SurfaceForce, heading="air_drag"):
    """Pressure and shear of the upper air on the surfaces of bodies: drag, lift and damping."""

    atmosphere: str = "atmosphere"
    """The air, a name in [surroundings]."""
    normal_accommodation: Annotated[float, Quantity(least=0.0, most=1.0)] = 1.0
    """Accommodation of the molecules' momentum along the normal; 1: they leave as from the wall at rest."""
    tangential_accommodation: Annotated[float, Quantity(least=0.0, most=1.0)] = 1.0
    """Accommodation of their momentum along the surface; 0: they slide without friction."""
    wall_temperature: Annotated[float, Quantity("K", above=0.0)] = 300.0
    """Temperature of the surface."""

    label = "air drag"

    def sources(self, context: Context) -> tuple[str, ...]:
        """Density, velocity and temperature of the air, and velocity on the orbit."""
        channels = ("density", "x", "y", "z", "temperature", "molar_mass")
        return (*inputs_of(context, self.atmosphere, Air, channels, "atmosphere"), *ORBIT_SIGNALS[3:])

    def head(self, context: Context) -> ArrayLike:
        """Accommodation along and across the normal, and wall temperature."""
        return [self.normal_accommodation, self.tangential_accommodation, self.wall_temperature, 0.0]

    def facet_numbers(self, facet: Facet) -> ArrayLike:
        """Whether its back is exposed."""
        return [float(facet.back is not None)]


@inner
def air_on_side(V: Vector, n: Vector, T: float, heat: float, p: Array) -> Vector:
    """Force per area, over the density, on a side with outward unit normal n in the wind V; temperature T [K].

    heat  2 R T / M of the air, the square of the molecules' most probable speed
    """
    speed = math.sqrt(dot(V, V))
    if speed == 0.0:
        return ZERO
    s, cosine = speed / math.sqrt(heat), -dot(V, n) / speed
    s_n, hot, root = s * cosine, math.sqrt(p[WALL] / T), math.sqrt(math.pi)
    e, f = math.exp(-s_n * s_n), 1.0 + math.erf(s_n)
    rest, half = 2.0 - p[ALONG_NORMAL], 0.5 * p[ALONG_NORMAL] * hot
    pressure = ((rest * s_n / root + half) * e + (rest * (s_n * s_n + 0.5) + half * root * s_n) * f) / (s * s)
    shear = p[ALONG_SURFACE] * (e + root * s_n * f) / (s * root)  # times the part of V / |V| along the surface
    along = scale(1.0 / speed, add(V, scale(cosine * speed, n)))
    return scale(0.5 * speed * speed, sub(scale(shear, along), scale(pressure, n)))


@inner
def air_on_facet(V: Vector, T: float, heat: float, p: Array, first: int) -> Vector:
    """Force over the density on a facet, in the axes of its marker, in the wind V relative to its centre."""
    n, size = load3(p, first + NORMAL), p[first + SIZE]
    if p[first + FORM] > 0.0:
        across = sub(V, scale(dot(V, n), n))
        speed = math.sqrt(dot(across, across))
        if speed == 0.0:
            across = cross(n, (1.0, 0.0, 0.0) if abs(n[0]) < 0.6 else (0.0, 1.0, 0.0))
            speed = math.sqrt(dot(across, across))
        a, force = scale(1.0 / speed, across), ZERO
        b = cross(n, a)
        for k in range(AROUND):
            angle = math.pi * (k + 0.5) / AROUND
            outward = add(scale(math.cos(angle), a), scale(math.sin(angle), b))
            force = add(force, air_on_side(V, outward, T, heat, p))
        return scale(2.0 * math.pi * size / AROUND, sub(force, scale(dot(force, b), b)))  # both halves
    force = air_on_side(V, n, T, heat, p)
    if p[first + REST] > 0.0:
        force = add(force, air_on_side(V, scale(-1.0, n), T, heat, p))
    return scale(size, force)


@AirDrag.kernel
def air_drag(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: density, velocity, temperature and molar mass of the air; velocity on the orbit."""
    p = parameters
    m = int(p[COUNT])
    density, T, power = seen[18 * m], seen[18 * m + 4], 0.0
    heat = 2.0 * GAS_CONSTANT * T / seen[18 * m + 5]
    wind = sub(load3(seen, 18 * m + 1), load3(seen, 18 * m + 6))
    for k in range(m):
        C = load9(seen, 3 * m + 9 * k)
        velocity, rate = load3(seen, 12 * m + 3 * k), load3(seen, 15 * m + 3 * k)
        V, w, force, torque = turn_back(C, sub(wind, velocity)), turn_back(C, rate), ZERO, ZERO
        first, n = int(p[FACETS + 2 * k]), int(p[FACETS + 2 * k + 1])
        for i in range(n):
            centre = load3(p, first + WIDTH * i + CENTRE)
            f = air_on_facet(sub(V, cross(w, centre)), T, heat, p, first + WIDTH * i)
            force, torque = add(force, f), add(torque, cross(centre, f))
        force, torque = turn(C, scale(density, force)), turn(C, scale(density, torque))
        store3(out, 3 * k, force)
        store3(out, 3 * m + 3 * k, torque)
        power += dot(force, velocity) + dot(torque, rate)
    out[6 * m] = out[6 * m + 1] = out[6 * m + 3] = 0.0
    out[6 * m + 2] = power
