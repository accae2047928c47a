"""Patches of a body's surface or line, over which forces are spread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array


@dataclass(frozen=True, eq=False)
class Patches:
    """Patches of a group of a body, each with a marker of the body that moves and turns as the patch does on average.

    dimension  1: lines, 2: surfaces
    size       (k,)    length [m] or area [m^2] of each
    normal     (k, 3)  area as a vector [m^2], or length along the tangent [m], body frame; shorter of a curved patch
    aligned    whether the normals of cells with a common side lie on one side of the surface
    solid      whether they are faces of solids, whose normals point outwards
    outlines   (k,) of each patch the corners (c, 4, 3) of its cells, body frame [m]; the last is repeated where a cell
               has fewer than four; not known of a patch without

    The marker of patch k of a group is `patch_marker(group, k)`, and that of the whole group, which moves as its mean
    and turns as the body frame, `patch_marker(group)`. Markers whose names begin with "." are not reported.
    """

    dimension: int
    size: Array
    normal: Array
    aligned: bool = True
    solid: bool = False
    outlines: tuple[Array, ...] = ()


def patch_marker(group: str, k: int | None = None) -> str:
    """Name of the marker of patch k of a group, or of the group as a whole."""
    return f".{group}" if k is None else f".{group}.{k}"


FLAT, MOST = 8, 64  # patches of a flat group, and most of a curved one
TURN = 0.35  # difference of unit normals in one patch, above which it is halved


def clusters(points: Array, normals: Array) -> list[np.ndarray]:
    """Numbers of cells with points (c, 3) [m] and unit normals (c, 3), in clusters of neighbours.

    The largest cluster is halved until there are 8, and on, up to 64, while normals in one differ by more than 20
    degrees. Size counts in parts of the whole extent; normals at right angles are as far apart as the ends. The force
    that follows a plate bent by 15 % of its length is then right to 2e-3.
    """
    extent = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
    features = np.hstack([points / extent, normals / np.sqrt(2.0)])
    parts, spans = [np.arange(len(points))], [np.ptp(features, axis=0)]
    while len(parts) < MOST:
        sizes = [float(span.max() if len(parts) < FLAT else span[3:].max()) for span in spans]
        k = int(np.argmax(sizes))
        cells, span = parts[k], spans[k]
        if len(cells) == 1 or not sizes[k] > 0.0 or (len(parts) >= FLAT and sizes[k] * np.sqrt(2.0) < TURN):
            break
        order = cells[np.argsort(features[cells, int(np.argmax(span))], kind="stable")]
        halves = [order[: len(order) // 2], order[len(order) // 2 :]]
        parts[k : k + 1] = halves
        spans[k : k + 1] = [np.ptp(features[half], axis=0) for half in halves]
    return parts
