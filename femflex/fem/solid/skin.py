"""Drawable surface of solid members: the faces that only one element has, cut into flat quadrilaterals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import SkinPart
from femflex.mesh.cells import CELL_TYPES

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Corners of the faces of a hexahedron, counterclockwise seen from outside.
FACES = np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]])


def solid_skin(points: Array, cells: dict[str, Index], numbering: Numbering) -> SkinPart:
    """Outer faces of hexahedra: four quads per face of a 27-node one, moved by its nodes."""
    quads = np.concatenate([_outer_quads(name, nodes) for name, nodes in cells.items()])
    nodes, corners = np.unique(quads, return_inverse=True)
    cols = numbering.translation_of(nodes)
    return SkinPart(
        points=points[nodes],
        cells={"quad": corners.reshape(-1, 4)},
        rows=np.arange(3 * len(nodes)),
        cols=cols.ravel(),
        values=np.ones(3 * len(nodes)),
    )


def _outer_quads(name: str, nodes: Index) -> Index:
    """Quadrilaterals (k, 4) of mesh nodes on the faces that occur once."""
    faces = nodes[:, FACES].reshape(-1, 4)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outer = np.sort(first[count == 1])
    element, face = outer // len(FACES), outer % len(FACES)
    tables = np.array([_face_quads(name, corners) for corners in FACES])  # (6, quads, 4)
    return np.take_along_axis(nodes[element], tables[face].reshape(len(outer), -1), axis=1).reshape(-1, 4)


def _face_quads(name: str, corners: Index) -> list[list[int]]:
    """A face as quadrilaterals of the element's own node numbers."""
    if CELL_TYPES[name].order == 1:
        return [corners.tolist()]
    middle = [_node_between(name, [a, b]) for a, b in zip(corners, np.roll(corners, -1), strict=True)]
    centre = _node_between(name, corners.tolist())
    return [[int(corners[i]), middle[i], centre, middle[i - 1]] for i in range(4)]


def _node_between(name: str, corners: list[int]) -> int:
    """The node at the mean position of corners of the reference cell."""
    places = CELL_TYPES[name].nodes
    distance = np.linalg.norm(places - places[corners].mean(axis=0), axis=1)
    return int(np.argmin(distance))
