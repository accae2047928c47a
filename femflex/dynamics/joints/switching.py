"""Changes of coordinates between two steps: the shadow of modified Rodrigues parameters, and re-based balls.

The motion is not touched: the new coordinates say the same orientation, and where a reference changes it is part of q.
Compiled apart from `rate`, and only for models that have such balls.
"""

from __future__ import annotations

import math

from femflex.arrays import Array, Record, Table
from femflex.dynamics.joints.ball import ball_coordinates_turn, intrinsic_angles
from femflex.dynamics.lowering.layout import BALL_MODIFIED, BALL_QUATERNION, BALL_RODRIGUES, W_NEAR, body_of, header_of
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import pointer
from femflex.kernels.symbols import types
from femflex.kernels.turns import angles_turn, quaternion_of, quaternion_turn
from femflex.kernels.vectors import ZERO, dot, load3, load4, product, scale, store3, store4, transpose
from femflex.system.ball import NEAR

_vector = types.float64[::1]
SWITCH = types.int64(types.float64, _vector, types.int64[::1], _vector, _vector)

FAR_RODRIGUES = math.tan(0.5 * (math.pi - NEAR)) ** 2
NEAR_ANGLES = math.sin(NEAR)


@inner
def is_near_singularity(b: Record, q: Array, pool: Array) -> bool:
    """Whether a re-based ball is closer than NEAR to the singularity of its set."""
    j = b["q"] + b["n_slide"]
    if b["ball"] == BALL_RODRIGUES:
        return dot(load3(q, j), load3(q, j)) > FAR_RODRIGUES
    axes = b["axes"] + 3 * b["n_slide"]
    turn = math.sin(q[j + 1]) if pool[axes] == pool[axes + 2] else math.cos(q[j + 1])
    return abs(turn) < NEAR_ANGLES


@inner
def rebase(b: Record, q: Array, pool: Array) -> None:
    """Count the ball's coordinates from a new reference, from which they are farthest from their singularity."""
    j, axes = b["q"] + b["n_slide"], b["axes"] + 3 * b["n_slide"]
    C = product(quaternion_turn(load4(q, b["reference"])), ball_coordinates_turn(b, q, pool))
    store3(q, j, ZERO)
    if b["ball"] != BALL_RODRIGUES and pool[axes] == pool[axes + 2]:
        q[j + 1] = 0.5 * math.pi
        C = product(C, transpose(angles_turn(intrinsic_angles(b, q, j), load3(pool, axes))))
    store4(q, b["reference"], quaternion_of(C))


@inner
def switch_ball(b: Record, q: Array, pool: Array) -> int:
    """1 after a change of the ball's coordinates, 0 when they are good as they are."""
    if b["ball"] == BALL_MODIFIED:
        j = b["q"] + b["n_slide"]
        square = dot(load3(q, j), load3(q, j))
        if square > 1.0:
            store3(q, j, scale(-1.0 / square, load3(q, j)))
            return 1
    elif b["reference"] and is_near_singularity(b, q, pool):
        rebase(b, q, pool)
        return 1
    return 0


@inner
def angle_to_singularity(b: Record, q: Array, pool: Array) -> float:
    """Return the angle that remains to the singularity of a ball's set (see femflex.rotations.singularity_distance)."""
    j = b["q"] + b["n_slide"]
    if b["ball"] == BALL_RODRIGUES or b["ball"] == BALL_MODIFIED:
        half = math.atan(math.sqrt(dot(load3(q, j), load3(q, j))))
        return math.pi - 2.0 * half if b["ball"] == BALL_RODRIGUES else 2.0 * math.pi - 4.0 * half
    axes = b["axes"] + 3 * b["n_slide"]
    turn = math.sin(q[j + 1]) if pool[axes] == pool[axes + 2] else math.cos(q[j + 1])
    return math.asin(abs(turn))


@inner
def note_smallest_angle(b: Record, t: float, q: Array, pool: Array, work: Array) -> None:
    """Keep the least angle that was left to a ball's singularity, and when."""
    note = b["work"] + W_NEAR
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
        if b["ball"] > BALL_QUATERNION:
            note_smallest_angle(b, t, pointer(x), pointer(pool), pointer(work))
            changed += switch_ball(b, pointer(x), pointer(pool))
    return changed
