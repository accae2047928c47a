"""Free lengths of deploying bodies: the forces that they lack, and the accelerations at which they lack none.

The length L and its rate U are states of an effector, which gives the force F on the length in place of a rate of U.
For given accelerations of the lengths the model is one of specified lengths, whose multipliers follow, and with them
what loops do at the members' own markers. The force that the drums need is affine in these accelerations, so one trial
for each and one more find them:

    drum force(Lddot) + drum mass Lddot = F

In Newton's correction the step of bodies and joints is affine in them likewise. What the drums lack in force is
differenced along them, length and rate moving as the step moves them:

    lack(Lddot + d) = 0,     L and U moved by c_d^2 d and c_d d
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.shapes import markers_motion
from femflex.dynamics.bodies.varying import length_motion
from femflex.dynamics.constraints.rows import push_rows, row_of
from femflex.dynamics.forces.effector_calls import solve_small
from femflex.dynamics.forces.marker_forces import clear_work_per_length, power_per_length
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.constraint_records import closing_of, constraint_of
from femflex.dynamics.layout.records import body_of, body_records, header_of, header_record
from femflex.dynamics.layout.variations import WORKED
from femflex.dynamics.layout.written_blocks import write_block
from femflex.dynamics.rate.auxiliary_states import copy_auxiliary_states, place_of_length
from femflex.dynamics.rate.drum_force import call_drum_force, drum_force
from femflex.dynamics.rate.gathering import gather_residual
from femflex.dynamics.rate.rate import LENGTH_STEPS, LENGTHS, place_and_load
from femflex.kernels.compiled import inner
from femflex.kernels.entries import entry
from femflex.kernels.lanes import offset
from femflex.kernels.vectors import ZERO, add, load3, scale, turn_back

STEP_RATIO = 1e-6  # of the rate of a length, by which it is differenced
LEAST_RATE = 1e-3  # of the length [1/s], added to its rate for this


def link_length_steps(table: Table) -> None:
    """Fill in the address of LENGTH_STEPS, before the first Newton's correction of a model with free lengths."""
    header_record(table)["step_lengths"] = step_lengths.address


def link_lengths(table: Table) -> None:
    """Fill in the addresses of the functions of bodies with a length: for reports, and for free lengths."""
    head = header_record(table)
    if head["n_free"]:
        head["solve_lengths"] = solve_lengths.address
    if body_records(table)["unit"].any():
        head["drum_force"] = drum_force.address


@inner
def write_unit_blocks(t: float, table: Table, pool: Array, work: Array) -> None:
    """Write the block of a unit rate of the length of every body that has a length."""
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        if b["unit"] > 0:
            L = length_motion(t, b, table, pool, work)[0]
            write_block((L, 1.0, 0.0), offset(pool, b["numbers"]), offset(pool, b["unit"]))


@inner
def add_marker_work(
    b: Record, c: Record, force_entry: int, rows: tuple[int, int, int, int], table: Table, pool: Array, work: Array
) -> None:
    """Add the work per length [N] of a constraint's rows at a marker of a deploying body; own: R_FP or R_FQ."""
    position, shape, spin, bends = rows
    force, torque = ZERO, ZERO
    for k in range(c["n_rows"]):
        r = row_of(table, c["first"] + k)
        factor = work[r + layout.R_LAMBDA]
        force = add(force, scale(factor, load3(work, r + force_entry)))
        torque = add(torque, scale(factor, load3(work, r + force_entry + 3)))
    T = markers_motion(pool, position, shape, spin, bends, b, work)[3]
    pool[b["unit"] - WORKED] += power_per_length(b, force, turn_back(T, torque), shape, spin, pool, work)


@inner
def add_constraint_work(table: Table, pool: Array, work: Array) -> None:
    """Add the work per length [N] of loops and discs at markers that move with the length."""
    for i in range(closing_of(table)["n_constraints"]):
        c = constraint_of(table, i)
        if c["kind"] == layout.CONSTRAINT_GENERAL:
            continue
        P, Q = body_of(table, c["parent"]), body_of(table, c["child"])
        if c["parent"] > 0 and c["bends_P"] >= at.VARIES and P["unit"] > 0:
            rows = c["place_P"], c["shape_P"], c["spin_P"], c["bends_P"]
            add_marker_work(P, c, layout.R_FP, rows, table, pool, work)
        if c["bends_Q"] >= at.VARIES and Q["unit"] > 0:
            rows = c["place_Q"], c["shape_Q"], c["spin_Q"], c["bends_Q"]
            add_marker_work(Q, c, layout.R_FQ, rows, table, pool, work)


