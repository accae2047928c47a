"""Rotations in the compiled model, on tuples: turns about axes, Euler parameters, rotation vectors, angle sequences.

C_PQ turns components in Q into components in P; omega is the rate of Q relative to P in Q components.
"""

from __future__ import annotations

import math

from femflex.kernels.compiled import inner
from femflex.kernels.formula import formula
from femflex.kernels.lanes import cosine, sine
from femflex.kernels.vectors import Four, Matrix, Vector, add, cross, dot, product, scale, solve3, turn_back

SERIES_ANGLE = 0.05  # rad; below it the quotients of a rotation vector's tangent are series, error under 1e-17


@formula
def axis_turn(axis: Vector, angle: float) -> Matrix:
    """C_PQ of a turn about a unit axis (Rodrigues' formula)."""
    c, s = cosine(angle), sine(angle)
    x, y, z = axis
    v = 1.0 - c
    return (
        c + v * x * x, v * x * y - s * z, v * x * z + s * y,
        v * x * y + s * z, c + v * y * y, v * y * z - s * x,
        v * x * z - s * y, v * y * z + s * x, c + v * z * z,
    )  # fmt: skip


@formula
def quaternion_turn(e: Four) -> Matrix:
    """C_PQ of Euler parameters, which need not be normalised."""
    w, x, y, z = e
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
        s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x),
        s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y),
    )  # fmt: skip


@formula
def rodrigues_quaternion(g: Vector) -> Four:
    """Euler parameters of Gibbs' vector, not normalised."""
    return 1.0, g[0], g[1], g[2]


@formula
def modified_quaternion(p: Vector) -> Four:
    """Euler parameters of modified Rodrigues parameters, not normalised."""
    return 1.0 - dot(p, p), 2.0 * p[0], 2.0 * p[1], 2.0 * p[2]


@inner
def quaternion_of(C: Matrix) -> Four:
    """Euler parameters of C_PQ, scalar part not negative (Shepperd's choice of the largest divisor)."""
    trace = C[0] + C[4] + C[8]
    if trace >= C[0] and trace >= C[4] and trace >= C[8]:
        w = 0.5 * math.sqrt(1.0 + trace)
        f = 0.25 / w
        return w, f * (C[7] - C[5]), f * (C[2] - C[6]), f * (C[3] - C[1])
    if C[0] >= C[4] and C[0] >= C[8]:
        x = 0.5 * math.sqrt(1.0 + C[0] - C[4] - C[8])
        f = 0.25 / x
        w, y, z = f * (C[7] - C[5]), f * (C[3] + C[1]), f * (C[6] + C[2])
    elif C[4] >= C[8]:
        y = 0.5 * math.sqrt(1.0 + C[4] - C[0] - C[8])
        f = 0.25 / y
        w, x, z = f * (C[2] - C[6]), f * (C[3] + C[1]), f * (C[7] + C[5])
    else:
        z = 0.5 * math.sqrt(1.0 + C[8] - C[0] - C[4])
        f = 0.25 / z
        w, x, y = f * (C[3] - C[1]), f * (C[6] + C[2]), f * (C[7] + C[5])
    sign = -1.0 if w < 0.0 else 1.0
    return sign * w, sign * x, sign * y, sign * z


@inner
def vector_coefficients(square: float) -> tuple[float, float, float, float, float]:
    """Of the angle a: s = sin(a)/a, c = (1 - cos a)/a^2, d = (a - sin a)/a^3, (s - 2c)/a^2, (c - 3d)/a^2."""
    b = square
    if b < SERIES_ANGLE * SERIES_ANGLE:
        return (
            1.0 - b / 6.0 * (1.0 - b / 20.0 * (1.0 - b / 42.0 * (1.0 - b / 72.0))),
            0.5 - b / 24.0 * (1.0 - b / 30.0 * (1.0 - b / 56.0 * (1.0 - b / 90.0))),
            1.0 / 6.0 - b / 120.0 * (1.0 - b / 42.0 * (1.0 - b / 72.0 * (1.0 - b / 110.0))),
            -1.0 / 12.0 + b * (1.0 / 180.0 - b * (1.0 / 6720.0 - b * (1.0 / 453600.0 - b / 47900160.0))),
            -1.0 / 60.0 + b * (1.0 / 1260.0 - b * (1.0 / 60480.0 - b * (1.0 / 4989600.0 - b / 622702080.0))),
        )
    a = math.sqrt(b)
    half = math.sin(0.5 * a)
    s, c, d = math.sin(a) / a, 2.0 * half * half / b, (a - math.sin(a)) / (b * a)
    return s, c, d, (s - 2.0 * c) / b, (c - 3.0 * d) / b


@formula
def polynomial(v: Vector, s: float, c: float) -> Matrix:
    """1 + s X + c X^2 with X = skew(v)."""
    x, y, z = v
    square = 1.0 - c * dot(v, v)
    return (
        square + c * x * x, c * x * y - s * z, c * x * z + s * y,
        c * x * y + s * z, square + c * y * y, c * y * z - s * x,
        c * x * z - s * y, c * y * z + s * x, square + c * z * z,
    )  # fmt: skip


@inner
def vector_turn(theta: Vector) -> Matrix:
    """C_PQ = exp(skew(theta))."""
    s, c, _, _, _ = vector_coefficients(dot(theta, theta))
    return polynomial(theta, s, c)


@inner
def vector_tangent(theta: Vector) -> Matrix:
    """T: rate of Q relative to P in P components = T dtheta/dt; in Q components T^T dtheta/dt."""
    _, c, d, _, _ = vector_coefficients(dot(theta, theta))
    return polynomial(theta, c, d)


