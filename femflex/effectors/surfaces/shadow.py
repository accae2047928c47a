"""Shadow of the parts of a craft on one another: the lit share and the lit centre of each facet, sampled.

At each sample the outlines of all surfaces stand where their markers carry them, each patch rigidly. Along the sun
their lit parts are exact (`visibility`). Light is parallel, so there is no penumbra. Tubes are strips across the light.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body import Marker
from femflex.effectors.noun import whole_body
from femflex.effectors.surfaces.surface import FLAT, Facet
from femflex.kernels.visibility import axes_across, lit_moments
from femflex.rotations import dcm_from_quaternion, dcm_from_vector
from femflex.system.acting import Context
from femflex.system.controller import Controller

LIGHT = 4  # numbers of a facet: the share that is lit, and its centre from that of the whole facet, axes of the marker
WHOLE = (1.0, 0.0, 0.0, 0.0)  # of a facet that is lit
RIGID = np.zeros(0)  # amplitudes of a body without shapes
Facets = Mapping[str, Sequence[Facet]]  # marker -> facets that move with it


class PlacedFacet(NamedTuple):
    """A facet, the numbers of its marker and its body, and whether light acts on it."""

    facet: Facet
    marker: int
    body: int
    lit: bool


def shadow(
    name: str, sun: str, period: float, surfaces: Mapping[str, Facets], lit: Sequence[str], context: Context
) -> Controller:
    """The controller of that name, whose memory holds LIGHT numbers for each facet of the bodies that are lit.

    sun       name of the sun
    period    between two updates [s]
    surfaces  body -> its facets, which cast shadow
    lit       bodies on which light acts, in the order of the memory
    Its commands are the lit shares of the area of each of these bodies, as seen from the sun.
    """
    order = [*lit, *(body for body in surfaces if body not in lit)]
    markers = [[whole_body(context, body).marker(marker) for marker in surfaces[body]] for body in order]
    carried = [
        PlacedFacet(facet, marker, b, b < len(lit))
        for marker, (b, facets) in enumerate(
            (b, facets) for b in range(len(order)) for facets in surfaces[order[b]].values()
        )
        for facet in facets
    ]
    outlines = outlines_of(carried)
    lit_facets = [each for each in carried if each.lit]
    marker_of, body_of = (np.array([getattr(each, key) for each in lit_facets]) for key in ("marker", "body"))
    first, n = np.unique(body_of, return_index=True)[1], len(lit_facets)
    to_sun = [f"effectors/{sun}/{axis}" for axis in "xyz"]
    keys = {body: ("position", "attitude", "delta")[: 3 if whole_body(context, body).n_shapes else 2] for body in order}
    motion = [tuple(f"bodies/{body}/{key}" for key in keys[body]) for body in order]

    def law(t: float, seen: Mapping[str, Array], memory: Array) -> tuple[Array, Array]:
        E = axes_across(np.array([seen[path] for path in to_sun]))
        moved = [marker_motion(m, *(seen[path] for path in paths)) for m, paths in zip(markers, motion, strict=True)]
        place, C = (np.concatenate(parts) for parts in zip(*moved, strict=True))
        whole, part = lit_moments(*outlines, E @ C, place @ E.T, n).swapaxes(0, 1)
        shaded, dark = part[:, 0] < whole[:, 0], part[:, 0] <= 0.0
        share = np.where(shaded, part[:, 0] / np.where(shaded, whole[:, 0], 1.0), 1.0)
        centres = [rows[:, 1:] / np.where(dark, 1.0, rows[:, 0])[:, None] for rows in (part, whole)]
        aside = np.where((shaded & ~dark)[:, None], centres[0] - centres[1], 0.0) @ E
        light = np.column_stack([share, np.einsum("kji,kj->ki", C[marker_of], aside)])
        of_part, of_whole = np.add.reduceat(np.stack([part[:, 0], whole[:, 0]]), first, axis=1)
        return np.where(of_whole > 0.0, of_part / np.where(of_whole > 0.0, of_whole, 1.0), 1.0), light.ravel()

    sensors = (*to_sun, *(path for paths in motion for path in paths))
    commands = {f"lit_{body}": "1" for body in lit}
    return Controller(name, law, period, sensors, commands, np.tile(WHOLE, n), np.ones(len(lit)), follows=True)


def outlines_of(carried: Sequence[PlacedFacet]) -> tuple[Array, Array, Array, IntArray]:
    """Outlines, radius, gaps and numbers of facets, those that are lit first, as `lit_parts` takes them."""
    counts = [len(each.facet.outlines) for each in carried]
    radius = [0.0 if each.facet.form == FLAT else each.facet.gap for each in carried]
    numbers = [
        (each.marker, k if each.lit else -1, each.body, each.facet.back is None and each.facet.form == FLAT)
        for k, each in enumerate(carried)
    ]
    return (
        np.concatenate([each.facet.outlines for each in carried]),
        np.repeat(radius, counts),
        np.repeat([each.facet.gap for each in carried], counts),
        np.repeat(np.array(numbers, np.int64), counts, axis=0),
    )


def marker_motion(markers: Sequence[Marker], r: Array, q: Array, delta: Array = RIGID) -> tuple[Array, Array]:
    """Place (m, 3) and C_NM (m, 3, 3), inertial components, of markers of one body.

    r (3,) [m], q (4,) = q_BN: its place and attitude; delta (n,): amplitudes of its shapes, none of a rigid body
    """
    C = dcm_from_quaternion(q)
    place = np.stack([marker.position + marker.phi @ delta for marker in markers])
    turn = dcm_from_vector(np.stack([marker.rotation_vector(delta) for marker in markers]))
    return r + place @ C.T, C @ turn @ np.stack([marker.orientation for marker in markers])
