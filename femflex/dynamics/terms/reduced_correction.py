"""Newton's correction of implicit integrators for equations from which terms have been left out.

One call serves models with and without constraints: it is slow either way, and compiled for few.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, Table
from femflex.dynamics.joints.prescribed_motion import prescribed_state
from femflex.dynamics.lowering.constraint_layout import closing_of
from femflex.dynamics.lowering.layout import header_of
from femflex.dynamics.motion.auxiliary_states import copy_auxiliary_states, correct_auxiliary_states
from femflex.dynamics.motion.residual import solve
from femflex.dynamics.motion.second_order import CORRECT
from femflex.dynamics.terms.reduced import reduced_residual
from femflex.dynamics.terms.reduced_constraints import constrain_freely
from femflex.kernels.compiled import kernel
from femflex.kernels.lanes import offset, pointer


@kernel(CORRECT)
def reduced_correct(
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
    """Write Newton's correction of udot to out, with the terms that `kept` leaves (see `motion.correction`).

    With constraints the accelerations are then corrected until they satisfy every row. The states' part follows.
    """
    records, scratch = pointer(table), pointer(work)
    head = header_of(records)
    force = np.empty(len(u))
    reduced_residual(t, q, u, udot, force, table, pool, work)
    for k in range(len(u)):
        force[k] = -force[k] if k < head["n_u"] else u[k]
    solve(t, q, force, out, 1.0, c_d, c_k, table, pool, work)
    if closing_of(records)["n_constraints"] > 0:
        for k in range(head["n_u"]):
            out[k] += udot[k]
        constrain_freely(t, pointer(q), pointer(u), pointer(out), c_d, c_k, records, pointer(pool), scratch)
        for k in range(head["n_u"]):
            out[k] -= udot[k]
    if head["n_z"] > 0:
        x, v, numbers, step = pointer(q), pointer(u), pointer(pool), pointer(out)
        copy_auxiliary_states(v, records, scratch)
        if head["n_holds"] > 0:
            x, v = prescribed_state(t, x, v, records, numbers, scratch)
        zdot = offset(pointer(udot), head["n_u"])
        correct_auxiliary_states(t, x, v, step, zdot, c_d, offset(step, head["n_u"]), records, numbers, scratch)
