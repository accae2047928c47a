"""Newton's method on the forces of a system at rest: how they balance, under a share of the outer ones.

Directions with a stiffness of their own are eliminated first; those that nothing resists are left where they are.
With loops all steps go along the directions that keep these closed, and multipliers carry the forces across.

A step that bends a slender body by h stretches it by h^2: a force that would stiffen the next step by (L / r)^2 h^2
times its bending stiffness, so that steps stay shorter than r / L. What is so stiff that the outer forces hardly move
it is therefore brought to rest again after every step (`relaxed`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.equilibria.closed_motion import least_multipliers
from femflex.dynamics.equilibria.increments import advanced
from femflex.dynamics.equilibria.steady import Steady

Merit = Callable[[Array], float]  # of the forces that are left (n_u,)

BALANCED = 1e-9  # residual over the largest force at which an equilibrium is found
FADED = 1e-6  # of the forces at the start, and of the energy of spin: equilibria without any forces are measured by it
SETTLED = 1e-8  # last step over usual sizes, likewise
SLOWLY_SETTLED = 1e-5  # the same along directions whose small forces show rounding of the large ones
LONGEST = 0.5  # step over usual sizes: half a radian, half the craft's length
NEUTRAL = 1e-7  # stiffness over the largest of the free coordinates below which a direction counts as neutral
NOISE = 1e-9  # of the largest force, or energy of spin: stiffness that differences cannot distinguish from zero
DIFFERENCES = 1e-9  # of the stiffness of coordinates alone: what their differences cannot distinguish from zero
ROUNDING = 1e-14  # of the largest stiffness: what directions across many coordinates, as loops leave them, pick up
TRIES, HALVINGS = 30, 12
STIFF = 1e3  # times the largest outer force: stiffness of what these alone move by no more than 1e-3 of its usual size
SOFT = 100.0  # times the least stiffness, up to which nothing is: loads that press along have no force where straight
ROUNDS = 8  # of bringing that to rest, each with its stiffness before the step


@dataclass(frozen=True, eq=False)
class Balance:
    """Where Newton's method came to at a share of the outer forces, and what is left over along which coordinate.

    neutral     names of the coordinates that nothing resists
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
    """Newton's method with shortened steps from the coordinates q (n_q,), under a share of the outer forces."""
    none = np.zeros((len(problem.sizes), 0))
    step = Step(np.zeros(len(problem.sizes)), (), none, 0.0)
    residual, worst, balanced = np.inf, 0, False
    least = FADED * max(problem.largest(q, share), share * problem.energy_of_spin)
    for k in range(TRIES):
        A = problem.ties(q)
        g, lambdas = unbalanced_forces(problem, q, share, A)
        worst = int(np.argmax(np.abs(g))) if g.size else 0
        size = max(problem.largest(q, share), least, float(np.abs(lambdas @ A).max(initial=0.0)))
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

        def merit(left: Array, K: Array = K, size: float = size, A: Array = A) -> float:
            # bending and closing loops stretch stiff shapes a little: large forces, which the next step takes away
            return float(np.linalg.norm(newton_step(problem, K, left, size, A).move))

        move = step.move * min(1.0, LONGEST / max(longest, 1e-300))
        q, moved = _along(problem, q, move, share, merit, stiff_answers(problem, q, share, A, K))
        if not moved:  # the forces are at their rounding, or do not fall at all
            return Balance(q, balanced, k + 1, residual, worst, step.neutral, directions)
    return Balance(q, False, TRIES, residual, worst, step.neutral, problem.sizes[:, None] * step.directions)


def unbalanced_forces(problem: Steady, q: Array, share: float, A: Array) -> tuple[Array, Array]:
    """Forces (n_u,) that are left at q under a share of the outer ones, and the multipliers (n_rows,) of the loops."""
    inner, outer = problem.forces(q)
    g = inner + share * outer
    lambdas = least_multipliers(A, g, problem.slack) if len(A) else np.zeros(0)
    return g - lambdas @ A, lambdas


def finely_balanced(problem: Steady, found: Balance) -> Balance:
    """The same, with directions at rest too that little resists for all its inertia, such as a small body's attitude.

    The gradient of gravity turns a small craft as fast as its long tether, with a torque that may be 1e-8 of the
    tether's. After each step along all directions the others are brought to rest again. Where that leads nowhere, the
    balance stays as it was found.
    """
    best = found
    for _ in range(ROUNDS if found.neutral else 0):
        A = problem.ties(best.q)
        g, lambdas = unbalanced_forces(problem, best.q, 1.0, A)
        K = problem.stiffness(best.q, 1.0, lambdas)
        size = max(problem.largest(best.q, 1.0), float(np.abs(lambdas @ A).max(initial=0.0)))
        step = newton_step(problem, K, g, size, A, problem.inertia(best.q))
        if len(step.neutral) >= len(found.neutral):
            return found
        longest = float(np.abs(step.move).max(initial=0.0))
        again = replace(best, neutral=step.neutral, directions=problem.sizes[:, None] * step.directions)
        if longest <= SLOWLY_SETTLED:
            return again
        moved = advanced(problem.full, best.q, step.move * problem.sizes * min(1.0, LONGEST / longest))
        best = balance(problem, problem.closed(moved), 1.0)
        if not best.balanced:
            return found
    return found


