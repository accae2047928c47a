"""Parts of flat outlines that light reaches, exactly for convex outlines.

Outlines are projected along the light. The lit part of each is a set of convex polygons: at first itself. Every other
outline is cut out of them, as far as it lies between the plane of the first and the light. Outlines that may meet come
from a uniform grid over the plane of projection.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.symbols import types
from femflex.kernels.vectors import cross, dot

CORNERS = 4  # of an outline; the last is repeated where it has fewer
VERTICES = 16  # most of a polygon: pieces have at most half, and gain one per cut
WHOLE, FRONT, CUTTER, INSIDE, SPARE, FIRST = 0, 1, 2, 3, 4, 5  # of the polygons: FIRST, ... are the lit pieces
SMALL = 16  # cells of the grid that a small outline meets at most
MARKER, FACET, BODY, CLOSED = 0, 1, 2, 3  # whole numbers of an outline
COSINE, BOX = 3, 4  # numbers of a projected outline: its plane (3,), the cosine to the light, and its box
N_PROJECTED = 10
EDGE_ON = 1e-7  # cosine to the light below which an outline is seen from its edge
SLIVER = 1e-13  # of an outline's area: smaller pieces are left out
TOUCHING = 1e-7  # of the whole extent: outlines that are closer, along the normal, touch
SAME_POINT = 1e-10  # of the whole extent: vertices that are closer are one
FULL = -1  # result where there is no more room for pieces

_stack, _rows, _vector = types.float64[:, :, ::1], types.float64[:, ::1], types.float64[::1]


class Outlines(NamedTuple):
    """Outlines in axes of markers.

    corners   (c, 4, 3)  from the marker [m]; of a tube its ends come first
    radius    (c,)       of tubes [m], 0 of flat outlines
    gaps      (c,)       distance from its plane up to which outlines of the same body do not shade it [m]
    numbers   (c, 4)     MARKER, FACET (-1: it only casts shadow), BODY, and CLOSED: whether its back is never lit
    """

    corners: Array
    radius: Array
    gaps: Array
    numbers: IntArray


class Room(NamedTuple):
    """Scratch: projected outlines (c, 4, 3) and (c, N_PROJECTED), polygons (m, VERTICES, 2), whole numbers."""

    corners: Array
    projected: Array
    polygons: Array
    integers: IntArray


class Pieces(NamedTuple):
    """Polygons (m, VERTICES, 2), their numbers of vertices (m,), and marks of the outlines (c,)."""

    polygons: Array
    sizes: IntArray
    marks: IntArray


class Grid(NamedTuple):
    """Cells per side of a grid over the unit square, and the outlines that each meets: members[start[cell]] and on."""

    per_side: int
    start: IntArray
    members: IntArray


LIT = types.int64(
    types.NamedTuple((_stack, _vector, _vector, types.int64[:, ::1]), Outlines),
    _stack,
    _rows,
    _rows,
    types.NamedTuple((_stack, _rows, _stack, types.int64[::1]), Room),
)


@inner
def area_of(x: Array, n: int) -> float:
    """Area of a polygon (n, 2), positive where it runs counter-clockwise."""
    total = 0.0
    for i in range(1, n - 1):
        total += (x[i, 0] - x[0, 0]) * (x[i + 1, 1] - x[0, 1]) - (x[i, 1] - x[0, 1]) * (x[i + 1, 0] - x[0, 0])
    return 0.5 * total


@inner
def with_vertex(x: Array, n: int, u: float, v: float) -> int:
    """Append a vertex to a polygon (n, 2), unless it is the last one; the number of vertices."""
    if n > 0 and abs(u - x[n - 1, 0]) + abs(v - x[n - 1, 1]) < SAME_POINT:
        return n
    x[n, 0], x[n, 1] = u, v
    return n + 1


@inner
def closed(x: Array, n: int) -> int:
    """The number of vertices of a polygon (n, 2) without a last one that is the first."""
    return n - 1 if n > 1 and abs(x[n - 1, 0] - x[0, 0]) + abs(x[n - 1, 1] - x[0, 1]) < SAME_POINT else n


@inner
def half_of(x: Array, n: int, a: float, b: float, c: float, out: Array) -> int:
    """Write the part of a convex polygon (n, 2) where a x + b y + c > 0; its number of vertices."""
    m = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        d, e = a * x[i, 0] + b * x[i, 1] + c, a * x[j, 0] + b * x[j, 1] + c
        if d > 0.0:
            m = with_vertex(out, m, x[i, 0], x[i, 1])
        if (d > 0.0) != (e > 0.0):
            f = d / (d - e)
            m = with_vertex(out, m, x[i, 0] + f * (x[j, 0] - x[i, 0]), x[i, 1] + f * (x[j, 1] - x[i, 1]))
    return closed(out, m)


@inner
def are_apart(x: Array, n: int, y: Array, m: int) -> bool:
    """Whether an edge of the polygon (n, 2), which runs counter-clockwise, has all of the other one (m, 2) outside."""
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        a, b = x[i, 1] - x[j, 1], x[j, 0] - x[i, 0]
        outside = True
        for k in range(m):
            if a * (y[k, 0] - x[i, 0]) + b * (y[k, 1] - x[i, 1]) > 0.0:
                outside = False
                break
        if outside:
            return True
    return False


@inner
def write_piece(x: Array, n: int, polygons: Array, sizes: IntArray, at: int) -> int:
    """Write a polygon as a piece, or as two where it has many vertices; the place of the next piece."""
    half = VERTICES // 2
    first = n if n <= half else half
    polygons[at, :first] = x[:first]
    sizes[at] = first
    if n <= half:
        return at + 1
    polygons[at + 1, 0] = x[0]
    polygons[at + 1, 1 : n - half + 2] = x[half - 1 : n]
    sizes[at + 1] = n - half + 2
    return at + 2


@inner
def without_cutter(polygons: Array, sizes: IntArray, piece: int, end: int, least: float) -> int:
    """Cut the polygon CUTTER out of a piece, which goes to `end` and on unless it is whole; the new end."""
    x, y, spare = polygons[CUTTER], polygons[INSIDE], polygons[SPARE]
    m, n, at = sizes[CUTTER], sizes[piece], end
    if are_apart(x, m, polygons[piece], n) or are_apart(polygons[piece], n, x, m):
        return end
    y[:n] = polygons[piece, :n]
    for i in range(m):
        j = i + 1 if i + 1 < m else 0
        a, b = x[i, 1] - x[j, 1], x[j, 0] - x[i, 0]
        c = -a * x[i, 0] - b * x[i, 1]
        n_out = half_of(y, n, -a, -b, -c, spare)
        if n_out > 2 and area_of(spare, n_out) > least:
            at = write_piece(spare, n_out, polygons, sizes, at)
        n = half_of(y, n, a, b, c, spare)
        if n < 3 or area_of(spare, n) <= least:
            return end
        y[:n] = spare[:n]
    sizes[piece] = 0
    return at


@inner
def packed(polygons: Array, sizes: IntArray, end: int) -> int:
    """Close the gaps that empty pieces leave; the new end."""
    at = FIRST
    for k in range(FIRST, end):
        if sizes[k] > 0:
            if at < k:
                polygons[at, : sizes[k]] = polygons[k, : sizes[k]]
                sizes[at] = sizes[k]
            at += 1
    return at


@inner
def add_moments(x: Array, n: int, plane: Array, sums: Array) -> None:
    """Add area and first moment of a polygon in the plane z = plane . (x, y, 1) to sums (4,)."""
    for i in range(1, n - 1):
        area = (x[i, 0] - x[0, 0]) * (x[i + 1, 1] - x[0, 1]) - (x[i, 1] - x[0, 1]) * (x[i + 1, 0] - x[0, 0])
        area *= 0.5
        u, v = (x[0, 0] + x[i, 0] + x[i + 1, 0]) / 3.0, (x[0, 1] + x[i, 1] + x[i + 1, 1]) / 3.0
        sums[0] += area
        sums[1] += area * u
        sums[2] += area * v
        sums[3] += area * (plane[0] * u + plane[1] * v + plane[2])


@inner
def set_polygon(corners: Array, clockwise: bool, out: Array) -> int:
    """Write the projected corners (4, 3) counter-clockwise, repeated ones once; their number."""
    n = 0
    for k in range(CORNERS):
        i = CORNERS - 1 - k if clockwise else k
        n = with_vertex(out, n, corners[i, 0], corners[i, 1])
    return closed(out, n)


@inner
def place_corners(outlines: Outlines, C: Array, place: Array, corners: Array) -> None:
    """Write corners (c, 4, 3) in axes of the light from outlines in axes of markers; tubes become strips across it."""
    radius = outlines.radius
    for k in range(len(corners)):
        m, x = outlines.numbers[k, MARKER], corners[k]
        for i in range(CORNERS):
            for a in range(3):
                x[i, a] = place[m, a]
                for b in range(3):
                    x[i, a] += C[m, a, b] * outlines.corners[k, i, b]
        if radius[k] > 0.0:
            u, v = x[1, 1] - x[0, 1], x[0, 0] - x[1, 0]  # along the projected tube, turned by a right angle
            size = math.sqrt(u * u + v * v)
            f = radius[k] / size if size > 0.0 else 0.0
            for i in range(2):  # ends 0, 1 become corners 0, 1 on one side and 3, 2 on the other
                x[3 - i, 0], x[3 - i, 1], x[3 - i, 2] = x[i, 0] + f * u, x[i, 1] + f * v, x[i, 2]
                x[i, 0], x[i, 1] = x[i, 0] - f * u, x[i, 1] - f * v


@inner
def scale_corners(corners: Array, frame: Array) -> None:
    """Count corners from their least coordinates, frame[:3], in parts of their largest extent, frame[3]."""
    frame[3] = 0.0
    for a in range(3):
        low, high = np.inf, -np.inf
        for k in range(len(corners)):
            for i in range(CORNERS):
                low, high = min(low, corners[k, i, a]), max(high, corners[k, i, a])
        frame[a], frame[3] = low, max(frame[3], high - low)
    for k in range(len(corners)):
        for i in range(CORNERS):
            for a in range(3):
                corners[k, i, a] = (corners[k, i, a] - frame[a]) / frame[3]


@inner
def project(x: Array, p: Array) -> None:
    """Plane z = p[:3] . (x, y, 1), cosine to the light (0 where seen from the edge) and box of the corners (4, 3)."""
    a = x[2, 0] - x[0, 0], x[2, 1] - x[0, 1], x[2, 2] - x[0, 2]
    b = x[3, 0] - x[1, 0], x[3, 1] - x[1, 1], x[3, 2] - x[1, 2]
    normal = cross(a, b)
    size = math.sqrt(dot(normal, normal))
    cosine = normal[2] / size if size > 0.0 else 0.0
    for axis in range(3):
        p[BOX + 2 * axis] = min(x[0, axis], x[1, axis], x[2, axis], x[3, axis])
        p[BOX + 2 * axis + 1] = max(x[0, axis], x[1, axis], x[2, axis], x[3, axis])
    if abs(cosine) < EDGE_ON:
        p[COSINE] = 0.0
        return
    p[0], p[1], p[COSINE] = -normal[0] / normal[2], -normal[1] / normal[2], cosine
    p[2] = x[0, 2] - p[0] * x[0, 0] - p[1] * x[0, 1]


@inner
def sort_into_grid(projected: Array, grid: Grid) -> bool:
    """Fill the members of each cell of a grid; False where there is no room."""
    per_side, start, members = grid
    for cell in range(len(start)):
        start[cell] = 0
    for fill in range(2):  # first their number in each cell, then they themselves
        for k in range(len(projected)):
            if projected[k, COSINE] == 0.0:
                continue
            i0, i1, j0, j1 = cells_of(projected[k], per_side)
            for i in range(i0, i1):
                for cell in range(i * per_side + j0, i * per_side + j1):
                    if fill:
                        start[cell] -= 1
                        members[start[cell]] = k
                    else:
                        start[cell] += 1
        if not fill:
            for cell in range(per_side * per_side):
                start[cell + 1] += start[cell]
            if start[per_side * per_side] > len(members):
                return False
    return True


@inner
def cells_of(p: Array, per_side: int) -> tuple[int, int, int, int]:
    """Ranges of the two numbers of the cells that a box meets, in a grid over the unit square."""
    last = per_side - 1
    i0, i1 = min(int(p[BOX] * per_side), last), min(int(p[BOX + 1] * per_side), last)
    j0, j1 = min(int(p[BOX + 2] * per_side), last), min(int(p[BOX + 3] * per_side), last)
    return i0, i1 + 1, j0, j1 + 1


@inner
def hides(p: Array, q: Array) -> bool:
    """Whether an outline p can lie in front of q: their boxes meet, and not all of it is farther from the light."""
    x = p[BOX] < q[BOX + 1] and p[BOX + 1] > q[BOX]
    return x and p[BOX + 2] < q[BOX + 3] and p[BOX + 3] > q[BOX + 2] and p[BOX + 5] > q[BOX + 4]


@inner
def part_in_cell(polygons: Array, n: int, whole: bool, i: int, j: int, per_side: int) -> int:
    """Write the polygon WHOLE, or its part in a cell of the grid, as the first piece; its number of vertices."""
    x, y, out = polygons[WHOLE], polygons[INSIDE], polygons[FIRST]
    if whole:
        out[:n] = x[:n]
        return n
    n = half_of(x, n, 1.0, 0.0, -i / per_side, y)
    n = half_of(y, n, -1.0, 0.0, (i + 1) / per_side, out)
    n = half_of(out, n, 0.0, 1.0, -j / per_side, y)
    return half_of(y, n, 0.0, -1.0, (j + 1) / per_side, out)


@inner
def lit_pieces(
    r: int,
    cells: tuple[int, int, int, int],
    mark: int,
    gap: float,
    least: float,
    numbers: IntArray,
    room: Room,
    pieces: Pieces,
    grid: Grid,
) -> int:
    """Cut what lies in front of outline r in these cells out of the piece FIRST; the end of the pieces, or FULL.

    marks[k] = mark: of those that were looked at, and of r where one of them cut something out
    """
    polygons, sizes, marks = pieces
    per_side, start, members = grid
    corners, projected = room.corners, room.projected
    p, end, i0, i1, j0, j1 = projected[r], FIRST + 1, cells[0], cells[1], cells[2], cells[3]
    steep = abs(p[COSINE])
    for i in range(i0, i1):
        for at in range(start[i * per_side + j0], start[i * per_side + j1]):
            k = members[at]
            if k == r or marks[k] == mark or end == FIRST:
                continue
            marks[k] = mark
            if not hides(projected[k], p):
                continue
            margin = max(gap, TOUCHING) if numbers[k, BODY] == numbers[r, BODY] else TOUCHING
            n = set_polygon(corners[k], projected[k, COSINE] < 0.0, polygons[FRONT])
            a, b, c = projected[k, 0] - p[0], projected[k, 1] - p[1], projected[k, 2] - p[2]
            sizes[CUTTER] = half_of(polygons[FRONT], n, steep * a, steep * b, steep * c - margin, polygons[CUTTER])
            if n < 3 or sizes[CUTTER] < 3:
                continue
            for piece in range(FIRST, end):
                if end + VERTICES > len(polygons):
                    return FULL
                end = without_cutter(polygons, sizes, piece, end, least)
                if sizes[piece] == 0:
                    marks[r] = mark
            end = packed(polygons, sizes, end)
    return end


@kernel(LIT)
def lit_parts(outlines: Outlines, C: Array, place: Array, sums: Array, room: Room) -> int:
    """Add projected area and first moment of the whole, and of its lit part, to sums (n_facets, 8); 0, or FULL.

    C, place  (m, 3, 3), (m, 3)  marker components to axes of which the third points to the light, and places there
    sums      (1 + n_facets, 8)  the last row: least x, y, z and extent [m], in which the sums count; scratch
    """
    numbers, (corners, projected, polygons, integers) = outlines.numbers, room
    count, most, frame = len(corners), len(polygons), sums[len(sums) - 1]
    per_side = max(1, int(math.sqrt(count)))
    n_cells = per_side * per_side
    first, last = most + count, most + count + n_cells + 1
    sizes, marks = integers[:most], integers[most:first]
    pieces, grid = Pieces(polygons, sizes, marks), Grid(per_side, integers[first:last], integers[last:])
    place_corners(outlines, C, place, corners)
    scale_corners(corners, frame)
    for k in range(count):
        project(corners[k], projected[k])
        marks[k] = 0
    if not sort_into_grid(projected, grid):
        return FULL
    mark, lit = 0, frame[4:]
    for r in range(count):
        facet, p = numbers[r, FACET], projected[r]
        if facet < 0 or p[COSINE] == 0.0 or (numbers[r, CLOSED] > 0 and p[COSINE] < 0.0):
            continue
        n = set_polygon(corners[r], p[COSINE] < 0.0, polygons[WHOLE])
        if n < 3:
            continue
        add_moments(polygons[WHOLE], n, p, sums[facet, :4])
        least, touched = SLIVER * area_of(polygons[WHOLE], n), False
        lit[:] = 0.0
        i0, i1, j0, j1 = cells_of(p, per_side)
        small = (i1 - i0) * (j1 - j0) <= SMALL
        di, dj = (i1 - i0, j1 - j0) if small else (1, 1)  # large ones are taken cell by cell
        for i in range(i0, i1, di):
            for j in range(j0, j1, dj):
                sizes[FIRST] = part_in_cell(polygons, n, small, i, j, per_side)
                if sizes[FIRST] < 3:
                    continue
                mark += 1
                cells, gap = (i, i + di, j, j + dj), outlines.gaps[r] / frame[3]
                end = lit_pieces(r, cells, mark, gap, least, numbers, room, pieces, grid)
                if end == FULL:
                    return FULL
                touched = touched or marks[r] == mark
                for piece in range(FIRST, end):
                    add_moments(polygons[piece], sizes[piece], p, lit)
        if touched:
            sums[facet, 4:] += lit
        else:
            add_moments(polygons[WHOLE], n, p, sums[facet, 4:])
    return 0


def lit_moments(
    outlines: Array, radius: Array, gaps: Array, numbers: IntArray, C: Array, place: Array, n_facets: int
) -> Array:
    """Projected area and its first moment (n_facets, 2, 4) of facets, of the whole and of its lit part [m^2, m^3].

    Arguments are those of `Outlines` and `lit_parts`.
    """
    count, most, given = len(outlines), 256, Outlines(outlines, radius, gaps, numbers)
    corners, projected = np.empty((count, CORNERS, 3)), np.empty((count, N_PROJECTED))
    while True:
        sums = np.zeros((n_facets + 1, 8))
        integers = np.empty(most + 2 * count + 1 + 4 * (count + most), np.int64)
        room = Room(corners, projected, np.empty((most, VERTICES, 2)), integers)
        if lit_parts(given, C, place, sums, room) != FULL:
            break
        most *= 4
    low, extent, out = sums[-1, :3], sums[-1, 3], sums[:-1].reshape(n_facets, 2, 4)
    out[:, :, 1:] = extent**2 * (extent * out[:, :, 1:] + low * out[:, :, :1])
    out[:, :, 0] *= extent**2
    return out


def axes_across(s: Array) -> Array:
    """Axes (3, 3) as rows: two across the unit vector s (3,), and s."""
    x = np.cross(s, np.eye(3)[int(np.argmin(np.abs(s)))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(s, x), s])
