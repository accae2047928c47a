"""Settled start: shapes and temperatures at rest in the surroundings of the first instant, whatever the craft does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.effector_states import with_settled_starts
from femflex.dynamics.model import Model, compile_system
from femflex.dynamics.motion.freedoms import freedom_names, is_prescribed, usual_sizes
from femflex.dynamics.motion.increments import jacobian
from femflex.linear.steady import Steady, elastic_freedoms
from femflex.system import System, started

ITERATIONS = 40  # of Newton's method, whose steps leave temperatures as they are
STEP = 1e-5  # of a coordinate's usual size
SETTLED = 1e-11  # last step over the usual sizes
LONGEST = 0.1  # step over the usual sizes


def settled(system: System) -> System:
    """The system with shapes and sprung joints where they have neither rate nor acceleration at the first instant.

    Other joints keep their initial coordinates and rates: a craft may turn or tumble, and its surroundings may change,
    so that it has no equilibrium. Inertia, gravity and the strain by heat bend it as if they had always been so, and
    the states of effectors that start settled (`Effector.settles`), such as temperatures, do not change.
    Raises ValueError where no such shapes are found.
    """
    model = compile_system(system)
    sizes, elastic, prescribed = usual_sizes(model), elastic_freedoms(model), is_prescribed(model)
    craft = Steady(system, model, model, sizes, elastic, prescribed)
    x = model.x0.copy()
    for _ in range(ITERATIONS):
        q = x[: model.n_q].copy()
        Z = craft.directions(craft.constraint_matrix(q))[0]
        x = _without_rates(model, x, Z, sizes)

        def accelerations(move: Array, x: Array = x, Z: Array = Z) -> Array:
            q = craft.coordinates_after(x[: model.n_q], Z @ move)
            rate = model.state_rate(0.0, np.concatenate([q, x[model.n_q :]]))
            return np.asarray(Z.T @ (rate[model.n_q : model.n_q + model.n_u] / sizes))

        a = accelerations(np.zeros(Z.shape[1]))
        K = jacobian(accelerations, np.full(Z.shape[1], STEP))
        scale = np.abs(K).max(axis=1, initial=0.0)
        move = np.linalg.lstsq(K / scale[:, None], -a / scale, rcond=None)[0] if Z.size else a
        longest = float(np.abs(move).max(initial=0.0))
        if not np.isfinite(longest):
            break
        q = craft.coordinates_after(q, Z @ move * min(1.0, LONGEST / max(longest, LONGEST)))
        x = with_settled_starts(replace(model, x0=np.concatenate([q, x[model.n_q :]]))).x0
        if longest < SETTLED:
            return replace(started(system, x), z0=system.z0)
    worst = freedom_names(system)[int(np.argmax(np.abs(Z @ move)))]
    raise ValueError(
        f"the shapes of the craft do not settle at the start: {worst} still moves after {ITERATIONS} steps. Lower the "
        "initial rates, or start from the state of a run that came to rest"
    )


def _without_rates(model: Model, x: Array, Z: Array, sizes: Array) -> Array:
    """The state x (n_x,) without rates along the directions Z (n_u, .), in usual sizes."""
    x = x.copy()
    u = x[model.n_q : model.n_q + model.n_u] / sizes
    x[model.n_q : model.n_q + model.n_u] = (u - Z @ (Z.T @ u)) * sizes
    return x
