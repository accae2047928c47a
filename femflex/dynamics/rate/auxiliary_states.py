"""Auxiliary states z, which follow the velocities in memory: their copy for kernels, and their rates.

Latch flags are constant between events. The other states belong to effectors, which write their rates into the work
array whenever forces are written. Of a free length and its speed, two states of an effector, the acceleration stands
in a slot behind z.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.layout.records import LENGTH_Z, body_of, header_of
from femflex.kernels.compiled import inner


@inner
def copy_auxiliary_states(u: Array, table: Table, work: Array) -> None:
    """Copy the states behind u (n_u,) to the place where every evaluation reads them."""
    head = header_of(table)
    for k in range(head["n_z"]):
        work[head["z"] + k] = u[head["n_u"] + k]


@inner
def place_of_length(k: int, table: Table, pool: Array) -> int:
    """Place in z of free length k; its speed follows it."""
    count = 0
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        if b["free_length"]:
            if count == k:
                return int(pool[b["numbers"] + LENGTH_Z])
            count += 1
    return 0


@inner
def write_auxiliary_rates(dz: Array, table: Table, pool: Array, work: Array) -> None:
    """dz/dt (n_z,) at the state at which forces were last written."""
    head = header_of(table)
    for k in range(head["n_z"]):
        dz[k] = work[head["zdot"] + k]
    for k in range(head["n_free"]):
        dz[place_of_length(k, table, pool) + 1] = work[head["z"] + head["n_z"] + k]
