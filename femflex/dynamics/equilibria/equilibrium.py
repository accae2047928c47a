"""Equilibria: rest in the base frame under constant loads, steady spin, or the gravity gradient of a circular orbit.

Newton's method (femflex.dynamics.equilibria.balance) on the compiled residual with u = du/dt = 0. Where it does not
get there at once, the outer forces grow from zero to full share in steps (continuation). Coordinates that nothing
resists (a free body's place, the angle of an axle) are held: they move along the least change, and no force may
remain along them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.dynamics.equilibria.balance import BALANCED, Balance, balance, finely_balanced
from femflex.dynamics.equilibria.frequency import damped
from femflex.dynamics.equilibria.small_motions import SmallMotions, small_motions
from femflex.dynamics.equilibria.stable_state import LEVEL, stable_state_below
from femflex.dynamics.equilibria.states import resting_state
from femflex.dynamics.equilibria.steady import Steady, steady
from femflex.dynamics.lowering.layout import body_records
from femflex.dynamics.model import Model, compile_system
from femflex.system import System

FIRST, LEAST = 0.25, 1e-4  # share of the outer forces added in a step of the continuation
UNMOVED = (
    "the craft has no free coordinate: its bodies are rigid, and its joints are welded or prescribed. An equilibrium "
    "needs a flexible body or a free joint"
)


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A state of rest in the base frame, or the last one reached.

    model        the system without damping, under the loads it is in balance with
    x            (n_x,) coordinates; quasi-velocities are zero
    share        of the outer forces that x balances: 1 when found
    residual     largest force left, over the largest of elastic and outer forces (times usual sizes of the motions)
    iterations   of Newton's method, all shares together
    neutral      coordinates that nothing resists, each with those it goes along with
    directions   (n_u, len(neutral)) increments along which nothing resists
    moving       the system at rest with its damping, and with the motors of wheels that a law commands
    left         the unstable equilibrium that was left for this one, None where there was none
    """

    model: Model
    x: Array
    share: float
    residual: float
    iterations: int
    neutral: tuple[str, ...]
    directions: Array
    moving: System
    left: Equilibrium | None = None

    @property
    def q(self) -> Array:
        """Coordinates (n_q,)."""
        return self.x[: self.model.n_q]

    @property
    def gap(self) -> float:
        """Largest gap of the loops, as lengths or angles; 0 without any."""
        tied = self.model.constraints
        return 0.0 if tied is None else float(np.abs(tied.residuals(0.0, self.x)[0]).max())

    @cached_property
    def motions(self) -> SmallMotions:
        """The small motions about the equilibrium, with damping."""
        model = compile_system(self.moving) if damped(self.moving) else self.model
        return small_motions(model, resting_state(self.model, self.x, model), self.directions)

    @property
    def eigenvalues(self) -> ComplexArray:
        """Of the small motions with damping [1/s], drift and neutral ones apart; empty when none was found."""
        return self.motions.spectrum if self.share == 1.0 else np.zeros(0, complex)

    @property
    def growth(self) -> float:
        """Largest real part of the eigenvalues [1/s]."""
        return float(self.eigenvalues.real.max(initial=0.0))

    @property
    def growth_threshold(self) -> float:
        """Real part [1/s] above which the fastest growing motion, or else the slowest of all, counts as growing."""
        values = self.eigenvalues
        if not len(values):
            return 0.0
        return float(self._thresholds[int(np.argmax(values.real))])

    @property
    def stable(self) -> bool:
        """Whether no small motion grows; next to an equilibrium that was left, some much slower growth is none."""
        return not bool((self.eigenvalues.real > self._thresholds).any())

    @property
    def verdict(self) -> str:
        """Stability in words, with the number behind it."""
        values = self.eigenvalues
        if self.share < 1.0:
            return "not known"
        neutral = self.neutral
        if self.motions.driven:  # a law may resist what forces of the craft do not
            neutral = tuple(dict.fromkeys(motion.name for motion in self.motions.known))
        held = f", neutral along {', '.join(neutral)}" if neutral else ""
        if not len(values):
            return f"stable{held}" if held else "nothing is free to move"
        if not self.stable:
            fastest = values[np.argmax(values.real - self._thresholds)]
            how = "monotonically" if abs(fastest.imag) < abs(fastest.real) * 1e-3 else "in oscillations"
            return f"unstable: a small motion grows {how} by a factor e in {1.0 / fastest.real:.4g} s"
        slowest = np.abs(values.imag)[np.abs(values.imag) > self._level].min(initial=np.inf)
        text = f"; its slowest vibration has {slowest / (2 * np.pi):.6g} Hz" if np.isfinite(slowest) else ""
        return f"stable{text}{held}"

    @property
    def _level(self) -> float:
        """Rate below which motion is taken for none [1/s]."""
        return LEVEL * self.left.growth if self.left is not None else 0.0

    @property
    def _thresholds(self) -> Array:
        """Real part above which each of the eigenvalues grows [1/s]."""
        return np.maximum(self.motions.spectrum_thresholds, self._level) if self.share == 1.0 else np.zeros(0)