@inner
def moving_vector_turn(theta: Vector, dtheta: Vector) -> tuple[Matrix, Matrix, Vector, Vector]:
    """exp(skew(theta)), its tangent T, the rate T dtheta/dt of Q relative to P, P components, and (dT/dt) dtheta/dt."""
    s, c, d, dc, dd = vector_coefficients(dot(theta, theta))
    along = dot(theta, dtheta)
    X_d = cross(theta, dtheta)
    XX_d = cross(theta, X_d)
    rate = add(dtheta, add(scale(c, X_d), scale(d, XX_d)))
    # with X = skew(theta), Y = skew(dtheta), Y dtheta = 0: (dc along X + d Y X + dd along X X) dtheta
    bias = add(scale(dc * along, X_d), add(scale(d, cross(dtheta, X_d)), scale(dd * along, XX_d)))
    return polynomial(theta, s, c), polynomial(theta, c, d), rate, bias


@inner
def vector_of(C: Matrix) -> Vector:
    """Rotation vector of C_PQ, of length at most pi."""
    w, x, y, z = quaternion_of(C)
    sine = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 if sine < 1e-12 else 2.0 * math.atan2(sine, w) / sine
    return factor * x, factor * y, factor * z


@inner
def unit_axis(number: float) -> Vector:
    """Unit vector of the axis with that number, 0 to 2."""
    return 1.0 if number == 0.0 else 0.0, 1.0 if number == 1.0 else 0.0, 1.0 if number == 2.0 else 0.0


@inner
def angles_turn(angles: Vector, numbers: Vector) -> Matrix:
    """C_PQ of three intrinsic turns about the axes with those numbers."""
    C = product(axis_turn(unit_axis(numbers[0]), angles[0]), axis_turn(unit_axis(numbers[1]), angles[1]))
    return product(C, axis_turn(unit_axis(numbers[2]), angles[2]))


@inner
def angles_of(C: Matrix, numbers: Vector) -> Vector:
    """Intrinsic angles of C_PQ; at the sequence's singularity the third is zero."""
    i, j = int(numbers[0]), int(numbers[1])
    k = 3 - i - j
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    singular = math.atan2(sign * C[3 * k + j], C[4 * j])
    if numbers[2] == numbers[0]:  # symmetric, such as zxz
        sine = math.sqrt(C[3 * i + j] ** 2 + C[3 * i + k] ** 2)
        middle = math.atan2(sine, C[4 * i])
        if sine < 1e-12:
            return singular, middle, 0.0
        return math.atan2(C[3 * j + i], -sign * C[3 * k + i]), middle, math.atan2(C[3 * i + j], sign * C[3 * i + k])
    cosine = math.sqrt(C[4 * i] ** 2 + C[3 * i + j] ** 2)
    middle = math.atan2(sign * C[3 * i + k], cosine)
    if cosine < 1e-12:
        return singular, middle, 0.0
    return math.atan2(-sign * C[3 * j + k], C[4 * k]), middle, math.atan2(-sign * C[3 * i + j], C[4 * i])


@inner
def angle_rates(angles: Vector, numbers: Vector, omega: Vector) -> Vector:
    """Rates of intrinsic angles: dangles/dt of omega = B dangles/dt."""
    third = unit_axis(numbers[2])
    C = axis_turn(third, angles[2])
    b = turn_back(C, unit_axis(numbers[1]))
    a = turn_back(product(axis_turn(unit_axis(numbers[1]), angles[1]), C), unit_axis(numbers[0]))
    return solve3((a[0], b[0], third[0], a[1], b[1], third[1], a[2], b[2], third[2]), omega)


@formula
def quaternion_rates(e: Four, omega: Vector) -> Four:
    """dEuler parameters/dt = 1/2 e o (0, omega)."""
    a, b, c = omega
    return (
        0.5 * (-e[1] * a - e[2] * b - e[3] * c),
        0.5 * (e[0] * a + e[2] * c - e[3] * b),
        0.5 * (e[0] * b + e[3] * a - e[1] * c),
        0.5 * (e[0] * c + e[1] * b - e[2] * a),
    )


@formula
def rodrigues_rates(g: Vector, omega: Vector) -> Vector:
    """dg/dt = (omega + g x omega + g (g . omega))/2 of Gibbs' vector."""
    return scale(0.5, add(add(omega, cross(g, omega)), scale(dot(g, omega), g)))


@formula
def modified_rates(p: Vector, omega: Vector) -> Vector:
    """dp/dt = ((1 - p . p) omega + 2 p x omega + 2 p (p . omega))/4 of modified Rodrigues parameters."""
    along = add(cross(p, omega), scale(dot(p, omega), p))
    return add(scale(0.25 * (1.0 - dot(p, p)), omega), scale(0.5, along))


@inner
def quaternion_advanced(e: Four, theta: Vector) -> Four:
    """Euler parameters of C_PQ exp(skew(theta))."""
    half = 0.5 * math.sqrt(dot(theta, theta))
    c = math.cos(half)
    s = 0.5 * (math.sin(half) / half if half > 1e-6 else 1.0 - half * half / 6.0)
    p, q, r = scale(s, theta)
    return (
        e[0] * c - e[1] * p - e[2] * q - e[3] * r,
        e[1] * c + e[0] * p + e[2] * r - e[3] * q,
        e[2] * c + e[0] * q + e[3] * p - e[1] * r,
        e[3] * c + e[0] * r + e[1] * q - e[2] * p,
    )
