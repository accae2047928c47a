"""The equations of motion (9), compiled: rate of the state.

Every function here has one fixed signature over flat arrays, so that nothing is compiled per model.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.bodies.flow import carry_material
from femflex.dynamics.bodies.inertia import deform
from femflex.dynamics.bodies.varying import write_varying_bodies
from femflex.dynamics.forces.base import move_base
from femflex.dynamics.forces.system import write_forces
from femflex.dynamics.joints.coordinates import coordinate_rates
from femflex.dynamics.joints.prescribed_motion import add_known_accelerations, prescribed_state
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.dynamics.motion.auxiliary_states import copy_auxiliary_states, write_auxiliary_rates
from femflex.dynamics.motion.kinematics import place_body
from femflex.dynamics.motion.recursion import accelerate, reduce_to_root
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer
from femflex.kernels.symbols import types

_vector = types.float64[::1]
RATE = types.void(types.float64, _vector, _vector, types.int64[::1], _vector, _vector)


@inner
def place_bodies(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Place every body at the state (q, u) and write its moments."""
    move_base(t, table, pool, work)
    if header_of(table)["n_varying"] > 0:
        write_varying_bodies(t, table, pool, work)
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        place_body(b, body_of(table, b["parent"]), q, u, pool, work)
        deform(b, pool, work)
        if b["flows"]:
            carry_material(b, pool, work)


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
def rate(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """Write dx/dt of x = (q, u, z): qdot = N(q) u, M udot = Q - h and zdot; prescribed freedoms have (sdot, sddot).

    Of models without constraints and free lengths (`femflex.dynamics.constraints.equations`), in O(n).
    """
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
