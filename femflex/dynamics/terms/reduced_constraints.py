"""Constrained equations of motion from which terms of the ledger have been left out.

[M -A^T; A 0] (udot, lambda) = (what is left of Q - h, bdot - Adot u): the free accelerations come from the terms that
are left, and what they lack in every row gives the multipliers. The rows are kinematics; nothing is left out there.
Compiled apart, and only at the first request.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, Table
from femflex.dynamics.constraints.equations import add_constraint_response
from femflex.dynamics.constraints.rows import write_rows, write_targets
from femflex.dynamics.forces.calls import write_resistance
from femflex.dynamics.forces.system import clear_forces
from femflex.dynamics.joints.prescribed_motion import prescribed_state
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.dynamics.motion.equations import RATE, place_bodies
from femflex.dynamics.motion.gathering import accelerate_body
from femflex.dynamics.motion.recursion import reduce_to_root
from femflex.dynamics.terms.reduced import write_reduced_rate
from femflex.dynamics.terms.rows import SPARE, n_rows
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer


@inner
def constrain_freely(
    t: float, q: Array, u: Array, udot: Array, c_d: float, c_k: float, table: Table, pool: Array, work: Array
) -> None:
    """Correct free accelerations udot, wherever they come from, by M + c_d D + c_k K until they satisfy every row."""
    head = header_of(table)
    if head["n_holds"] > 0:
        q, u = prescribed_state(t, q, u, table, pool, work)
    place_bodies(t, q, u, table, pool, work)
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        accelerate_body(b, body_of(table, b["parent"]), udot, work)
    write_rows(t, q, u, table, pool, work)
    write_targets(udot, table, work)
    clear_forces(table, work)
    if c_k != 0.0 and head["n_terms"] > 0:
        write_resistance(t, q, u, 0.0, c_k, table, pool, work)  # as the free accelerations were solved for
    reduce_to_root(table, pool, work, c_d, c_k, True)
    add_constraint_response(udot, table, pool, work, c_d != 0.0 or c_k != 0.0)


@kernel(RATE)
def reduced_constrained_rate(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """dx/dt of a model with constraints from which terms have been left out."""
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    head = header_of(records)
    room, bias = np.zeros((SPARE + n_rows(records)) * head["n_u"]), np.empty(head["n_u"] + head["n_z"])
    write_reduced_rate(t, pointer(x), pointer(dx), room, bias, records, numbers, scratch)
    q, u, udot = pointer(x), offset(x, head["n_q"]), offset(dx, head["n_q"])
    constrain_freely(t, q, u, udot, 0.0, 0.0, records, numbers, scratch)
