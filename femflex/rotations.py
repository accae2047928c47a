"""Rotations: Euler parameters (scalar first), rotation vectors, angle sequences, direction cosines.

C_AB turns components in B into components in A. For a rotation from P to Q every function here speaks of C_PQ and of
omega, the rate of Q relative to P in Q components. All functions run compiled, and as plain Python with the compiler off.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ANGLE_SEQUENCES = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz")
SMALL_ANGLE = 1e-3  # rad; below it series to sixth order replace quotients, error under 1e-20


def axes_of_sequence(sequence: str) -> Index:
    """Axis numbers (3,) of an intrinsic angle sequence such as "xzy".

    >>> axes_of_sequence("xzy")
    array([0, 2, 1])
    """
    if sequence not in ANGLE_SEQUENCES:
        raise ValueError(f"angle sequence {sequence!r} is not known; known are {list(ANGLE_SEQUENCES)}")
    return np.array(["xyz".index(letter) for letter in sequence], dtype=np.int64)


@njit(cache=True)
def skew(v: Array) -> Array:
    """The matrix of v x, (3, 3)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@njit(cache=True)
def dcm_from_quaternion(e: Array) -> Array:
    """C_PQ (3, 3) from Euler parameters (4,), which need not be normalised."""
    C = np.empty((3, 3))
    w, x, y, z = e[0], e[1], e[2], e[3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    C[0, 0] = 1.0 - s * (y * y + z * z)
    C[0, 1] = s * (x * y - w * z)
    C[0, 2] = s * (x * z + w * y)
    C[1, 0] = s * (x * y + w * z)
    C[1, 1] = 1.0 - s * (x * x + z * z)
    C[1, 2] = s * (y * z - w * x)
    C[2, 0] = s * (x * z - w * y)
    C[2, 1] = s * (y * z + w * x)
    C[2, 2] = 1.0 - s * (x * x + y * y)
    return C


@njit(cache=True)
def quaternion_from_dcm(C: Array) -> Array:
    """Euler parameters (4,) of C_PQ, scalar part not negative (Shepperd's choice of the largest divisor)."""
    e = np.empty(4)
    trace = C[0, 0] + C[1, 1] + C[2, 2]
    k = 0
    largest = trace
    for i in range(3):
        if C[i, i] > largest:
            largest = C[i, i]
            k = i + 1
    if k == 0:
        e[0] = 0.5 * np.sqrt(1.0 + trace)
        e[1] = (C[2, 1] - C[1, 2]) / (4.0 * e[0])
        e[2] = (C[0, 2] - C[2, 0]) / (4.0 * e[0])
        e[3] = (C[1, 0] - C[0, 1]) / (4.0 * e[0])
    else:
        i = k - 1
        j, m = (i + 1) % 3, (i + 2) % 3
        e[k] = 0.5 * np.sqrt(1.0 + C[i, i] - C[j, j] - C[m, m])
        e[0] = (C[m, j] - C[j, m]) / (4.0 * e[k])
        e[j + 1] = (C[j, i] + C[i, j]) / (4.0 * e[k])
        e[m + 1] = (C[m, i] + C[i, m]) / (4.0 * e[k])
    if e[0] < 0.0:
        e *= -1.0
    return e


@njit(cache=True)
def quaternion_rate(e: Array, omega: Array) -> Array:
    """de/dt (4,) from the rate of Q relative to P in Q components (3,) [rad/s]."""
    de = np.empty(4)
    de[0] = 0.5 * (-e[1] * omega[0] - e[2] * omega[1] - e[3] * omega[2])
    de[1] = 0.5 * (e[0] * omega[0] + e[2] * omega[2] - e[3] * omega[1])
    de[2] = 0.5 * (e[0] * omega[1] + e[3] * omega[0] - e[1] * omega[2])
    de[3] = 0.5 * (e[0] * omega[2] + e[1] * omega[1] - e[2] * omega[0])
    return de


@njit(cache=True)
def quaternion_product(a: Array, b: Array) -> Array:
    """Euler parameters of C_PQ(a) C_QR(b), (4,)."""
    c = np.empty(4)
    c[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    c[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    c[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    c[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    return c


@njit(cache=True)
def axis_dcm(axis: Array, angle: float) -> Array:
    """C_PQ (3, 3) of a turn about a unit axis (Rodrigues' formula)."""
    c, s = np.cos(angle), np.sin(angle)
    C = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            C[i, j] = (1.0 - c) * axis[i] * axis[j]
        C[i, i] += c
    C[0, 1] -= s * axis[2]
    C[0, 2] += s * axis[1]
    C[1, 0] += s * axis[2]
    C[1, 2] -= s * axis[0]
    C[2, 0] -= s * axis[1]
    C[2, 1] += s * axis[0]
    return C


@njit(cache=True)
def vector_coefficients(angle: float) -> tuple[float, float, float]:
    """sin(a)/a, (1 - cos a)/a^2 and (a - sin a)/a^3, safe at a = 0."""
    a2 = angle * angle
    if angle < SMALL_ANGLE:
        return (
            1.0 - a2 / 6.0 * (1.0 - a2 / 20.0),
            0.5 - a2 / 24.0 * (1.0 - a2 / 30.0),
            1.0 / 6.0 - a2 / 120.0 * (1.0 - a2 / 42.0),
        )
    half = np.sin(0.5 * angle)
    return np.sin(angle) / angle, 2.0 * half * half / a2, (angle - np.sin(angle)) / (a2 * angle)


@njit(cache=True)
def dcm_from_vector(theta: Array) -> Array:
    """C_PQ = exp(skew(theta)) (3, 3) from a rotation vector (3,) [rad]."""
    s, c, _ = vector_coefficients(np.sqrt(theta[0] ** 2 + theta[1] ** 2 + theta[2] ** 2))
    X = skew(theta)
    return np.eye(3) + s * X + c * (X @ X)


@njit(cache=True)
def vector_from_dcm(C: Array) -> Array:
    """Rotation vector (3,) [rad] of C_PQ, of length at most pi."""
    e = quaternion_from_dcm(C)
    sine = np.sqrt(e[1] ** 2 + e[2] ** 2 + e[3] ** 2)
    factor = 2.0 if sine < 1e-12 else 2.0 * np.arctan2(sine, e[0]) / sine
    return factor * e[1:]


@njit(cache=True)
def vector_tangent(theta: Array) -> Array:
    """T (3, 3) of the rotation vector: rate of Q relative to P in P components = T dtheta/dt; in Q components T^T dtheta/dt."""
    _, c, d = vector_coefficients(np.sqrt(theta[0] ** 2 + theta[1] ** 2 + theta[2] ** 2))
    X = skew(theta)
    return np.eye(3) + c * X + d * (X @ X)


@njit(cache=True)
def vector_tangent_rate(theta: Array, dtheta: Array) -> Array:
    """dT/dt (3, 3) of vector_tangent along dtheta/dt."""
    a = np.sqrt(theta[0] ** 2 + theta[1] ** 2 + theta[2] ** 2)
    s, c, d = vector_coefficients(a)
    along = theta[0] * dtheta[0] + theta[1] * dtheta[1] + theta[2] * dtheta[2]
    if a < 0.05:  # (s - 2 c)/a^2 and (c - 3 d)/a^2 lose digits below; series to a^8, error under 1e-17
        b = a * a
        dc = -1.0 / 12.0 + b * (1.0 / 180.0 - b * (1.0 / 6720.0 - b * (1.0 / 453600.0 - b / 47900160.0)))
        dd = -1.0 / 60.0 + b * (1.0 / 1260.0 - b * (1.0 / 60480.0 - b * (1.0 / 4989600.0 - b / 622702080.0)))
    else:
        dc, dd = (s - 2.0 * c) / (a * a), (c - 3.0 * d) / (a * a)
    X, Y = skew(theta), skew(dtheta)
    return c * Y + dc * along * X + d * (X @ Y + Y @ X) + dd * along * (X @ X)


@njit(cache=True)
def dcm_from_angles(angles: Array, axes: Index) -> Array:
    """C_PQ (3, 3) of three intrinsic turns [rad] about the axes' numbers (3,)."""
    C = np.eye(3)
    for k in range(3):
        unit = np.zeros(3)
        unit[axes[k]] = 1.0
        C = C @ axis_dcm(unit, angles[k])
    return C


@njit(cache=True)
def angles_from_dcm(C: Array, axes: Index) -> Array:
    """Intrinsic angles (3,) [rad] of C_PQ for the axes' numbers (3,); at the singularity the third is zero."""
    i, j = axes[0], axes[1]
    k = 3 - i - j
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    out = np.zeros(3)
    if axes[2] == i:  # symmetric, such as zxz
        sine = np.sqrt(C[i, j] ** 2 + C[i, k] ** 2)
        out[1] = np.arctan2(sine, C[i, i])
        if sine > 1e-12:
            out[0] = np.arctan2(C[j, i], -sign * C[k, i])
            out[2] = np.arctan2(C[i, j], sign * C[i, k])
            return out
    else:
        cosine = np.sqrt(C[i, i] ** 2 + C[i, j] ** 2)
        out[1] = np.arctan2(sign * C[i, k], cosine)
        if cosine > 1e-12:
            out[0] = np.arctan2(-sign * C[j, k], C[k, k])
            out[2] = np.arctan2(-sign * C[i, j], C[i, i])
            return out
    out[0] = np.arctan2(sign * C[k, j], C[j, j])
    return out


@njit(cache=True)
def angle_rate_matrix(angles: Array, axes: Index) -> Array:
    """B (3, 3) with omega = B dangles/dt, omega the rate of Q relative to P in Q components."""
    B = np.zeros((3, 3))
    C = np.eye(3)
    for k in range(2, -1, -1):
        unit = np.zeros(3)
        unit[axes[k]] = 1.0
        B[:, k] = C.T @ unit
        C = axis_dcm(unit, angles[k]) @ C
    return B
