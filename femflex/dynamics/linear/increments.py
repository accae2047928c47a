"""Increments of the coordinates along the quasi-velocities, in which linear equations are written."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


def advanced(model: Model, q: Array, increment: Array) -> Array:
    """q o exp(increment): the coordinates (n_q,) after an increment (n_u,) along the quasi-velocities."""
    out = np.array(q, float)
    model.tree.advance(
        np.ascontiguousarray(q), np.ascontiguousarray(increment), out, model.table, model.pool, model.work
    )
    return out
