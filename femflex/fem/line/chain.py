"""Line cells as straight elements, the arc length along their chains, and points that stand for their sections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import Array, IntArray

if TYPE_CHECKING:
    from femflex.mesh import Mesh

PARALLEL = 1e-3  # sine of the angle below which an element counts as parallel to a reference direction
LINE_TYPES = ("line", "line3")


def straight_elements(cells: dict[str, IntArray]) -> IntArray:
    """Numbers (e, 2) of the end nodes of the straight elements that line cells stand for; line3 is two, joined at its
    middle node."""
    line, line3 = cells.get("line", np.zeros((0, 2), np.int64)), cells.get("line3", np.zeros((0, 3), np.int64))
    return np.concatenate([line, line3[:, [0, 2, 2, 1]].reshape(-1, 2)])


def arc_excess(points: Array, line3: IntArray) -> float:
    """Relative length by which the arcs through the three points of line3 cells (n, 3) [m] exceed their chords."""
    a, b, c = (points[line3[:, k]] for k in range(3))
    chords = np.stack([np.linalg.norm(c - a, axis=1), np.linalg.norm(b - c, axis=1)])
    across = np.linalg.norm(np.cross(c - a, b - c), axis=1)
    curvature = 2 * across / (chords.prod(axis=0) * np.linalg.norm(b - a, axis=1))  # of the circle through the points
    angle = np.arcsin(np.minimum(chords * curvature / 2, 1.0))  # half of that which a chord spans
    arcs = chords / np.sinc(angle / np.pi)
    return float(arcs.sum() / chords.sum() - 1)


def element_frames(start: Array, end: Array, orientation: Array | None, group: str) -> tuple[Array, Array]:
    """Lengths (e,) and frames (e, 3, 3) of elements from start to end (e, 3); rows of a frame are its x, y, z axes.

    x runs along the element. With an orientation vector, y is that vector made normal to x. Without, z points as
    nearly as it can along the mesh's z axis; elements parallel to that axis take y along the mesh's y axis.
    Raises ValueError on elements of no length and on an orientation parallel to an element.
    """
    length = np.linalg.norm(end - start, axis=1)
    scale = max(1.0, float(np.abs(start).max(initial=0.0)))
    if (length <= 1e-12 * scale).any():
        first = int(np.argmin(length))
        raise ValueError(
            f"group {group!r} has {int((length <= 1e-12 * scale).sum())} line cells of no length, the first is cell "
            f"{first} at ({', '.join(f'{c:.6g}' for c in start[first])}) m; join its two nodes or take it out"
        )
    x = (end - start) / length[:, None]
    if orientation is None:
        y = np.cross([0.0, 0.0, 1.0], x)
        vertical = np.linalg.norm(y, axis=1) < PARALLEL
        y[vertical] = [0.0, 1.0, 0.0]
    else:
        y = np.broadcast_to(orientation, x.shape)
    y = y - np.einsum("ei,ei->e", y, x)[:, None] * x
    size = np.linalg.norm(y, axis=1)
    parallel = size < PARALLEL * (1.0 if orientation is None else np.linalg.norm(orientation))
    if orientation is not None and parallel.any():
        raise ValueError(
            f"orientation {orientation.tolist()} is parallel to {int(parallel.sum())} of the {len(x)} elements of "
            f"group {group!r}; give a vector that points across them"
        )
    y = y / size[:, None]
    return length, np.stack([x, y, np.cross(x, y)], axis=1)


def straight_frame(root: ArrayLike, direction: ArrayLike, orientation: ArrayLike | None) -> Array:
    """Axes (3, 3) of a straight beam from its root (3,) [m] along a direction, as `element_frames` has them."""
    start = np.asarray(root, float)
    end = start + np.asarray(direction, float)
    vector = None if orientation is None else np.asarray(orientation, float)
    return element_frames(start[None], end[None], vector, "beam")[1][0]


@dataclass(frozen=True, eq=False)
class ArcLength:
    """Arc length of elements along their chain: at both ends (e, 2), and of the whole chain (e,) [m]."""

    ends: Array
    whole: Array

    def arc_at(self, xi: Array) -> Array:
        """Arc lengths (e, q) at positions xi (q,) in [0, 1] of every element."""
        return self.ends[:, :1] * (1 - xi) + self.ends[:, 1:] * xi


def arc_length(mesh: Mesh, elements: IntArray, group: str, start: str | None) -> ArcLength:
    """Arc length [m] along the chains that elements (e, 2) form, from the points of group `start`.

    Without `start` a chain begins at the end from which its cells point away (the first node of an end cell; of two
    such ends, the one with the lower point number). Raises ValueError on branches, on closed chains without a start,
    and on chains that no start, or more than one, lies on.
    """
    nodes, local = np.unique(elements, return_inverse=True)
    local = local.reshape(-1, 2)
    length = np.linalg.norm(mesh.points[elements[:, 1]] - mesh.points[elements[:, 0]], axis=1)
    graph = sparse.coo_array((length, (local[:, 0], local[:, 1])), shape=(nodes.size, nodes.size)).tocsr()
    degree = np.bincount(local.ravel(), minlength=nodes.size)
    if degree.max() > 2:
        raise ValueError(
            f"group {group!r} branches at {int((degree > 2).sum())} of its nodes, so it has no arc length for "
            "properties that vary along it; make each branch a group and a member of its own"
        )
    n_chains, chain = csgraph.connected_components(graph, directed=False)
    if start is None:
        begins = _free_ends(local, degree, chain)
    else:
        begins = np.flatnonzero(np.isin(nodes, mesh.group_points(start)))
    per_chain = np.bincount(chain[begins], minlength=n_chains)
    if (per_chain != 1).any():
        raise ValueError(
            f"the {n_chains} chains of group {group!r} have {per_chain.tolist()} points where the arc length may "
            'start; name one point of each in a point group and give it as the option "start"'
        )
    s = csgraph.dijkstra(graph, directed=False, indices=begins, min_only=True)
    chain_length = np.zeros(n_chains)
    np.maximum.at(chain_length, chain, s)
    return ArcLength(s[local], chain_length[chain[local[:, 0]]])


def _free_ends(local: IntArray, degree: IntArray, chain: NDArray[np.int32]) -> IntArray:
    """One end node of each open chain: where a cell begins rather than stops, then the lowest number."""
    ends = np.flatnonzero(degree == 1)
    begins = np.isin(ends, local[:, 0])
    ordered = ends[np.lexsort((ends, ~begins, chain[ends]))]
    return ordered[np.unique(chain[ordered], return_index=True)[1]].astype(np.int64)


def section_points(rz2: Array, ry2: Array, rotary: bool = True, product: Array | None = None) -> tuple[Array, Array]:
    """Offsets (..., k, 3) from the line in axes of the section, x along the beam, and their shares of its mass (k,).

    rz2, ry2 (...): squared radii of gyration, int y^2 dm and int z^2 dm per mass [m^2]; product: int y z dm per mass.

    Four points at (+-sqrt(2) rz, 0) and (0, +-sqrt(2) ry) have these moments. Without rotary the section has no inertia
    in bending, but still p = ry2 + rz2 in twist: int o o^T dm = p/2 diag(-1, 1, 1), the inertia diag(p, 0, 0), by
    points on all three axes, those along x with negative mass. Rigid rotations of the body and elastic slopes then both
    have no rotary inertia; without it for slopes only, the two would differ in mass.
    """
    o = np.zeros_like(rz2)
    if rotary and product is not None:
        moments = np.stack([np.stack([rz2, product], axis=-1), np.stack([product, ry2], axis=-1)], axis=-2)
        value, axes = np.linalg.eigh(moments)
        arms = np.sqrt(2 * np.maximum(value, 0.0))[..., None, :] * axes  # columns: the two principal arms
        flat = [(o, sign * arms[..., 0, k], sign * arms[..., 1, k]) for k in (0, 1) for sign in (1, -1)]
        share = np.full(4, 0.25)
    elif rotary:
        a, b = np.sqrt(2 * rz2), np.sqrt(2 * ry2)
        flat = [(o, a, o), (o, -a, o), (o, o, b), (o, o, -b)]
        share = np.full(4, 0.25)
    else:
        a = np.sqrt((rz2 + ry2) / 2)
        flat = [(a, o, o), (-a, o, o), (o, a, o), (o, -a, o), (o, o, a), (o, o, -a)]
        share = np.array([-0.5, -0.5, 0.5, 0.5, 0.5, 0.5])
    return np.stack([np.stack(point, axis=-1) for point in flat], axis=-2), share
