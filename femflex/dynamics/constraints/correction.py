"""Newton's correction of implicit integrators with constraints: multipliers are solved for with the accelerations.

(M + c_d D + c_k K) d - A^T lambda = -(M udot + h - Q) and A (udot + d) = bdot - Adot u, in one pass of the recursion.
The integrator removes the drift, by `project`. Compiled apart, and only at the first request.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.constraints.equations import constrain
from femflex.dynamics.forces.system import clear_all_joint_forces
from femflex.dynamics.motion.correction import resisted_accelerations, subtract_rates
from femflex.dynamics.motion.second_order import CORRECT
from femflex.kernels.compiled import kernel
from femflex.kernels.lanes import pointer


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
    """Write Newton's correction of (udot, zdot) to out; it is zero along the constrained motion."""
    records, numbers, scratch, accelerations, rates = (
        pointer(table),
        pointer(pool),
        pointer(work),
        pointer(out),
        pointer(udot),
    )
    clear_all_joint_forces(records, scratch)
    x, v = resisted_accelerations(
        t, pointer(q), pointer(u), rates, accelerations, c_d, c_k, True, records, numbers, scratch
    )
    constrain(t, x, v, accelerations, records, numbers, scratch, c_d != 0.0 or c_k != 0.0)
    subtract_rates(t, x, v, accelerations, rates, c_d, records, numbers, scratch)
