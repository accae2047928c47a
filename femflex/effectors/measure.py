"""Exact measurements of motion: the signal of a sensor before period, delay, noise and quantisation."""

from __future__ import annotations

import math

from femflex.arrays import Array
from femflex.effectors.gyro import rotated
from femflex.kernels.compiled import inner
from femflex.kernels.entries import ACT, entry
from femflex.kernels.vectors import (
    Matrix,
    Vector,
    add,
    cross,
    dot,
    load3,
    load9,
    product,
    scale,
    store3,
    sub,
    transpose,
    turn,
    turn_back,
)

# parameters, as femflex.effectors.sensor lays them: kind, number of markers, bias (3), then own numbers
KIND, MARKERS, BIAS, OWN = 0, 1, 2, 5
ATTITUDE, RATE, DISPLACEMENT, VELOCITY, ACCELERATION, POINTING, JOINT, VALUE, VECTOR = 0, 1, 2, 3, 4, 5, 6, 7, 9


@inner
def attitude_error(R: Matrix) -> Vector:
    """2 sign(q_0) (q_1, q_2, q_3) of the rotation R: its rotation vector where it is small, 2 long at half a turn."""
    trace = R[0] + R[4] + R[8]
    axis = (R[7] - R[5], R[2] - R[6], R[3] - R[1])  # 4 q_0 q
    if trace > 0.0:
        return scale(1.0 / math.sqrt(1.0 + trace), axis)
    if R[0] >= R[4] and R[0] >= R[8]:
        four = 2.0 * math.sqrt(1.0 + R[0] - R[4] - R[8])
        q, q0 = (0.25 * four, (R[1] + R[3]) / four, (R[2] + R[6]) / four), (R[7] - R[5]) / four
    elif R[4] >= R[8]:
        four = 2.0 * math.sqrt(1.0 + R[4] - R[0] - R[8])
        q, q0 = ((R[1] + R[3]) / four, 0.25 * four, (R[5] + R[7]) / four), (R[2] - R[6]) / four
    else:
        four = 2.0 * math.sqrt(1.0 + R[8] - R[0] - R[4])
        q, q0 = ((R[2] + R[6]) / four, (R[5] + R[7]) / four, 0.25 * four), (R[3] - R[1]) / four
    return scale(2.0 if q0 >= 0.0 else -2.0, q)


@inner
def in_axes_of_second(seen: Array, m: int, v: Vector) -> Vector:
    """An inertial vector in the axes of the second marker, or as it is without one."""
    if m == 2:
        return turn_back(load9(seen, 3 * m + 9), v)
    return v


@entry(ACT)
def measure(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Channels: x, y, z; of pointing, joints and values one or two numbers.

    attitude       error of the first marker against a reference, turned by an angle (input) about an axis of the
                   reference where it is given, in marker axes
    rate           inertial rate in marker axes
    displacement   of the first marker from the second, in the axes of the second, less an offset; inertial without one
    velocity       rate of that
    acceleration   inertial acceleration in marker axes behind a lag of first order; the states are the lagged velocity
    pointing       angle between an axis of the first marker and an inertial direction, or towards the second marker
    joint          coordinate and rate of a slide or turn
    value          an input
    vector         three inputs, inertial components, in marker axes
    """
    p = parameters
    kind, m = int(p[KIND]), int(p[MARKERS])
    bias, first = load3(p, BIAS), 6 * m
    if kind == JOINT:
        out[1], out[2] = seen[0] + bias[0], seen[1]
        return
    if kind == VALUE:
        out[0] = seen[0] + bias[0]
        return
    C = load9(seen, 3 * m)
    if kind == ATTITUDE:
        reference = load9(p, OWN)
        if p[OWN + 9] > 0.0:
            axis, angle = turn(reference, load3(p, OWN + 10)), seen[18 * m]
            x = rotated((reference[0], reference[3], reference[6]), axis, angle)
            y = rotated((reference[1], reference[4], reference[7]), axis, angle)
            w = cross(x, y)
            reference = (x[0], y[0], w[0], x[1], y[1], w[1], x[2], y[2], w[2])
        if m == 2:
            reference = product(load9(seen, 3 * m + 9), reference)
        store3(out, first, add(bias, attitude_error(product(transpose(reference), C))))
    elif kind == RATE:
        store3(out, first, add(bias, turn_back(C, load3(seen, 15 * m))))
    elif kind == VECTOR:
        store3(out, first, add(bias, turn_back(C, load3(seen, 18 * m))))
    elif kind == DISPLACEMENT or kind == VELOCITY:
        r, v = load3(seen, 0), load3(seen, 12 * m)
        if m == 2:
            r = sub(r, load3(seen, 3))
            v = sub(sub(v, load3(seen, 12 * m + 3)), cross(load3(seen, 15 * m + 3), r))
        value = (
            sub(in_axes_of_second(seen, m, r), load3(p, OWN)) if kind == DISPLACEMENT else in_axes_of_second(seen, m, v)
        )
        store3(out, first, add(bias, value))
    elif kind == ACCELERATION:
        change = scale(p[OWN], sub(load3(seen, 12 * m), load3(z, 0)))
        store3(out, first, change)
        store3(out, first + 3, add(bias, turn_back(C, change)))
    else:
        axis, aim = turn(C, load3(p, OWN)), load3(p, OWN + 3)
        if m == 2:
            aim = sub(load3(seen, 3), load3(seen, 0))
        normal = cross(axis, aim)
        out[first] = bias[0] + math.atan2(math.sqrt(dot(normal, normal)), dot(axis, aim))
