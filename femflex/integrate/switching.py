"""The change of coordinates between two steps, for models that ask for none."""

from __future__ import annotations

from femflex.arrays import Array, IntArray
from femflex.integrate.compiled import kernel
from femflex.integrate.protocol import SWITCH, Call, Model


@kernel(SWITCH)
def stay(t: float, x: Array, table: IntArray, pool: Array, work: Array) -> int:
    """0: nothing is changed."""
    return 0


def switch_of(model: Model) -> Call:
    """The model's own change of coordinates, or `stay`."""
    return stay if model.switch is None else model.switch
