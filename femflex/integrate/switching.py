"""The call for a change of coordinates between two steps, and its replacement in models that need none."""

from __future__ import annotations

from femflex.arrays import Array, IntArray
from femflex.integrate.compiled import kernel
from femflex.integrate.protocol import SWITCH, Call, Model


@kernel(SWITCH)
def no_switch(t: float, x: Array, table: IntArray, pool: Array, work: Array) -> int:
    """Number 0 of changes."""
    return 0


def switch_of(model: Model) -> Call:
    """The model's call for a change of coordinates, or `no_switch`."""
    return no_switch if model.switch is None else model.switch
