"""The Earth as a disc of parts in the sky of a craft, for its radiation (`femflex.effectors.surfaces.earth_radiation`).

The disc is taken in RINGS rings, at Gauss nodes of the cosine of the angle from the nadir, of SECTORS sectors each.
"""

from __future__ import annotations

import math

from femflex.kernels.compiled import inner
from femflex.kernels.vectors import Vector, add, cross, dot, scale

NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263)  # Gauss, from 0 to 1
WEIGHTS = (0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692)
RINGS, SECTORS = len(NODES), 8


@inner
def disc_axes(place: Vector, velocity: Vector) -> tuple[Vector, Vector, Vector]:
    """Unit vectors up, ahead and along the orbit's normal."""
    up, normal = scale(1.0 / math.sqrt(dot(place, place)), place), cross(place, velocity)
    normal = scale(1.0 / math.sqrt(dot(normal, normal)), normal)
    return up, cross(normal, up), normal


@inner
def disc_part(
    ring: int, sector: int, place: Vector, radius: float, axes: tuple[Vector, Vector, Vector]
) -> tuple[Vector, Vector, float]:
    """Direction to a part of the disc, the normal of the ground there, and its solid angle over pi."""
    up, ahead, normal = axes
    r = math.sqrt(dot(place, place))
    limb = math.sqrt(1.0 - (radius / r) ** 2)  # cosine of its angle from the nadir
    mu = limb + (1.0 - limb) * NODES[ring]
    sine = math.sqrt(1.0 - mu * mu)
    distance = r * mu - math.sqrt(radius * radius - (r * sine) ** 2)
    angle = 2.0 * math.pi * (sector + 0.5 * (ring % 2)) / SECTORS
    level = add(scale(math.cos(angle), ahead), scale(math.sin(angle), normal))
    direction = add(scale(-mu, up), scale(sine, level))
    ground = scale(1.0 / radius, add(place, scale(distance, direction)))
    return direction, ground, 2.0 * (1.0 - limb) * WEIGHTS[ring] / SECTORS
