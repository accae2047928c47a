"""From an equilibrium that is unstable to one that is not: down the potential, along the motion that grows.

The stiffness K of the forces g (symmetric where these have a potential) gives the steps -|K|^-1 g: Newton's where all
directions resist, away from where the potential is level where one gives way, as a column beyond Euler's load does.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.linear.balance import relaxed, stiff_compliance, unbalanced_forces
from femflex.dynamics.linear.increments import advanced
from femflex.dynamics.linear.steady import Steady

FIRST = 0.02  # step off the unstable equilibrium over usual sizes
LONGEST = 0.1  # of the others: a buckled column is a radian away, and may have other equilibria beyond
LEVEL = 3e-3  # of the growth that is left: slower growth is none, as round the ring on which a round column may lie
NEWTON_STEP = 1e-4  # step at which what gives way no more is left to Newton's method
STEPS, HALVINGS = 200, 20
UPHILL_LIMIT = 0.5  # of the force along a step that its end may have, the other way round


def stable_state_below(problem: Steady, q: Array, start: Array) -> Array | None:
    """Return coordinates (n_q,) near a stable equilibrium below the unstable q; None if none is reached.

    Of the two sides of q that of the coordinates begun from is taken.
    """
    g, K, values, V = _resistance(problem, q)
    direction = V[:, int(np.argmin(values))]
    direction = direction / np.abs(direction).max()
    offset = direction @ (problem.shape(start) - problem.shape(q))
    side = np.sign(offset) if abs(offset) > NEWTON_STEP else np.sign(direction[int(np.argmax(np.abs(direction)))])
    current, level = _displaced(problem, q, K, FIRST * side * direction), LEVEL**2 * abs(values.min())
    for _ in range(STEPS):
        g, K, values, V = _resistance(problem, current)
        size = np.abs(values)
        significant = size > level
        move = -V[:, significant] @ ((V[:, significant].T @ g) / size[significant])
        longest = float(np.abs(move).max(initial=0.0))
        resists = bool((values[significant] > 0).all())
        if resists and longest < NEWTON_STEP:
            return current
        next_q = _descend(problem, current, g, K, move * min(1.0, LONGEST / max(longest, 1e-300)))
        if next_q is None:
            return current if resists else None
        current = next_q
    return None


def _resistance(problem: Steady, q: Array) -> tuple[Array, Array, Array, Array]:
    """Forces (n_u,) that are left, and the stiffness (n_u, n_u), its values (m,) and directions (n_u, m)."""
    A = problem.constraint_matrix(q)
    g, lambdas = unbalanced_forces(problem, q, 1.0, A)
    Z = np.hstack(problem.directions(A))
    K = problem.stiffness(q, 1.0, lambdas)
    values, V = np.linalg.eigh(Z.T @ (K + K.T) @ Z / 2)
    return g, K, values, Z @ V


def _descend(problem: Steady, q: Array, g: Array, K: Array, move: Array) -> Array | None:
    """Return the coordinates after a step, shortened until the potential falls along it or hardly rises."""
    for _ in range(HALVINGS):
        trial = _displaced(problem, q, K, move)
        after = unbalanced_forces(problem, trial, 1.0, problem.constraint_matrix(trial))[0]
        if after @ move <= UPHILL_LIMIT * abs(g @ move):
            return trial
        move = move / 2
    return None


def _displaced(problem: Steady, q: Array, K: Array, move: Array) -> Array:
    compliance = stiff_compliance(problem, q, 1.0, problem.constraint_matrix(q), K)
    return relaxed(problem, problem.closed(advanced(problem.full, q, move * problem.sizes)), 1.0, compliance)
