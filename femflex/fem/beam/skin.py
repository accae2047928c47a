"""The drawable surface of beams: the section's outline swept along every element, closed at free ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.family import SkinPart
from femflex.fem.sections.section import Section

if TYPE_CHECKING:
    from femflex.fem.beam.elements import BeamElements


def swept_outline(elements: BeamElements, section: Section, centre: Array) -> SkinPart:
    """Surface of a member's elements: quads between order + 2 stations per element, triangles over its ends.

    centre (2,) [m]: y and z of the outline's origin from the node line. Points move with their section, u + theta x
    offset; a bent element is drawn bent.
    """
    n_stations = elements.order.bending + 2
    xi = np.linspace(0.0, 1.0, n_stations)
    outline = section.outline(elements.arc.arc_at(xi), elements.arc.whole[:, None])
    n_elements, _, n_corners, _ = outline.points.shape
    number = np.arange(n_elements * n_stations * n_corners).reshape(n_elements, n_stations, n_corners)
    offsets = np.concatenate([np.zeros((*outline.points.shape[:3], 1)), outline.points + centre], axis=-1)
    motion = elements.motion(xi, offsets).reshape(number.size * 3, -1)
    rows, local = np.nonzero(motion)
    element = rows // (3 * n_stations * n_corners)
    return SkinPart(
        points=elements.positions(xi, offsets).reshape(-1, 3),
        cells={"quad": _sides(number), "triangle": _caps(number, outline.triangles, elements.dofs)},
        rows=rows,
        cols=elements.dofs[element, local],
        values=motion[rows, local],
    )


def _sides(number: IntArray) -> IntArray:
    """Quads (n, 4) between neighbouring stations, outward."""
    around = np.roll(number, -1, axis=2)
    return np.stack([number[:, :-1], around[:, :-1], around[:, 1:], number[:, 1:]], axis=-1).reshape(-1, 4)


def _caps(number: IntArray, triangles: IntArray, dofs: IntArray) -> IntArray:
    """Triangles (n, 3) over element ends that no other element of the member continues, outward."""
    ends = dofs[:, [0, 6]]  # one dof identifies the node
    _, node, count = np.unique(ends, return_inverse=True, return_counts=True)
    free = count[node.reshape(-1, 2)] == 1
    first, last = number[free[:, 0], 0], number[free[:, 1], -1]
    return np.concatenate([first[:, triangles[:, ::-1]].reshape(-1, 3), last[:, triangles].reshape(-1, 3)])
