"""Projection onto the constraints after a step, and the call that replaces it in models without constraints."""

from __future__ import annotations

from femflex.arrays import Array, IntArray
from femflex.integrate.compiled import kernel, types
from femflex.integrate.protocol import PROJECT, Call, Model

Projection = tuple[bool, Call]  # whether the model has constraints, and the call that projects a state onto them

PROJECTION = types.Tuple((types.boolean, types.FunctionType(PROJECT)))


@kernel(PROJECT)
def no_projection(t: float, x: Array, table: IntArray, pool: Array, work: Array) -> float:
    """Residual 0 of a model without constraints."""
    return 0.0


def projection_of(model: Model) -> Projection:
    """The model's projection onto its constraints, or `no_projection`."""
    return (False, no_projection) if model.project is None else (True, model.project)
