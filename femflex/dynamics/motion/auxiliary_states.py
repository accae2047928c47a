"""Auxiliary states z, which follow the velocities in memory: their copy for kernels, and their rates.

Latch flags are constant between events. The other states belong to effectors, which write their rates into the work
array whenever forces are written.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.forces.calls import apply_terms, call_relax
from femflex.dynamics.lowering.layout import header_of, term_of
from femflex.dynamics.motion.equations import place_bodies
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import offset


@inner
def copy_auxiliary_states(u: Array, table: Table, work: Array) -> None:
    """Copy the states behind u (n_u,) to the place where every evaluation reads them."""
    head = header_of(table)
    for k in range(head["n_z"]):
        work[head["z"] + k] = u[head["n_u"] + k]


@inner
def write_auxiliary_rates(dz: Array, table: Table, work: Array) -> None:
    """dz/dt (n_z,) at the state at which forces were last written."""
    head = header_of(table)
    for k in range(head["n_z"]):
        dz[k] = work[head["zdot"] + k]


@inner
def correct_auxiliary_states(
    t: float,
    q: Array,
    u: Array,
    step: Array,
    zdot: Array,
    c_d: float,
    out: Array,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """Write Newton's correction of the given dz/dt to out (n_z,): (1 - c_d J)^-1 (zdot - given).

    zdot is that at the velocities u + c_d step, which the same iteration has found: states that follow velocities
    faster than the step would lag an iteration behind otherwise. J = dzdot/dz is known to the terms whose states
    they are.
    """
    head = header_of(table)
    if head["relaxes"] == 1:
        velocities = offset(work, head["moved_u"])
        for k in range(head["n_u"]):
            velocities[k] = u[k] + c_d * step[k]
        place_bodies(t, q, velocities, table, pool, work)
        apply_terms(t, q, velocities, table, pool, work)  # for the rates; the forces are not used any more
    for k in range(head["n_z"]):
        out[k] = work[head["zdot"] + k] - zdot[k]
    for i in range(head["n_terms"]):
        term = term_of(table, i)
        if term["relax"] != 0:
            call_relax(term["relax"], t, zdot, c_d, out, term["at"], term["n"], table, pool, work)
