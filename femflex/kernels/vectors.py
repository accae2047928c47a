"""Three-vectors and 3 x 3 matrices as tuples: they live in registers when compiled, and need no allocation.

A vector is (x, y, z), a matrix nine numbers row by row; each may as well be a lane, for four vectors at once.
`load3` and `load9` read them from a flat array.
"""

from __future__ import annotations

from femflex.arrays import Array
from femflex.kernels.formula import formula
from femflex.kernels.lanes import lane_of, put_lane

Vector = tuple[float, float, float]
Four = tuple[float, float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]

ZERO: Vector = (0.0, 0.0, 0.0)
UNIT: Matrix = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@formula
def load3(a: Array, i: int) -> Vector:
    """Vector at a[i : i + 3]."""
    return a[i], a[i + 1], a[i + 2]


@formula
def store3(a: Array, i: int, v: Vector) -> None:
    """Write v to a[i : i + 3]."""
    a[i], a[i + 1], a[i + 2] = v[0], v[1], v[2]


@formula
def load4(a: Array, i: int) -> Four:
    """Four numbers at a[i : i + 4]."""
    return a[i], a[i + 1], a[i + 2], a[i + 3]


@formula
def store4(a: Array, i: int, v: Four) -> None:
    """Write four numbers to a[i : i + 4]."""
    a[i], a[i + 1], a[i + 2], a[i + 3] = v[0], v[1], v[2], v[3]


@formula
def load9(a: Array, i: int) -> Matrix:
    """Matrix at a[i : i + 9], row by row."""
    return a[i], a[i + 1], a[i + 2], a[i + 3], a[i + 4], a[i + 5], a[i + 6], a[i + 7], a[i + 8]


@formula
def store9(a: Array, i: int, m: Matrix) -> None:
    """Write m to a[i : i + 9], row by row."""
    a[i], a[i + 1], a[i + 2] = m[0], m[1], m[2]
    a[i + 3], a[i + 4], a[i + 5] = m[3], m[4], m[5]
    a[i + 6], a[i + 7], a[i + 8] = m[6], m[7], m[8]


@formula
def load_rows(a: Array, i: int) -> Matrix:
    """Matrix of three rows of four numbers at a[i : i + 12], the fourth left out."""
    return a[i], a[i + 1], a[i + 2], a[i + 4], a[i + 5], a[i + 6], a[i + 8], a[i + 9], a[i + 10]


@formula
def store_rows(a: Array, i: int, m: Matrix) -> None:
    """Write m to a[i : i + 12] as three rows of four numbers, the fourth zero."""
    for r in range(3):
        store4(a, i + 4 * r, (m[3 * r], m[3 * r + 1], m[3 * r + 2], 0.0))


@formula
def store_lane(a: Array, i: int, v: Vector, last: float = 0.0) -> None:
    """Write v and a fourth number to a[i : i + 4]."""
    put_lane(a, i, lane_of(v[0], v[1], v[2], last))


@formula
def add(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@formula
def sub(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@formula
def scale(s: float, a: Vector) -> Vector:
    """s a."""
    return s * a[0], s * a[1], s * a[2]


@formula
def dot(a: Vector, b: Vector) -> float:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@formula
def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@formula
def turn(m: Matrix, v: Vector) -> Vector:
    """m v."""
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


@formula
def turn_back(m: Matrix, v: Vector) -> Vector:
    """m^T v."""
    return (
        m[0] * v[0] + m[3] * v[1] + m[6] * v[2],
        m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
        m[2] * v[0] + m[5] * v[1] + m[8] * v[2],
    )


@formula
def product(a: Matrix, b: Matrix) -> Matrix:
    """a b."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


@formula
def transpose(m: Matrix) -> Matrix:
    """m^T."""
    return m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]


@formula
def add9(a: Matrix, b: Matrix) -> Matrix:
    """a + b."""
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
        a[8] + b[8],
    )


@formula
def solve3(m: Matrix, v: Vector) -> Vector:
    """x with m x = v (Cramer's rule)."""
    a, b, c = (m[0], m[3], m[6]), (m[1], m[4], m[7]), (m[2], m[5], m[8])
    bc = cross(b, c)
    volume = dot(a, bc)
    return dot(bc, v) / volume, dot(cross(c, a), v) / volume, dot(cross(a, b), v) / volume
