"""Newton's method for the balance of forces of a system at rest, under a share of the outer ones.

Directions with a stiffness of their own are eliminated first; those without stiffness are left where they are.
With loops all steps go along the directions that keep these closed, and multipliers carry the forces across.

A step that bends a slender body by h stretches it by h^2: a force that would stiffen the next step by (L / r)^2 h^2
times its bending stiffness, so that steps stay shorter than r / L. What is so stiff that the outer forces hardly move
it is therefore brought to rest again after every step (`relaxed`).

An unstable equilibrium is left down the potential, along the motion that grows. The stiffness K of the forces g
(symmetric where these have a potential) gives the steps -|K|^-1 g: Newton's where all directions resist, away from
where the potential is level where one gives way, as a column beyond Euler's load does (`stable_state_below`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.motion.freedoms import freedom_names, least_multipliers
from femflex.linear.steady import Steady

Merit = Callable[[Array], float]  # of the forces that are left (n_u,)

BALANCED = 1e-9  # residual over the largest force at which an equilibrium is found
ENERGY_TOLERANCE = (
    1e-6  # of the forces at the start, and of the energy of spin: equilibria without any forces are measured by it
)
SETTLED = 1e-8  # last step over usual sizes, likewise
SLOWLY_SETTLED = 1e-5  # the same along directions whose small forces show rounding of the large ones
LONGEST = 0.5  # step over usual sizes: half a radian, half the craft's length
NEUTRAL = 1e-7  # stiffness over the largest of the free coordinates below which a direction counts as neutral
NOISE = 1e-9  # of the largest force, or energy of spin: stiffness that differences cannot distinguish from zero
DIFFERENCES = 1e-9  # of the stiffness of coordinates alone: what their differences cannot distinguish from zero
ROUNDING = 1e-14  # of the largest stiffness: what directions across many coordinates, as loops leave them, pick up
MAX_STEPS, HALVINGS = 30, 12
STIFF = 1e3  # times the largest outer force: stiffness of what these alone move by no more than 1e-3 of its usual size
SOFT = 100.0  # times the least stiffness, up to which nothing is: loads that press along have no force where straight
RELAXATIONS = 8  # of bringing that to rest, each with its stiffness before the step
FIRST_DESCENT = 0.02  # step off the unstable equilibrium over usual sizes
LONGEST_DESCENT = 0.1  # of the others: a buckled column is a radian away, and may have other equilibria beyond
LEVEL = 3e-3  # of the growth that is left: slower growth is none, as round the ring on which a round column may lie
NEWTON_STEP = 1e-4  # step at which what gives way no more is left to Newton's method
DESCENTS, DESCENT_HALVINGS = 200, 20
UPHILL_LIMIT = 0.5  # of the force along a step that its end may have, the other way round


@dataclass(frozen=True, eq=False)
class Balance:
    """Result of Newton's method at a share of the outer forces, and the residual with its largest coordinate.

    neutral     names of the coordinates without stiffness
    directions  (n_u, len(neutral)) increments along which nothing does
    """

    q: Array
    balanced: bool
    iterations: int
    residual: float
    worst: int
    neutral: tuple[str, ...]
    directions: Array


@dataclass(frozen=True, eq=False)
class Step:
    """A step of Newton's method, in usual sizes of the coordinates.

    move        (n_u,)
    neutral     names of the coordinates along which the neutral directions lead most
    directions  (n_u, len(neutral)) along which nothing resists
    stiffest    largest stiffness of the coordinates that have none of their own [J]
    """

    move: Array
    neutral: tuple[str, ...]
    directions: Array
    stiffest: float


def balance(problem: Steady, q: Array, share: float) -> Balance:
    """Newton's method with shortened steps from the coordinates q (n_q,), under a share [1] of the outer forces.

    Where the steps do not settle, such as along a ring of equilibria, the result is the step of least residual.
    """
    no_directions = np.zeros((len(problem.sizes), 0))
    step = Step(np.zeros(len(problem.sizes)), (), no_directions, 0.0)
    residual, worst, balanced = np.inf, 0, False
    best = Balance(q, False, MAX_STEPS, residual, worst, (), no_directions)
    least = ENERGY_TOLERANCE * max(problem.largest_force(q, share), share * problem.energy_of_spin)
    for k in range(MAX_STEPS):
        g, lambdas, A = unbalanced_forces(problem, q, share)
        worst = int(np.argmax(np.abs(g))) if g.size else 0
        size = max(problem.largest_force(q, share), least, float(np.abs(lambdas @ A).max(initial=0.0)))
        K = problem.stiffness(q, share, lambdas)
        try:
            step = newton_step(problem, K, g, size, A)
        except np.linalg.LinAlgError:
            break
        residual, directions = _ratio(g, max(size, step.stiffest)), problem.sizes[:, None] * step.directions
        longest = float(np.abs(step.move).max(initial=0.0))
        balanced = residual <= BALANCED
        if balanced and longest <= SETTLED:
            return Balance(q, True, k, residual, worst, step.neutral, directions)
        if residual < best.residual:
            best = Balance(q, False, MAX_STEPS, residual, worst, step.neutral, directions)

        def merit(forces: Array, K: Array = K, size: float = size, A: Array = A) -> float:
            # bending and closing loops stretch stiff shapes a little: large forces, which the next step takes away
            return float(np.linalg.norm(newton_step(problem, K, forces, size, A).move))

        move = step.move * min(1.0, LONGEST / max(longest, 1e-300))
        q, improved = _line_search(problem, q, move, share, merit, stiff_compliance(problem, q, share, A, K))
        if not improved:  # the forces are at their rounding, or do not fall at all
            return Balance(q, balanced, k + 1, residual, worst, step.neutral, directions)
    return best


def unbalanced_forces(problem: Steady, q: Array, share: float) -> tuple[Array, Array, Array]:
    """Forces (n_u,) [SI] left at q under a share of the outer ones; the multipliers (n_rows,) of the loops, and A.

    A (n_rows, n_u): their constraint matrix.
    """
    A, (inner, outer) = problem.constraint_matrix(q), problem.forces(q)
    g = inner + share * outer
    lambdas = least_multipliers(A, g, problem.slack) if len(A) else np.zeros(0)
    return g - lambdas @ A, lambdas, A


def finely_balanced(problem: Steady, first: Balance) -> Balance:
    """The same, with directions at rest too that little resists for all its inertia, such as a small body's attitude.

    The gradient of gravity turns a small craft as fast as its long tether, with a torque that may be 1e-8 of the
    tether's. After each step along all directions the others are brought to rest again. Where that leads nowhere, the
    balance stays as it was found.
    """
    best = first
    for _ in range(RELAXATIONS if first.neutral else 0):
        g, lambdas, A = unbalanced_forces(problem, best.q, 1.0)
        K = problem.stiffness(best.q, 1.0, lambdas)
        size = max(problem.largest_force(best.q, 1.0), float(np.abs(lambdas @ A).max(initial=0.0)))
        step = newton_step(problem, K, g, size, A, problem.inertia(best.q))
        if len(step.neutral) >= len(first.neutral):
            return first
        longest = float(np.abs(step.move).max(initial=0.0))
        refined = replace(best, neutral=step.neutral, directions=problem.sizes[:, None] * step.directions)
        if longest <= SLOWLY_SETTLED:
            return refined
        best = balance(problem, problem.coordinates_after(best.q, step.move * min(1.0, LONGEST / longest)), 1.0)
        if not best.balanced:
            return first
    return first


def newton_step(problem: Steady, K: Array, g: Array, size: float, A: Array, inertia: Array | None = None) -> Step:
    """The step that balances g (n_u,), least along neutral directions; A (n_rows, n_u) of the loops.

    inertia: (n_u, n_u) in the sizes of the coordinates [kg m^2]: what is neutral goes by stiffness per inertia
    """
    E, R = problem.directions(A)
    relaxed = np.linalg.solve(E.T @ K @ E, np.column_stack([E.T @ K @ R, E.T @ g]))
    S = R.T @ K @ R - R.T @ K @ E @ relaxed[:, :-1]
    remaining = R.T @ g - R.T @ K @ E @ relaxed[:, -1]
    rounding = ROUNDING * float(np.abs(K).max(initial=0.0)) if len(A) else 0.0
    M = None if inertia is None else R.T @ inertia @ R
    resisted, neutrals = _split_by_resistance(S, M, max(NOISE * max(size, problem.energy_of_spin), rounding))
    amplitudes = resisted @ np.linalg.lstsq(S @ resisted, -remaining, rcond=None)[0]
    move = R @ amplitudes - E @ (relaxed[:, -1] + relaxed[:, :-1] @ amplitudes)
    if not np.isfinite(move).all():
        raise np.linalg.LinAlgError("the step is not finite")
    names = freedom_names(problem.full.system)
    neutral = tuple(names[int(np.argmax(np.abs(R @ direction)))] for direction in neutrals.T)
    directions = (R - E @ relaxed[:, :-1]) @ neutrals
    stiffest = np.linalg.norm(S @ resisted, 2) if resisted.size else 0.0
    return Step(move, neutral, directions, float(stiffest))


def _split_by_resistance(S: Array, M: Array | None, noise: float) -> tuple[Array, Array]:
    """Return orthonormal directions (n, .) that a stiffness S (n, n) resists, and those that it does not.

    M (n, n): their inertia, where resistance is stiffness per inertia.
    """
    if M is None:
        _, sigma, Vt = np.linalg.svd(S)
        resisted = sigma > max(NEUTRAL * sigma.max(initial=0.0), noise)
        return Vt[resisted].T, Vt[~resisted].T
    m, Q = np.linalg.eigh(M)
    W = Q / np.sqrt(np.maximum(m, ROUNDING * m.max(initial=1.0)))
    _, rates, Vt = np.linalg.svd(W.T @ S @ W)
    V = W @ Vt.T
    V /= np.linalg.norm(V, axis=0)
    rounding = DIFFERENCES * (np.sqrt(np.abs(np.diag(S))) @ np.abs(V)) ** 2
    resisted = (rates > NEUTRAL * rates.max(initial=0.0)) & (
        np.linalg.norm(S @ V, axis=0) > np.maximum(noise, rounding)
    )
    n = int((~resisted).sum())
    basis = np.linalg.qr(V[:, ~resisted], mode="complete")[0] if n else np.eye(len(S))
    return basis[:, n:], basis[:, :n]


def stiff_compliance(problem: Steady, q: Array, share: float, A: Array, K: Array) -> Array:
    """Compliance (n_u, n_u) of stiff directions, in usual sizes; K (n_u, n_u) [SI] at q."""
    E, _ = problem.directions(A)
    stiffness = problem.own_stiffness[0] * problem.sizes * problem.sizes[:, None]
    values, V = np.linalg.eigh(E.T @ stiffness @ E)
    outer = share * float(np.abs(problem.forces(q)[1]).max(initial=0.0))
    D = E @ V[:, values > max(STIFF * outer, SOFT * values.min(initial=np.inf))]
    return np.asarray(D @ np.linalg.lstsq(D.T @ K @ D, D.T, rcond=None)[0])


def relaxed(problem: Steady, q: Array, share: float, compliance: Array) -> Array:
    """Return the coordinates (n_q,) [m, rad] with the stiff ones brought to rest and all others unchanged."""
    before = np.inf
    for _ in range(RELAXATIONS):
        move = -compliance @ unbalanced_forces(problem, q, share)[0]
        size = float(np.linalg.norm(move))
        if not size < before:
            break
        q, before = problem.coordinates_after(q, move), size
    return q


def _line_search(
    problem: Steady, q: Array, move: Array, share: float, merit: Merit, compliance: Array
) -> tuple[Array, bool]:
    """Return the coordinates after a step, shortened until the residual falls by its merit, and whether that helped."""
    before = merit(unbalanced_forces(problem, q, share)[0])
    for k in range(HALVINGS):
        factor = 0.5**k
        trial = relaxed(problem, problem.coordinates_after(q, factor * move), share, compliance)
        after = merit(unbalanced_forces(problem, trial, share)[0])
        if np.isfinite(after) and after <= before * (1.0 - 1e-4 * factor):
            return trial, True
    return q, False


def _ratio(forces: Array, size: float) -> float:
    largest = float(np.abs(forces).max(initial=0.0))
    return largest / size if size > 0 else (np.inf if largest > 0 else 0.0)


def stable_state_below(problem: Steady, q: Array, start: Array) -> Array | None:
    """Return coordinates (n_q,) [m, rad] near a stable equilibrium below the unstable q; None if none is reached.

    Of the two sides of q that of the coordinates begun from is taken.
    """
    g, K, values, V = _resistance(problem, q)
    direction = V[:, int(np.argmin(values))]
    direction = direction / np.abs(direction).max()
    offset = direction @ (problem.shape(start) - problem.shape(q))
    side = np.sign(offset) if abs(offset) > NEWTON_STEP else np.sign(direction[int(np.argmax(np.abs(direction)))])
    current, level = _displaced(problem, q, K, FIRST_DESCENT * side * direction), LEVEL**2 * abs(values.min())
    for _ in range(DESCENTS):
        g, K, values, V = _resistance(problem, current)
        size = np.abs(values)
        significant = size > level
        move = -V[:, significant] @ ((V[:, significant].T @ g) / size[significant])
        longest = float(np.abs(move).max(initial=0.0))
        resists = bool((values[significant] > 0).all())
        if resists and longest < NEWTON_STEP:
            return current
        next_q = _descend(problem, current, g, K, move * min(1.0, LONGEST_DESCENT / max(longest, 1e-300)))
        if next_q is None:
            return current if resists else None
        current = next_q
    return None


def _resistance(problem: Steady, q: Array) -> tuple[Array, Array, Array, Array]:
    """Forces (n_u,) that are left, and the stiffness (n_u, n_u), its values (m,) and directions (n_u, m)."""
    g, lambdas, A = unbalanced_forces(problem, q, 1.0)
    Z = np.hstack(problem.directions(A))
    K = problem.stiffness(q, 1.0, lambdas)
    values, V = np.linalg.eigh(Z.T @ (K + K.T) @ Z / 2)
    return g, K, values, Z @ V


def _descend(problem: Steady, q: Array, g: Array, K: Array, move: Array) -> Array | None:
    """Return the coordinates after a step, shortened until the potential falls along it or hardly rises."""
    for _ in range(DESCENT_HALVINGS):
        trial = _displaced(problem, q, K, move)
        after = unbalanced_forces(problem, trial, 1.0)[0]
        if after @ move <= UPHILL_LIMIT * abs(g @ move):
            return trial
        move = move / 2
    return None


def _displaced(problem: Steady, q: Array, K: Array, move: Array) -> Array:
    compliance = stiff_compliance(problem, q, 1.0, problem.constraint_matrix(q), K)
    return relaxed(problem, problem.coordinates_after(q, move), 1.0, compliance)
