"""Equilibria: rest in the base frame under constant loads, steady spin, or the gravity gradient of a circular orbit.

Newton's method (femflex.linear.balance) on the compiled residual with u = du/dt = 0. Where it does not
get there at once, the outer forces grow from zero to full share in steps (continuation); where that fails too, as with
slack cables, it starts from where a motion comes to rest (femflex.linear.relaxation). Coordinates that nothing
resists (a free body's place, the angle of an axle) are held: they move along the least change, and no force may
remain along them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.dynamics.model import Model, compile_system
from femflex.dynamics.motion.freedoms import elastic_places, freedom_names
from femflex.dynamics.motion.motion_scale import damped
from femflex.effectors.constant_commands import with_held_commands
from femflex.linear.balance import BALANCED, LEVEL, Balance, balance, finely_balanced, stable_state_below
from femflex.linear.relaxation import relaxed_states
from femflex.linear.small_motions import SmallMotions, small_motions
from femflex.linear.steady import Steady, steady
from femflex.linear.still import frozen_system, without_variation
from femflex.system import Controller, System

FIRST, LEAST = 0.25, 1e-4  # share of the outer forces added in a step of the continuation
SUBSTITUTIONS, SETTLED = 50, 1e-9  # of what followers hold, and their change that counts as none
NO_FREE_COORDINATE = (
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
    neutral      coordinates without stiffness, each with those it goes along with
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
        """Coordinates (n_q,) [m, rad]."""
        return self.x[: self.model.n_q]

    @property
    def gap(self) -> float:
        """Largest gap of the loops, as lengths or angles; 0 without any."""
        constraints = self.model.constraints
        return 0.0 if constraints is None else float(np.abs(constraints.residuals(0.0, self.x)[0]).max())

    @cached_property
    def motions(self) -> SmallMotions:
        """The small motions about the equilibrium, with damping."""
        model = compile_system(self.moving) if damped(self.moving) else self.model
        return small_motions(model, self.state_in(model), self.directions)

    def state_in(self, model: Model) -> Array:
        """The state (n_x,) [SI] of another model of the craft at rest there; states missing here start as there."""
        values = dict(
            zip([name for name, _ in self.model.system.state_names()], self.model.parts(self.x)[2], strict=True)
        )
        x = model.at_rest(self.q)
        z = model.parts(x)[2]
        for k, (name, _) in enumerate(model.system.state_names()):
            z[k] = values.get(name, z[k])
        return x

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
        """Stability in words, with the number behind it and the neutral motions."""
        neutral = self._neutral if self.share == 1.0 and self.stable else ()
        return f"{self.stability}, neutral along {', '.join(neutral)}" if neutral else self.stability

    @property
    def _neutral(self) -> tuple[str, ...]:
        if self.motions.driven:  # a law may resist what forces of the craft do not
            return tuple(dict.fromkeys(motion.name for motion in self.motions.known))
        return self.neutral

    @property
    def stability(self) -> str:
        """Stability in words, with the number behind it."""
        values = self.eigenvalues
        if self.share < 1.0:
            return "not known"
        if not len(values):
            return "stable" if self._neutral else "nothing is free to move"
        if not self.stable:
            fastest = values[np.argmax(values.real - self._thresholds)]
            how = "monotonically" if abs(fastest.imag) < abs(fastest.real) * 1e-3 else "in oscillations"
            return f"unstable: a small motion grows {how} by a factor e in {1.0 / fastest.real:.4g} s"
        slowest = np.abs(values.imag)[np.abs(values.imag) > self._level].min(initial=np.inf)
        text = f"; its slowest vibration has {slowest / (2 * np.pi):.6g} Hz" if np.isfinite(slowest) else ""
        return f"stable{text}"

    @property
    def _level(self) -> float:
        """Return the rate below which a motion counts as none [1/s]."""
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
    those at the time `at` [s]. stable: an unstable one is left along the motion that grows, for one that is stable.
    What follows the motion in samples, such as shadow, is that of the equilibrium.
    Raises ValueError when forces change over time or nothing can move, EquilibriumError when none is found.
    """
    if any(controller.follows for controller in system.controllers):
        return _with_followers(system, at, stable)
    problem = steady(system, at)
    if not problem.full.n_u:
        raise ValueError(NO_FREE_COORDINATE)
    start = problem.full.x0[: problem.full.n_q].copy()
    try:
        result = _by_continuation(problem, start)
    except EquilibriumError:
        relaxed = _by_relaxation(problem, start)
        if relaxed is None:
            raise
        result = relaxed
    return result if not stable or result.stable else _stable_equilibrium_from(problem, result, start)


