"""Free lengths of deploying bodies: the forces that they lack, and the accelerations at which they lack none.

The length L and its rate U are states of an effector, which gives the force F on the length in place of a rate of U.
For given accelerations of the lengths the model is one of specified lengths. The force that their drums need is affine
in these accelerations, so one trial for each and one more find them:

    drum force(Lddot) + drum mass Lddot = F
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.lowering.by_length import write_block
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.dynamics.motion.drum_force import drum_force, strain_force
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import offset

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
def place_of_length(k: int, table: Table, pool: Array) -> int:
    """Place in z of free length k."""
    count = 0
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        if b["free_length"]:
            if count == k:
                return int(pool[b["numbers"] + Z])
            count += 1
    return 0


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
    for k in range(head["n_free"]):
        dz[place_of_length(k, table, pool) + 1] = work[head["z"] + head["n_z"] + k]
