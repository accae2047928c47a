"""Coordinates that describe the same motion: a mass matrix that is singular at the start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.linear.linearised import is_prescribed
from femflex.dynamics.lowering.layout import body_records

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

SINGULAR = 1e-13  # smallest eigenvalue of the mass matrix with unit diagonal
DEPENDENT = 1e-10  # part of its own mass that is left to a coordinate once those before it are eliminated
SHARE = 1e-3  # of the largest part in a dependence, below which a coordinate is not named


def refuse_singular_mass(model: Model, M: Array | None = None) -> None:
    """Raise ValueError where coordinates of a model describe the same motion at the start, with names and remedy.

    M: its mass matrix (n_u, n_u) there, where it is known
    """
    free = np.flatnonzero(~is_prescribed(model))
    if not free.size:
        return
    M = (model.mass_matrix(0.0, model.x0) if M is None else M)[np.ix_(free, free)]
    diagonal = np.diag(M)
    if not (np.isfinite(M).all() and (diagonal > 0.0).all()):
        return  # the run itself says what is wrong
    size = 1.0 / np.sqrt(diagonal)
    scaled = size[:, None] * (M + M.T) / 2.0 * size
    if np.linalg.eigvalsh(scaled)[0] > SINGULAR:
        return
    for k in range(1, len(free)):
        parts = np.linalg.lstsq(scaled[:k, :k], scaled[:k, k], rcond=None)[0]
        if 1.0 - scaled[k, :k] @ parts < DEPENDENT:
            raise ValueError(
                _sentence(model, int(free[k]), free[:k][np.abs(parts) > SHARE * np.abs(parts).max()].tolist())
            )


def _sentence(model: Model, k: int, related: list[int]) -> str:
    """The sentence on coordinate k, which only moves as these others together do."""
    system, records = model.system, body_records(model.table)[1:]
    names = [name.removesuffix("_rate") for name, _ in system.velocity_names()]
    bodies = [name for name, b in zip(system.order, records, strict=True) for _ in range(_count(b))]
    listed = ", ".join(names[i] for i in related)
    body_names = " and ".join(dict.fromkeys(repr(bodies[i]) for i in (*related, k)))
    return (
        f"the mass matrix is singular at the start: coordinate {names[k]} describes the same motion as {listed} (of "
        f"{body_names}), so its acceleration is not determined. Leave one of them out: lock that motion of the joint, "
        "choose a joint with fewer free motions, or take fewer shapes (of a deploying tether, functions.straight = "
        "false)"
    )


def _count(record: np.void) -> int:
    """Number of quasi-velocities of a body and its joint."""
    return int(record["ue"] + record["n"] - record["u"])
