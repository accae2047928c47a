"""The residual of the equations of motion, and the linear solve with their matrices, as calls."""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.bodies.inertia import zero_forces
from femflex.dynamics.constraints.rows import push_rows, subtract_general
from femflex.dynamics.forces.forces import write_resistance
from femflex.dynamics.joints.prescribed_motion import (
    add_known_accelerations,
    is_prescribed_now,
    prescribed_state,
    write_prescribed_rows,
)
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.constraint_records import closing_of
from femflex.dynamics.layout.records import W_BIAS, W_TAU, body_of, header_of
from femflex.dynamics.rate.auxiliary_states import copy_auxiliary_states
from femflex.dynamics.rate.gathering import gather_residual
from femflex.dynamics.rate.rate import place_and_load, place_bodies
from femflex.dynamics.rate.recursion import accelerate, reduce_to_root
from femflex.kernels.compiled import kernel
from femflex.kernels.entries import ARRAYS, REAL, VECTOR, VOID
from femflex.kernels.lanes import pointer
from femflex.kernels.pairs import put_pair, zero_pair

RESIDUAL = VOID(REAL, VECTOR, VECTOR, VECTOR, VECTOR, *ARRAYS)
SOLVE = VOID(REAL, VECTOR, VECTOR, VECTOR, REAL, REAL, REAL, *ARRAYS)


@kernel(RESIDUAL)
def residual(t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = M(q, t) udot + h(q, u, t) - Q of eq. (9), in O(n); out = udot - sddot on the rows of prescribed freedoms.

    W_P has the force that every joint carries. With an eliminated root translation M is M - M_v^T M_vv^-1 M_v and
    forces work through displacements relative to O. Where the task is TASK_PUSH the forces A^T lambda of constraints
    count, with the multipliers that were solved for last.
    """
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    x, v, rates, forces = pointer(q), pointer(u), pointer(udot), pointer(out)
    head, closing = header_of(records), closing_of(records)
    pushed = closing["n_constraints"] > 0 and scratch[closing["task"]] == layout.TASK_PUSH
    copy_auxiliary_states(v, records, scratch)
    if head["n_holds"] > 0:
        x, v = prescribed_state(t, x, v, records, numbers, scratch)
    place_and_load(t, x, v, records, numbers, scratch)
    if pushed:
        push_rows(records, scratch)
    gather_residual(rates, forces, records, numbers, scratch)
    if pushed:
        subtract_general(forces, records, scratch)
    if head["n_holds"] > 0:
        write_prescribed_rows(rates, forces, records, scratch)


@kernel(SOLVE)
def solve(
    t: float,
    q: Array,
    rhs: Array,
    out: Array,
    c_m: float,
    c_d: float,
    c_k: float,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """out = (c_m M + c_d D + c_k K)^-1 rhs with M at q, D and K of shapes, springs and dampers; O(n).

    On prescribed freedoms the matrix is c_m times the unit matrix. K counts the stiffness of force terms; D leaves out
    what these resist at a rate, which is not known here. The states stand behind rhs, which is also handed to `place`
    for velocities: they only reach biases, which are cleared.
    """
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    x, right = pointer(q), pointer(rhs)
    head = header_of(records)
    copy_auxiliary_states(right, records, scratch)
    if head["n_holds"] > 0:
        x, _ = prescribed_state(t, x, right, records, numbers, scratch)
        for k in range(head["n_u"]):
            scratch[head["known"] + k] = scratch[head["flags"] + k] * right[k] / c_m
    place_bodies(t, x, right, records, numbers, scratch)
    if c_k != 0.0 and head["n_terms"] > 0:
        write_resistance(t, x, right, 0.0, c_k / c_m, records, numbers, scratch)
    for i in range(1, head["n_bodies"]):
        b = body_of(records, i)
        w = b["work"]
        zero_forces(b, scratch)
        put_pair(scratch, w + W_BIAS, zero_pair())
        for k in range(b["n_h"] - (3 if b["hidden"] else 0)):
            prescribed = b["held"] and is_prescribed_now(b, k, scratch)
            scratch[w + W_TAU + k] = 0.0 if prescribed else right[b["u"] + k] / c_m
        for k in range(b["n"]):
            scratch[b["pn"] + k] = -right[b["ue"] + k] / c_m
    if head["n_holds"] > 0:
        add_known_accelerations(records, scratch)
    reduce_to_root(records, numbers, scratch, c_d / c_m, c_k / c_m, True)
    accelerate(records, scratch, pointer(out), True)
