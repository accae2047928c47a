"""Auxiliary states z, which follow the velocities in memory: their copy for kernels, and their rates.

Latch flags are constant between events. The other states belong to effectors, which write their rates into the work
array whenever forces are written.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.lowering.layout import header_of
from femflex.kernels.compiled import inner


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
