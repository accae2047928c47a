"""An independent check: scipy's solvers driving the same compiled rate."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter
from types import SimpleNamespace
from typing import Any

import numpy as np
import scipy.integrate

from femflex import integrate
from femflex.arrays import Array
from femflex.integrate import resume as head
from femflex.integrate.driver import checked, collected
from femflex.integrate.first_step import set_rate
from femflex.integrate.intervals import Span, interval_until_sample
from femflex.integrate.outcome import ROWS, Block, IntegrationError, Solution, Steps
from femflex.integrate.protocol import Integrator, Model, Progress
from femflex.integrate.step_monitor import BLOCK_SECONDS, StepMonitor

ORDERS = {"RK23": 3, "RK45": 5, "DOP853": 8, "Radau": 5, "BDF": 5, "LSODA": 12}
SCIPY = {f"scipy_{method.lower()}": method for method in ORDERS}
NUMBER = 9
MOST_CALLS = 10_000  # of the rate in one step, and a hundred more per state: a solver that asks more goes in circles


@dataclass(frozen=True, eq=False)
class Scipy:
    """Any method of `scipy.integrate.solve_ivp` on the model's compiled rate; slow, and written by others.

    It stops at breaks like our own methods and brings Euler parameters to unit length only in the rows. A run resumes
    from its last row with a fresh start of the solver: to the tolerance, not bit for bit.
    """

    method: str = "DOP853"
    rtol: float = 1e-9
    atol: float | Array = 1e-10
    max_step: float = math.inf

    def __post_init__(self) -> None:
        if self.method not in ORDERS:
            raise ValueError(f"scipy method {self.method!r} is not known; its methods are {sorted(ORDERS)}.")

    @property
    def name(self) -> str:
        """Name, such as scipy_radau."""
        return f"scipy_{self.method.lower()}"

    @property
    def order(self) -> int:
        """Highest order of the method."""
        return ORDERS[self.method]

    def blocks(self, model: Model, times: Array, x0: Array, state: Array | None = None) -> Iterator[Block]:
        """Blocks of the states at `times` (n_t,), ascending [s]; x0 (n_x,) is the state at times[0]."""
        times, x0 = checked(times, x0, model.n_x)
        if getattr(model, "events", None) is not None:
            raise ValueError(f"{self.name} does not follow latches and other events; choose 'dop853' or 'esdirk4'.")
        if state is None:
            resume = np.concatenate([np.zeros(head.HEAD), x0])
            resume[head.METHOD], resume[head.N_X] = NUMBER, model.n_x
            resume[head.T], resume[head.LAST_OUT], resume[head.SMALLEST] = times[0], -math.inf, math.inf
        else:
            resume = np.array(state, float)
            if resume.size != head.HEAD + model.n_x or resume[head.METHOD] != NUMBER:
                raise ValueError(f"the stored state was not written by a scipy method for {model.n_x} states.")
        return self._blocks(model, times[times > resume[head.LAST_OUT]], resume)

    def solve(
        self, model: Model, times: Array, x0: Array, progress: Progress | None = None, state: Array | None = None
    ) -> Solution:
        """All states at `times`; `progress(t)` is called after each block, and a true answer from it stops the run."""
        return collected(self.blocks(model, times, x0, state), progress, model.n_x)

    def _blocks(self, model: Model, todo: Array, resume: Array) -> Iterator[Block]:
        rows: list[Array] = []
        done, stop_at = 0, perf_counter() + BLOCK_SECONDS
        for solver in self._steps(model, todo[-1] if todo.size else resume[head.T], resume):
            reach = int(np.searchsorted(todo, solver.t, side="right"))
            if reach > done:
                dense = solver.dense_output() if solver.t_old is not None else None
                rows += [unit(dense(t) if dense is not None else solver.y, model) for t in todo[done:reach]]
                resume[head.T] = resume[head.LAST_OUT] = todo[reach - 1]
                resume[head.HEAD :] = rows[-1]
                done = reach
            if len(rows) >= ROWS or perf_counter() > stop_at:
                yield self._block(todo, done, rows, resume, model.n_x)
                rows, stop_at = [], perf_counter() + BLOCK_SECONDS
            if solver.status == "failed":
                if rows:
                    yield self._block(todo, done, rows, resume, model.n_x)
                raise failed(self.name, model, solver, resume)
        if rows:
            yield self._block(todo, done, rows, resume, model.n_x)

    def _block(self, todo: Array, done: int, rows: list[Array], resume: Array, n_x: int) -> Block:
        return Block(todo[done - len(rows) : done], np.array(rows).reshape(-1, n_x), resume.copy())

    def _steps(self, model: Model, end: float, resume: Array) -> Iterator[Any]:
        """The solver at its start and after each step, a new one for each smooth interval and change of coordinates."""
        breaks, t, x = np.unique(np.asarray(model.breaks, float)), float(resume[head.T]), resume[head.HEAD :].copy()
        pace, clock = StepMonitor(resume), getattr(model, "clock", None)
        while True:
            if clock is not None and clock.next_instant(x) <= t:
                yield SimpleNamespace(t=t, y=x.copy(), t_old=None, status="running")  # for the row before the change
                clock.sample(t, x)
            rate = Rate(model, interval_until_sample(clock, x, t, end, breaks))
            solver = self._solver(rate, t, x)
            yield solver
            while solver.status == "running":
                before = solver.nfev
                rate.left = MOST_CALLS + 100 * model.n_x
                self._step(solver)
                resume[head.EVALUATIONS] += solver.nfev - before
                if solver.status != "failed":
                    h = solver.t - solver.t_old
                    resume[head.ACCEPTED] += 1
                    resume[head.SMALLEST] = min(resume[head.SMALLEST], h)
                    resume[head.LARGEST] = max(resume[head.LARGEST], h)
                if pace.stalled(int(resume[head.ACCEPTED]), float(solver.t), rate.span[0]):
                    solver.status = "failed"
                yield solver
                t, x = float(solver.t), solver.y.copy()
                if model.switch is not None and model.switch(solver.t, x, model.table, model.pool, model.work) > 0:
                    break
            if solver.status == "failed" or solver.t >= end:
                return

    def _step(self, solver: Any) -> None:
        """One step; a solver that chokes on values that are not finite, or lets them pass, counts as failed."""
        t, y = solver.t, solver.y
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of LSODA; its status says the same
            try:
                solver.step()
            except (ValueError, np.linalg.LinAlgError):
                solver.status = "failed"
        if not np.all(np.isfinite(solver.y)):
            solver.status, solver.t, solver.y = "failed", t, y

    def _solver(self, rate: Rate, t: float, x: Array) -> Any:
        settings = {"rtol": self.rtol, "atol": self.atol, "max_step": self.max_step}
        with np.errstate(all="ignore"):
            return getattr(scipy.integrate, self.method)(rate, t, x, rate.span[0], **settings)


class Rate:
    """The rate of a model over a smooth interval as scipy asks it, no more than `left` times.

    Values that are not finite let some of scipy's solvers try again for ever within one step.
    """

    def __init__(self, model: Model, span: Span) -> None:
        self.model, self.span, self.left = model, span, MOST_CALLS + 100 * model.n_x

    def __call__(self, t: float, x: Array) -> Array:
        """dx/dt (n_x,) at (t, x)."""
        self.left -= 1
        if self.left < 0:
            raise ValueError("the solver finds no end of a step")
        out = np.empty_like(x)
        set_rate(self.model, t, x, out, self.span)
        return out


def unit(x: Array, model: Model) -> Array:
    """x with its Euler parameters at unit length."""
    x = x.copy()
    for start in model.renormalise:
        x[start : start + 4] /= np.linalg.norm(x[start : start + 4])
    return x


def failed(name: str, model: Model, solver: Any, resume: Array) -> IntegrationError:
    """The error that carries the last state the solver reached."""
    ahead = np.empty(model.n_x)
    set_rate(model, solver.t + 1e-9 * max(1.0, abs(solver.t)), solver.y, ahead, (math.inf, -math.inf, math.inf))
    bad = ~np.isfinite(ahead)
    coordinate = int(np.argmax(bad)) if bad.any() else int(np.argmax(np.abs(ahead)))
    message = f"{name} stopped at t = {solver.t:.9g} s near coordinate {coordinate}; the state at this time is kept."
    steps = Steps.from_resume(resume, ended=f"failed near coordinate {coordinate}")
    return IntegrationError(message, np.array([solver.t]), solver.y.copy()[None, :], coordinate, steps)


def integrator(name: str, **settings: Any) -> Integrator:
    """The integrator of that name, one of SCIPY too."""
    if name in SCIPY:
        return Scipy(SCIPY[name], **settings)
    return integrate.integrator(name, **settings)
