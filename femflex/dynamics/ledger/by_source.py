"""Terms by source: every term of eq. (9) along a run, by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.forces.force_term import force_terms
from femflex.dynamics.joints.places import FORCES, body_places, prescribed_places
from femflex.dynamics.layout.records import body_records
from femflex.dynamics.ledger.equation_terms import EQUATION_TERMS
from femflex.dynamics.ledger.ledger import ledger
from femflex.system import System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


# the ledger's rows in its order, with what they say; then come "drives/<held freedom>" and the items of force terms
TERMS = {term.name: term.meaning for term in EQUATION_TERMS}
SWITCHED = tuple(term.name for term in EQUATION_TERMS if term.switched)  # left out of the compiled equations
DRIVES, INERTIA_OF = "drives/", "inertia/"
FORCE_UNITS = FORCES | {"kg^1/2 m/s": "kg^1/2 m/s^2"}


def terms(model: Model, times: Array, states: Array) -> dict[str, Array]:
    """Every term of M udot + h - Q = 0 along a motion: name -> (n_t, n_u), with its sign in that equation.

    times (n_t,) [s], states (n_t, n_x); udot is the model's own. Row k is the generalised force on the coordinate with
    quasi-velocity u_k (units as in `force_units`). The names are those of `TERMS`, without what the system has not,
    "drives/<freedom>" of prescribed freedoms, those of force terms ("loads/<name>", "laws/<law>", "springs/<name>",
    "effectors/<name>"), "loops/<name>" and "constraints/<name>"; -Q and -A^T lambda carry their minus. The terms sum
    to zero to rounding, row by row.
    """
    times, states, rates = _motion(model, times, states)
    out = _ledger_of_motion(model, times, states, rates)
    rows = ledger_rows(model.system)
    present = [name for name in term_names(model.system) if name not in model.omitted]
    rows_by_name = {name: out[:, rows.index(name)] for name in present}
    if model.constraints is not None:
        rows_by_name |= model.constraints.forces(times, states)
    if model.constraints is not None:  # what is left sets the forces that hold freedoms
        remaining = np.sum([row for name, row in rows_by_name.items() if not name.startswith(DRIVES)], axis=0)
        for joint, k, _, u in prescribed_places(model.system):
            rows_by_name[DRIVES + joint.freedom_names()[k]][:, u] = -remaining[:, u]
    return rows_by_name


def inertia_by_source(model: Model, times: Array, states: Array) -> dict[str, Array]:
    """M udot split by whose acceleration it is: "inertia/<joint>" or "inertia/<body>" (its shapes) -> (n_t, n_u).

    Only joints that move and bodies with shapes have one; the parts sum to the term "inertia" of `terms`.
    """
    times, states, rates = _motion(model, times, states)
    out = {}
    for name, indices in velocity_slices(model.system).items():
        udot = np.zeros_like(rates)
        udot[:, indices] = rates[:, indices]
        out[INERTIA_OF + name] = _ledger(model, times, states, udot)[:, 0]
    return out


def velocity_slices(system: System) -> dict[str, slice]:
    """Places in u of the joints that move, by label, and of the bodies' shapes, by name."""
    slices: dict[str, slice] = {}
    for name, joint, body, _, u in body_places(system):
        elastic = u + joint.n_u
        slices |= {joint.label: slice(u, elastic), name: slice(elastic, elastic + body.n_modes)}
    return {name: indices for name, indices in slices.items() if indices.stop > indices.start}


def _motion(model: Model, times: Array, states: Array) -> tuple[Array, Array, Array]:
    """Times, states and the model's accelerations (n_t, n_u), checked."""
    times = np.ascontiguousarray(times, float)
    states = np.ascontiguousarray(states, float)
    if states.shape != (len(times), model.n_x):
        raise ValueError(
            f"states have shape {states.shape}; {len(times)} times of this model need ({len(times)}, {model.n_x})"
        )
    rates = np.empty((len(times), model.n_u))
    for k, (t, x) in enumerate(zip(times, states, strict=True)):
        rates[k] = model.parts(model.state_rate(t, x))[1]
    return times, states, rates


def _ledger_of_motion(model: Model, times: Array, states: Array, rates: Array) -> Array:
    """All rows of the ledger along a motion, (n_t, n_rows, n_u).

    Accelerations of free lengths stand in the model's scratch, where the evaluation before leaves them.
    """
    if not any(record["free_length"] for record in body_records(model.table)):
        return _ledger(model, times, states, rates)
    parts = []
    for k, (t, x) in enumerate(zip(times, states, strict=True)):
        model.state_rate(t, x)
        parts.append(_ledger(model, times[k : k + 1], states[k : k + 1], rates[k : k + 1]))
    return np.concatenate(parts)


def _ledger(model: Model, times: Array, states: Array, rates: Array) -> Array:
    """All rows of the ledger, (n_t, n_rows, n_u)."""
    n_rows = len(ledger_rows(model.system))
    out = np.empty((len(times), n_rows * model.n_u))
    ledger(times, states, rates, out, model.table, model.pool, model.work)
    return out.reshape(len(times), n_rows, model.n_u)


def ledger_rows(system: System) -> list[str]:
    """Return the names of the ledger's rows for a system, also of those that are zero throughout."""
    drives = (DRIVES + joint.freedom_names()[k] for joint, k, _, _ in prescribed_places(system))
    return [*TERMS, *drives, *(name for term in force_terms() for name in term.names(system))]


def term_names(system: System) -> list[str]:
    """Names of the terms that the system has, in the ledger's order."""
    present = {term.name: term.present(system) for term in EQUATION_TERMS}
    return [name for name in ledger_rows(system) if present.get(name, True)]


def force_units(system: System) -> list[str]:
    """Unit of the generalised force on every coordinate (n_u): force times velocity is power."""
    return [FORCE_UNITS[unit] for _, unit in system.velocity_names()]