def _with_followers(system: System, at: float | None, stable: bool) -> Equilibrium:
    """Return the equilibrium in which followers hold what they answer to it: a fixed point, by substitution."""
    for _ in range(SUBSTITUTIONS):
        state = equilibrium(with_held_commands(system, loops=False), at, stable)
        channels = {path: values[0] for path, values in state.model.observe(np.zeros(1), state.x[None]).items()}
        effectors, change = [], 0.0
        for each in system.effectors:
            if isinstance(each, Controller) and each.follows:
                commands, memory = each.law(at or 0.0, channels, each.memory)
                change = max(change, float(np.abs(np.subtract(memory, each.memory)).max(initial=0.0)))
                each = replace(each, held=commands, memory=memory)
            effectors.append(each)
        if change <= SETTLED:
            return state
        system = replace(system, effectors=tuple(effectors))
    raise EquilibriumError(
        f"the shadow at the equilibrium changes by {change:.3g} even after {SUBSTITUTIONS} substitutions; leave it out "
        "(--without), or start nearer to the equilibrium",
        state,
    )


def rest_equilibrium(system: System, at: float | None = None) -> tuple[Equilibrium, tuple[str, ...]]:
    """The equilibrium nearest to the initial coordinates, and the names of loads and motions that do not act in it.

    at: time [s] at which loads and prescribed motions are taken. Left out, loads given over time do not act, prescribed
    motions stay at their initial values, and where there is no equilibrium under the constant loads, as of a free craft
    that is pushed, these do not act either. Raises as `equilibrium`.
    """
    if at is not None:
        return equilibrium(system, at), ()
    constant, left_out = without_variation(system)
    try:
        return equilibrium(constant), left_out
    except EquilibriumError:
        if not constant.loads:
            raise
    unloaded = tuple(f"load {load.name!r} (no equilibrium under it)" for load in constant.loads)
    return equilibrium(replace(constant, loads=())), left_out + unloaded


def rest_system(system: System, at: float | None, about: Equilibrium) -> System:
    """The system under the loads of the equilibrium; loads that do not act there are zero, rotors keep their motors."""
    if at is not None:
        return frozen_system(system, at)
    return frozen_system(with_loads_of(without_variation(system)[0], system, about))


def with_loads_of(still: System, system: System, about: Equilibrium) -> System:
    """The system `still` with the loads of the equilibrium, the other loads of the system at zero."""
    loads = {load.name: load for load in about.moving.loads}
    return replace(still, loads=tuple(loads.get(load.name, load.steady()) for load in system.loads))


def _by_continuation(problem: Steady, start: Array) -> Equilibrium:
    """Return the solution of Newton's method from the initial coordinates, or else along growing outer forces."""
    q, share, step, count = start, 0.0, 1.0, 0
    first = True
    while share < 1.0:
        target = min(1.0, share + step)
        trial = balance(problem, q, target)
        count += trial.iterations
        if trial.balanced:
            q, share = trial.q, target
            step *= 2.0 if trial.iterations <= 6 else 1.0
        elif first and (preloaded := _balance_with_preload(problem, q)) is not None:
            count += preloaded.iterations
            trial, q, share = preloaded, preloaded.q, 1.0
        elif first and not problem.elastic.any():  # without loads nothing holds it anywhere
            raise _failed(problem, q, 0.0, count, trial)
        elif first:  # not at once: from the unloaded state, in steps
            unloaded = balance(problem, q, 0.0)
            count += unloaded.iterations
            if not unloaded.balanced:
                raise _failed(problem, q, 0.0, count, unloaded)
            q, step = unloaded.q, FIRST
            smallest = balance(problem, q, LEAST)
            count += smallest.iterations
            if not smallest.balanced:  # halving the steps down to there would only take its time
                raise _failed(problem, q, 0.0, count, smallest)
        else:
            step /= 2.0
            if step < LEAST:
                raise _failed(problem, q, share, count, trial)
        first = False
    result = finely_balanced(problem, trial)
    return _as_equilibrium(problem, result, result.q, 1.0, count)


