"""Surfaces of bodies as flat facets and tubes that move with markers, for forces of light and air.

A flexible body's surface is a group of its mesh: patches, each flat and turned as it is on average, or lengths
of tube of a group of lines. A rigid body's surface is that of its shapes, whose facets move with one marker; facets in
one plane, of one kind, are one facet.
"""

from __future__ import annotations

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
SAME = 1e-6  # difference of normals, and of distances over the extent, of facets in one plane


@dataclass(frozen=True, eq=False)
class Facet:
    """A flat facet, or a length of tube, in axes of its marker.

    area    (3,) vector [m^2] along the normal of the front; of a tube its axis, times length and radius
    centre  (3,) from the marker [m]
    front, back   properties of its sides; None: a side that is not exposed
    """

    form: float
    area: Array
    centre: Array
    front: SideProperties
    back: SideProperties | None


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
        if not body.n_shapes:
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
        for k in range(len(patches.size)):
            marker = patch_marker(self.group or "all", k)
            if self.diameter is not None:
                axis = patches.normal[k] * self.diameter / 2
                out[marker] = [Facet(TUBE, axis, np.zeros(3), front, None)]
            else:
                out[marker] = [
                    Facet(FLAT, patches.normal[k], np.zeros(3), front, back if back or patches.solid else front)
                ]
        return out


def _side_properties(value: str | Optical) -> SideProperties:
    return (
        CATALOGUE[value] if isinstance(value, str) else SideProperties(value.specular, value.diffuse, value.emissivity)
    )


def _facets_of_skin(name: str, body: FlexibleBody, front: SideProperties) -> Iterator[Facet]:
    """The facets of a rigid body's skin, those in one plane as one."""
    skin = body.skin or Skin(np.zeros((0, 3)), {}, np.zeros((0, 0, 3)))
    areas, centres = np.zeros((0, 3)), np.zeros((0, 3))
    for kind, cells in skin.cells.items():
        if kind in ("triangle", "quad"):
            x = skin.points[cells]
            fans = [(x[:, 0], x[:, k], x[:, k + 1]) for k in range(1, x.shape[1] - 1)]
            parts = [np.cross(b - a, c - a) / 2 for a, b, c in fans]
            size = [np.linalg.norm(part, axis=1)[:, None] for part in parts]
            middle = sum(s * (a + b + c) / 3 for s, (a, b, c) in zip(size, fans, strict=True)) / sum(size)
            areas, centres = np.concatenate([areas, sum(parts)]), np.concatenate([centres, middle])
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
        yield Facet(FLAT, areas[rows].sum(axis=0), sizes[rows] @ centres[rows] / sizes[rows].sum(), front, None)
