"""Equations of motion (9) of a model with prescribed joint freedoms or states z.

Compiled apart from `rate`, and only for such models: the others keep their speed and their first compilation.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.forces.system import write_forces
from femflex.dynamics.joints.coordinates import coordinate_rates
from femflex.dynamics.joints.prescribed_motion import add_known_accelerations, prescribed_state
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.dynamics.motion.auxiliary_states import copy_auxiliary_states, write_auxiliary_rates
from femflex.dynamics.motion.equations import RATE, place_bodies
from femflex.dynamics.motion.recursion import accelerate, reduce_to_root
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer


@inner
def write_accelerations(t: float, q: Array, u: Array, udot: Array, table: Table, pool: Array, work: Array) -> None:
    """Write udot of M udot = Q - h at the state (q, u), with prescribed freedoms at their values."""
    place_bodies(t, q, u, table, pool, work)
    write_forces(t, q, u, table, pool, work)
    if header_of(table)["n_holds"] > 0:
        add_known_accelerations(table, work)
    reduce_to_root(table, pool, work, 0.0, 0.0, False)
    accelerate(table, work, udot, False)


@kernel(RATE)
def rate_with_prescribed_motion(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """Write dx/dt of x = (q, u, z): qdot = N(q) u, M udot = Q - h and zdot; prescribed freedoms have (sdot, sddot)."""
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    head = header_of(records)
    q, u, dq, udot = pointer(x), offset(x, head["n_q"]), pointer(dx), offset(dx, head["n_q"])
    copy_auxiliary_states(u, records, scratch)
    if head["n_holds"] > 0:
        q, u = prescribed_state(t, q, u, records, numbers, scratch)
    write_accelerations(t, q, u, udot, records, numbers, scratch)
    write_auxiliary_rates(offset(udot, head["n_u"]), records, scratch)
    for i in range(1, head["n_bodies"]):
        coordinate_rates(body_of(records, i), q, u, dq, numbers)
