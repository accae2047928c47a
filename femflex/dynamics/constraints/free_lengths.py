"""Work of constraints on deploying bodies of free length, and the force that each of these lacks.

For given accelerations of the lengths the model is one of specified lengths, whose multipliers follow, and with them
what loops do at the members' own markers. The force that each drum needs is affine in these accelerations.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.shapes import markers_motion
from femflex.dynamics.constraints.rows import push_rows, row_of
from femflex.dynamics.forces.marker_forces import power_per_length
from femflex.dynamics.forces.system import write_forces
from femflex.dynamics.forces.work_per_length import clear_work_per_length
from femflex.dynamics.lowering import constraint_layout as layout
from femflex.dynamics.lowering.constraint_layout import closing_of, constraint_of
from femflex.dynamics.lowering.layout import VARIES, body_of, header_of
from femflex.dynamics.lowering.unit_block import WORKED
from femflex.dynamics.motion.equations import place_bodies
from femflex.dynamics.motion.free_lengths import write_imbalance_entries
from femflex.dynamics.motion.gathering import gather_residual
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import offset
from femflex.kernels.vectors import ZERO, add, load3, scale, turn_back


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
        if c["parent"] > 0 and c["bends_P"] >= VARIES and P["unit"] > 0:
            rows = c["place_P"], c["shape_P"], c["spin_P"], c["bends_P"]
            add_marker_work(P, c, layout.R_FP, rows, table, pool, work)
        if c["bends_Q"] >= VARIES and Q["unit"] > 0:
            rows = c["place_Q"], c["shape_Q"], c["spin_Q"], c["bends_Q"]
            add_marker_work(Q, c, layout.R_FQ, rows, table, pool, work)


@inner
def write_imbalance(
    t: float, q: Array, u: Array, udot: Array, column: int, table: Table, pool: Array, work: Array
) -> None:
    """Write the deficit of force [N] of each free length in a motion with accelerations udot (n_u,).

    Lengths accelerate as their slots say, and constraints have the multipliers that were solved for.
    """
    clear_work_per_length(table, pool)
    place_bodies(t, q, u, table, pool, work)
    write_forces(t, q, u, table, pool, work)
    push_rows(table, work)
    add_constraint_work(table, pool, work)
    gather_residual(udot, offset(work, header_of(table)["lack"]), table, pool, work)
    write_imbalance_entries(column, table, pool, work)
