"""The linearised motion of a craft, as a method of solution in addition to the integrators.

Departures y = (dxi, du, dz) are measured from a reference x_r(t): the equilibrium nearest to the start, with the
prescribed coordinates along their motion and deploying bodies at their lengths. They obey

    y' = A(t) y + b(t),    b = f(t, x_r) - x_r',

with A the state matrix of M du' + (D + G) du + K dxi + R dz = 0 about x_r(t) under the loads that act in the
equilibrium, and f the compiled rate under all loads. Loads thus act to first order. Channels are computed from the
coordinates as in any run.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from time import perf_counter

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from femflex.arrays import Array, IntArray
from femflex.dynamics.joints.places import prescribed_states
from femflex.dynamics.layout.records import BALL_NONE, BALL_QUATERNION, body_records
from femflex.dynamics.ledger.by_source import SWITCHED
from femflex.dynamics.model import Model, compile_system
from femflex.dynamics.motion.freedoms import free_directions, is_prescribed, refuse_rolling, usual_sizes
from femflex.dynamics.motion.increments import displaced, increment_between
from femflex.integrate import Block
from femflex.integrate import resume as head
from femflex.integrate.driver import collected
from femflex.integrate.outcome import ROWS, Solution
from femflex.integrate.protocol import Model as AnyModel
from femflex.integrate.protocol import Progress
from femflex.integrate.step_monitor import BLOCK_SECONDS
from femflex.linear.equations import linearised
from femflex.linear.equilibrium import rest_equilibrium, with_loads_of
from femflex.linear.states import effector_states
from femflex.system import System

NUMBER = 20  # of the method in resume arrays
RTOL = 1e-7  # error of a step over the largest departure so far
SMALLEST_DEPARTURE = 1e-12  # departure over its usual size below which it is zero
NODES = np.sqrt(0.6) * np.array([-1.0, 0.0, 1.0])  # Gauss points of a step, from -1 to 1
SMALLEST = 1e-9  # least step over an output step
KNOTS, SPLINE = (9, 600), 1e-5  # least and most points of a table of A; its error before the last halving, relative
NOISE = 3.0  # if a halving divides the error by less than this, the rest is the error of the finite differences


@dataclass(frozen=True, eq=False)
class LinearMotion:
    """The integration method: departures by exponentials of A, forcing by its values at three points of a step."""

    rtol: float = RTOL

    @property
    def name(self) -> str:
        """Name in the result file."""
        return "linearised"

    @property
    def order(self) -> int:
        """Order of the global error in the step size; exact for constant A and loads of second degree in time."""
        return 4

    def blocks(self, model: AnyModel, times: Array, x0: Array, state: Array | None = None) -> Iterator[Block]:
        """Blocks of the states at `times` (n_t,), ascending [s]; x0 (n_x,) is the state at times[0].

        Raises ValueError for a system without linear motion, and for a run that is to be resumed.
        """
        if not isinstance(model, Model):
            raise ValueError("a linearised motion is that of a compiled femflex system")
        if state is not None:
            raise ValueError("a linearised run is not resumed; run it anew")
        return one_thread(self._blocks(Reference.from_model(model), np.asarray(times, float), np.asarray(x0, float)))

    def solve(
        self, model: AnyModel, times: Array, x0: Array, progress: Progress | None = None, state: Array | None = None
    ) -> Solution:
        """All states (n_t, n_x) [SI] at `times` (n_t,) [s] in one object."""
        return collected(self.blocks(model, times, x0, state), progress, model.n_x)

    def _blocks(self, reference: Reference, times: Array, x0: Array) -> Iterator[Block]:
        model = reference.model
        resume = np.concatenate([np.zeros(head.HEAD), x0])
        resume[head.METHOD], resume[head.N_X], resume[head.SMALLEST] = NUMBER, model.n_x, math.inf
        breaks = np.unique(np.asarray(model.breaks, float))
        breaks = breaks[(breaks > times[0]) & (breaks < times[-1])]
        steps = Steps(reference, self.rtol, resume, np.array([times[0], *breaks, times[-1]]))
        y, rows, start, stop_at = reference.departure(x0, float(times[0])), list[Array](), 0, 0.0
        for k, goal in enumerate(times.tolist()):
            if not rows:
                stop_at = perf_counter() + BLOCK_SECONDS
            for t, end in pairwise(
                [times[k - 1], *breaks[(breaks > times[k - 1]) & (breaks < goal)], goal] if k else ()
            ):
                y = steps.advanced_to(y, float(t), float(end))
            rows.append(reference.state(goal, y))
            if len(rows) >= ROWS or perf_counter() > stop_at or k == len(times) - 1:
                resume[head.T] = resume[head.LAST_OUT] = goal
                resume[head.HEAD :] = rows[-1]
                yield Block(times[start : k + 1], np.array(rows), resume.copy())
                rows, start = [], k + 1


def one_thread(blocks: Iterator[Block]) -> Iterator[Block]:
    """The blocks, computed with matrix products on one thread, which is faster than several for small matrices."""
    from threadpoolctl import threadpool_limits

    while True:
        with threadpool_limits(1):
            block = next(blocks, None)
        if block is None:
            return
        yield block


class Steps:
    """Steps of the departures with error control by halving; A is tabulated, or constant with its exponentials kept."""

    def __init__(self, reference: Reference, rtol: float, resume: Array, ends: Array) -> None:
        self.reference, self.rtol, self.resume, self.ends = reference, rtol, resume, ends
        self.tables: dict[int, CubicSpline] = {}
        self.largest = SMALLEST_DEPARTURE * reference.sizes
        self.cached: dict[float, tuple[Array, Array]] = {}
        self.A = reference.matrix(0.0) if reference.constant else np.zeros((0, 0))
        self.h = math.inf

    def matrix(self, t: float) -> Array:
        """A (n_y, n_y) [SI] at a time, from a table of the smooth interval about it."""
        k = min(max(int(np.searchsorted(self.ends, t)) - 1, 0), len(self.ends) - 2)
        if k not in self.tables:
            self.tables[k] = tabulated(self.reference, float(self.ends[k]), float(self.ends[k + 1]))
        return np.asarray(self.tables[k](t))

    def advanced_to(self, y: Array, t: float, end: float) -> Array:
        """The departures (n_y,) [SI] at `end` [s], from y at t; no load jumps in between."""
        least, resume = SMALLEST * (end - t), self.resume
        while t < end:
            h = min(self.h, end - t)
            if end - t - h < 1e-9 * (end - t):
                h = end - t
            whole = self._step(y, t, h)
            halves = self._step(self._step(y, t, h / 2), t + h / 2, h / 2)
            size = np.maximum(self.largest, np.abs(halves))
            error = float((np.abs(whole - halves) / (self.rtol * size)).max(initial=0.0)) / 15.0
            change = min(4.0, max(0.25, 0.8 * max(error, 1e-9) ** -0.2))
            if error > 1.0 and h > least:
                self.h = h * change
                resume[head.REJECTED] += 1
                continue
            y, t, self.largest = halves, end if h == end - t else t + h, size
            resume[head.ACCEPTED] += 1
            resume[head.SMALLEST], resume[head.LARGEST] = min(resume[head.SMALLEST], h), max(resume[head.LARGEST], h)
            if h == self.h or error > 0.1 or h * change > self.h:
                self.h = h * change
        return y

    def _step(self, y: Array, t: float, h: float) -> Array:
        """The departures (n_y,) after h [s]: exp(Omega) y plus the response to a parabola through b at Gauss points."""
        middle, n = t + h / 2, len(y)
        first, second, third = (self.reference.forcing(middle + h / 2 * node) for node in NODES)
        self.resume[head.EVALUATIONS] += len(NODES)
        slope, bend = (third - first) / (2 * NODES[2]), (third - 2 * second + first) / NODES[2] ** 2
        c = [second - slope + bend / 2, (slope - bend) * 2 / h, bend * 4 / h**2]  # of c_0 + c_1 s + c_2 s^2 / 2
        if self.reference.constant:
            key = float(f"{h:.12e}")  # output times differ by rounding
            if key not in self.cached:
                wide = np.zeros((4 * n, 4 * n))  # the response to constant, s and s^2 / 2 follows exp(A h)
                wide[:n, :n] = key * self.A
                wide[: 3 * n, n:] += key * np.eye(3 * n)
                grown = np.asarray(expm(wide))
                self.cached[key] = grown[:n, :n], grown[:n, n:]
            E, P = self.cached[key]
            return np.asarray(E @ y + P @ np.concatenate(c))
        A, B = (self.matrix(middle + sign * h / math.sqrt(12.0)) for sign in (-1.0, 1.0))
        twist, C = h**2 * math.sqrt(3.0) / 12, np.column_stack(c)  # Magnus' series of the matrix and of its forcing
        wide = np.zeros((n + 3, n + 3))
        wide[:n, :n], wide[:n, n:] = h / 2 * (A + B) - twist * (A @ B - B @ A), h * C - twist * (A - B) @ C
        wide[n + 1, n] = wide[n + 2, n + 1] = h
        return np.asarray(expm(wide)[:n] @ np.concatenate([y, [1.0, 0.0, 0.0]]))


def tabulated(reference: Reference, start: float, end: float) -> CubicSpline:
    """Spline of A (n_y, n_y) [SI] over a smooth interval [s], refined until SPLINE is met."""
    times = np.linspace(start + 1e-9 * (end - start), end - 1e-9 * (end - start), KNOTS[0])
    values, error = np.array([reference.matrix(float(t)) for t in times]), math.inf
    while True:
        before, finer = error, np.linspace(times[0], times[-1], 2 * len(times) - 1)
        between = np.array([reference.matrix(float(t)) for t in finer[1::2]])
        size = np.abs(between * reference.sizes).max(axis=(0, 2))[None, :, None] + 1e-300
        misfit = np.abs(CubicSpline(times, values)(finer[1::2]) - between) * reference.sizes / size
        error, times = float(misfit.max(initial=0.0)), finer
        values = np.insert(values, np.arange(1, len(values)), between, axis=0)
        if error <= SPLINE or error > before / NOISE or len(times) > KNOTS[1]:
            return CubicSpline(times, values)


@dataclass(frozen=True, eq=False)
class Reference:
    """The reference motion from which the departures are measured.

    model        under all loads;  rest_model  under those of the equilibrium alone, whose tangent is A
    x            (n_x,) the reference state, prescribed coordinates at their initial values
    Z            (n_u, n) motion of all coordinates with the independent ones
    independent  indices of the independent coordinates;  effector_states  indices in x of the states of effectors
    sizes        (n_y,) usual sizes of departures
    moves        whether prescribed coordinates move;  constant  whether A does not change over time
    """

    model: Model
    rest_model: Model
    x: Array
    Z: Array
    independent: IntArray
    effector_states: IntArray
    sizes: Array
    moves: bool
    constant: bool

    @classmethod
    def from_model(cls, model: Model) -> Reference:
        """The reference of a model. Raises ValueError for a system without linear motion."""
        system = model.system
        check(system)
        changes = bool(system.varying) or _turning_orbit(system)
        equilibrium = None if changes else rest_equilibrium(system)[0]
        steady = replace(system, loads=tuple(load.steady() for load in system.loads))
        rest_model = compile_system(steady if equilibrium is None else with_loads_of(system, system, equilibrium))
        if names := [name for name in model.omitted if name in SWITCHED]:
            rest_model = rest_model.without(*names)
        x = nominal_state(rest_model) if equilibrium is None else equilibrium.state_in(rest_model)
        independent, Z = free_directions(rest_model, 0.0, x)
        (inner, state_sizes), sizes = effector_states(model), usual_sizes(model)[independent]
        sizes = np.concatenate([sizes, sizes, state_sizes])
        moves = any(profile.moves for joint in system.joints for profile in joint.prescribed.values())
        return cls(model, rest_model, x, Z, independent, inner, sizes, moves, not (changes or moves))

    def reference_state(self, t: float) -> Array:
        """The reference state x_r (n_x,) [SI] at a time [s]."""
        return prescribed_states(self.model, np.array([t]), self.x[None])[0] if self.moves else self.x

    def matrix(self, t: float) -> Array:
        """The state matrix A (n_y, n_y) [SI] at a time [s]."""
        x = self.reference_state(t)
        prescribed, udot = is_prescribed(self.rest_model, x), np.zeros(self.model.n_u)
        if prescribed.any() and not self.constant:
            rate = self.rest_model.state_rate(t, x)[self.model.n_q : self.model.n_q + self.model.n_u]
            udot = np.where(prescribed, rate, 0.0)
        return linearised(self.rest_model, t, x, udot).state_matrix()

    def forcing(self, t: float) -> Array:
        """The forcing b (n_y,) [SI] at a time [s]; the free coordinates of x_r are at rest."""
        rate = self.model.state_rate(t, self.reference_state(t))
        u = rate[self.model.n_q : self.model.n_q + self.model.n_u]
        return np.concatenate([np.zeros(len(self.independent)), u[self.independent], rate[self.effector_states]])

    def departure(self, x: Array, t: float) -> Array:
        """The departures (n_y,) of a state (n_x,) [SI] from the reference."""
        (q, u, z), (p, v, w) = self.model.parts(self.reference_state(t)), self.model.parts(x)
        first = self.model.n_q + self.model.n_u
        increments = increment_between(self.model, q, p)
        return np.concatenate(
            [increments[self.independent], (v - u)[self.independent], (w - z)[self.effector_states - first]]
        )

    def state(self, t: float, y: Array) -> Array:
        """The state (n_x,) [SI] of departures (n_y,)."""
        n = len(self.independent)
        x = displaced(self.model, self.reference_state(t), self.Z @ y[:n], self.Z @ y[n : 2 * n])
        x[self.effector_states] += y[2 * n :]
        return x


def check(system: System) -> None:
    """Raise ValueError for a system without linear motion."""
    refuse_rolling(system, "a linearised run")
    if system.controllers:
        raise ValueError(
            f"controller {system.controllers[0].name!r} is sampled, and a linearised run is continuous; leave it out, "
            "or give it no period"
        )
    if any(joint.latches for joint in system.joints):
        raise ValueError("a joint latches during the run, so there is no linearised run; lock it, or leave it free")
    if system.loops and any(profile.moves for joint in system.joints for profile in joint.prescribed.values()):
        raise ValueError("with loops a linearised run needs prescribed joints that stay where they are")


def nominal_state(model: Model) -> Array:
    """The state (n_x,) [SI] of the undeformed craft at rest; in orbit along the orbital frame, joints as they start."""
    q = model.parts(model.x0)[0].copy()
    for record in body_records(model.table)[1:]:
        first, elastic = int(record["q"]) + int(record["n_slide"]), int(record["qe"])
        q[elastic : elastic + int(record["n"])] = 0.0
        root = int(record["u"]) == 0
        if root and model.system.frame.kind == "orbital" and record["ball"] != BALL_NONE:
            n = 4 if record["ball"] == BALL_QUATERNION else 3
            q[first : first + n] = np.eye(4)[0, :n] if n == 4 else 0.0
    return model.at_rest(q)


def _turning_orbit(system: System) -> bool:
    """Whether gravity or the frame's rate changes along the orbit."""
    orbit = system.orbit
    return orbit is not None and (not orbit.is_steady or system.frame.kind != "orbital")
