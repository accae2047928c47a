"""Equations of motion (9) for implicit integrators and studies, each call compiled when first used.

RESIDUAL   residual(t, q, u, udot, out, table, pool, work): out = M udot + h - Q
SOLVE      solve(t, q, rhs, out, c_m, c_d, c_k, table, pool, work): out = (c_m M + c_d D + c_k K)^-1 rhs
CORRECT, KINEMATIC    see femflex.integrate.protocol
ADVANCE               out = q o exp(increment), (n_q,): where q is after unit time at the constant quasi-velocity
                      `increment` (n_u,); out is never q itself

The states z stand behind the quasi-velocities: u is (n_u + n_z,) = (u, z), and so is the right side rhs of SOLVE,
whose own numbers are the first n_u. Outputs are (n_u,), those of CORRECT (n_u + n_z,).
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.joints.coordinates import advance_coordinates, coordinate_rates
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.kernels.compiled import kernel
from femflex.kernels.lanes import pointer
from femflex.kernels.symbols import types

_vector = types.float64[::1]
_own = (types.int64[::1], _vector, _vector)  # table, pool, work
RESIDUAL = types.void(types.float64, _vector, _vector, _vector, _vector, *_own)
SOLVE = types.void(types.float64, _vector, _vector, _vector, types.float64, types.float64, types.float64, *_own)
CORRECT = types.void(types.float64, _vector, _vector, _vector, _vector, types.float64, types.float64, *_own)
KINEMATIC = types.void(types.float64, _vector, _vector, _vector, *_own)
ADVANCE = types.void(_vector, _vector, _vector, *_own)


@kernel(KINEMATIC)
def kinematic(t: float, q: Array, u: Array, dq: Array, table: Table, pool: Array, work: Array) -> None:
    """dq/dt = N(q) u."""
    records = pointer(table)
    for i in range(1, header_of(records)["n_bodies"]):
        coordinate_rates(body_of(records, i), pointer(q), pointer(u), pointer(dq), pointer(pool))


@kernel(ADVANCE)
def advance(q: Array, increment: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = q o exp(increment): the coordinates after unit time at the constant quasi-velocity `increment` (n_u,)."""
    records = pointer(table)
    for i in range(1, header_of(records)["n_bodies"]):
        advance_coordinates(body_of(records, i), pointer(q), pointer(increment), pointer(out), pointer(pool))
