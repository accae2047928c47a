"""Work per length of forces at markers of deploying bodies, summed anew in every evaluation."""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.dynamics.lowering.unit_block import WORKED
from femflex.kernels.compiled import inner


@inner
def clear_work_per_length(table: Table, pool: Array) -> None:
    """Set the work per length [N] of forces at markers of deploying bodies to zero."""
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        if b["unit"] > 0:
            pool[b["unit"] - WORKED] = 0.0
