"""Forces and torques that prescribed motions of freedoms need, and the power that they supply.

Compiled apart from `rate`, and only for models that hold a freedom.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, Table
from femflex.dynamics.joints.prescribed_motion import prescribed_state
from femflex.dynamics.lowering.layout import header_of
from femflex.dynamics.motion.auxiliary_states import copy_auxiliary_states
from femflex.dynamics.motion.equations import write_accelerations
from femflex.dynamics.reports.observe import OBSERVE
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer


@inner
def write_prescribing_forces(
    t: float, x: Array, out: Array, udot: Array, table: Table, pool: Array, work: Array
) -> None:
    """Write to out (n_u,) the generalised forces of prescribed freedoms at the state x, zero for the others."""
    head = header_of(table)
    copy_auxiliary_states(offset(x, head["n_q"]), table, work)
    q, u = prescribed_state(t, x, offset(x, head["n_q"]), table, pool, work)
    write_accelerations(t, q, u, pointer(udot), table, pool, work)
    for k in range(head["n_u"]):
        out[k] = work[head["drives"] + k]


@kernel(OBSERVE)
def observe_prescribing_forces(
    times: Array, states: Array, rows: Array, table: Table, pool: Array, work: Array
) -> None:
    """Write to rows (n_t, n_u) the forces of prescribed freedoms at times (n_t,) and states (n_t, n_x)."""
    udot = np.empty(rows.shape[1])
    for j in range(len(times)):
        write_prescribing_forces(
            times[j], pointer(states[j]), pointer(rows[j]), udot, pointer(table), pointer(pool), pointer(work)
        )
