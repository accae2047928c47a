"""Bodies that vary with time: their blocks are written anew at every evaluation, before anything reads them.

The function of the user writes the block (`femflex.system.variation`); rows that follow from its moments are derived
here. Kernels read the properties of every body at the places that its record holds, so a body that does not vary costs
nothing.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.shapes import put_rows3, rows9, turning_of
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.entries import call_user
from femflex.kernels.lanes import offset, put_lane


@inner
def write_varying_bodies(t: float, table: Table, pool: Array, work: Array) -> None:
    """Write the properties at t of all bodies that vary, and the total mass."""
    head = header_of(table)
    mass = 0.0
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        if b["varies"]:
            states = offset(work, head["z"])
            call_user(b["write"], t, states, offset(pool, b["numbers"]), offset(pool, b["block"]))
            if b["derived"]:
                derive_rows(b, pool)
        mass += pool[b["mass"]]
    pool[head["mass"]] = mass


@inner
def derive_rows(b: Record, pool: Array) -> None:
    """Write the numbers that follow from a body's moments: transposed first ones, R1[j,a,k], and the elastic mass."""
    wide, first = b["wide"], b["first"]
    for k in range(wide):
        for a in range(3):
            pool[b["momentum"] + 4 * k + a] = pool[first + wide * a + k]
    for j in range(b["n_shapes"]):
        for k in range(0, wide, 4):
            P = rows9(pool, b["second"] + 9 * wide * (j + 1) + k, wide)  # a c k
            put_rows3(pool, b["gyro"] + 3 * wide * j + k, wide, turning_of(P))
            put_lane(pool, b["elastic_mass"] + wide * j + k, P[0] + P[4] + P[8])
