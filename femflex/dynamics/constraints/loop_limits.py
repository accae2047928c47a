"""Loops in a limit configuration: rows that have become dependent since the start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.constraints.conflicts import ENTRY_TOLERANCE, prescribed_coordinates

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


DEPENDENT = 1e-8  # singular value, relative to the largest, of rows that follow from others


def loop_limit_text(model: Model, t: float, x: Array, part: float) -> str:
    """Describe a loop whose smallest singular value is below that part of its value at the start; "" for none."""
    constraints = model.constraints
    assert constraints is not None
    B_start = mass_scaled_rows(model, 0.0, model.x0)
    B = mass_scaled_rows(model, t, x)
    if not (B.size and np.isfinite(B).all()):
        return ""
    rows, values, _ = np.linalg.svd(B)
    values_start = np.linalg.svd(B_start, compute_uv=False)
    rank = int((values_start > DEPENDENT * values_start[0]).sum()) if values_start[0] > 0.0 else 0
    if rank == 0 or not values[rank - 1] / values[0] < part * values_start[rank - 1] / values_start[0]:
        return ""
    row_weights = rows[:, rank - 1]
    name = max(constraints.names, key=lambda name: float(np.abs(row_weights[constraints.rows_of(name)]).max()))
    entries = np.abs(row_weights @ constraints.matrix(t, x))
    freedoms = prescribed_coordinates(model.system).items()
    names = [repr(freedom) for k, (freedom, _) in freedoms if entries[k] > ENTRY_TOLERANCE * entries.max()]
    text = f"(smallest singular value of its rows {values[rank - 1]:.2g}, at the start {values_start[rank - 1]:.2g})"
    if names:
        return (
            f"{constraints.kind_of(name)} cannot follow the prescribed motion of {', '.join(names)} any further: it "
            f"has come to the end of its reach {text}. End the motion earlier, or change the lengths"
        )
    return (
        f"{constraints.kind_of(name)} is in a singular configuration, where its joints' motion is not determined {text}"
    )


def mass_scaled_rows(model: Model, t: float, x: Array) -> Array:
    """Return A root(M)^-T of the freedoms that are not prescribed, each row at the length of the free bodies' own."""
    constraints = model.constraints
    assert constraints is not None
    free = [k for k in range(model.n_u) if k not in prescribed_coordinates(model.system)]
    M = model.mass_matrix(t, x)[np.ix_(free, free)]
    A = np.take(constraints.matrix(t, x), free, axis=1)
    if not (np.isfinite(M).all() and np.isfinite(A).all()):
        return np.full((constraints.n_rows, len(free)), np.nan)
    try:
        return np.linalg.solve(np.linalg.cholesky(M), A.T).T
    except np.linalg.LinAlgError:  # no mass is left to some freedom
        return np.full((constraints.n_rows, len(free)), np.nan)
