"""What held freedoms report: the forces and torques that their specification needs, and the power these give.

Compiled apart from `rate`, and only for models that hold a freedom.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, Table
from femflex.dynamics.arithmetic.compiled import inner, kernel
from femflex.dynamics.arithmetic.lanes import beyond, start
from femflex.dynamics.joints.held import held_state
from femflex.dynamics.lowering.layout import header_of
from femflex.dynamics.motion.led_equations import write_accelerations
from femflex.dynamics.motion.states import take_states
from femflex.dynamics.reports.observe import OBSERVE


@inner
def write_drives(t: float, x: Array, out: Array, room: Array, table: Table, pool: Array, work: Array) -> None:
    """out (n_u,): generalised forces that hold the held freedoms at the state x, zero on the others."""
    head = header_of(table)
    take_states(beyond(x, head["n_q"]), table, work)
    q, u = held_state(t, x, beyond(x, head["n_q"]), table, pool, work)
    write_accelerations(t, q, u, start(room), table, pool, work)
    for k in range(head["n_u"]):
        out[k] = work[head["drives"] + k]


@kernel(OBSERVE)
def observe_drives(times: Array, states: Array, rows: Array, table: Table, pool: Array, work: Array) -> None:
    """rows (n_t, n_u): the forces that hold the held freedoms at times (n_t,) and states (n_t, n_x)."""
    room = np.empty(rows.shape[1])
    for j in range(len(times)):
        write_drives(times[j], start(states[j]), start(rows[j]), room, start(table), start(pool), start(work))