def newton_step(problem: Steady, K: Array, g: Array, size: float, A: Array, inertia: Array | None = None) -> Step:
    """The step that balances g (n_u,), least along neutral directions; A (n_rows, n_u) of the loops.

    inertia: (n_u, n_u) in the sizes of the coordinates [kg m^2]: what is neutral goes by stiffness per inertia
    """
    E, R = problem.directions(A)
    relaxed = np.linalg.solve(E.T @ K @ E, np.column_stack([E.T @ K @ R, E.T @ g]))
    S = R.T @ K @ R - R.T @ K @ E @ relaxed[:, :-1]
    rest = R.T @ g - R.T @ K @ E @ relaxed[:, -1]
    rounding = ROUNDING * float(np.abs(K).max(initial=0.0)) if len(A) else 0.0
    M = None if inertia is None else R.T @ inertia @ R
    resisted, neutrals = _resisted(S, M, max(NOISE * max(size, problem.energy_of_spin), rounding))
    along = resisted @ np.linalg.lstsq(S @ resisted, -rest, rcond=None)[0]
    move = R @ along - E @ (relaxed[:, -1] + relaxed[:, :-1] @ along)
    if not np.isfinite(move).all():
        raise np.linalg.LinAlgError("the step is not finite")
    names = [name.removesuffix("_rate") for name, _ in problem.full.system.velocity_names()]
    neutral = tuple(names[int(np.argmax(np.abs(R @ one)))] for one in neutrals.T)
    directions = (R - E @ relaxed[:, :-1]) @ neutrals
    stiffest = np.linalg.norm(S @ resisted, 2) if resisted.size else 0.0
    return Step(move, neutral, directions, float(stiffest))


def _resisted(S: Array, M: Array | None, noise: float) -> tuple[Array, Array]:
    """Orthonormal directions (n, .) that a stiffness S (n, n) resists, and those that it does not.

    M (n, n): their inertia, where resistance is stiffness per inertia.
    """
    if M is None:
        _, sigma, Vt = np.linalg.svd(S)
        kept = sigma > max(NEUTRAL * sigma.max(initial=0.0), noise)
        return Vt[kept].T, Vt[~kept].T
    m, Q = np.linalg.eigh(M)
    W = Q / np.sqrt(np.maximum(m, ROUNDING * m.max(initial=1.0)))
    _, rates, Vt = np.linalg.svd(W.T @ S @ W)
    V = W @ Vt.T
    V /= np.linalg.norm(V, axis=0)
    lost = DIFFERENCES * (np.sqrt(np.abs(np.diag(S))) @ np.abs(V)) ** 2
    kept = (rates > NEUTRAL * rates.max(initial=0.0)) & (np.linalg.norm(S @ V, axis=0) > np.maximum(noise, lost))
    n = int((~kept).sum())
    whole = np.linalg.qr(V[:, ~kept], mode="complete")[0] if n else np.eye(len(S))
    return whole[:, n:], whole[:, :n]


def stiff_answers(problem: Steady, q: Array, share: float, A: Array, K: Array) -> Array:
    """Compliance (n_u, n_u) of stiff directions, in usual sizes; K (n_u, n_u) at q."""
    E, _ = problem.directions(A)
    own = problem.own_stiffness[0] * problem.sizes * problem.sizes[:, None]
    values, V = np.linalg.eigh(E.T @ own @ E)
    outer = share * float(np.abs(problem.forces(q)[1]).max(initial=0.0))
    D = E @ V[:, values > max(STIFF * outer, SOFT * values.min(initial=np.inf))]
    return np.asarray(D @ np.linalg.lstsq(D.T @ K @ D, D.T, rcond=None)[0])


def relaxed(problem: Steady, q: Array, share: float, answers: Array) -> Array:
    """The coordinates with what is stiff brought to rest, everything else where it is."""
    before = np.inf
    for _ in range(ROUNDS):
        move = -answers @ unbalanced_forces(problem, q, share, problem.ties(q))[0]
        size = float(np.linalg.norm(move))
        if not size < before:
            break
        q, before = problem.closed(advanced(problem.full, q, move * problem.sizes)), size
    return q


def _along(problem: Steady, q: Array, move: Array, share: float, merit: Merit, answers: Array) -> tuple[Array, bool]:
    """The coordinates a step further, shortened until what is left falls by its merit, and whether that helped."""
    before = merit(unbalanced_forces(problem, q, share, problem.ties(q))[0])
    for k in range(HALVINGS):
        part = 0.5**k
        tried = problem.closed(advanced(problem.full, q, part * move * problem.sizes))
        tried = relaxed(problem, tried, share, answers)
        after = merit(unbalanced_forces(problem, tried, share, problem.ties(tried))[0])
        if np.isfinite(after) and after <= before * (1.0 - 1e-4 * part):
            return tried, True
    return q, False


def _ratio(left: Array, size: float) -> float:
    largest = float(np.abs(left).max(initial=0.0))
    return largest / size if size > 0 else (np.inf if largest > 0 else 0.0)
