"""The exact discrete model of a craft with sampled controllers, and the margins of its loops.

Between two samples the linear craft moves freely with commands and memory z held; at a sample the controllers change z:

    s(kT+) = S s(kT-),    s((k+1)T-) = E s(kT+),    E = exp([[A, B], [0, 0]] T)

with s = (departures of the craft, commands, memory). S is the derivative of the very calls that a run makes, of all
controllers in their order; A and B those of the compiled equations. A loop is broken where a command is held: the
command that the controllers give, v, over the one that acts, w, is L(z) = v / w; the loop is closed by v = w.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from femflex.arrays import Array, ComplexArray, IntArray
from femflex.case.problems import near
from femflex.dynamics.equilibria.increments import advanced
from femflex.dynamics.equilibria.linearised import free_directions, linearised, usual_sizes
from femflex.dynamics.equilibria.local_derivative import local_derivative, on_line
from femflex.dynamics.equilibria.states import effector_states
from femflex.dynamics.model import Model, compile_system
from femflex.pipeline.rest import rest_of, rest_state, rest_system
from femflex.system import System
from femflex.system.constant_commands import is_sampled, with_held_commands
from femflex.system.sensor import without_quantum

STEP = 1e-4  # of a usual size: the first of steps that fall
SAME = 1e-9  # relative difference of two periods that are one
POINTS = 4000  # of a frequency response up to half the rate of the samples
LOWEST = 1e-4  # of that rate, where it begins
LEVEL = 1e-2  # relative change over the first octave, below which a response has come to that at rest


@dataclass(frozen=True, eq=False)
class SampledModel:
    """Discrete model of a craft with controllers of one period [s].

    flow    E (n, n);  sample  S (n, n);  states (name, unit) of s
    commands  names of the commands that act between samples, and their places in s
    """

    flow: Array
    sample: Array
    states: tuple[tuple[str, str], ...]
    commands: dict[str, int]
    period: float

    def multipliers(self) -> ComplexArray:
        """Eigenvalues (n,) of S E by falling size; the loop is stable where none lies outside the unit circle."""
        values = np.asarray(np.linalg.eigvals(self.sample @ self.flow), complex)
        return values[np.argsort(-np.abs(values), kind="stable")]

    def loop(self, command: str, omega: Array) -> ComplexArray:
        """L (n_omega,) at omega (n_omega,) [rad/s] with the loop broken at a command, the others closed.

        Raises KeyError for a command that is not there, nearest name first.
        """
        if command not in self.commands:
            raise KeyError(f"there is no sampled command {command!r}; {near(command, self.commands)}")
        k, n = self.commands[command], len(self.flow)
        keep = np.ones(n)
        keep[k] = 0.0
        A, B, C = self.flow @ (keep[:, None] * self.sample), self.flow[:, k], self.sample[k]
        z = np.exp(1j * np.atleast_1d(omega) * self.period)
        return np.array([C @ np.linalg.solve(one * np.eye(n) - A, B.astype(complex)) for one in z])


@dataclass(frozen=True)
class Margins:
    """Margins of a loop closed by v = w.

    gain_up, gain_down  factors on the command at which the loop becomes unstable, above and below 1 (inf and 0: none)
    phase       [rad] of lag that makes it so, inf where |L| is nowhere 1;  delay [s] that does
    crossover   highest frequency [rad/s] at which |L| is 1, 0 without
    modulus     least distance of L from 1: one over the largest sensitivity
    """

    gain_up: float
    gain_down: float
    phase: float
    delay: float
    crossover: float
    modulus: float


def sampled_model(system: System) -> SampledModel:
    """The discrete model of a system with sampled controllers about its equilibrium.

    Raises ValueError without controllers, for controllers of different periods or starts, and for calls between two
    samples; and as `femflex.equilibrium`.
    """
    period = _period(system)
    effectors = tuple(without_quantum(one) if is_sampled(one) else one for one in system.effectors)
    system = replace(system, effectors=effectors)
    still = with_held_commands(system)
    about = rest_of(still)[0]
    rest = rest_system(still, None, about)
    model = compile_system(_with_controllers(rest, system))
    x = _state(model, rest_state(about, compile_system(rest)), rest)
    names = [name for name, _ in model.system.state_names()]
    held = [
        names.index(name)
        for one in model.system.controllers
        for name, _ in one.state_names()
        if not name.endswith(".next")
    ]
    builder = _Sampled(model, x, np.array(held, int))
    flow = builder.flow()
    E = np.asarray(expm(flow * period))
    commands = {
        f"{one.name}/{command}": builder.n + held.index(names.index(f"{one.name}.{command}"))
        for one in model.system.controllers
        for command in one.commands
    }
    commands = {name: k for name, k in commands.items() if flow[: builder.n, k].any()}
    return SampledModel(E, builder.sample(period), builder.names(), commands, period)


def margins(model: SampledModel, command: str) -> Margins:
    """The margins of the loop broken at a command, up to half the rate of the samples."""
    top = np.pi / model.period
    omega = np.geomspace(LOWEST * top, top, POINTS)
    L = model.loop(command, omega)

    def at(w: float) -> complex:
        return complex(model.loop(command, np.array([w]))[0])

    real = _roots(omega[:-1], L[:-1].imag, lambda w: at(w).imag)
    gains = [1.0 / value for value in (at(w).real for w in real) if value > 0]
    gains += [1.0 / float(L[-1].real)] if L[-1].real > 0 else []  # at half the rate of the samples L is real
    level = abs(at(2.0 * omega[0]) - complex(L[0])) < LEVEL * abs(L[0])  # and at rest, where nothing drifts
    gains += [1.0 / float(L[0].real)] if level and L[0].real > 0 else []
    around = _roots(omega, np.abs(L) - 1.0, lambda w: abs(at(w)) - 1.0)
    phases = [float(np.angle(at(w))) for w in around]
    lags = [phase % (2 * np.pi) for phase in phases]  # L turns by -lag: it meets 1 after its own angle
    delays = [lag / w for lag, w in zip(lags, around, strict=True)]
    return Margins(
        min((g for g in gains if g > 1), default=np.inf),
        max((g for g in gains if g < 1), default=0.0),
        min(lags, default=np.inf),
        min(delays, default=np.inf),
        max(around, default=0.0),
        float(np.abs(1.0 - L).min()),
    )


def _roots(omega: Array, values: Array, exact: Callable[[float], float]) -> list[float]:
    """Frequencies at which a function with these values changes its sign."""
    places = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0)
    return [float(brentq(exact, omega[k], omega[k + 1], xtol=1e-12 * omega[k])) for k in places]


def _period(system: System) -> float:
    if not system.controllers:
        raise ValueError("the craft has no sampled controller; give one a period, or take the linear model")
    first = system.controllers[0]
    for one in system.controllers:
        if abs(one.period - first.period) > SAME * first.period or abs(one.start - first.start) > SAME * first.period:
            raise ValueError(
                f"controllers {first.name!r} and {one.name!r} are called every {first.period:g} s from {first.start:g} "
                f"s and every {one.period:g} s from {one.start:g} s; a discrete model needs one period and start"
            )
    return first.period


def _with_controllers(rest: System, system: System) -> System:
    """The system at rest with the sampled controllers in place of their held commands."""
    by_name = {one.name: one for one in rest.effectors}
    effectors = tuple(one if one in system.controllers else by_name.get(one.name, one) for one in system.effectors)
    return replace(rest, effectors=effectors, z0=system.z0)


def _state(model: Model, x: Array, rest: System) -> Array:
    """The state of the model with controllers: coordinates at rest, states of effectors settled."""
    found = dict(zip([name for name, _ in rest.state_names()], x[len(x) - len(rest.state_names()) :], strict=True))
    full = np.concatenate([x[: model.n_q + model.n_u], model.parts(model.x0)[2]])
    for k, (name, _) in enumerate(model.system.state_names()):
        full[model.n_q + model.n_u + k] = found.get(name, full[model.n_q + model.n_u + k])
    return full


class _Sampled:
    """Derivatives of the motion between samples and of the samples about a state x, over s."""

    def __init__(self, model: Model, x: Array, held: IntArray) -> None:
        self.model, self.x = model, x
        first = model.n_q + model.n_u
        self.inner, self.held = first + np.array(effector_states(model.system), int), first + held
        self.own, self.Z = free_directions(model, 0.0, x)
        self.n = 2 * len(self.own) + len(self.inner)

    def names(self) -> tuple[tuple[str, str], ...]:
        """Names and units of s."""
        system, first = self.model.system, self.model.n_q + self.model.n_u
        rates, states = system.velocity_names(), system.state_names()
        own = [rates[k] for k in self.own]
        turned = [
            (name.removesuffix("_rate").replace(".omega_", ".turn_"), unit.removesuffix("/s")) for name, unit in own
        ]
        return (*turned, *own, *(states[k - first] for k in (*self.inner, *self.held)))

    def flow(self) -> Array:
        """[[A, B], [0, 0]] (n, n)."""
        wide = np.zeros((self.n + len(self.held),) * 2)
        wide[: self.n, : self.n] = linearised(self.model, 0.0, self.x).state_matrix()
        sizes = self.model.system.state_sizes()
        m, first = len(self.own), self.model.n_q + self.model.n_u
        for k, place in enumerate(self.held):
            e = np.eye(self.model.n_x)[place]
            size = STEP * float(sizes[place - first])
            rate = local_derivative(on_line(lambda dx: self.model.state_rate(0.0, self.x + dx), e), size)
            wide[m : 2 * m, self.n + k] = rate[self.model.n_q + self.own]
            wide[2 * m : self.n, self.n + k] = rate[self.inner]
        return wide

    def sample(self, period: float) -> Array:
        """S (n, n) by central differences of the controllers' calls."""
        clock = self.model.clock
        assert clock is not None
        m, first = len(self.own), self.model.n_q + self.model.n_u
        place = usual_sizes(self.model)[self.own]
        inner = self.model.system.state_sizes()[self.inner - first]
        sizes = np.concatenate([place, place / period, inner, self.model.system.state_sizes()[self.held - first]])
        x = self.x.copy()
        t = clock.next_instant(x)
        clock.sample(t, x)
        if clock.next_instant(x) < t + period * (1.0 - SAME):
            late = next(one for one in clock.samplers if x[one.next_instant] < t + period * (1.0 - SAME)).controller
            raise ValueError(
                f"{late.name!r} is called again {clock.next_instant(x) - t:.6g} s after its sample, as for a delay; a "
                "discrete model has calls at samples alone, so leave the delay out or give it as a memory of the "
                "controller"
            )
        S = np.eye(self.n + len(self.held))
        for j, size in enumerate(sizes):
            e = np.eye(len(sizes))[j]
            S[self.n :, j] = local_derivative(on_line(lambda s: self._called(s, m), e), STEP * size)
        return S

    def _called(self, s: Array, m: int) -> Array:
        """Commands and memory after a sample at so much from the state."""
        x, clock = self._moved(s, m), self.model.clock
        assert clock is not None
        clock.sample(clock.next_instant(x), x)
        return np.asarray(x[self.held])

    def _moved(self, s: Array, m: int) -> Array:
        q, u, z = self.model.parts(self.x)
        x = np.concatenate([advanced(self.model, q, self.Z @ s[:m]), u + self.Z @ s[m : 2 * m], z])
        x[self.inner] += s[2 * m : self.n]
        x[self.held] += s[self.n :]
        return x
