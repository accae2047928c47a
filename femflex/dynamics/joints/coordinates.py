"""Coordinates of joints and shapes: their rates from quasi-velocities, and their change by a finite motion.

KINEMATIC    see femflex.integrate.protocol
ADVANCE      out = q o exp(increment), (n_q,): where q is after unit time at the constant quasi-velocity `increment`
             (n_u,); out is never q itself
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.joints.ball import advance_ball, ball_rates
from femflex.dynamics.layout.records import BALL_NONE, BALL_QUATERNION, body_of, header_of
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.entries import ARRAYS, REAL, VECTOR, VOID
from femflex.kernels.lanes import pointer
from femflex.kernels.turns import quaternion_advanced, quaternion_rates
from femflex.kernels.vectors import load3, load4, store4

KINEMATIC = VOID(REAL, VECTOR, VECTOR, VECTOR, *ARRAYS)
ADVANCE = VOID(VECTOR, VECTOR, VECTOR, *ARRAYS)


@inner
def coordinate_rates(b: Record, q: Array, u: Array, dq: Array, pool: Array) -> None:
    """qdot = N(q) u of one body's joint and elastic coordinates."""
    for k in range(b["n_slide"] + b["n_turn"]):
        dq[b["q"] + k] = u[b["u"] + k]
    j, v = b["q"] + b["n_slide"], b["u"] + b["n_slide"]
    if b["ball"] == BALL_QUATERNION:
        store4(dq, j, quaternion_rates(load4(q, j), load3(u, v)))
    elif b["ball"] != BALL_NONE:
        ball_rates(b, q, load3(u, v), dq, pool)
    for k in range(b["n"]):
        dq[b["qe"] + k] = u[b["ue"] + k]


@inner
def advance_coordinates(b: Record, q: Array, step: Array, out: Array, pool: Array) -> None:
    """One body's joint and elastic coordinates after unit time at the constant quasi-velocity `step`."""
    for k in range(b["n_slide"] + b["n_turn"]):
        out[b["q"] + k] = q[b["q"] + k] + step[b["u"] + k]
    j, v = b["q"] + b["n_slide"], b["u"] + b["n_slide"]
    if b["ball"] == BALL_QUATERNION:
        store4(out, j, quaternion_advanced(load4(q, j), load3(step, v)))
    elif b["ball"] != BALL_NONE:
        advance_ball(b, q, load3(step, v), out, pool)
    for k in range(b["n"]):
        out[b["qe"] + k] = q[b["qe"] + k] + step[b["ue"] + k]


@kernel(KINEMATIC)
def kinematic(t: float, q: Array, u: Array, dq: Array, table: Table, pool: Array, work: Array) -> None:
    """dq/dt = N(q) u."""
    records = pointer(table)
    for i in range(1, header_of(records)["n_bodies"]):
        coordinate_rates(body_of(records, i), pointer(q), pointer(u), pointer(dq), pointer(pool))


@kernel(ADVANCE)
def advance(q: Array, increment: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = q o exp(increment): the coordinates after unit time at the constant quasi-velocity `increment` (n_u,)."""
    records = pointer(table)
    for i in range(1, header_of(records)["n_bodies"]):
        advance_coordinates(body_of(records, i), pointer(q), pointer(increment), pointer(out), pointer(pool))
