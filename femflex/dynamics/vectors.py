"""Three-vectors and 3 x 3 matrices as tuples: they live in registers when compiled, and need no allocation.

A vector is (x, y, z), a matrix nine numbers row by row. `load3` and `load9` read them from a flat array.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]

FAST = {"contract", "arcp", "nsz", "reassoc"}  # everything that keeps NaN and infinity honest


@njit(cache=True)
def load3(a: Array, i: int) -> Vector:
    """Vector at a[i : i + 3]."""
    return a[i], a[i + 1], a[i + 2]


@njit(cache=True)
def store3(a: Array, i: int, v: Vector) -> None:
    """Write v to a[i : i + 3]."""
    a[i], a[i + 1], a[i + 2] = v[0], v[1], v[2]


@njit(cache=True)
def accumulate3(a: Array, i: int, v: Vector) -> None:
    """Add v to a[i : i + 3]."""
    a[i] += v[0]
    a[i + 1] += v[1]
    a[i + 2] += v[2]


@njit(cache=True)
def load9(a: Array, i: int) -> Matrix:
    """Matrix at a[i : i + 9], row by row."""
    return a[i], a[i + 1], a[i + 2], a[i + 3], a[i + 4], a[i + 5], a[i + 6], a[i + 7], a[i + 8]


@njit(cache=True)
def store9(a: Array, i: int, m: Matrix) -> None:
    """Write m to a[i : i + 9], row by row."""
    a[i], a[i + 1], a[i + 2] = m[0], m[1], m[2]
    a[i + 3], a[i + 4], a[i + 5] = m[3], m[4], m[5]
    a[i + 6], a[i + 7], a[i + 8] = m[6], m[7], m[8]


@njit(cache=True)
def add(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@njit(cache=True)
def sub(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(cache=True)
def scale(s: float, a: Vector) -> Vector:
    """s a."""
    return s * a[0], s * a[1], s * a[2]


@njit(cache=True)
def dot(a: Vector, b: Vector) -> float:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def turn(m: Matrix, v: Vector) -> Vector:
    """m v."""
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


@njit(cache=True)
def turn_back(m: Matrix, v: Vector) -> Vector:
    """m^T v."""
    return (
        m[0] * v[0] + m[3] * v[1] + m[6] * v[2],
        m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
        m[2] * v[0] + m[5] * v[1] + m[8] * v[2],
    )


@njit(cache=True)
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


@njit(cache=True)
def transpose(m: Matrix) -> Matrix:
    """m^T."""
    return m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]


@njit(cache=True)
def axis_turn(axis: Vector, angle: float) -> Matrix:
    """C_PQ of a turn about a unit axis (Rodrigues' formula)."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis
    v = 1.0 - c
    return (
        c + v * x * x, v * x * y - s * z, v * x * z + s * y,
        v * x * y + s * z, c + v * y * y, v * y * z - s * x,
        v * x * z - s * y, v * y * z + s * x, c + v * z * z,
    )  # fmt: skip


@njit(cache=True)
def quaternion_turn(w: float, x: float, y: float, z: float) -> Matrix:
    """C_PQ of Euler parameters, which need not be normalised."""
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
        s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x),
        s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y),
    )  # fmt: skip
