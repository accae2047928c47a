"""A warning about second-order cells with curved sides, since plates use their corners only."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES, EDGES
from femflex.warning import PhysicsWarning

STRAIGHT = 1e-4  # distance of a middle node from the straight side, over its length, that passes for rounding


def warn_of_curved_sides(points: Array, cells: Mapping[str, IntArray], where: str) -> None:
    """Warn when middle nodes of cells (e, k) lie off the straight sides of the elements, with the largest distance.

    points (n_p, 3) [m].
    """
    distances = [_off_sides(points, nodes, name) for name, nodes in cells.items() if CELL_TYPES[name].order == 2]
    if not distances:
        return
    distance, length = (np.concatenate(part) for part in zip(*distances, strict=True))
    curved = distance > STRAIGHT * length
    if not curved.any():
        return
    worst = int(np.argmax(distance / length))
    warnings.warn(
        PhysicsWarning(
            "{body_or_joint}: {curved} of {count} sides of its second-order cells are curved, and the elements have "
            "straight ones between the corners: the worst middle node lies {distance:.3g} m off a side of {length:.3g} "
            "m ({value:.2%}; at most {limit:.2%} counts as straight).",
            body_or_joint=where,
            value=distance[worst] / length[worst],
            limit=STRAIGHT,
            remedy="Refine the mesh: refine = 1 makes corners of the middle nodes and divides the distance by 4",
            curved=int(curved.sum()),
            count=len(curved),
            distance=distance[worst],
            length=length[worst],
        ),
        stacklevel=5,
    )


def _off_sides(points: Array, nodes: IntArray, name: str) -> tuple[Array, Array]:
    """Distances (k,) of the middle nodes of cells (e, n) from the straight lines between corners, and their lengths."""
    cell = CELL_TYPES[name]
    first, last = (points[nodes[:, [edge[end] for edge in EDGES[cell.shape]]]] for end in (0, 1))
    middle = points[nodes[:, cell.n_corners : cell.n_corners + len(EDGES[cell.shape])]]
    chord, to_middle = last - first, middle - first
    length = np.linalg.norm(chord, axis=2)
    safe = np.where(length > 0, length, 1.0)
    return (np.linalg.norm(np.cross(chord, to_middle), axis=2) / safe).ravel(), safe.ravel()
