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
from femflex.dynamics.lowering.layout import body_of, header_of
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


@kernel(RATE)
def rate(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """Write dx/dt of x = (q, u): qdot = N(q) u and M udot = Q - h, in O(n); without prescribed freedoms and states."""
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    head = header_of(records)
    q, u, dq, udot = pointer(x), offset(x, head["n_q"]), pointer(dx), offset(dx, head["n_q"])
    place_bodies(t, q, u, records, numbers, scratch)
    write_forces(t, q, u, records, numbers, scratch)
    reduce_to_root(records, numbers, scratch, 0.0, 0.0, False)
    accelerate(records, scratch, udot, False)
    for i in range(1, head["n_bodies"]):
        coordinate_rates(body_of(records, i), q, u, dq, numbers)
