"""Diagnosis of the state at which a run ended: the one cause that its numbers point to."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.constraints.conflicts import (
    ENTRY_TOLERANCE,
    flat_disc_text,
    prescribed_coordinates,
    violated_text,
)
from femflex.dynamics.joints.places import joint_places, prescribed_states
from femflex.dynamics.user_functions import user_function_fault
from femflex.system import LengthTable
from femflex.system.gimbal_lock import can_lock, lock_angle, lock_text

if TYPE_CHECKING:
    from femflex.dynamics.constraints.constrained import Constraints
    from femflex.dynamics.model import Model


AT_END = 1e-3  # of the stock, or of the first length: how near to its end a length explains that a run stops
THRESHOLD = 1e-2  # rad left to gimbal lock, or smallest part of a singular value at the start, that explains an end


def diagnosis(model: Model, t: float, x: Array, infeasible: bool) -> tuple[str, Exception | None]:
    """A sentence on the state x (n_x,) beyond which there is no step, and the exception behind it; or "" and None.

    infeasible: there is none because no state satisfies the constraints
    """
    if model.constraints is not None:
        if (failed := model.constraints.failed_user()) is not None:
            name, error = failed
            return f"the function of constraint {name!r} raised {type(error).__name__}: {error}", error
        if infeasible:
            text = violated_text(model.constraints, t, x, " any further")
            return loop_limit_text(model.constraints, model, t, x) or text, None
    if text := length_limit_text(model, t, x):  # where the law of the reel is NaN on purpose
        return text, None
    text, cause = user_function_fault(model, t, x)
    if text:
        return text, cause
    text = gimbal_lock_text(model, t, x)
    if model.constraints is not None:
        text = text or flat_disc_text(model.constraints, t, x, THRESHOLD)
        text = text or loop_limit_text(model.constraints, model, t, x)
    return text, None


def length_limit_text(model: Model, t: float, x: Array) -> str:
    """Describe a free length that has reached zero or its stock; "" for none."""
    names, z = [name for name, _ in model.system.state_names()], model.parts(x)[2]
    for body, variation in model.system.varying.items():
        table = variation.write
        if not (isinstance(table, LengthTable) and isinstance(table.length, str)):
            continue
        position = names.index(table.length)
        L, U, stock = float(z[position]), float(z[position + 1]), table.stock or np.inf
        if U > 0.0 and L > stock * (1.0 - AT_END):
            return (
                f"the free length of body {body!r} has reached the total length of the member, stock = {stock:g} m, at "
                f"{U:.4g} m/s; raise stock, brake more, or end the run earlier"
            )
        if U < 0.0 and L < AT_END * table.bounds[1]:
            return (
                f"the free length of body {body!r} has reached zero at {U:.4g} m/s; lower the tension, brake more, or "
                "end the run earlier"
            )
    return ""


def gimbal_lock_text(model: Model, t: float, x: Array) -> str:
    """A joint whose free turns hardly span their space any more."""
    q = prescribed_states(model, np.array([t]), x[None])[0]
    for joint, first, _ in joint_places(model.system):
        coordinates = q[first : first + joint.n_q]
        if can_lock(joint) and lock_angle(joint, coordinates) < THRESHOLD:
            return (
                f"joint {joint.label!r} has reached gimbal lock: {lock_text(joint, coordinates)}. Choose a sequence of "
                "turns that stays clear of it, or lock other turns"
            )
    return ""


DEPENDENT = 1e-8  # singular value, relative to the largest, of rows that follow from others


def loop_limit_text(constraints: Constraints, model: Model, t: float, x: Array) -> str:
    """Describe a loop whose rows have lost their independence since the start; "" for none."""
    B_start = mass_scaled_rows(constraints, model, 0.0, model.x0)
    B = mass_scaled_rows(constraints, model, t, x)
    if not (B.size and np.isfinite(B).all()):
        return ""
    rows, values, _ = np.linalg.svd(B)
    values_start = np.linalg.svd(B_start, compute_uv=False)
    rank = int((values_start > DEPENDENT * values_start[0]).sum()) if values_start[0] > 0.0 else 0
    if rank == 0 or not values[rank - 1] / values[0] < THRESHOLD * values_start[rank - 1] / values_start[0]:
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


def mass_scaled_rows(constraints: Constraints, model: Model, t: float, x: Array) -> Array:
    """Return A root(M)^-T of the freedoms that are not prescribed, each row at the length of the free bodies' own."""
    free = [k for k in range(model.n_u) if k not in prescribed_coordinates(model.system)]
    M = model.mass_matrix(t, x)[np.ix_(free, free)]
    A = np.take(constraints.matrix(t, x), free, axis=1)
    if not (np.isfinite(M).all() and np.isfinite(A).all()):
        return np.full((constraints.n_rows, len(free)), np.nan)
    try:
        return np.linalg.solve(np.linalg.cholesky(M), A.T).T
    except np.linalg.LinAlgError:  # no mass is left to some freedom
        return np.full((constraints.n_rows, len(free)), np.nan)
