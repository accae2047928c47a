"""Small compiled functions of the kernels: copies, clipping, unit quaternions, finiteness, projection."""

from __future__ import annotations

import math
from collections.abc import Callable

from femflex.arrays import Array, IntArray
from femflex.integrate import resume as head
from femflex.integrate.compiled import kernel, part, types
from femflex.integrate.protocol import PROJECT, Call, Model, ModelArrays

Projection = tuple[bool, Call]  # whether the model has constraints, and the call that projects a state onto them

PROJECTION = types.Tuple((types.boolean, types.FunctionType(PROJECT)))


@part
def copy_vector(source: Array, target: Array) -> None:
    """Set target[:] = source; a plain loop compiles in a tenth of the time a checked slice takes."""
    for i in range(target.size):
        target[i] = source[i]


@part
def clipped(t: float, lo: float, hi: float) -> float:
    """Time t limited to lo..hi, so that the model is never called on or beyond a break."""
    return min(max(t, lo), hi)


@part
def normalise(x: Array, renormalise: IntArray) -> None:
    """Bring the four Euler parameters at each position of `renormalise` to unit length, in place."""
    for start in renormalise:
        length = math.sqrt(x[start] ** 2 + x[start + 1] ** 2 + x[start + 2] ** 2 + x[start + 3] ** 2)
        for i in range(start, start + 4):
            x[i] /= length


@part
def write_rows(
    interpolate: Callable[[float, float, Array, Array], None],
    times: Array,
    rows: Array,
    row: int,
    state: Array,
    vectors: Array,
    renormalise: IntArray,
    projection: Projection,
    arrays: ModelArrays,
) -> int:
    """Write the output rows whose times the steps have reached; return the number of rows written so far.

    interpolate  sets a row to the state at a fraction of the last step, of a size, from the vectors kept between calls
    """
    t, t_old = state[head.T], state[head.T_OLD]
    while row < rows.shape[0] and times[row] <= t:
        if times[row] == t:
            copy_vector(vectors[0], rows[row])
        else:
            interpolate((times[row] - t_old) / (t - t_old), t - t_old, vectors, rows[row])
            normalise(rows[row], renormalise)
            if projection[0]:
                projection[1](times[row], rows[row], *arrays)
        state[head.LAST_OUT] = times[row]
        row += 1
    return row


@part
def first_not_finite(v: Array) -> int:
    """Index of the first entry of v that is not finite, or -1."""
    for i in range(v.size):
        if not math.isfinite(v[i]):
            return i
    return -1


@kernel(PROJECT)
def no_projection(t: float, x: Array, table: IntArray, pool: Array, work: Array) -> float:
    """Residual 0 of a model without constraints."""
    return 0.0


def projection_of(model: Model) -> Projection:
    """The model's projection onto its constraints, or `no_projection`."""
    return (False, no_projection) if model.project is None else (True, model.project)
