"""Increments of the coordinates along the quasi-velocities, in which linear equations are written."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.model import Model

Array = NDArray[np.float64]


def advanced(model: Model, q: Array, increment: Array) -> Array:
    """q o exp(increment): the coordinates (n_q,) after an increment (n_u,) along the quasi-velocities."""
    out = np.array(q, float)
    model.tree.advance(
        np.ascontiguousarray(q), np.ascontiguousarray(increment), out, model.table, model.pool, model.work
    )
    return out
