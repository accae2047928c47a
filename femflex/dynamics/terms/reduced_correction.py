"""Newton's correction of implicit integrators for equations from which terms have been left out.

One call serves models with and without constraints: it is slow either way, and compiled for few.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import kernel
from femflex.dynamics.arithmetic.lanes import start
from femflex.dynamics.lowering.tie_layout import closing_of
from femflex.dynamics.motion.correction import less_rates
from femflex.dynamics.motion.residual import solve
from femflex.dynamics.motion.second_order import CORRECT
from femflex.dynamics.terms.reduced import reduced_residual
from femflex.dynamics.terms.reduced_constraints import constrain_freely

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
    """out = what Newton's method adds to udot with the terms that the header's `kept` leaves (see `motion.correction`).

    With constraints the accelerations are then corrected until they satisfy every row.
    """
    force = np.empty(len(u))
    reduced_residual(t, q, u, udot, force, table, pool, work)
    for k in range(len(u)):
        force[k] = -force[k]
    solve(t, q, force, out, 1.0, c_d, c_k, table, pool, work)
    records, found, rates = start(table), start(out), start(udot)
    if closing_of(records)["n_constraints"] > 0:
        for k in range(len(u)):
            found[k] += rates[k]
        constrain_freely(t, start(q), start(u), found, c_d, c_k, records, start(pool), start(work))
        less_rates(found, rates, records)
