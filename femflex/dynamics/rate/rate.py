"""The equations of motion (9), compiled: rate of the state.

Every function here has one fixed signature over flat arrays, so that nothing is compiled per model. What few models
have stands behind an address in the header, and is compiled for these alone:

CONSTRAIN     constrain(t, q, u, udot, stiff, table, pool, work)
              Adds to udot (n_u,) what the multipliers of constraints give; stiff: 1 after the recursion of an implicit
              step.
LENGTHS       solve_lengths(t, k, q, u, udot, table, pool, work)
              Before solution k of the accelerations: sets those of the free lengths, from the solution udot before.
LENGTH_STEPS  step_lengths(t, k, q, v, vdot, out, c_d, table, pool, work)
              The same before solution k of Newton's correction of vdot; out (n_u,) is the solution before.
STAGE         place_all(t, q, u, table, pool, work), load_all, place_and_cancel
              Places all bodies; writes the forces on them; does both, with forces on the coordinates that cancel the
              terms of eq. (9) left out. The first two serve all kernels, which would compile them anew.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.bodies.added_mass import call_add_mass
from femflex.dynamics.bodies.inertia import deform
from femflex.dynamics.bodies.varying import carry_material, write_varying_bodies
from femflex.dynamics.forces.base_frame import move_base
from femflex.dynamics.forces.forces import clear_all_joint_forces, write_forces
from femflex.dynamics.joints.coordinates import coordinate_rates
from femflex.dynamics.joints.prescribed_motion import add_known_accelerations, prescribed_state
from femflex.dynamics.layout.records import body_of, header_of, header_record
from femflex.dynamics.rate.auxiliary_states import copy_auxiliary_states, write_auxiliary_rates
from femflex.dynamics.rate.kinematics import place_body
from femflex.dynamics.rate.recursion import accelerate, reduce_to_root
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.entries import ARRAYS, INTEGER, NUMBERS, POINTERS, REAL, VECTOR, VOID, caller, entry
from femflex.kernels.lanes import offset, pointer

RATE = VOID(REAL, VECTOR, VECTOR, *ARRAYS)
CONSTRAIN = VOID(REAL, NUMBERS, NUMBERS, NUMBERS, INTEGER, *POINTERS)
LENGTHS = VOID(REAL, INTEGER, NUMBERS, NUMBERS, NUMBERS, *POINTERS)
LENGTH_STEPS = VOID(REAL, INTEGER, NUMBERS, NUMBERS, NUMBERS, NUMBERS, REAL, *POINTERS)
STAGE = VOID(REAL, NUMBERS, NUMBERS, *POINTERS)
call_constrain, call_lengths, call_length_steps, call_stage = (
    caller(kind) for kind in (CONSTRAIN, LENGTHS, LENGTH_STEPS, STAGE)
)


def link_stages(table: Table) -> None:
    """Fill in the addresses of the stages that all models have."""
    head = header_record(table)
    head["placing"], head["loading"] = place_all.address, load_all.address


@entry(STAGE)
def place_all(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Place every body at the state (q, u) and write its moments."""
    move_base(t, table, pool, work)
    if header_of(table)["n_varying"] > 0:
        write_varying_bodies(t, table, pool, work)
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        place_body(b, body_of(table, b["parent"]), q, u, pool, work)
        deform(b, pool, work)
        if b["flows"]:
            carry_material(b, pool, work)
    if header_of(table)["add_mass"] != 0:
        call_add_mass(header_of(table)["add_mass"], t, table, pool, work)


@entry(STAGE)
def load_all(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Write all forces but those of constraints on the placed bodies, no term left out."""
    if header_of(table)["constrain"] != 0:
        clear_all_joint_forces(table, work)
    write_forces(t, q, u, table, pool, work)


@inner
def place_bodies(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Place every body at the state (q, u) and write its moments."""
    call_stage(header_of(table)["placing"], t, q, u, table, pool, work)


@inner
def place_and_load_all(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Place every body at the state (q, u), and write all forces but those of constraints, no term left out."""
    place_bodies(t, q, u, table, pool, work)
    call_stage(header_of(table)["loading"], t, q, u, table, pool, work)


@inner
def place_and_load(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Place every body at the state (q, u), and write all forces that act but those of constraints."""
    head = header_of(table)
    if head["left_out"] != 0:
        call_stage(head["left_out"], t, q, u, table, pool, work)
    else:
        place_and_load_all(t, q, u, table, pool, work)


@inner
def write_accelerations(t: float, q: Array, u: Array, udot: Array, table: Table, pool: Array, work: Array) -> None:
    """Write udot of M udot + h = Q + A^T lambda, A udot = bdot - Adot u, with prescribed freedoms at their values."""
    place_and_load(t, q, u, table, pool, work)
    head = header_of(table)
    if head["n_holds"] > 0:
        add_known_accelerations(table, work)
    forced = head["constrain"] != 0
    reduce_to_root(table, pool, work, 0.0, 0.0, forced)
    accelerate(table, work, udot, forced)
    if forced:
        call_constrain(head["constrain"], t, q, u, udot, 0, table, pool, work)


@inner
def n_solutions(table: Table) -> int:
    """Solutions that the accelerations take: with n free lengths n + 1 trials, and that with the lengths' own."""
    n = header_of(table)["n_free"]
    return n + 2 if n > 0 else 1


@kernel(RATE)
def rate(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """Write dx/dt of x = (q, u, z): qdot = N(q) u, M udot = Q - h + A^T lambda, and zdot, in O(n).

    Prescribed freedoms have (sdot, sddot).
    """
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    head = header_of(records)
    q, u, dq, udot = pointer(x), offset(x, head["n_q"]), pointer(dx), offset(dx, head["n_q"])
    copy_auxiliary_states(u, records, scratch)
    if head["n_holds"] > 0:
        q, u = prescribed_state(t, q, u, records, numbers, scratch)
    for k in range(n_solutions(records)):
        if head["n_free"] > 0:
            call_lengths(head["solve_lengths"], t, k, q, u, udot, records, numbers, scratch)
        write_accelerations(t, q, u, udot, records, numbers, scratch)
    write_auxiliary_rates(offset(udot, head["n_u"]), records, numbers, scratch)
    for i in range(1, head["n_bodies"]):
        coordinate_rates(body_of(records, i), q, u, dq, numbers)
