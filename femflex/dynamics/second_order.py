"""The equations of motion (9) as implicit integrators and studies ask for them: residual, linear solve, kinematics.

Compiled apart from `rate`, and only when first asked for.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.compiled import kernel
from femflex.dynamics.coordinates import advance_coordinates, coordinate_rates
from femflex.dynamics.gathering import write_residual, write_solution
from femflex.dynamics.lanes import start
from femflex.dynamics.layout import body_of, header_of
from femflex.dynamics.symbols import types

Array = NDArray[np.float64]
Table = NDArray[np.int64]

_vector = types.float64[::1]
_own = (types.int64[::1], _vector, _vector)  # table, pool, work
RESIDUAL = types.void(types.float64, _vector, _vector, _vector, _vector, *_own)
SOLVE = types.void(types.float64, _vector, _vector, _vector, types.float64, types.float64, types.float64, *_own)
KINEMATIC = types.void(types.float64, _vector, _vector, _vector, *_own)
ADVANCE = types.void(_vector, _vector, _vector, *_own)


@kernel(KINEMATIC)
def kinematic(t: float, q: Array, u: Array, dq: Array, table: Table, pool: Array, work: Array) -> None:
    """dq/dt = N(q) u."""
    records = start(table)
    for i in range(1, header_of(records)["n_bodies"]):
        coordinate_rates(body_of(records, i), start(q), start(u), start(dq), start(pool))


@kernel(ADVANCE)
def advance(q: Array, increment: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = q o exp(increment): the coordinates after unit time at the constant quasi-velocity `increment` (n_u,)."""
    records = start(table)
    for i in range(1, header_of(records)["n_bodies"]):
        advance_coordinates(body_of(records, i), start(q), start(increment), start(out), start(pool))


@kernel(RESIDUAL)
def residual(t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = M(q, t) udot + h(q, u, t) - Q of eq. (9), in O(n).

    With an eliminated root translation M is M - M_v^T M_vv^-1 M_v and forces work through displacements relative to O.
    """
    write_residual(
        t,
        start(q),
        start(u),
        start(udot),
        start(out),
        start(table),
        start(pool),
        start(work),
    )


@kernel(SOLVE)
def solve(
    t: float,
    q: Array,
    rhs: Array,
    out: Array,
    c_m: float,
    c_d: float,
    c_k: float,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """out = (c_m M + c_d D + c_k K)^-1 rhs with M at q, D and K of shapes, springs and dampers; O(n)."""
    write_solution(
        t,
        start(q),
        start(rhs),
        start(out),
        c_m,
        c_d,
        c_k,
        start(table),
        start(pool),
        start(work),
    )


@dataclass(frozen=True)
class SecondOrderCalls:
    """The calls that implicit integrators use, over the model's own arrays."""

    n_q: int
    n_u: int
    residual: Any = field(default=residual)
    solve: Any = field(default=solve)
    kinematic: Any = field(default=kinematic)
    advance: Any = field(default=advance)
