"""Rows [A | p]: inertia and bias of a body at its origin, six rows of eight numbers (A_r1..3, 0, A_r4..6, p_r).

Row r of A stands in two lanes, the three force columns and the three couple columns; the bias p_r rides along in the
last place, so that every elimination and every change of axes treats both at once. A body's columns (H, and the rows
of the elastic border) are likewise (force or acceleration (3), 0, couple or angular acceleration (3), last).
"""

from __future__ import annotations

from typing import Any

from femflex.arrays import Array
from femflex.kernels.formula import formula
from femflex.kernels.lanes import cross_lane, lane, lane_of, put_lane, reciprocal, with_fourth
from femflex.kernels.pairs import SLOTS, Pair, dot_pair, pair, put_pair, six_of
from femflex.kernels.vectors import Matrix, Vector

Rows = tuple[Pair, ...]
Six = tuple[float, float, float, float, float, float]


@formula
def six_rows(a: Array, i: int) -> Rows:
    """The six rows at a[i : i + 48]."""
    return tuple(pair(a, i + 8 * r) for r in range(6))


@formula
def put_six_rows(a: Array, i: int, rows: Rows) -> None:
    """Write six rows to a[i : i + 48]."""
    for r in range(6):
        put_pair(a, i + 8 * r, rows[r])


@formula
def body_rows(m: float, s: Vector, Q: Matrix, f: Vector, c: Vector) -> Rows:
    """[A | p] with A = [[m 1, -skew(s)], [skew(s), J]], J = tr(Q) 1 - Q, p = (f, c)."""
    x, y, z = s
    t = Q[0] + Q[4] + Q[8]
    return (
        (lane_of(m, 0.0, 0.0, 0.0), lane_of(0.0, z, -y, f[0])),
        (lane_of(0.0, m, 0.0, 0.0), lane_of(-z, 0.0, x, f[1])),
        (lane_of(0.0, 0.0, m, 0.0), lane_of(y, -x, 0.0, f[2])),
        (lane_of(0.0, -z, y, 0.0), lane_of(t - Q[0], -Q[1], -Q[2], c[0])),
        (lane_of(z, 0.0, -x, 0.0), lane_of(-Q[3], t - Q[4], -Q[5], c[1])),
        (lane_of(-y, x, 0.0, 0.0), lane_of(-Q[6], -Q[7], t - Q[8], c[2])),
    )


@formula
def weighted(rows: Rows, a: Array, i: int, step: int) -> Pair:
    """sum_r v_r row_r of six numbers v_r = a[i + step r]: for v of the body's motion (A v, p . v)."""
    return _sum_of(rows, [a[i + step * r] for r in range(6)])


@formula
def rows_times(rows: Rows, v: Pair) -> Pair:
    """sum_r v_r row_r = (A v, p . v)."""
    return _sum_of(rows, six_of(v))


def _sum_of(rows: Rows, v: list[Any]) -> Pair:
    first, second = v[0] * rows[0][0], v[0] * rows[0][1]
    for r in range(1, 6):
        first, second = first + v[r] * rows[r][0], second + v[r] * rows[r][1]
    return first, second


@formula
def less_outer(rows: Rows, v: Pair, scaled: Pair) -> Rows:
    """row_r - v_r scaled."""
    numbers = six_of(v)
    return tuple((a - v_r * scaled[0], b - v_r * scaled[1]) for (a, b), v_r in zip(rows, numbers, strict=True))


@formula
def less_outer_at(rows: Rows, a: Array, i: int, scaled: Pair) -> Rows:
    """row_r - v_r scaled for v at a[i : i + 8]."""
    numbers = [a[i + slot] for slot in SLOTS]
    return tuple((b - v_r * scaled[0], c - v_r * scaled[1]) for (b, c), v_r in zip(rows, numbers, strict=True))


@formula
def with_bias(rows: Rows, bias: Pair) -> Rows:
    """p + A bias in place of p, for the bias acceleration of the body."""
    motion = (bias[0], with_fourth(bias[1], 1.0))
    return tuple((row[0], with_fourth(row[1], dot_pair(row, motion))) for row in rows)


@formula
def turned_rows(rows: Array, i: int, a: Array, C: int) -> Rows:
    """[C^T A C | C^T p] block by block, of rows at rows[i:] and C of three rows of four at a[C:]."""
    c = [lane(a, C + 4 * j) for j in range(3)]
    unit = lane_of(0.0, 0.0, 0.0, 1.0)
    right = []
    for r in range(6):
        row = i + 8 * r
        first = rows[row] * c[0] + rows[row + 1] * c[1] + rows[row + 2] * c[2]
        second = rows[row + 4] * c[0] + rows[row + 5] * c[1] + rows[row + 6] * c[2] + rows[row + 7] * unit
        right.append((first, second))
    return tuple(_column_sum(a, C + k, right[3 * half : 3 * half + 3]) for half in range(2) for k in range(3))


def _column_sum(a: Array, i: int, rows: list[Pair]) -> Pair:
    """Three rows times three numbers four apart."""
    x, y, z = a[i], a[i + 4], a[i + 8]
    first = x * rows[0][0] + y * rows[1][0] + z * rows[2][0]
    return first, x * rows[0][1] + y * rows[1][1] + z * rows[2][1]


@formula
def shifted_rows(rows: Rows, r: Vector) -> Rows:
    """[A | p] referred to a point from which the body's origin is at r: a = a' - r x alpha, couples + r x force."""
    arm = lane_of(r[0], r[1], r[2], 0.0)
    shifted = [(a, b + cross_lane(arm, a)) for a, b in rows]
    (fx, fy, fz), (cx, cy, cz) = shifted[:3], shifted[3:]
    return (
        fx, fy, fz,
        _plus(cx, -r[2], fy, r[1], fz),
        _plus(cy, r[2], fx, -r[0], fz),
        _plus(cz, -r[1], fx, r[0], fy),
    )  # fmt: skip


def _plus(a: Pair, s: Any, b: Pair, t: Any, c: Pair) -> Pair:
    return a[0] + s * b[0] + t * c[0], a[1] + s * b[1] + t * c[1]


@formula
def add_rows(a: Array, i: int, rows: Rows) -> None:
    """Add six rows to those at a[i : i + 48]."""
    for r in range(6):
        put_lane(a, i + 8 * r, lane(a, i + 8 * r) + rows[r][0])
        put_lane(a, i + 8 * r + 4, lane(a, i + 8 * r + 4) + rows[r][1])


@formula
def free_motion(a: Array, i: int) -> Six:
    """x with A x = p of the rows [A | p] at a[i : i + 48], by L D L^T; NaN when A is not positive."""
    A = [[a[i + 8 * r + SLOTS[c]] for c in range(r + 1)] for r in range(6)]
    x = [a[i + 8 * r + 7] for r in range(6)]
    inverse = []
    for j in range(6):
        inverse.append(reciprocal(A[j][j]))
        for r in range(j + 1, 6):
            factor = A[r][j] * inverse[j]
            x[r] = x[r] - factor * x[j]
            for c in range(j + 1, r + 1):
                A[r][c] = A[r][c] - factor * A[c][j]
    for j in reversed(range(6)):
        for r in range(j + 1, 6):
            x[j] = x[j] - A[r][j] * x[r]
        x[j] = x[j] * inverse[j]
    return tuple(x)
