"""Radiation of the Earth on surfaces: sunlight that it reflects (albedo) and its infrared, by the law of `light`.

The Earth is a sphere of radius R that radiates and reflects evenly in all directions. From the craft at distance r it
is a disc around the nadir. A part of the disc of solid angle dw, in the direction s, lights facets with the pressure

    dP = [ albedo S (n.s_sun > 0) + infrared ] / (pi c) dw,    S = (1361 W/m^2) (1 au / distance of the sun)^2

n the normal of the ground there, c the speed of light. The disc is taken in RINGS rings, at Gauss nodes of the cosine
of the angle from the nadir, of SECTORS sectors each, after Knocke, Ries and Tapley (1988). Infrared on a surface that
sees all of the disc is exact. Where its horizon or the terminator cuts the disc, the error is at most 6e-3 of the
largest force, and 1.5e-3 in the mean square. Of infrared the shares that surfaces reflect are those of light. Parts of
a craft do not shade one another.
"""

from __future__ import annotations

from typing import Annotated

from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.effectors.surfaces.forces import CENTRE, COUNT, FACETS, HEAD, inputs_of
from femflex.effectors.surfaces.light import WIDTH, LightForce, light_on_facet
from femflex.effectors.surroundings.earth_disc import RINGS, SECTORS, disc_axes, disc_part
from femflex.effectors.surroundings.noun import orbit_signals
from femflex.effectors.surroundings.sun import AU, LIGHT_PRESSURE, SPEED_OF_LIGHT, Sun
from femflex.kernels.vectors import ZERO, add, cross, dot, load3, load9, scale, store3, turn, turn_back
from femflex.noun.values import Quantity
from femflex.system.acting import Context

ALBEDO, INFRARED, RADIUS = HEAD, HEAD + 1, HEAD + 2


class EarthRadiation(LightForce, heading="earth_radiation"):
    """Pressure of the Earth's radiation on the surfaces of bodies: reflected sunlight and infrared.

    The defaults are means over the globe and the year.
    """

    sun: str = "sun"
    """The sun, a name in [surroundings]; not needed without albedo."""
    albedo: Annotated[float, Quantity(least=0.0, most=1.0)] = 0.3
    """Share of the sunlight that the Earth reflects."""
    infrared: Annotated[float, Quantity("W/m^2", least=0.0)] = 237.0
    """Heat radiation of the Earth, per area of its surface."""

    label = "earth radiation"

    def sources(self, context: Context) -> tuple[str, ...]:
        """Place and velocity on the orbit; with albedo direction and distance of the sun."""
        orbit = orbit_signals(context, "the radiation of the Earth")
        if self.albedo == 0.0:
            return orbit
        return (*orbit, *inputs_of(context, self.sun, Sun, ("x", "y", "z", "distance"), "sun"))

    def head(self, context: Context) -> ArrayLike:
        """Albedo, infrared pressure [Pa], and radius of the Earth [m]."""
        return [self.albedo, self.infrared / SPEED_OF_LIGHT, context.radius, 0.0]


@EarthRadiation.kernel
def earth_radiation(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: place and velocity on the orbit; with albedo direction and distance of the sun."""
    p = parameters
    m = int(p[COUNT])
    for i in range(6 * m + 4):
        out[i] = 0.0
    place, radius = load3(seen, 18 * m), p[RADIUS]
    if dot(place, place) <= radius * radius:
        return
    to_sun, reflected = ZERO, 0.0
    if p[ALBEDO] > 0.0:
        to_sun = load3(seen, 18 * m + 6)
        reflected = p[ALBEDO] * LIGHT_PRESSURE * (AU / seen[18 * m + 9]) ** 2
    axes = disc_axes(place, load3(seen, 18 * m + 3))
    for ring in range(RINGS):
        for sector in range(SECTORS):
            direction, ground, share = disc_part(ring, sector, place, radius, axes)
            pressure = share * (p[INFRARED] + reflected * max(0.0, dot(ground, to_sun)))
            for k in range(m):
                C = load9(seen, 3 * m + 9 * k)
                s, force, torque = turn_back(C, direction), ZERO, ZERO
                first, n = int(p[FACETS + 2 * k]), int(p[FACETS + 2 * k + 1])
                for i in range(n):
                    f = light_on_facet(s, p, first + WIDTH * i)
                    force = add(force, f)
                    torque = add(torque, cross(load3(p, first + WIDTH * i + CENTRE), f))
                store3(out, 3 * k, add(load3(out, 3 * k), turn(C, scale(pressure, force))))
                store3(out, 3 * m + 3 * k, add(load3(out, 3 * m + 3 * k), turn(C, scale(pressure, torque))))
    for k in range(m):
        out[6 * m + 2] += dot(load3(out, 3 * k), load3(seen, 12 * m + 3 * k))
        out[6 * m + 2] += dot(load3(out, 3 * m + 3 * k), load3(seen, 15 * m + 3 * k))
