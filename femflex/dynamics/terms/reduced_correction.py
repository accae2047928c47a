"""Newton's correction of implicit integrators for equations from which terms have been left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import kernel
from femflex.dynamics.motion.residual import solve
from femflex.dynamics.motion.second_order import CORRECT
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
    """out = -(M + c_d D + c_k K)^-1 (M udot + h - Q) with the terms that the header's `kept` leaves."""
    force = np.empty(len(u))
    reduced_residual(t, q, u, udot, force, table, pool, work)
    for k in range(len(u)):
        force[k] = -force[k]
    solve(t, q, force, out, 1.0, c_d, c_k, table, pool, work)
