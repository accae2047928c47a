"""Newton's correction of implicit integrators with constraints: multipliers are solved for with the accelerations.

(M + c_d D + c_k K) d - A^T lambda = -(M udot + h - Q) and A (udot + d) = bdot - Adot u, in one pass of the recursion.
Drift is the integrator's to take away, by `project`. Compiled apart, and only when first asked for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import kernel
from femflex.dynamics.arithmetic.lanes import beyond, start
from femflex.dynamics.constraints.equations import constrain
from femflex.dynamics.forces.system import release_joints
from femflex.dynamics.joints.held import held_state
from femflex.dynamics.lowering.layout import header_of
from femflex.dynamics.motion.correction import resisted_accelerations
from femflex.dynamics.motion.second_order import CORRECT
from femflex.dynamics.motion.states import correct_states, take_states

Array = NDArray[np.float64]
Table = NDArray[np.int64]


@kernel(CORRECT)
def correct(
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
    """out = what Newton's method adds to (udot, zdot); zero along the constrained motion."""
    records, numbers, scratch, x, v = start(table), start(pool), start(work), start(q), start(u)
    head = header_of(records)
    take_states(v, records, scratch)
    if head["n_holds"] > 0:
        x, v = held_state(t, x, v, records, numbers, scratch)
    release_joints(records, scratch)
    found = start(out)
    resisted_accelerations(t, x, v, start(udot), found, c_d, c_k, True, records, numbers, scratch)
    constrain(t, x, v, found, records, numbers, scratch, c_d != 0.0 or c_k != 0.0)
    for k in range(head["n_u"]):
        out[k] -= udot[k]
    if head["n_z"] > 0:
        given = beyond(start(udot), head["n_u"])
        correct_states(t, given, c_d, beyond(found, head["n_u"]), records, numbers, scratch)
