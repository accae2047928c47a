"""Light on facets: the force per pressure of its rays, by the sides of a surface after deformation (THEORY section 8).

With the unit vectors s to the source and n along the normal of the lit side, c = n.s > 0, a facet of area A feels

    F = -P A c [ (1 - specular) s + 2 (specular c + diffuse / 3) n ]
        -P A c (1 - specular - diffuse) 2/3 (eps - eps') / (eps + eps') n

the second row for a film of which both sides radiate the absorbed heat away, with emissivities eps of the lit side and
eps' of the other. Over the lit half of a tube of radius r and length L, u the unit vector across it in the plane of s
and S = |s across|,

    F = -P r L S [ 2 (1 - specular) s + (8/3 specular S + pi/3 diffuse) u ]
"""

from __future__ import annotations

import math

from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.effectors.surfaces.forces import FORM, NORMAL, REST, SIZE, SurfaceForce
from femflex.effectors.surfaces.surface import Facet
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import ZERO, Vector, add, dot, load3, scale, sub

SIDE = 3  # numbers of a side: specular, diffuse, recoil of the heat radiation per absorbed light; back: -1 where none
WIDTH = REST + 2 * SIDE


class LightForce(SurfaceForce):
    """A force of light on the surfaces of bodies."""

    def facet_numbers(self, facet: Facet) -> ArrayLike:
        """Both sides; a back that is not exposed has -1."""
        front, back = facet.front, facet.back
        if back is None:
            return [front.specular, front.diffuse, 0.0, -1.0, 0.0, 0.0]
        total = front.emissivity + back.emissivity
        recoil = 2.0 / 3.0 * (front.emissivity - back.emissivity) / total if total > 0.0 else 0.0
        return [front.specular, front.diffuse, recoil, back.specular, back.diffuse, -recoil]


@inner
def light_on_facet(s: Vector, p: Array, first: int) -> Vector:
    """Force on a facet per pressure of the light, in the axes of its marker, s to its source."""
    n, size = load3(p, first + NORMAL), p[first + SIZE]
    c = dot(n, s)
    side = first + REST
    if p[first + FORM] > 0.0:
        across = sub(s, scale(c, n))
        S = math.sqrt(dot(across, across))
        if S == 0.0:
            return ZERO
        along = size * S
        both = 8.0 / 3.0 * p[side] * S + math.pi / 3.0 * p[side + 1]
        return add(scale(-2.0 * along * (1.0 - p[side]), s), scale(-along * both / S, across))
    if c < 0.0:
        side, n, c = side + SIDE, scale(-1.0, n), -c
        if p[side] < 0.0:
            return ZERO
    specular, diffuse = p[side], p[side + 1]
    along_n = 2.0 * (specular * c + diffuse / 3.0) + (1.0 - specular - diffuse) * p[side + 2]
    return add(scale(-size * c * (1.0 - specular), s), scale(-size * c * along_n, n))