def _by_relaxation(problem: Steady, start: Array) -> Equilibrium | None:
    """Return the equilibrium at which motion from the initial coordinates comes to rest; None where it does not."""
    count = 0
    for q in relaxed_states(problem, start):
        trial = balance(problem, q, 1.0)
        count += trial.iterations
        if trial.balanced:
            result = finely_balanced(problem, trial)
            return _as_equilibrium(problem, result, result.q, 1.0, count)
    return None


def _balance_with_preload(problem: Steady, q: Array) -> Balance | None:
    """The balance from undeformed bodies where some have a preload, without which they would be slack; else None."""
    model = problem.full
    if not any(body.strain.f0.any() for body in model.system.bodies.values()):
        return None
    start = q.copy()
    start[elastic_places(model)[0]] = 0.0
    trial = balance(problem, start, 1.0)
    return trial if trial.balanced else None


def _stable_equilibrium_from(problem: Steady, unstable: Equilibrium, start: Array) -> Equilibrium:
    """The stable equilibrium that the motion that grows away from an unstable one leads to."""
    q = stable_state_below(problem, unstable.q, start)
    trial = None if q is None else balance(problem, q, 1.0)
    if trial is not None and trial.residual <= BALANCED:  # it may go on along a ring of equilibria, hardly resisted
        count = unstable.iterations + trial.iterations
        settled = replace(_as_equilibrium(problem, trial, trial.q, 1.0, count), left=unstable)
        if settled.stable:
            return settled
    raise EquilibriumError(
        f"the equilibrium that was found is {unstable.verdict}, and no stable one was found from it. Start from "
        "another state, lower the loads, or let a damped run come to rest",
        unstable,
    )


def _as_equilibrium(problem: Steady, result: Balance, q: Array, share: float, count: int) -> Equilibrium:
    """The state at rest at q (n_q,) under a share of the outer forces, after `count` iterations."""
    return Equilibrium(
        model=problem.full,
        x=problem.at_rest(q),
        share=share,
        residual=result.residual,
        iterations=count,
        neutral=result.neutral,
        directions=result.directions,
        moving=problem.damped,
    )


def _failed(problem: Steady, q: Array, share: float, count: int, trial: Balance) -> EquilibriumError:
    """The error after a trial that did not balance; q (n_q,) balances a share of the outer forces."""
    last = _as_equilibrium(problem, trial, q, share, count)
    names = freedom_names(problem.full.system)
    where = names[trial.worst] if names else "nothing"
    if not np.isfinite(trial.residual):
        text = (
            "no equilibrium was found: at rest the stiffness is singular, as of a cable without tension. Give its "
            "preload, or the spin of the base frame ([attitude] frame = 'spinning'), or linearise about the state of a "
            "run (femflex linearize --run FILE --at TIME)"
        )
        return EquilibriumError(text, last)
    neutral_text = f"; nothing resists {', '.join(trial.neutral)}" if trial.neutral else ""
    return EquilibriumError(
        f"no equilibrium was found beyond {share:.4g} of the loads, spin and gravity: the largest unbalanced force, "
        f"in {where}, is {trial.residual:.3g} of the largest force{neutral_text}. Start nearer to the equilibrium, "
        "lower the loads or the spin, or fix free coordinates.",
        last,
    )
