"""Newton's correction of implicit integrators for equations from which terms have been left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import kernel
from femflex.dynamics.arithmetic.lanes import beyond, start
from femflex.dynamics.lowering.layout import header_of
from femflex.dynamics.motion.residual import solve
from femflex.dynamics.motion.second_order import CORRECT
from femflex.dynamics.motion.states import correct_states
from femflex.dynamics.terms.reduced import reduced_residual

Array = NDArray[np.float64]
Table = NDArray[np.int64]


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
    """out = -(M + c_d D + c_k K)^-1 (M udot + h - Q) with the terms that `kept` leaves; the states' part follows."""
    records, scratch = start(table), start(work)
    head = header_of(records)
    force = np.empty(len(u))
    reduced_residual(t, q, u, udot, force, table, pool, work)
    if head["n_z"] > 0:
        given, found = beyond(start(udot), head["n_u"]), beyond(start(out), head["n_u"])
        correct_states(t, given, c_d, found, records, start(pool), scratch)
    for k in range(len(u)):
        force[k] = -force[k] if k < head["n_u"] else u[k]
    solve(t, q, force, out, 1.0, c_d, c_k, table, pool, work)
