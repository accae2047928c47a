"""Surfaces of bodies as flat facets and tubes that move with markers, for forces of light and air.

A flexible body's surface is a group of its mesh: patches, each flat and turned as it is on average, or lengths
of tube of a group of lines. A rigid body's surface is that of its shapes, whose facets move with one marker; facets in
one plane, of one kind, are one facet.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.body import FlexibleBody, Skin
from femflex.body.patches import patch_marker
from femflex.effectors.noun import EffectorNoun, whole_body
from femflex.effectors.surfaces.materials import CATALOGUE, Optical, SideProperties
from femflex.noun.problems import suggestion_text
from femflex.noun.table import refuse
from femflex.noun.values import Quantity
from femflex.system.acting import ALONE, Context
from femflex.system.controller import Controller
from femflex.system.effector import Effector

FLAT, TUBE = 0.0, 1.0
NEIGHBOURS = 0.01  # of the side of a patch: how far the edges of two of them on a bent panel may be apart
SAME = 1e-6  # difference of normals, and of distances over the extent, of facets in one plane


@dataclass(frozen=True, eq=False)
class Facet:
    """A flat facet, or a length of tube, in axes of its marker.

    area    (3,) vector [m^2] along the normal of the front; of a tube its axis, times length and radius
    centre  (3,) from the marker [m]
    front, back   properties of its sides; None: a side that is not exposed
    outlines      (c, 4, 3) corners from the marker [m] of the cells that it consists of, the last repeated where a cell
                  has fewer than four; of a tube the ends of its lines, the second repeated
    gap           distance from its plane up to which its own body does not shade it, as the edges of patches on a bent
                  panel do not quite meet; of a tube its radius [m]
    """

    form: float
    area: Array
    centre: Array
    front: SideProperties
    back: SideProperties | None
    outlines: Array
    gap: float = 0.0


class Surface(EffectorNoun, heading="surfaces"):
    """The surface of a body, on which light and air act."""

    body: str
    """Body of the surface."""
    group: str | None = None
    """Group of surfaces, or of lines, of a body with a mesh. Default: "all". A rigid body has the surface of its
    shapes."""
    front: str | Optical = "black"
    """Properties of the side of the normals, by a name of the catalogue or as a table."""
    back: str | Optical | None = None
    """Properties of the other side. Default: those of the front for a group of surfaces; a closed body has none."""
    diameter: Annotated[float, Quantity("m", above=0.0)] | None = None
    """Diameter of the tubes of a group of lines."""

    label = "surface"
    n_markers = 0
    exerts = ()

    @model_validator(mode="after")
    def _known_materials(self) -> Surface:
        for key in ("front", "back"):
            value = getattr(self, key)
            if isinstance(value, str) and value not in CATALOGUE:
                refuse(f"found {key} = {value!r}, which is not in the catalogue; {suggestion_text(value, CATALOGUE)}")
        return self

    def needed_patches(self) -> tuple[tuple[str, str], ...]:
        """(body, group) of its patches."""
        return ((self.body, self.group or "all"),)

    def effectors(self, name: str, context: Context = ALONE) -> tuple[Effector | Controller, ...]:
        """No effector: forces refer to it. Raises ValueError for a body without such a surface."""
        self.facets(context)
        return ()

    def facets(self, context: Context) -> dict[str, list[Facet]]:
        """Marker of the body -> the facets that move with it. Raises ValueError."""
        body = whole_body(context, self.body)
        front, back = _side_properties(self.front), None if self.back is None else _side_properties(self.back)
        self._check_alone(context)
        if not body.n_shapes:
            extra = next((key for key in ("group", "diameter") if getattr(self, key) is not None), None)
            if extra is not None:
                raise ValueError(
                    f"found {extra} = {getattr(self, extra)!r}, and body {self.body!r} is rigid: its surface is that "
                    f"of its shapes; leave {extra} out"
                )
            return {"origin": list(_facets_of_skin(self.body, body, front))}
        patches = body.patches.get(self.group or "all")
        if patches is None:
            raise ValueError(
                f"body {self.body!r} has no patches of group {self.group or 'all'!r}; surfaces are those of bodies "
                "with a mesh, of beams on admissible functions, and of rigid bodies with shapes"
            )
        if (patches.dimension == 1) != (self.diameter is not None):
            text = "lines; give their diameter" if patches.dimension == 1 else "surfaces, which have no diameter"
            raise ValueError(f"group {self.group or 'all'!r} of body {self.body!r} consists of {text}")
        out = {}
        for k, outlines in enumerate(patches.outlines):
            marker = patch_marker(self.group or "all", k)
            at, normal = outlines - body.marker(marker).position, patches.normal[k]
            if self.diameter is not None:
                radius = self.diameter / 2
                out[marker] = [Facet(TUBE, normal * radius, np.zeros(3), front, None, at, radius)]
            else:
                gap = NEIGHBOURS * math.sqrt(patches.size[k])
                other = back if back or patches.solid else front
                out[marker] = [Facet(FLAT, normal, np.zeros(3), front, other, _counter_clockwise(at, normal), gap)]
        return out

    def _check_alone(self, context: Context) -> None:
        """Raise ValueError where another surface has the same part of the body, on which forces would act twice."""
        for name, other in context.nouns.items():
            if isinstance(other, Surface) and other is not self and other.body == self.body:
                if "all" in (mine := self.group or "all", its := other.group or "all") or mine == its:
                    raise ValueError(
                        f"body {self.body!r} has two surfaces, also {name!r} of group {its!r}, so that forces would "
                        "act twice; give each a group of its own"
                    )


def _side_properties(value: str | Optical) -> SideProperties:
    return (
        CATALOGUE[value] if isinstance(value, str) else SideProperties(value.specular, value.diffuse, value.emissivity)
    )


def _facets_of_skin(name: str, body: FlexibleBody, front: SideProperties) -> Iterator[Facet]:
    """The facets of a rigid body's skin, those in one plane as one."""
    skin = body.skin or Skin(np.zeros((0, 3)), {}, np.zeros((0, 0, 3)))
    areas, centres, outlines = np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 4, 3))
    for kind, cells in skin.cells.items():
        if kind in ("triangle", "quad"):
            x = skin.points[cells]
            fans = [(x[:, 0], x[:, k], x[:, k + 1]) for k in range(1, x.shape[1] - 1)]
            parts = [np.cross(b - a, c - a) / 2 for a, b, c in fans]
            size = [np.linalg.norm(part, axis=1)[:, None] for part in parts]
            middle = sum(s * (a + b + c) / 3 for s, (a, b, c) in zip(size, fans, strict=True)) / sum(size)
            areas, centres = np.concatenate([areas, sum(parts)]), np.concatenate([centres, middle])
            outlines = np.concatenate([outlines, x[:, np.minimum(np.arange(4), x.shape[1] - 1)]])
    if not len(areas):
        raise ValueError(f"rigid body {name!r} has no surface; give it shapes, such as a box or a cylinder")
    if (
        np.linalg.norm(areas.sum(axis=0)) < 1e-6 * np.linalg.norm(areas, axis=1).sum()
        and np.einsum("ka,ka->", areas, centres) < 0
    ):
        areas = -areas  # a closed body whose normals point inwards
    sizes = np.linalg.norm(areas, axis=1)
    extent = float(np.ptp(centres, axis=0).max()) or 1.0
    normals = areas / sizes[:, None]
    key = np.column_stack([normals, np.einsum("ka,ka->k", normals, centres) / extent])
    _, plane = np.unique(np.round(key / SAME / 10.0).astype(np.int64), axis=0, return_inverse=True)
    for k in range(int(plane.max()) + 1):
        rows = plane.ravel() == k
        area, centre = areas[rows].sum(axis=0), sizes[rows] @ centres[rows] / sizes[rows].sum()
        yield Facet(FLAT, area, centre, front, None, _counter_clockwise(outlines[rows], area))


def _counter_clockwise(outlines: Array, area: Array) -> Array:
    """Outlines (c, 4, 3) in planes, which run counter-clockwise seen from the side of the area; warped ones halved."""
    normal = np.cross(outlines[:, 2] - outlines[:, 0], outlines[:, 3] - outlines[:, 1])
    warp = np.abs(np.einsum("ca,ca->c", normal, outlines[:, 1] - outlines[:, 0]))
    warped = warp > SAME * np.linalg.norm(normal, axis=1) ** 1.5
    halves = outlines[warped][:, [[0, 1, 2, 2], [0, 2, 3, 3]]].reshape(-1, 4, 3)
    outlines = np.concatenate([outlines[~warped], halves])
    normal = np.cross(outlines[:, 2] - outlines[:, 0], outlines[:, 3] - outlines[:, 1])
    away = normal @ area < 0.0
    outlines[away] = outlines[away][:, ::-1]
    return outlines
