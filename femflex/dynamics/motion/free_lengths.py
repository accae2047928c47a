"""The equations of motion of a model whose deploying bodies have free lengths.

The length L and its rate U are states of an effector, which gives the force F on the length in place of a rate of U.
For given accelerations of the lengths the model is one of specified lengths. The force that their drums need is affine
in these accelerations, so one trial for each and one more find them:

    drum force(Lddot) + drum mass Lddot = F
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.forces.work_per_length import clear_work_per_length
from femflex.dynamics.joints.coordinates import coordinate_rates
from femflex.dynamics.joints.prescribed_motion import prescribed_state
from femflex.dynamics.lowering.by_length import write_block
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.dynamics.motion.auxiliary_states import copy_auxiliary_states, write_auxiliary_rates
from femflex.dynamics.motion.drum_force import drum_force, strain_force
from femflex.dynamics.motion.equations import RATE
from femflex.dynamics.motion.gathering import write_residual
from femflex.dynamics.motion.prescribed_motion import write_accelerations
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer

SOURCE, Z, SLOT, PICKUP, STRAIN, DRUM_MASS = 7, 8, 9, 10, 11, 12  # of the numbers of a LengthTable


@inner
def write_unit_blocks(table: Table, pool: Array, work: Array) -> None:
    """Write the block of a unit rate of the length of every body whose length is free."""
    head = header_of(table)
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        if b["free_length"]:
            numbers = offset(pool, b["numbers"])
            L = work[head["z"] + int(numbers[Z])]
            write_block((L, 1.0, 0.0), numbers, offset(pool, b["unit"]))


@inner
def write_imbalance(
    t: float, x: Array, u: Array, udot: Array, column: int, table: Table, pool: Array, work: Array
) -> None:
    """Write the deficit of force of each free length, at the accelerations of lengths in their slots."""
    clear_work_per_length(table, pool)
    write_residual(t, x, u, udot, offset(work, header_of(table)["lack"]), table, pool, work)
    write_imbalance_entries(column, table, pool, work)


@inner
def write_imbalance_entries(column: int, table: Table, pool: Array, work: Array) -> None:
    """Write the deficit of force [N] of each free length at the state that was gathered last."""
    head = header_of(table)
    n, k = head["n_free"], 0
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        if b["free_length"]:
            numbers = offset(pool, b["numbers"])
            z, slot = int(numbers[Z]), int(numbers[SLOT])
            rate, acceleration = work[head["z"] + z + 1], work[head["z"] + slot]
            pickup = b["unit"] + int(numbers[PICKUP]) if numbers[PICKUP] >= 0.0 else -1
            imbalance = drum_force(i, rate, acceleration, pickup, table, pool, work)
            if numbers[STRAIN] >= 0.0:
                imbalance += strain_force(b, b["unit"] + int(numbers[STRAIN]), pool, work)
            imbalance += numbers[DRUM_MASS] * acceleration - work[head["zdot"] + z + 1]
            work[head["needs"] + (n + 1) * k + column] = imbalance
            k += 1


@inner
def solve_dense(a: Array, n: int) -> None:
    """Solve A x = b for [A | b] (n, n + 1) in place, A with a positive definite part; x in the last column."""
    for k in range(n):
        for i in range(k + 1, n):
            factor = a[(n + 1) * i + k] / a[(n + 1) * k + k]
            for j in range(k, n + 1):
                a[(n + 1) * i + j] -= factor * a[(n + 1) * k + j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            a[(n + 1) * k + n] -= a[(n + 1) * k + j] * a[(n + 1) * j + n]
        a[(n + 1) * k + n] /= a[(n + 1) * k + k]


@inner
def solve_lengths(table: Table, work: Array) -> None:
    """Put the accelerations [m/s^2] at which no free length lacks force into their slots."""
    head = header_of(table)
    n, needs, slots = head["n_free"], head["needs"], head["z"] + head["n_z"]
    for i in range(n):
        row = needs + (n + 1) * i
        for k in range(n):
            work[row + k] -= work[row + n]
        work[row + n] = -work[row + n]
    solve_dense(offset(work, needs), n)
    for k in range(n):
        work[slots + k] = work[needs + (n + 1) * k + n]


@inner
def write_length_rates(dz: Array, table: Table, pool: Array, work: Array) -> None:
    """Write the accelerations [m/s^2] in the slots as rates of the states that are speeds of lengths."""
    head = header_of(table)
    slots, k = head["z"] + head["n_z"], 0
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        if b["free_length"]:
            dz[int(pool[b["numbers"] + Z]) + 1] = work[slots + k]
            k += 1


@kernel(RATE)
def free_rate(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """dx/dt of the state x = (q, u, z) with free lengths among z."""
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    head = header_of(records)
    x_q, u, dq, udot = pointer(x), offset(x, head["n_q"]), pointer(dx), offset(dx, head["n_q"])
    n = head["n_free"]
    slots = head["z"] + head["n_z"]
    copy_auxiliary_states(u, records, scratch)
    write_unit_blocks(records, numbers, scratch)
    q, v = x_q, u
    if head["n_holds"] > 0:
        q, v = prescribed_state(t, x_q, u, records, numbers, scratch)
    for trial in range(n + 1):  # none first, then each alone
        for k in range(n):
            scratch[slots + k] = 1.0 if k + 1 == trial else 0.0
        write_accelerations(t, q, v, udot, records, numbers, scratch)
        column = n if trial == 0 else trial - 1
        write_imbalance(t, x_q, u, udot, column, records, numbers, scratch)
    solve_lengths(records, scratch)
    write_accelerations(t, q, v, udot, records, numbers, scratch)
    dz = offset(udot, head["n_u"])
    write_auxiliary_rates(dz, records, scratch)
    write_length_rates(dz, records, numbers, scratch)
    for i in range(1, head["n_bodies"]):
        coordinate_rates(body_of(records, i), q, v, dq, numbers)
