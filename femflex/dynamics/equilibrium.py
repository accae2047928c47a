"""Equilibria: rest in the base frame under constant loads, steady spin, or the gravity gradient of a circular orbit.

Newton's method on the compiled residual with u = du/dt = 0, coordinates with a stiffness of their own eliminated
first. Where it does not get there at once, the outer forces grow from zero to full share in steps (continuation).
Coordinates that nothing resists (a free body's place, the angle of an axle) are held: they move along the least
change, and no force may remain along them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.linearised import advanced, linearised
from femflex.dynamics.model import Model
from femflex.dynamics.steady import Steady, steady
from femflex.dynamics.vibration import GROWING
from femflex.system import System

Array = NDArray[np.float64]

BALANCED = 1e-9  # residual over the largest force at which an equilibrium is found
FADED = 1e-6  # of the forces at the start, and of the energy of spin: equilibria without any forces are measured by it
SETTLED = 1e-8  # last step over usual sizes, likewise
LONGEST = 0.5  # step over usual sizes: half a radian, half the craft's length
NEUTRAL = 1e-7  # stiffness over the largest of the free coordinates below which a direction counts as neutral
NOISE = 1e-9  # of the largest force: stiffness that differences cannot tell from none
TRIES, HALVINGS = 30, 12
FIRST, LEAST = 0.25, 1e-4  # share of the outer forces added in a step of the continuation


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A state of rest in the base frame, or the last one reached.

    model        the system without damping, under the loads it is in balance with
    x            (n_x,) coordinates; quasi-velocities are zero
    share        of the outer forces that x balances: 1 when found
    residual     largest force left, over the largest of elastic and outer forces (times usual sizes of the motions)
    iterations   of Newton's method, all shares together
    neutral      coordinates that nothing resists, each with those it goes along with
    eigenvalues  of small motions about x, damping left out [1/s]; empty when not found
    """

    model: Model
    x: Array
    share: float
    residual: float
    iterations: int
    neutral: tuple[str, ...]
    eigenvalues: NDArray[np.complex128]

    @property
    def q(self) -> Array:
        """Coordinates (n_q,)."""
        return self.x[: self.model.n_q]

    @property
    def growth(self) -> float:
        """Largest real part of the eigenvalues [1/s], of those that are not neutral."""
        return float(self._moving().real.max(initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether no small motion grows."""
        moving = self._moving()
        return not bool((moving.real > GROWING * np.abs(moving)).any())

    @property
    def verdict(self) -> str:
        """Stability in words, with the number behind it."""
        if not len(self.eigenvalues):
            return "not known"
        moving = self._moving()
        if not self.stable:
            fastest = moving[np.argmax(moving.real)]
            how = "monotonously" if abs(fastest.imag) < abs(fastest.real) * 1e-3 else "in swings"
            return f"unstable: a small motion grows {how} by a factor e in {1.0 / fastest.real:.4g} s"
        slowest = np.abs(moving.imag)[np.abs(moving.imag) > 0].min(initial=np.inf)
        told = f"; its slowest vibration has {slowest / (2 * np.pi):.6g} Hz" if np.isfinite(slowest) else ""
        held = f", neutral along {', '.join(self.neutral)}" if self.neutral else ""
        return f"stable: no small motion grows{told}{held}"

    def _moving(self) -> NDArray[np.complex128]:
        return self.eigenvalues[2 * len(self.neutral) :]


class EquilibriumError(RuntimeError):
    """No equilibrium was found; `last` is the last state in balance, under the share of the forces that it tells."""

    def __init__(self, text: str, last: Equilibrium) -> None:
        super().__init__(text)
        self.last = last


def equilibrium(system: System, at: float | None = None) -> Equilibrium:
    """The equilibrium nearest to the system's initial coordinates: at rest in its base frame, damping ignored.

    On the ground, in a uniformly spinning frame, or in the orbital frame of a circular orbit; loads are constant, or
    those at the time `at` [s]. Raises ValueError when forces change over time, EquilibriumError when none is found.
    """
    problem = steady(system, at)
    model = problem.full
    q, share, step, count = model.x0[: model.n_q].copy(), 0.0, 1.0, 0
    first = True
    while share < 1.0:
        wanted = min(1.0, share + step)
        found = balance(problem, q, wanted)
        count += found.iterations
        if found.balanced:
            q, share = found.q, wanted
            step *= 2.0 if found.iterations <= 6 else 1.0
        elif first:  # not at once: from the unloaded state, in steps
            rest = balance(problem, q, 0.0)
            count += rest.iterations
            if not rest.balanced:
                raise _failed(problem, q, 0.0, count, rest)
            q, step = rest.q, FIRST
        else:
            step /= 2.0
            if step < LEAST:
                raise _failed(problem, q, share, count, found)
        first = False
    linear = linearised(model, 0.0, np.concatenate([q, np.zeros(model.n_u)]))
    return Equilibrium(
        model=model,
        x=np.concatenate([q, np.zeros(model.n_u)]),
        share=1.0,
        residual=found.residual,
        iterations=count,
        neutral=found.neutral,
        eigenvalues=linear.eigenvalues(),
    )


@dataclass(frozen=True, eq=False)
class Balance:
    """Where Newton's method came to at a share of the outer forces, and what is left over along which coordinate."""

    q: Array
    balanced: bool
    iterations: int
    residual: float
    worst: int
    neutral: tuple[str, ...]


def balance(problem: Steady, q: Array, share: float) -> Balance:
    """Newton's method with shortened steps from the coordinates q (n_q,), under a share of the outer forces."""
    neutral: tuple[str, ...] = ()
    residual, worst, balanced = np.inf, 0, False
    least = FADED * max(problem.largest(q, share), share * problem.energy_of_spin)
    for k in range(TRIES):
        inner, outer = problem.forces(q)
        g = inner + share * outer
        worst = int(np.argmax(np.abs(g))) if g.size else 0
        size = max(problem.largest(q, share), least)
        try:
            move, neutral, held = newton_step(problem, problem.stiffness(q, share), g, size)
        except np.linalg.LinAlgError:
            break
        residual = _ratio(g, max(size, held))
        longest = float(np.abs(move).max(initial=0.0))
        balanced = residual <= BALANCED
        if balanced and longest <= SETTLED:
            return Balance(q, True, k, residual, worst, neutral)
        q, moved = _along(problem, q, move * min(1.0, LONGEST / max(longest, 1e-300)), share, float(np.linalg.norm(g)))
        if not moved:  # the forces are at their rounding, or do not fall at all
            return Balance(q, balanced, k + 1, residual, worst, neutral)
    return Balance(q, False, TRIES, residual, worst, neutral)


def newton_step(problem: Steady, A: Array, g: Array, size: float) -> tuple[Array, tuple[str, ...], float]:
    """The step (n_u,) in usual sizes that balances g, least along neutral directions.

    With it the names of the coordinates along which these lead most, and the largest stiffness of the others that have
    none of their own [J].
    """
    e, r = problem.elastic & ~problem.held, ~problem.elastic & ~problem.held
    move = np.zeros(len(g))
    relaxed = np.linalg.solve(A[np.ix_(e, e)], np.column_stack([A[np.ix_(e, r)], g[e]]))
    S = A[np.ix_(r, r)] - A[np.ix_(r, e)] @ relaxed[:, :-1]
    rest = g[r] - A[np.ix_(r, e)] @ relaxed[:, -1]
    U, sigma, Vt = np.linalg.svd(S)
    kept = sigma > max(NEUTRAL * sigma.max(initial=0.0), NOISE * size)
    move[r] = -(Vt[kept].T @ ((U[:, kept].T @ rest) / sigma[kept]))
    move[e] = -(relaxed[:, -1] + relaxed[:, :-1] @ move[r])
    if not np.isfinite(move).all():
        raise np.linalg.LinAlgError("the step is not finite")
    names = np.array([name for name, _ in problem.full.system.velocity_names()])[r]
    neutral = tuple(str(names[np.argmax(np.abs(row))]).removesuffix("_rate") for row in Vt[~kept])
    return move, neutral, float(sigma[kept].max(initial=0.0))


def _along(problem: Steady, q: Array, move: Array, share: float, before: float) -> tuple[Array, bool]:
    """The coordinates a step further, shortened until the forces fall, and whether that helped."""
    for k in range(HALVINGS):
        part = 0.5**k
        tried = advanced(problem.full, q, part * move * problem.sizes)
        inner, outer = problem.forces(tried)
        after = float(np.linalg.norm(inner + share * outer))
        if np.isfinite(after) and after <= before * (1.0 - 1e-4 * part):
            return tried, True
    return q, False


def _ratio(left: Array, size: float) -> float:
    largest = float(np.abs(left).max(initial=0.0))
    return largest / size if size > 0 else (np.inf if largest > 0 else 0.0)


def _failed(problem: Steady, q: Array, share: float, count: int, tried: Balance) -> EquilibriumError:
    names = [name.removesuffix("_rate") for name, _ in problem.full.system.velocity_names()]
    where = names[tried.worst] if names else "nothing"
    last = Equilibrium(
        model=problem.full,
        x=np.concatenate([q, np.zeros(problem.full.n_u)]),
        share=share,
        residual=tried.residual,
        iterations=count,
        neutral=tried.neutral,
        eigenvalues=np.zeros(0, complex),
    )
    along = f"; nothing resists {', '.join(tried.neutral)}" if tried.neutral else ""
    return EquilibriumError(
        f"no equilibrium was found beyond {share:.4g} of the loads, spin and gravity: in {where} a force of "
        f"{tried.residual:.3g} of the largest is left{along}. Begin nearer to the equilibrium, lower the loads or the "
        f"spin, or hold what is free.",
        last,
    )