class EquilibriumError(RuntimeError):
    """No equilibrium was found; `last` is the last state in balance, under its share of the forces."""

    def __init__(self, text: str, last: Equilibrium) -> None:
        super().__init__(text)
        self.last = last


def equilibrium(system: System, at: float | None = None, stable: bool = False) -> Equilibrium:
    """The equilibrium nearest to the system's initial coordinates: at rest in its base frame.

    On the ground, in a uniformly spinning frame, or in the orbital frame of a circular orbit; loads are constant, or
    those at the time `at` [s]. stable: an unstable one is left along the motion that grows, for one that is stable
    (`leaving`). Raises ValueError when forces change over time or nothing can move, EquilibriumError when none is
    found.
    """
    problem = steady(system, at)
    if not problem.full.n_u:
        raise ValueError(UNMOVED)
    begun = problem.full.x0[: problem.full.n_q].copy()
    found = _nearest(problem, begun)
    return found if not stable or found.stable else _beyond(problem, found, begun)


def _nearest(problem: Steady, begun: Array) -> Equilibrium:
    """What Newton's method comes to from the coordinates begun from, or a path along growing outer forces."""
    q, share, step, count = begun, 0.0, 1.0, 0
    first = True
    while share < 1.0:
        wanted = min(1.0, share + step)
        found = balance(problem, q, wanted)
        count += found.iterations
        if found.balanced:
            q, share = found.q, wanted
            step *= 2.0 if found.iterations <= 6 else 1.0
        elif first and (again := _about_preload(problem, q)) is not None:
            count += again.iterations
            found, q, share = again, again.q, 1.0
        elif first:  # not at once: from the unloaded state, in steps
            rest = balance(problem, q, 0.0)
            count += rest.iterations
            if not rest.balanced:
                raise _failed(problem, q, 0.0, count, rest)
            q, step = rest.q, FIRST
            least = balance(problem, q, LEAST)
            count += least.iterations
            if not least.balanced:  # halving the steps down to there would only take its time
                raise _failed(problem, q, 0.0, count, least)
        else:
            step /= 2.0
            if step < LEAST:
                raise _failed(problem, q, share, count, found)
        first = False
    return _as_equilibrium(problem, finely_balanced(problem, found), count)


def _about_preload(problem: Steady, q: Array) -> Balance | None:
    """The balance from undeformed bodies where some have a preload, without which they would be slack; else None."""
    model = problem.full
    if not any(body.strain.f0.any() for body in model.system.bodies.values()):
        return None
    start = q.copy()
    for record in body_records(model.table)[1:]:
        start[int(record["qe"]) : int(record["qe"]) + int(record["n"])] = 0.0
    found = balance(problem, start, 1.0)
    return found if found.balanced else None


def _beyond(problem: Steady, unstable: Equilibrium, begun: Array) -> Equilibrium:
    """The stable equilibrium that the motion that grows away from an unstable one leads to."""
    near = stable_state_below(problem, unstable.q, begun)
    found = None if near is None else balance(problem, near, 1.0)
    if found is not None and found.residual <= BALANCED:  # it may go on along a ring of equilibria, hardly resisted
        settled = _as_equilibrium(problem, found, unstable.iterations + found.iterations, unstable)
        if settled.stable:
            return settled
    raise EquilibriumError(
        f"the equilibrium that was found is {unstable.verdict}, and no stable one was found from it. Start from "
        "another state, lower the loads, or let a damped run come to rest",
        unstable,
    )


def _as_equilibrium(problem: Steady, found: Balance, count: int, left: Equilibrium | None = None) -> Equilibrium:
    model = problem.full
    x = problem.at_rest(found.q)
    return Equilibrium(
        model=model,
        x=x,
        share=1.0,
        residual=found.residual,
        iterations=count,
        neutral=found.neutral,
        directions=found.directions,
        moving=problem.damped,
        left=left,
    )


def _failed(problem: Steady, q: Array, share: float, count: int, tried: Balance) -> EquilibriumError:
    names = [name.removesuffix("_rate") for name, _ in problem.full.system.velocity_names()]
    where = names[tried.worst] if names else "nothing"
    last = Equilibrium(
        model=problem.full,
        x=problem.at_rest(q),
        share=share,
        residual=tried.residual,
        iterations=count,
        neutral=tried.neutral,
        directions=tried.directions,
        moving=problem.damped,
    )
    if not np.isfinite(tried.residual):
        text = (
            "no equilibrium was found: at rest the stiffness is singular, as of a cable without tension. Give its "
            "preload, or the spin of the base frame ([attitude] frame = 'spinning'), or linearise about the state of a "
            "run (femflex linearize --run FILE --at TIME)"
        )
        return EquilibriumError(text, last)
    along = f"; nothing resists {', '.join(tried.neutral)}" if tried.neutral else ""
    return EquilibriumError(
        f"no equilibrium was found beyond {share:.4g} of the loads, spin and gravity: the largest unbalanced force, "
        f"in {where}, is {tried.residual:.3g} of the largest force{along}. Start nearer to the equilibrium, lower the "
        "loads or the spin, or fix free coordinates.",
        last,
    )
