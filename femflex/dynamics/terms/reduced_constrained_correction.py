"""Newton's correction of implicit integrators for constrained equations from which terms have been left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import kernel
from femflex.dynamics.arithmetic.lanes import start
from femflex.dynamics.lowering.layout import header_of
from femflex.dynamics.motion.second_order import CORRECT
from femflex.dynamics.terms.reduced_constraints import constrain_freely
from femflex.dynamics.terms.reduced_correction import reduced_correct

Array = NDArray[np.float64]
Table = NDArray[np.int64]


@kernel(CORRECT)
def reduced_constrained_correct(
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
    """out = what Newton's method adds to udot, as `constrained_correction.correct`, with the terms that are left."""
    n_u = header_of(start(table))["n_u"]
    reduced_correct(t, q, u, udot, out, c_d, c_k, table, pool, work)
    for k in range(n_u):
        out[k] += udot[k]
    constrain_freely(t, start(q), start(u), start(out), c_d, c_k, start(table), start(pool), start(work))
    for k in range(n_u):
        out[k] -= udot[k]
