"""Newton's correction of implicit integrators, with the multipliers of constraints and the accelerations of lengths.

(M + c_d D + c_k K) d - A^T lambda = -(M udot + h - Q) and A (udot + d) = bdot - Adot u, in one pass of the recursion
(see `femflex.dynamics.motion.correction`). The integrator removes the drift, by `project`.

The accelerations of free lengths are unknowns like the others: the step of bodies and joints is affine in them, and
what the drums lack in force (see `free_lengths`) is differenced along them, length and rate moving as the step moves
them.

    lack(Lddot + d) = 0,     L and U moved by c_d^2 d and c_d d

Trees without free lengths use femflex.dynamics.motion.correction instead and never load this.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.constraints.equations import constrain
from femflex.dynamics.constraints.free_lengths import write_imbalance
from femflex.dynamics.lowering.constraint_layout import closing_of
from femflex.dynamics.lowering.layout import header_of
from femflex.dynamics.motion.auxiliary_states import copy_auxiliary_states
from femflex.dynamics.motion.correction import resisted_accelerations, subtract_rates
from femflex.dynamics.motion.free_lengths import place_of_length, solve_dense, write_unit_blocks
from femflex.dynamics.motion.second_order import CORRECT
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer

STEP_RATIO = 1e-6  # of the rate of a length, by which it is differenced
LEAST_RATE = 1e-3  # of the length [1/s], added to its rate for this


@inner
def trial_step(z: Array, place: int, c_d: float) -> float:
    """Change of the acceleration of a length by which the lack of force is differenced."""
    return STEP_RATIO * (abs(z[place + 1]) + LEAST_RATE * abs(z[place])) / c_d if c_d > 0.0 else 1.0


@inner
def solve_length_changes(z: Array, zdot: Array, c_d: float, table: Table, pool: Array, work: Array) -> None:
    """Solve for the changes of the lengths' accelerations from their lack of force as they are and after trial steps.

    They are left in the last column of `needs`, and the accelerations in their slots.
    """
    head = header_of(table)
    n, needs, slots = head["n_free"], head["needs"], head["z"] + head["n_z"]
    for k in range(n):
        step = trial_step(z, place_of_length(k, table, pool), c_d)
        for i in range(n):
            row = needs + (n + 1) * i
            work[row + k] = (work[row + k] - work[row + n]) / step
    for k in range(n):
        work[needs + (n + 1) * k + n] = -work[needs + (n + 1) * k + n]
    solve_dense(offset(work, needs), n)
    for k in range(n):
        work[slots + k] = zdot[place_of_length(k, table, pool) + 1] + work[needs + (n + 1) * k + n]


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
    """out = -(M + c_d D + c_k K)^-1 (M udot + h - Q - A^T lambda) at the state (q, u), in O(n); or sddot - udot.

    It is zero along the constrained motion. The part of out for the states z follows (`correct_auxiliary_states`), that
    of free lengths with c_k = c_d^2 or near it.
    """
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    accelerations, rates, head = pointer(out), pointer(udot), header_of(records)
    x, v = pointer(q), pointer(u)
    n, slots = head["n_free"], head["z"] + head["n_z"]
    z, zdot = offset(v, head["n_u"]), offset(rates, head["n_u"])
    for k in range(n):
        scratch[slots + k] = zdot[place_of_length(k, records, numbers) + 1]
    trials = n + 1 if n > 0 else 0  # as given, then each alone
    q_now, u_now = x, v
    for trial in range(trials + 1):
        place, step, length, speed = 0, 0.0, 0.0, 0.0
        if 0 < trial < trials:
            place = place_of_length(trial - 1, records, numbers)
            step, length, speed = trial_step(z, place, c_d), z[place], z[place + 1]
            z[place], z[place + 1] = length + c_d * c_d * step, speed + c_d * step
            scratch[slots + trial - 1] += step
        elif n > 0 and trial == trials:
            solve_length_changes(z, zdot, c_d, records, numbers, scratch)
        if n > 0:
            copy_auxiliary_states(v, records, scratch)
            write_unit_blocks(records, numbers, scratch)
        q_now, u_now = resisted_accelerations(t, x, v, rates, accelerations, c_d, c_k, records, numbers, scratch)
        if trial < trials:
            write_imbalance(t, q_now, u_now, accelerations, n if trial == 0 else trial - 1, records, numbers, scratch)
        if 0 < trial < trials:
            z[place], z[place + 1] = length, speed
            scratch[slots + trial - 1] -= step
    if closing_of(records)["n_constraints"] > 0:
        constrain(t, q_now, u_now, accelerations, records, numbers, scratch, c_d != 0.0 or c_k != 0.0)
    subtract_rates(t, q_now, u_now, accelerations, rates, c_d, records, numbers, scratch)
    dz = offset(accelerations, head["n_u"])
    for k in range(n):
        place, change = place_of_length(k, records, numbers), scratch[head["needs"] + (n + 1) * k + n]
        dz[place] = z[place + 1] + c_d * change - zdot[place]
        dz[place + 1] = change
