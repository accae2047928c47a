"""Highest natural frequency of a compiled model, which limits the step of an explicit method."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.dynamics.joints.law_places import law_places
from femflex.dynamics.lowering.layout import body_records
from femflex.system import System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


DENSE_LIMIT = 100  # coordinates; beyond, the largest eigenvalue is found by Arnoldi's method, without the matrix
STEP = 1e-6  # of the difference quotient, times a unit of the coordinate


def highest_frequency(model: Model) -> float:
    """Highest natural frequency of shapes and springs at the initial configuration, at rest [rad/s].

    That of the whole system, bodies and joints coupled and loops closed: the largest eigenvalue of M^-1 K, which turns
    displacements of the elastic, sliding and turning coordinates that have stiffness into the accelerations that they
    call up. Where dampers let motion die faster than anything vibrates, their rate.
    """
    return max(linear_frequency(model), law_frequency(model), damping_rate(model), state_frequency(model))


def state_frequency(model: Model) -> float:
    """Fastest rate of states z among themselves at rest, the largest eigenvalue of dzdot/dz [1/s]; 0 without any."""
    if not model.system.effectors:
        return 0.0
    x, first, columns = model.at_rest(model.x0[: model.n_q]), model.n_q + model.n_u, []
    base = model.state_rate(0.0, x)[first:]
    changing = np.flatnonzero(np.isfinite(model.system.state_sizes()))  # not what only samples change
    for k in changing:
        displaced, step = x.copy(), STEP * max(1.0, abs(x[first + k]))
        displaced[first + k] += step
        columns.append(((model.state_rate(0.0, displaced)[first:] - base) / step)[changing])
    return float(np.abs(np.linalg.eigvals(np.column_stack(columns))).max(initial=0.0)) if columns else 0.0


def damping_rate(model: Model) -> float:
    """Fastest rate at which motion dies by dampers, shapes' damping and friction at rest [1/s]; 0 without any.

    The largest real part among the eigenvalues of M^-1 D, which turns velocities into decelerations; gyroscopic forces
    have none.
    """
    if not damped(model.system):
        return 0.0
    rest = model.at_rest(model.x0[: model.n_q])

    def decelerations(velocities: Array) -> Array:
        ahead, behind = (_with_velocities(model, rest, sign * STEP * velocities) for sign in (1.0, -1.0))
        return (_accelerations(model, behind) - _accelerations(model, ahead)) / (2.0 * STEP)

    return max(0.0, largest_eigenvalue(decelerations, model.n_u))


def _with_velocities(model: Model, x: Array, velocities: Array) -> Array:
    """The state x (n_x,) with each of the quasi-velocities (m, n_u): (m, n_x)."""
    states = np.tile(x, (len(velocities), 1))
    model.parts(states)[1][:] = velocities
    return states


def _accelerations(model: Model, states: Array) -> Array:
    """du/dt (m, n_u) at t = 0 at states (m, n_x)."""
    rates, arrays = np.empty_like(states), model.workspace.arrays
    for x, dx in zip(states, rates, strict=True):
        model.rate(0.0, x, dx, *arrays)
    return model.parts(rates)[1]


def damped(system: System) -> bool:
    """Whether anything in a system resists velocities linearly."""
    return (
        any(joint.damping.any() or joint.laws for joint in system.joints)
        or any(body.damping.any() for body in system.bodies.values())
        or any(spring.damping for spring in system.springs)
        or bool(system.effectors)
    )


def largest_eigenvalue(operator: Callable[[Array], Array], n: int) -> float:
    """Largest real part of the eigenvalues of a linear map, 0 of none; of many coordinates by Arnoldi's method.

    operator: takes vectors (m, n) to their images (m, n).
    """
    if n == 0:
        return 0.0
    if n <= DENSE_LIMIT:
        values = np.linalg.eigvals(operator(np.eye(n)))
    else:
        from scipy.sparse.linalg import LinearOperator, eigs

        start = np.random.default_rng(0).normal(size=n)
        values = eigs(
            LinearOperator((n, n), matvec=lambda one: operator(one.reshape(1, n))[0], dtype=float), 1, which="LR",
            v0=start, tol=1e-6, return_eigenvectors=False,
        )  # fmt: skip
    return float(values.real.max())


def law_frequency(model: Model) -> float:
    """Highest frequency that stops, tabulated springs and latches can reach where they are stiffest [rad/s]."""
    squares = [0.0]
    for law_place in law_places(model.system):
        unit, out = np.zeros(model.n_u), np.empty(model.n_u)
        unit[law_place.u] = 1.0
        stiffest = law_place.law.stiffest
        if stiffest > 0:
            q = np.ascontiguousarray(model.x0[: model.n_q])
            rhs = np.concatenate([unit, model.parts(model.x0)[2]])
            model.tree.solve(0.0, q, rhs, out, 1.0, 0.0, 0.0, model.table, model.pool, model.work)
            squares.append(stiffest * out[law_place.u])
    return float(np.sqrt(max(squares)))


def linear_frequency(model: Model) -> float:
    """Highest natural frequency of shapes and springs at the initial configuration, at rest [rad/s].

    M^-1 K column by column: the accelerations that a unit of each elastic, sliding or turning coordinate calls up.
    """
    indices = stiff_indices(model)

    def accelerations(displacements: Array) -> Array:
        return restoring_accelerations(model, indices, displacements)[:, indices[1]]

    return float(np.sqrt(max(largest_eigenvalue(accelerations, len(indices[1])), 0.0)))


def stiff_indices(model: Model) -> tuple[IntArray, IntArray]:
    """Return places in q and in u (m,) of coordinates with stiffness; all of u if there are springs or effectors."""
    if model.system.springs or model.system.effectors:  # these may act on any coordinate
        return np.full(model.n_u, -1), np.arange(model.n_u)
    pairs = [pair for record in body_records(model.table)[1:] for pair in stiff_coordinates(record)]
    q, u = np.array(pairs, np.int64).reshape(-1, 2).T
    return q, u


def restoring_accelerations(model: Model, indices: tuple[IntArray, IntArray], displacements: Array) -> Array:
    """Accelerations (k, n_u) that oppose displacements (k, m) of these places from the initial state, at rest."""
    rest = model.at_rest(model.x0[: model.n_q])
    displaced = np.tile(rest, (len(displacements), 1))
    if model.system.springs or model.system.effectors:
        start = rest[: model.n_q].copy()
        for x, displacement in zip(displaced, displacements, strict=True):
            model.tree.advance(start, STEP * displacement, x[: model.n_q], model.table, model.pool, model.work)
    else:
        displaced[:, indices[0]] += STEP * displacements
    return np.asarray((_accelerations(model, rest[None]) - _accelerations(model, displaced)) / STEP)


def stiff_coordinates(record: np.void) -> list[tuple[int, int]]:
    """(q, u) places of a body's elastic coordinates, and of its joint's coordinates when it has springs."""
    joint = int(record["n_slide"] + record["n_turn"]) if record["sprung"] else 0
    elastic = [(int(record["qe"]) + k, int(record["ue"]) + k) for k in range(int(record["n"]))]
    return [(int(record["q"]) + k, int(record["u"]) + k) for k in range(joint)] + elastic
