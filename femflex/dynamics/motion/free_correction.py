"""Newton's correction of implicit integrators for models whose deploying bodies have free lengths.

The accelerations of the lengths are unknowns like the others: the step of bodies and joints is affine in them, and what
the drums lack in force (see `free_lengths`) is differenced along them, length and rate moving as the step moves them.

    lack(Lddot + d) = 0,     L and U moved by c_d^2 d and c_d d

Compiled apart, and only at the first request.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.dynamics.motion.auxiliary_states import copy_auxiliary_states
from femflex.dynamics.motion.correction import resisted_accelerations, subtract_rates
from femflex.dynamics.motion.free_lengths import Z, solve_dense, write_imbalance, write_unit_blocks
from femflex.dynamics.motion.second_order import CORRECT
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer

STEP_RATIO = 1e-6  # of the rate of a length, by which it is differenced
LEAST_RATE = 1e-3  # of the length [1/s], added to its rate for this


@inner
def position_of_length(k: int, table: Table, pool: Array) -> int:
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
def trial_step(z: Array, position: int, c_d: float) -> float:
    """Change of the acceleration of a length by which the lack of force is differenced."""
    return STEP_RATIO * (abs(z[position + 1]) + LEAST_RATE * abs(z[position])) / c_d if c_d > 0.0 else 1.0


@inner
def write_imbalance_slopes(
    t: float,
    q: Array,
    u: Array,
    udot: Array,
    out: Array,
    c_d: float,
    c_k: float,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """Write rows [d(deficit)/d(Lddot), deficit] of the free lengths, at the step's motion of bodies and joints."""
    head = header_of(table)
    n, slots, z = head["n_free"], head["z"] + head["n_z"], offset(u, head["n_u"])
    for trial in range(n + 1):  # as given, then each alone
        k = trial - 1
        position, step, length, rate = 0, 0.0, 0.0, 0.0
        if trial > 0:
            position = position_of_length(k, table, pool)
            step, length, rate = trial_step(z, position, c_d), z[position], z[position + 1]
            z[position], z[position + 1] = length + c_d * c_d * step, rate + c_d * step
            work[slots + k] += step
        copy_auxiliary_states(u, table, work)
        write_unit_blocks(table, pool, work)
        resisted_accelerations(t, q, u, udot, out, c_d, c_k, False, table, pool, work)
        write_imbalance(t, q, u, out, n if trial == 0 else k, table, pool, work)
        if trial > 0:
            z[position], z[position + 1] = length, rate
            work[slots + k] -= step
    for k in range(n):
        step = trial_step(z, position_of_length(k, table, pool), c_d)
        for i in range(n):
            row = head["needs"] + (n + 1) * i
            work[row + k] = (work[row + k] - work[row + n]) / step


@kernel(CORRECT)
def correct(
    t: float,
    q: Array,
    u: Array,
    udot: Array,
    out: Array,
    c_d: float,
    c_k: float,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """Write Newton's correction of (udot, zdot), lengths among z, to out; c_k = c_d^2 or near it."""
    records, numbers, scratch, accelerations, rates = (
        pointer(table),
        pointer(pool),
        pointer(work),
        pointer(out),
        pointer(udot),
    )
    given, v, head = pointer(q), pointer(u), header_of(records)
    n, slots, needs = head["n_free"], head["z"] + head["n_z"], head["needs"]
    z, zdot = offset(v, head["n_u"]), offset(rates, head["n_u"])
    for k in range(n):
        scratch[slots + k] = zdot[position_of_length(k, records, numbers) + 1]
    write_imbalance_slopes(t, given, v, rates, accelerations, c_d, c_k, records, numbers, scratch)
    for k in range(n):
        scratch[needs + (n + 1) * k + n] = -scratch[needs + (n + 1) * k + n]
    solve_dense(offset(scratch, needs), n)
    for k in range(n):
        scratch[slots + k] = zdot[position_of_length(k, records, numbers) + 1] + scratch[needs + (n + 1) * k + n]
    copy_auxiliary_states(v, records, scratch)
    x, w = resisted_accelerations(t, given, v, rates, accelerations, c_d, c_k, False, records, numbers, scratch)
    subtract_rates(t, x, w, accelerations, rates, c_d, records, numbers, scratch)
    dz = offset(accelerations, head["n_u"])
    for k in range(n):
        position, change = position_of_length(k, records, numbers), scratch[needs + (n + 1) * k + n]
        dz[position] = z[position + 1] + c_d * change - zdot[position]
        dz[position + 1] = change
