"""Pressure of sunlight on surfaces, by the law of `light`.

Where shadow counts, the force is that of the lit share of a facet, and acts at the centre of the lit part. Both are
sampled (`shadow`), and constant between two samples. Of a tube it is the lit share of its length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.effectors.surfaces.forces import CENTRE, COUNT, FACETS, HEAD, inputs_of, surfaces_of_craft
from femflex.effectors.surfaces.light import WIDTH, LightForce, light_on_facet
from femflex.effectors.surfaces.shadow import LIGHT, shadow
from femflex.effectors.surroundings.sun import Sun
from femflex.kernels.vectors import ZERO, add, cross, dot, load3, load9, scale, store3, turn, turn_back
from femflex.noun.values import Duration
from femflex.system.acting import ALONE, Context
from femflex.system.controller import Controller
from femflex.system.effector import Effector

SHADED = HEAD  # whether the lit parts of facets are among its inputs


class SolarPressure(LightForce, heading="solar_pressure"):
    """Pressure of sunlight on the surfaces of bodies."""

    sun: str = "sun"
    """The sun, a name in [surroundings]."""
    shadow_period: Duration | None = None
    """Time between two updates of the shadow that parts of the craft cast on one another. Default: no shadow."""

    label = "solar pressure"

    def sources(self, context: Context) -> tuple[str, ...]:
        """Direction to the sun, and pressure of its light."""
        return inputs_of(context, self.sun, Sun, ("x", "y", "z", "pressure"), "sun")

    def head(self, context: Context) -> ArrayLike:
        """Whether shadow counts."""
        return [float(self.shadow_period is not None), 0.0, 0.0, 0.0]

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector | Controller]:
        """One effector for each body, and where shadow counts the controller that finds the lit parts."""
        pushed = self.on_bodies(name, context)
        surfaces = surfaces_of_craft(context)
        if self.shadow_period is None or not all(surfaces.values()):  # a surface with mistakes reports them itself
            return pushed
        lit = self.chosen_bodies(surfaces)
        sampled = shadow(f"{name}_shadow", self.sun, self.shadow_period, surfaces, lit, context)
        numbers = iter(sampled.memory_names())
        counts = [LIGHT * sum(len(facets) for facets in surfaces[body].values()) for body in lit]
        inputs = [(*effector.inputs, *islice(numbers, n)) for effector, n in zip(pushed, counts, strict=True)]
        return [sampled, *(replace(effector, inputs=names) for effector, names in zip(pushed, inputs, strict=True))]


@SolarPressure.kernel
def solar_pressure(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: direction to the sun, and pressure of its light; where shadow counts LIGHT numbers per facet."""
    p = parameters
    m = int(p[COUNT])
    to_sun, pressure, power, at = load3(seen, 18 * m), seen[18 * m + 3], 0.0, 18 * m + 4
    for k in range(m):
        C = load9(seen, 3 * m + 9 * k)
        s, force, torque = turn_back(C, to_sun), ZERO, ZERO
        first, n = int(p[FACETS + 2 * k]), int(p[FACETS + 2 * k + 1])
        for i in range(n):
            f, centre = light_on_facet(s, p, first + WIDTH * i), load3(p, first + WIDTH * i + CENTRE)
            if p[SHADED] > 0.0:
                f, centre = scale(seen[at], f), add(centre, load3(seen, at + 1))
                at += LIGHT
            force, torque = add(force, f), add(torque, cross(centre, f))
        force, torque = turn(C, scale(pressure, force)), turn(C, scale(pressure, torque))
        store3(out, 3 * k, force)
        store3(out, 3 * m + 3 * k, torque)
        power += dot(force, load3(seen, 12 * m + 3 * k)) + dot(torque, load3(seen, 15 * m + 3 * k))
    out[6 * m] = out[6 * m + 1] = out[6 * m + 3] = 0.0
    out[6 * m + 2] = power
