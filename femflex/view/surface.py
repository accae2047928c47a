"""Surface of a body's skin for drawing: merged, oriented, with normals and edges that follow the deformation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from femflex.arrays import Array, BoolArray, IntArray
from femflex.body import Skin

Single = NDArray[np.float32]

CORNERS = {
    "vertex": 1,
    "line": 2,
    "line3": 2,
    "triangle": 3,
    "triangle6": 3,
    "triangle7": 3,
    "quad": 4,
    "quad8": 4,
    "quad9": 4,
}
FEATURE_ANGLE = np.deg2rad(50.0)  # sharper edges are drawn and split the shading; tubes have at least 8 sides
VISIBLE = 4.0  # pixels; narrower bodies are drawn with thick lines
MESH_LINE_GAP = 4.0  # pixels between mesh lines that are drawn; nearer ones would darken the surface
SLENDER = 0.4  # second over first extent of a part below which it has an axis
MERGE = 1e-7  # of the size: points nearer than this that move alike are one


@dataclass(frozen=True, eq=False)
class Points:
    """Points that move with the elastic coordinates: at rest (n_p, 3) [m], shapes (n, n_p, 3), numbers on the skin.

    grows: whether the last shape is the growth of a body that deploys, which is no displacement.
    """

    reference: Single
    shapes: Single
    numbers: IntArray
    grows: bool = False

    @classmethod
    def from_skin(cls, skin: Skin, numbers: IntArray) -> Points:
        """The points (k, 3) [m] of these numbers (k,) of a skin."""
        return cls(
            skin.points[numbers].astype(np.float32),
            skin.shapes[:, numbers].astype(np.float32),
            numbers,
            skin.growth is not None,
        )

    def with_shapes(self, kept: IntArray) -> Points:
        """The points with these of their shapes."""
        last = len(self.shapes) - 1
        return Points(self.reference, self.shapes[kept], self.numbers, self.grows and last in kept)

    def displaced(self, delta: Array, scale: float = 1.0) -> tuple[Single, Single]:
        """Points (n_p, 3) [m] at elastic coordinates (n,), magnified, and the true length of their displacement
        (n_p,)."""
        if not delta.any():
            return self.reference, np.zeros(len(self.reference), np.float32)
        u = (delta.astype(np.float32) @ self.shapes.reshape(len(delta), -1)).reshape(-1, 3)
        positions = self.reference + np.float32(scale) * u
        if self.grows:
            u = u - np.float32(delta[-1]) * self.shapes[-1]
        return positions, np.sqrt(np.einsum("pi,pi->p", u, u))


@dataclass(frozen=True, eq=False)
class Surface:
    """Drawable geometry of a body: faces over `skin`; edges, mesh, lines and dots over `wires`.

    Points of the skin are shared where the shading is smooth and split at sharp edges.
    triangles (k, 3), quads (k, 4); edges (k, 2), mesh (k, 2) faint, lines (k, 2), dots (k,): numbers of points
    closed  whether every edge has two faces, which then look outward (back faces need not be drawn)
    """

    skin: Points
    triangles: IntArray
    quads: IntArray
    closed: bool
    wires: Points
    edges: IntArray
    mesh: IntArray
    lines: IntArray
    dots: IntArray
    summing: sparse.csr_array  # (n_p, n_faces) adds the faces around each point of the skin

    def with_shapes(self, kept: IntArray) -> Surface:
        """The surface with these of its shapes."""
        return replace(self, skin=self.skin.with_shapes(kept), wires=self.wires.with_shapes(kept))

    def without_faces(self) -> Surface:
        """Edges, lines and dots alone."""
        return replace(self, triangles=self.triangles[:0], quads=self.quads[:0])

    def normals(self, points: Single) -> Single:
        """Unit normals (n_p, 3) [1] of the faces around each point of the skin, weighted by area."""
        total = self.summing @ _area_vectors(points, self.triangles, self.quads)
        length = np.sqrt(np.einsum("pi,pi->p", total, total))
        return np.asarray(total / np.where(length > 0, length, 1.0)[:, None], np.float32)


def surface_of(skin: Skin, drawn_edges: str = "sharp", least_gap: float = np.inf) -> Surface:
    """The surface of a skin; its edges are the "sharp" ones, those of the "mesh", or "none".

    "auto" draws the sharp ones, and the others as faint mesh lines if their median length is above `least_gap` [m].
    "thick" makes all edges lines of the body itself, so that a very slender one is visible.

    Raises ValueError for cells that cannot be drawn.
    """
    unknown = sorted(set(skin.cells) - set(CORNERS))
    if unknown:
        raise ValueError(f"cells {unknown} of a skin cannot be drawn; known are {sorted(CORNERS)}")
    keep, merged = _distinct_points(skin)
    by_corners = {k: [merged[c[:, :k]] for name, c in skin.cells.items() if CORNERS[name] == k] for k in (1, 2, 3, 4)}
    cells = {k: np.concatenate([np.zeros((0, k), np.int64), *wire_tables]) for k, wire_tables in by_corners.items()}
    sides = _edges(skin.points[keep], cells[3], cells[4], "sharp" if drawn_edges == "auto" else drawn_edges)
    mesh = _mesh_lines(skin.points[keep], cells[3], cells[4], sides, least_gap) if drawn_edges == "auto" else sides[:0]
    edges, lines = (sides[:0], np.concatenate([cells[2], sides])) if drawn_edges == "thick" else (sides, cells[2])
    source, triangles, quads, closed = _oriented(skin.points[keep], cells[3], cells[4])
    tables = [edges.ravel(), mesh.ravel(), lines.ravel(), cells[1].ravel()]
    used, wires = np.unique(np.concatenate(tables), return_inverse=True)
    wire_tables = np.split(wires, np.cumsum([table.size for table in tables])[:-1])
    return Surface(
        skin=Points.from_skin(skin, keep[source]),
        triangles=triangles,
        quads=quads,
        closed=closed,
        wires=Points.from_skin(skin, keep[used.astype(np.int64)]),
        edges=wire_tables[0].reshape(-1, 2),
        mesh=wire_tables[1].reshape(-1, 2),
        lines=wire_tables[2].reshape(-1, 2),
        dots=wire_tables[3],
        summing=_face_to_point_matrix(len(source), triangles, quads),
    )


def breadth(skin: Skin) -> float:
    """Diameter [m] of the rod that has the area and the length of a skin: small for slender bodies alone."""
    p = skin.points
    faces = [skin.cells[name][:, : CORNERS[name]] for name in skin.cells if CORNERS.get(name, 0) > 2]
    triangles = [np.concatenate([f[:, [0, 1, 2]], f[:, [0, 2, 3]]]) if f.shape[1] == 4 else f for f in faces]
    area = sum(
        np.linalg.norm(np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]]), axis=1).sum() / 2 for t in triangles
    )
    length = np.linalg.norm(np.ptp(p, axis=0))
    return float(area / (np.pi * length)) if length else 0.0


def twist_of(skin: Skin) -> Array:
    """Largest twist (n,) of each shape at unit amplitude about the axes of slender parts [rad]; 0 without such parts.

    A shape is linear in its amplitude, so that a twist of theta widens a tube by sqrt(1 + theta^2).
    """
    keep, merged = _distinct_points(skin)
    faces = {k: [merged[c[:, :k]] for name, c in skin.cells.items() if CORNERS.get(name) == k] for k in (3, 4)}
    sides = _sides(*(np.concatenate([np.zeros((0, k), np.int64), *tables]) for k, tables in faces.items()))
    points, shapes, twist = skin.points[keep], skin.shapes[:, keep], np.zeros(len(skin.shapes))
    links = sparse.csr_array((np.ones(len(sides)), (sides[:, 0], sides[:, 1])), shape=(len(keep), len(keep)))
    _, piece = connected_components(links, directed=False)
    for number in np.unique(piece[sides[:, 0]]):
        own_sides = sides[piece[sides[:, 0]] == number]
        own_points = points[piece == number]
        if len(own_points) == 1:  # faces without extent, as of a rigid body that is drawn as a point
            continue
        _, extent, axes = np.linalg.svd(own_points - own_points.mean(axis=0), full_matrices=False)
        if extent[1] > SLENDER * extent[0]:
            continue
        along, side = axes[0], np.diff(points[own_sides], axis=1)[:, 0]
        length = np.linalg.norm(side, axis=1)
        across = (np.abs(side @ along) < 0.1 * length) & (length > 0)
        rotations = np.diff(shapes[:, own_sides[across]], axis=2)[:, :, 0]
        rotations -= (rotations @ along)[..., None] * along
        rotations = np.linalg.norm(rotations, axis=2) / length[across]
        twist = np.maximum(twist, rotations.max(axis=1, initial=0.0))
    return twist


def _distinct_points(skin: Skin) -> tuple[IntArray, IntArray]:
    """Numbers of the distinct points, and for every point its index among them; equal points are merged."""
    n_points = len(skin.points)
    columns = [skin.points, *skin.shapes]
    scaled = [c / size for c in columns if (size := np.ptp(c, axis=0).max(initial=0.0) or np.abs(c).max(initial=0.0))]
    if not scaled:
        return np.arange(n_points), np.arange(n_points)
    table = np.concatenate(scaled, axis=1)
    mixing = np.random.default_rng(0).standard_normal((table.shape[1], 3))  # three numbers distinguish points
    key = np.round(table @ mixing / (MERGE * np.sqrt(table.shape[1]))).astype(np.int64)
    _, keep, merged = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return keep, merged.reshape(-1)


def _oriented(points: Array, triangles: IntArray, quads: IntArray) -> tuple[IntArray, IntArray, IntArray, bool]:
    """Source of each drawn point, triangles and quads (oriented alike; outward if closed), and whether closed.

    A point where faces meet at a sharp edge, or more than two at one edge, is drawn once for each smooth part.
    """
    if not len(triangles) + len(quads):
        return np.zeros(0, np.int64), triangles, quads, False
    n_triangles, n_sides = len(triangles), triangles.size + quads.size
    sides = _sides(triangles, quads)
    face = np.concatenate([np.repeat(np.arange(n_triangles), 3), n_triangles + np.repeat(np.arange(len(quads)), 4)])
    _, number, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    closed, order = bool(np.all(count == 2)), np.argsort(number.reshape(-1), kind="stable")
    first = order[(np.cumsum(count) - count)[count == 2]]
    second = order[(np.cumsum(count) - count)[count == 2] + 1]
    alike = sides[first, 0] == sides[second, 1]  # neighbours of one orientation pass their side in opposite directions
    turned = _turned_faces(face[first], face[second], alike, n_triangles + len(quads))
    area = _area_vectors(points, triangles, quads)
    area = np.where(turned[:, None], -area, area)
    if closed:
        middle = np.concatenate([points[triangles].mean(axis=1), points[quads].mean(axis=1)])
        _, part = _components(face[first], face[second], len(area))
        inward = np.bincount(part, np.sum((middle - points.mean(axis=0)) * area, axis=1))[part] < 0.0
        turned, area = turned ^ inward, np.where(inward[:, None], -area, area)
    normal = area / np.maximum(np.linalg.norm(area, axis=1), np.finfo(float).tiny)[:, None]
    smooth = np.sum(normal[face[first]] * normal[face[second]], axis=1) > np.cos(FEATURE_ANGLE)
    first, second, alike = first[smooth], second[smooth], alike[smooth]
    after = np.concatenate(
        [np.roll(np.arange(c.size).reshape(c.shape), -1, axis=1).ravel() for c in (triangles, quads)]
    )
    after[triangles.size :] += triangles.size
    ends = (np.where(alike, after[second], second), np.where(alike, second, after[second]))
    _, corner = _components(np.concatenate([first, after[first]]), np.concatenate(ends), n_sides)
    source = np.zeros(corner.max() + 1, np.int64)
    source[corner] = sides[:, 0]
    split = corner.astype(np.int64)
    three, four = split[: triangles.size].reshape(-1, 3), split[triangles.size :].reshape(-1, 4)
    three[turned[:n_triangles]] = three[turned[:n_triangles], ::-1]
    four[turned[n_triangles:]] = four[turned[n_triangles:], ::-1]
    return source, three, four, closed


def _turned_faces(first: IntArray, second: IntArray, alike: BoolArray, n_faces: int) -> BoolArray:
    """Whether each face is turned round, so that neighbours (n_pairs,) agree; the first face of a part stays.

    Every face stands twice in a graph, as it is and turned (n_faces later), and is joined with the one of its neighbour
    that agrees with it.
    """
    shift = np.where(alike, 0, n_faces)
    _, part = _components(
        np.concatenate([first, first + n_faces]),
        np.concatenate([second + shift, second + n_faces - shift]),
        2 * n_faces,
    )
    plain, turned = part[:n_faces], part[n_faces:]
    return turned < plain  # numbers grow with the first member of a part


def _components(first: IntArray, second: IntArray, size: int) -> tuple[int, IntArray]:
    """Count of connected parts, and the part of each of so many items, from pairs of neighbours."""
    links = sparse.coo_array((np.ones(len(first), np.int8), (first, second)), shape=(size, size))
    count, part = connected_components(links, directed=False)
    return int(count), np.asarray(part, np.int64)


def _sides(triangles: IntArray, quads: IntArray) -> IntArray:
    """The two ends of every side of every face, face by face, (n_sides, 2)."""
    return np.concatenate([np.stack([c, np.roll(c, -1, axis=1)], axis=-1).reshape(-1, 2) for c in (triangles, quads)])


def _edges(points: Array, triangles: IntArray, quads: IntArray, which: str) -> IntArray:
    """Sides (k, 2) with one face, or between faces at a sharp angle; or every one."""
    sides = np.sort(_sides(triangles, quads), axis=1)
    if not len(sides):
        return sides
    unique, side, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    if which != "sharp":
        return unique[:0] if which == "none" else unique
    normal = _area_vectors(points, triangles, quads)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    total = np.zeros((len(unique), 3))
    np.add.at(total, side.reshape(-1), normal[_face_of_corner(triangles, quads)])
    smooth = (count == 2) & (np.linalg.norm(total, axis=1) > 2 * np.cos(FEATURE_ANGLE / 2))
    return np.asarray(unique[~smooth])


def _mesh_lines(points: Array, triangles: IntArray, quads: IntArray, sharp: IntArray, least_gap: float) -> IntArray:
    """Sides (k, 2) that are not sharp, if half of them are longer than `least_gap` [m]; else none."""
    sides = np.unique(np.sort(_sides(triangles, quads), axis=1), axis=0)
    if not len(sides) or np.median(np.linalg.norm(np.diff(points[sides], axis=1)[:, 0], axis=1)) <= least_gap:
        return sides[:0]
    n = len(points)
    return np.asarray(sides[~np.isin(sides @ [n, 1], sharp @ [n, 1])])


def _area_vectors(points: NDArray[Any], triangles: IntArray, quads: IntArray) -> NDArray[Any]:
    """Twice the area of each face along its normal, (n_faces, 3)."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    p, q, r, s = (points[quads[:, k]] for k in range(4))
    return np.concatenate([np.cross(b - a, c - a), np.cross(r - p, s - q)])


def _face_of_corner(triangles: IntArray, quads: IntArray) -> IntArray:
    """Number of the face that each corner, in order, belongs to."""
    return np.concatenate(
        [np.repeat(np.arange(len(triangles)), 3), len(triangles) + np.repeat(np.arange(len(quads)), 4)]
    )


def _face_to_point_matrix(n_points: int, triangles: IntArray, quads: IntArray) -> sparse.csr_array:
    rows, columns = np.concatenate([triangles.ravel(), quads.ravel()]), _face_of_corner(triangles, quads)
    return sparse.csr_array(
        (np.ones(len(rows), np.float32), (rows, columns)), shape=(n_points, len(triangles) + len(quads))
    )
