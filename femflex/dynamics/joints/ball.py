"""Balls: the turn, rates and finite motion of a joint that turns freely, in rotation sets besides Euler parameters.

The coordinates of extrinsic angles stand in the order of their turns and are read backwards: the last turn about an
axis that stays is the first of the intrinsic ones that make the same rotation. A reference stands before it all, in P.

Between two steps coordinates change to the shadow of modified Rodrigues parameters, or to those from a new reference.
The motion is not touched: they say the same orientation, and a reference that changes is part of q. This call is
compiled only for models that have such balls.
"""

from __future__ import annotations

import math

from femflex.arrays import Array, Record, Table
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.records import body_of, header_of
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.entries import ARRAYS, INTEGER, REAL, VECTOR
from femflex.kernels.lanes import pointer
from femflex.kernels.turns import (
    angle_rates,
    angles_of,
    angles_turn,
    modified_quaternion,
    modified_rates,
    quaternion_advanced,
    quaternion_of,
    quaternion_turn,
    rodrigues_quaternion,
    rodrigues_rates,
    vector_turn,
)
from femflex.kernels.vectors import (
    ZERO,
    Matrix,
    Vector,
    dot,
    load3,
    load4,
    product,
    scale,
    store3,
    store4,
    sub,
    transpose,
)
from femflex.system.ball import NEAR


@inner
def intrinsic_angles(b: Record, q: Array, j: int) -> Vector:
    """Angles at q[j] in the order of intrinsic turns."""
    return (q[j + 2], q[j + 1], q[j]) if b["ball"] == at.BALL_EXTRINSIC else load3(q, j)


@inner
def store_angles(b: Record, q: Array, j: int, angles: Vector) -> None:
    """Write angles of intrinsic turns to q[j] in the order of the ball's own."""
    store3(q, j, (angles[2], angles[1], angles[0]) if b["ball"] == at.BALL_EXTRINSIC else angles)


@inner
def ball_coordinates_turn(b: Record, q: Array, pool: Array) -> Matrix:
    """C_RQ of the coordinates of a ball, counted from its reference."""
    j = b["q"] + b["n_slide"]
    if b["ball"] == at.BALL_RODRIGUES:
        return quaternion_turn(rodrigues_quaternion(load3(q, j)))
    if b["ball"] == at.BALL_MODIFIED:
        return quaternion_turn(modified_quaternion(load3(q, j)))
    return angles_turn(intrinsic_angles(b, q, j), load3(pool, b["axes"] + 3 * b["n_slide"]))


@inner
def ball_turn(b: Record, q: Array, pool: Array) -> Matrix:
    """C_PQ of a ball whose coordinates are not Euler parameters."""
    C = ball_coordinates_turn(b, q, pool)
    return product(quaternion_turn(load4(q, b["reference"])), C) if b["reference"] else C


@inner
def ball_rates(b: Record, q: Array, omega: Vector, dq: Array, pool: Array) -> None:
    """Rates of coordinates that are not Euler parameters, of a ball turning at omega, Q components."""
    j = b["q"] + b["n_slide"]
    if b["ball"] == at.BALL_RODRIGUES:
        store3(dq, j, rodrigues_rates(load3(q, j), omega))
    elif b["ball"] == at.BALL_MODIFIED:
        store3(dq, j, modified_rates(load3(q, j), omega))
    else:
        numbers = load3(pool, b["axes"] + 3 * b["n_slide"])
        store_angles(b, dq, j, angle_rates(intrinsic_angles(b, q, j), numbers, omega))
    if b["reference"]:
        store4(dq, b["reference"], (0.0, 0.0, 0.0, 0.0))


@inner
def nearest_turns(angles: Vector, old: Vector) -> Vector:
    """Angles shifted by whole turns to lie next to the old ones."""
    full_turn = 2.0 * math.pi
    return (
        angles[0] + full_turn * math.floor((old[0] - angles[0]) / full_turn + 0.5),
        angles[1] + full_turn * math.floor((old[1] - angles[1]) / full_turn + 0.5),
        angles[2] + full_turn * math.floor((old[2] - angles[2]) / full_turn + 0.5),
    )


@inner
def nearest_angles(angles: Vector, old: Vector, numbers: Vector) -> Vector:
    """Of the two sets of angles of one turn, each up to whole turns, the one next to the old angles."""
    first = nearest_turns(angles, old)
    mirror = -angles[1] if numbers[2] == numbers[0] else math.pi - angles[1]
    second = nearest_turns((angles[0] + math.pi, mirror, angles[2] + math.pi), old)
    to_first, to_second = sub(first, old), sub(second, old)
    return first if dot(to_first, to_first) <= dot(to_second, to_second) else second