@inner
def write_imbalance_entries(column: int, table: Table, pool: Array, work: Array) -> None:
    """Write the deficit of force [N] of each free length at the state that was gathered last."""
    head = header_of(table)
    n, k = head["n_free"], 0
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        if b["free_length"]:
            numbers, (_, rate, acceleration) = offset(pool, b["numbers"]), length_motion(0.0, b, table, pool, work)
            imbalance = (
                call_drum_force(head["drum_force"], i, rate, acceleration, table, pool, work)
                + numbers[at.LENGTH_DRUM_MASS] * acceleration
            )
            imbalance -= work[head["zdot"] + int(numbers[at.LENGTH_Z]) + 1]
            work[head["needs"] + (n + 1) * k + column] = imbalance
            k += 1


@inner
def write_imbalance(t: float, q: Array, u: Array, udot: Array, k: int, table: Table, pool: Array, work: Array) -> None:
    """Write the deficit of force [N] of each free length in a motion with accelerations udot (n_u,), of trial k.

    Lengths accelerate as their slots say, and constraints have the multipliers that were solved for. The first trial
    stands in the last column.
    """
    clear_work_per_length(table, pool)
    place_and_load(t, q, u, table, pool, work)
    push_rows(table, work)
    add_constraint_work(table, pool, work)
    gather_residual(udot, offset(work, header_of(table)["lack"]), table, pool, work)
    write_imbalance_entries(k - 1 if k > 0 else int(header_of(table)["n_free"]), table, pool, work)


@inner
def solve_accelerations(table: Table, work: Array) -> None:
    """Put the accelerations [m/s^2] at which no free length lacks force into their slots."""
    head = header_of(table)
    n, needs, slots = head["n_free"], head["needs"], head["z"] + head["n_z"]
    for i in range(n):
        row = needs + (n + 1) * i
        for k in range(n):
            work[row + k] -= work[row + n]
        work[row + n] = -work[row + n]
    solve_small(offset(work, needs), n)
    for k in range(n):
        work[slots + k] = work[needs + (n + 1) * k + n]


@entry(LENGTHS)
def solve_lengths(t: float, k: int, q: Array, u: Array, udot: Array, table: Table, pool: Array, work: Array) -> None:
    """Set the accelerations of the free lengths for solution k: none, each alone, and those at which no force lacks."""
    head = header_of(table)
    n, slots = head["n_free"], head["z"] + head["n_z"]
    if k == 0:
        write_unit_blocks(t, table, pool, work)
    else:
        write_imbalance(t, q, u, udot, k - 1, table, pool, work)
    if k > n:
        solve_accelerations(table, work)
    else:
        for j in range(n):
            work[slots + j] = 1.0 if j + 1 == k else 0.0


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
    solve_small(offset(work, needs), n)
    for k in range(n):
        work[slots + k] = zdot[place_of_length(k, table, pool) + 1] + work[needs + (n + 1) * k + n]


@entry(LENGTH_STEPS)
def step_lengths(
    t: float, k: int, q: Array, v: Array, vdot: Array, out: Array, c_d: float, table: Table, pool: Array, work: Array
) -> None:
    """Set the accelerations of the free lengths for solution k: as given, each a step further, and as solved for.

    v and vdot are (u, z) and their rates; the length that a trial moves is put back by the next one.
    """
    head = header_of(table)
    n, slots, kept = head["n_free"], head["z"] + head["n_z"], head["needs"] + head["n_free"] * (head["n_free"] + 1)
    z, zdot = offset(v, head["n_u"]), offset(vdot, head["n_u"])
    if k > 0:
        held = head["n_holds"] > 0
        q_now, u_now = offset(work, head["held_q"]) if held else q, offset(work, head["held_u"]) if held else v
        write_imbalance(t, q_now, u_now, out, k - 1, table, pool, work)
    if k > 1:
        place = place_of_length(k - 2, table, pool)
        z[place], z[place + 1] = work[kept], work[kept + 1]
        work[slots + k - 2] -= work[kept + 2]
    if k == 0:
        for j in range(n):
            work[slots + j] = zdot[place_of_length(j, table, pool) + 1]
    elif k > n:
        solve_length_changes(z, zdot, c_d, table, pool, work)
    else:
        place = place_of_length(k - 1, table, pool)
        step = trial_step(z, place, c_d)
        work[kept], work[kept + 1], work[kept + 2] = z[place], z[place + 1], step
        z[place], z[place + 1] = z[place] + c_d * c_d * step, z[place + 1] + c_d * step
        work[slots + k - 1] += step
    copy_auxiliary_states(v, table, work)
    write_unit_blocks(t, table, pool, work)
