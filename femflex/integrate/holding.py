"""The way back onto constraints after a step, for models that have them; and what stands for it in others."""

from __future__ import annotations

from femflex.arrays import Array, IntArray
from femflex.integrate.compiled import kernel, types
from femflex.integrate.protocol import PROJECT, Call, Model

Hold = tuple[bool, Call]  # whether the model has constraints, and the call that brings a state back onto them

HOLD = types.Tuple((types.boolean, types.FunctionType(PROJECT)))


@kernel(PROJECT)
def as_it_is(t: float, x: Array, table: IntArray, pool: Array, work: Array) -> float:
    """0: there is nothing to hold."""
    return 0.0


def hold_of(model: Model) -> Hold:
    """The model's own way back, or `as_it_is`."""
    return (False, as_it_is) if model.project is None else (True, model.project)