@inner
def advance_ball(b: Record, q: Array, theta: Vector, out: Array, pool: Array) -> None:
    """Coordinates, not Euler parameters, of C_PQ exp(skew(theta)): next to the old ones where a set has several."""
    j = b["q"] + b["n_slide"]
    if b["ball"] == at.BALL_RODRIGUES:
        w, x, y, z = quaternion_advanced(rodrigues_quaternion(load3(q, j)), theta)
        store3(out, j, scale(1.0 / w, (x, y, z)))
    elif b["ball"] == at.BALL_MODIFIED:
        p = load3(q, j)
        w, x, y, z = quaternion_advanced(modified_quaternion(p), theta)
        store3(out, j, scale(1.0 / (1.0 + dot(p, p) + w), (x, y, z)))
    else:
        numbers, old = load3(pool, b["axes"] + 3 * b["n_slide"]), intrinsic_angles(b, q, j)
        C = product(angles_turn(old, numbers), vector_turn(theta))
        store_angles(b, out, j, nearest_angles(angles_of(C, numbers), old, numbers))
    if b["reference"]:
        store4(out, b["reference"], load4(q, b["reference"]))


SWITCH = INTEGER(REAL, VECTOR, *ARRAYS)


@inner
def rebase(b: Record, q: Array, pool: Array) -> None:
    """Count the ball's coordinates from a new reference, from which they are farthest from their singularity."""
    j, axes = b["q"] + b["n_slide"], b["axes"] + 3 * b["n_slide"]
    C = product(quaternion_turn(load4(q, b["reference"])), ball_coordinates_turn(b, q, pool))
    store3(q, j, ZERO)
    if b["ball"] != at.BALL_RODRIGUES and pool[axes] == pool[axes + 2]:
        q[j + 1] = 0.5 * math.pi
        C = product(C, transpose(angles_turn(intrinsic_angles(b, q, j), load3(pool, axes))))
    store4(q, b["reference"], quaternion_of(C))


@inner
def angle_to_singularity(b: Record, q: Array, pool: Array) -> float:
    """Return the angle that remains to the singularity of a ball's set (see femflex.rotations.singularity_distance)."""
    j = b["q"] + b["n_slide"]
    if b["ball"] == at.BALL_RODRIGUES or b["ball"] == at.BALL_MODIFIED:
        half = math.atan(math.sqrt(dot(load3(q, j), load3(q, j))))
        return math.pi - 2.0 * half if b["ball"] == at.BALL_RODRIGUES else 2.0 * math.pi - 4.0 * half
    axes = b["axes"] + 3 * b["n_slide"]
    turn = math.sin(q[j + 1]) if pool[axes] == pool[axes + 2] else math.cos(q[j + 1])
    return math.asin(abs(turn))


@inner
def switch_ball(b: Record, q: Array, pool: Array) -> int:
    """1 after a change of the ball's coordinates, 0 when they are good as they are."""
    if b["ball"] == at.BALL_MODIFIED:
        j = b["q"] + b["n_slide"]
        square = dot(load3(q, j), load3(q, j))
        if square > 1.0:
            store3(q, j, scale(-1.0 / square, load3(q, j)))
            return 1
    elif b["reference"] and angle_to_singularity(b, q, pool) < NEAR:
        rebase(b, q, pool)
        return 1
    return 0


@inner
def note_smallest_angle(b: Record, t: float, q: Array, pool: Array, work: Array) -> None:
    """Keep the least angle that was left to a ball's singularity, and when."""
    note = b["work"] + at.W_NEAR
    angle = angle_to_singularity(b, q, pool)
    if angle < work[note]:
        work[note], work[note + 1] = angle, t


@kernel(SWITCH)
def switch(t: float, x: Array, table: Table, pool: Array, work: Array) -> int:
    """Change the coordinates of balls near their singularity in x, in place; return how many, note the least angle."""
    records = pointer(table)
    changed = 0
    for i in range(1, header_of(records)["n_bodies"]):
        b = body_of(records, i)
        if b["ball"] > at.BALL_QUATERNION:
            note_smallest_angle(b, t, pointer(x), pointer(pool), pointer(work))
            changed += switch_ball(b, pointer(x), pointer(pool))
    return changed
