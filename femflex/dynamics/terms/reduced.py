"""Equations of motion from which terms of the ledger have been left out: residual and rate of the state.

Compiled apart from `rate`, and only at the first request.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, Table
from femflex.dynamics.joints.coordinates import coordinate_rates
from femflex.dynamics.joints.prescribed_motion import prescribed_state, write_prescribed_rows
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.dynamics.motion.auxiliary_states import write_auxiliary_rates
from femflex.dynamics.motion.equations import RATE
from femflex.dynamics.motion.gathering import write_solution
from femflex.dynamics.motion.second_order import RESIDUAL
from femflex.dynamics.terms.ledger import write_terms
from femflex.dynamics.terms.rows import PRESCRIBED_UDOT, SPARE, n_rows
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer


@inner
def write_reduced(
    t: float, q: Array, u: Array, udot: Array, out: Array, scratch: Array, table: Table, pool: Array, work: Array
) -> None:
    """out = the sum of the terms that the header's `kept` leaves; room (SPARE + n_terms, n_u) holds spare and rows."""
    head = header_of(table)
    n_u = head["n_u"]
    rows = offset(scratch, SPARE * n_u)
    write_terms(t, q, u, udot, rows, pointer(scratch), table, pool, work)
    for k in range(n_u):
        out[k] = 0.0
    for i in range(n_rows(table)):
        if pool[head["kept"] + i] != 0.0:
            for k in range(n_u):
                out[k] += rows[i * n_u + k]
    if head["n_holds"] > 0:
        write_prescribed_rows(udot, out, table, work)


@kernel(RESIDUAL)
def reduced_residual(
    t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array
) -> None:
    """out = M udot + h - Q with the terms that the header's `kept` leaves."""
    records = pointer(table)
    scratch = np.zeros((SPARE + n_rows(records)) * header_of(records)["n_u"])
    write_reduced(
        t, pointer(q), pointer(u), pointer(udot), pointer(out), scratch, records, pointer(pool), pointer(work)
    )


@inner
def write_reduced_rate(
    t: float, x: Array, dx: Array, scratch: Array, bias: Array, table: Table, pool: Array, work: Array
) -> None:
    """dx/dt from the terms that are left; room (SPARE + n_terms, n_u) begins with zeros.

    bias (n_u + n_z,): room for -(h - Q), z behind it.
    """
    head = header_of(table)
    q, u, dq, udot, force = x, offset(x, head["n_q"]), dx, offset(dx, head["n_q"]), pointer(bias)
    write_reduced(t, q, u, pointer(scratch), force, scratch, table, pool, work)
    n_u = head["n_u"]
    for k in range(n_u):
        force[k] = -force[k]
    for k in range(n_u, n_u + head["n_z"]):
        force[k] = u[k]
    known_rates = offset(
        scratch, PRESCRIBED_UDOT * n_u
    )  # they stand in the specified motion, not in the accelerations solved for
    if head["n_holds"] > 0:
        for k in range(n_u):
            force[k] = force[k] - known_rates[k]
    write_solution(t, q, force, udot, 1.0, 0.0, 0.0, table, pool, work)
    if head["n_holds"] > 0:
        for k in range(n_u):
            udot[k] = udot[k] + known_rates[k]
        q, u = prescribed_state(t, q, u, table, pool, work)
    write_auxiliary_rates(offset(udot, n_u), table, work)
    for i in range(1, head["n_bodies"]):
        coordinate_rates(body_of(table, i), q, u, dq, pool)


@kernel(RATE)
def reduced_rate(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """dx/dt of a model from which terms have been left out; some three to five times the cost of `rate`."""
    records = pointer(table)
    n_u, n_z = header_of(records)["n_u"], header_of(records)["n_z"]
    scratch_rows, bias = np.zeros((SPARE + n_rows(records)) * n_u), np.empty(n_u + n_z)
    write_reduced_rate(t, pointer(x), pointer(dx), scratch_rows, bias, records, pointer(pool), pointer(work))
