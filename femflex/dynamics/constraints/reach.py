"""Loops that have come to the end of their reach: rows that have lost their independence since the start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.constraints.conflicts import TOUCHED, held_freedoms

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


DEPENDENT = 1e-8  # singular value, relative to the largest, of rows that follow from others


def end_of_reach_text(model: Model, t: float, x: Array, part: float) -> str:
    """The sentence on a loop whose smallest singular value is below that part of what it was at the start, or ""."""
    held = model.constraints
    assert held is not None
    before = weighed_rows(model, 0.0, model.x0)
    B = weighed_rows(model, t, x)
    if not (B.size and np.isfinite(B).all()):
        return ""
    rows, values, _ = np.linalg.svd(B)
    first = np.linalg.svd(before, compute_uv=False)
    rank = int((first > DEPENDENT * first[0]).sum()) if first[0] > 0.0 else 0
    if rank == 0 or not values[rank - 1] / values[0] < part * first[rank - 1] / first[0]:
        return ""
    lost = rows[:, rank - 1]
    name = max(held.names, key=lambda name: float(np.abs(lost[held.rows_of(name)]).max()))
    driven = np.abs(lost @ held.matrix(t, x))
    freedoms = held_freedoms(model.system).items()
    moved = [repr(freedom) for k, (freedom, _) in freedoms if driven[k] > TOUCHED * driven.max()]
    text = f"(smallest singular value of its rows {values[rank - 1]:.2g}, at the start {first[rank - 1]:.2g})"
    if moved:
        return (
            f"{held.kind_of(name)} cannot follow the prescribed motion of {', '.join(moved)} any further: it has come "
            f"to the end of its reach {text}. End the motion earlier, or change the lengths"
        )
    return f"{held.kind_of(name)} is in a singular configuration, where its joints' motion is not determined {text}"


def weighed_rows(model: Model, t: float, x: Array) -> Array:
    """A root(M)^-T of the freedoms that no motion holds, each row at the length of the free bodies' own."""
    held = model.constraints
    assert held is not None
    free = [k for k in range(model.n_u) if k not in held_freedoms(model.system)]
    M = model.mass_matrix(t, x)[np.ix_(free, free)]
    A = np.take(held.matrix(t, x), free, axis=1)
    if not (np.isfinite(M).all() and np.isfinite(A).all()):
        return np.full((held.n_rows, len(free)), np.nan)
    try:
        return np.linalg.solve(np.linalg.cholesky(M), A.T).T
    except np.linalg.LinAlgError:  # no mass is left to some freedom
        return np.full((held.n_rows, len(free)), np.nan)
