"""The exact discrete model of a craft with sampled controllers, and the margins of its loops.

Between two samples commands and memory z are constant; at a sample the controllers change z:

    s(kT+) = S s(kT-),    s((k+1)T-) = E s(kT+),    E = exp([[A, B], [0, 0]] T)

with s = (departures of the craft, commands, memory). S is the derivative of the controllers' calls, in the
order of a run; A and B are those of the compiled equations. A loop is broken at a sampled command: the command v of the
controllers over the command w that acts is L(z) = v / w; the loop is closed by v = w.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from femflex.arrays import Array, ComplexArray, IntArray
from femflex.dynamics.model import Model, compile_system
from femflex.dynamics.motion.freedoms import usual_sizes
from femflex.dynamics.motion.increments import displaced, local_derivative, on_line
from femflex.effectors.constant_commands import is_sampled, with_held_commands
from femflex.effectors.sensor import without_quantum
from femflex.linear.equations import linearised
from femflex.linear.equilibrium import rest_equilibrium, rest_system
from femflex.linear.states import effector_states
from femflex.noun.problems import suggestion_text
from femflex.system import System

STEP = 1e-4  # of a usual size: the first of steps that fall
SAME = 1e-9  # relative difference of two periods that are one
POINTS = 4000  # of a frequency response up to half the rate of the samples
LOWEST = 1e-4  # of that rate, where it begins
LEVEL = 1e-2  # relative change over the first octave below which a response counts as the static one


@dataclass(frozen=True, eq=False)
class SampledModel:
    """Discrete model of a craft with controllers of one period [s].

    generator  [[A, B], [0, 0]] (n, n);  sample  S (n, n);  states (name, unit) of s
    commands  names of the commands that act between samples, and their indices in s
    """

    generator: Array
    sample: Array
    states: tuple[tuple[str, str], ...]
    commands: dict[str, int]
    period: float

    @cached_property
    def flow(self) -> Array:
        """E (n, n) [SI], from one sample to the next."""
        return np.asarray(expm(self.generator * self.period))

    def multipliers(self) -> ComplexArray:
        """Eigenvalues (n,) of S E by falling size; the loop is stable where none lies outside the unit circle."""
        values = np.asarray(np.linalg.eigvals(self.sample @ self.flow), complex)
        return values[np.argsort(-np.abs(values), kind="stable")]

    def loop(self, command: str, omega: Array) -> ComplexArray:
        """L (n_omega,) at omega (n_omega,) [rad/s] with the loop broken at a command, the others closed.

        Raises KeyError for an unknown command.
        """
        if command not in self.commands:
            raise KeyError(f"there is no sampled command {command!r}; {suggestion_text(command, self.commands)}")
        k, n = self.commands[command], len(self.flow)
        keep = np.ones(n)
        keep[k] = 0.0
        A, B, C = self.flow @ (keep[:, None] * self.sample), self.flow[:, k], self.sample[k]
        z = np.exp(1j * np.atleast_1d(omega) * self.period)
        return np.array([C @ np.linalg.solve(factor * np.eye(n) - A, B.astype(complex)) for factor in z])


@dataclass(frozen=True)
class Margins:
    """Margins of a loop closed by v = w.

    gain_up, gain_down  factors on the command at which the loop becomes unstable, above and below 1 (inf and 0: none)
    phase       lag [rad] that makes it unstable, inf where |L| is nowhere 1;  delay [s] that does
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
    system = with_held_commands(system, loops=False)
    period = _period(system)
    effectors = tuple(without_quantum(item) if is_sampled(item) else item for item in system.effectors)
    system = replace(system, effectors=effectors)
    continuous = with_held_commands(system)
    about = rest_equilibrium(continuous)[0]
    balanced = rest_system(continuous, None, about)
    model = compile_system(_with_controllers(balanced, system))
    x = _state_with_controllers(model, about.state_in(compile_system(balanced)), balanced)
    names = [name for name, _ in model.system.state_names()]
    stored = [name for item in model.system.controllers for name, _ in item.state_names()]
    sampled_states = [names.index(name) for name in stored if not name.endswith(".next")]
    builder = _SampledBuilder(model, x, np.array(sampled_states, int))
    flow = builder.flow()
    commands = {
        f"{item.name}/{command}": builder.n + sampled_states.index(names.index(f"{item.name}.{command}"))
        for item in model.system.controllers
        for command in item.commands
    }
    commands = {name: k for name, k in commands.items() if flow[: builder.n, k].any()}
    return SampledModel(flow, builder.sample(period), builder.names(), commands, period)


def margins(model: SampledModel, command: str) -> Margins:
    """The margins of the loop broken at a command, up to half the rate of the samples."""
    top = np.pi / model.period
    omega = np.geomspace(LOWEST * top, top, POINTS)
    L = model.loop(command, omega)

    def loop_at(w: float) -> complex:
        return complex(model.loop(command, np.array([w]))[0])

    real = _sign_changes(omega[:-1], L[:-1].imag, lambda w: loop_at(w).imag)
    gains = [1.0 / value for value in (loop_at(w).real for w in real) if value > 0]
    gains += [1.0 / float(L[-1].real)] if L[-1].real > 0 else []  # at half the rate of the samples L is real
    level = abs(loop_at(2.0 * omega[0]) - complex(L[0])) < LEVEL * abs(L[0])  # and at rest, if nothing drifts
    gains += [1.0 / float(L[0].real)] if level and L[0].real > 0 else []
    crossovers = _sign_changes(omega, np.abs(L) - 1.0, lambda w: abs(loop_at(w)) - 1.0)
    phases = [float(np.angle(loop_at(w))) for w in crossovers]
    lags = [phase % (2 * np.pi) for phase in phases]  # a lag turns L by -lag, to 1 after its own angle
    delays = [lag / w for lag, w in zip(lags, crossovers, strict=True)]
    return Margins(
        min((g for g in gains if g > 1), default=np.inf),
        max((g for g in gains if g < 1), default=0.0),
        min(lags, default=np.inf),
        min(delays, default=np.inf),
        max(crossovers, default=0.0),
        float(np.abs(1.0 - L).min()),
    )


def _sign_changes(omega: Array, values: Array, exact: Callable[[float], float]) -> list[float]:
    """Frequencies at which a function with these values changes its sign."""
    intervals = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0)
    return [float(brentq(exact, omega[k], omega[k + 1], xtol=1e-12 * omega[k])) for k in intervals]


def _period(system: System) -> float:
    if not system.controllers:
        raise ValueError("the craft has no sampled controller; give one a period, or take the linear model")
    reference = system.controllers[0]
    for controller in system.controllers:
        differences = controller.period - reference.period, controller.start - reference.start
        if max(map(abs, differences)) > SAME * reference.period:
            raise ValueError(
                f"controllers {reference.name!r} and {controller.name!r} are called every {reference.period:g} "
                f"s from {reference.start:g} s and every {controller.period:g} s from {controller.start:g} s; a "
                "discrete model needs one period and start"
            )
    return reference.period


def _with_controllers(balanced: System, system: System) -> System:
    """The system at rest with the sampled controllers in place of their held commands."""
    held = {effector.name: effector for effector in balanced.effectors}
    effectors = tuple(item if item in system.controllers else held.get(item.name, item) for item in system.effectors)
    return replace(balanced, effectors=effectors, z0=system.z0)


def _state_with_controllers(model: Model, x: Array, balanced: System) -> Array:
    """The state of the model with controllers: coordinates at rest, states of effectors settled."""
    n = model.n_q + model.n_u
    settled = {name: value for (name, _), value in zip(balanced.state_names(), x[n:], strict=True)}
    z0 = model.parts(model.x0)[2]
    z = [settled.get(name, value) for (name, _), value in zip(model.system.state_names(), z0, strict=True)]
    return np.concatenate([x[:n], z])


class _SampledBuilder:
    """Derivatives of the motion between samples and of the samples about a state x, over s."""

    def __init__(self, model: Model, x: Array, sampled_states: IntArray) -> None:
        self.model, self.x = model, x
        offset = model.n_q + model.n_u
        self.continuous_states, self.state_sizes = effector_states(model)
        self.sampled_states = offset + sampled_states
        self.linear = linearised(model, 0.0, x)
        self.free_coordinates, self.Z = self.linear.free, self.linear.Z
        self.n = 2 * len(self.free_coordinates) + len(self.continuous_states)

    def names(self) -> tuple[tuple[str, str], ...]:
        """Names and units of s."""
        system, offset = self.model.system, self.model.n_q + self.model.n_u
        rates, states = system.velocity_names(), system.state_names()
        velocities = [rates[k] for k in self.free_coordinates]
        names = [name.removesuffix("_rate").replace(".omega_", ".turn_") for name, _ in velocities]
        coordinates = [(name, unit.removesuffix("/s")) for name, (_, unit) in zip(names, velocities, strict=True)]
        auxiliary = [states[k - offset] for k in (*self.continuous_states, *self.sampled_states)]
        return (*coordinates, *velocities, *auxiliary)

    def flow(self) -> Array:
        """[[A, B], [0, 0]] (n, n)."""
        generator = np.zeros((self.n + len(self.sampled_states),) * 2)
        generator[: self.n, : self.n] = self.linear.state_matrix()
        sizes = self.model.system.state_sizes()
        m, offset = len(self.free_coordinates), self.model.n_q + self.model.n_u
        for k, index in enumerate(self.sampled_states):
            e = np.eye(self.model.n_x)[index]
            size = STEP * float(sizes[index - offset])
            rate = local_derivative(on_line(lambda dx: self.model.state_rate(0.0, self.x + dx), e), size)
            generator[m : 2 * m, self.n + k] = rate[self.model.n_q + self.free_coordinates]
            generator[2 * m : self.n, self.n + k] = rate[self.continuous_states]
        return generator

    def sample(self, period: float) -> Array:
        """S (n, n) by central differences of the controllers' calls."""
        clock = self.model.clock
        assert clock is not None
        m, offset = len(self.free_coordinates), self.model.n_q + self.model.n_u
        moves, stored = usual_sizes(self.model)[self.free_coordinates], self.model.system.state_sizes()
        sizes = np.concatenate([moves, moves / period, self.state_sizes, stored[self.sampled_states - offset]])
        x = self.x.copy()
        t = clock.next_instant(x)
        clock.sample(t, x)
        due = t + period * (1.0 - SAME)
        if clock.next_instant(x) < due:
            delayed = next(sampler for sampler in clock.samplers if x[sampler.next_instant] < due).controller
            raise ValueError(
                f"{delayed.name!r} is called again {clock.next_instant(x) - t:.6g} s after its sample, as for a delay; "
                "a discrete model has calls at samples alone, so leave the delay out or give it as a memory of "
                "the controller"
            )
        S = np.eye(self.n + len(self.sampled_states))
        for j, size in enumerate(sizes):
            e = np.eye(len(sizes))[j]
            S[self.n :, j] = local_derivative(on_line(lambda s: self._sampled_values(s, m), e), STEP * size)
        return S

    def _sampled_values(self, s: Array, m: int) -> Array:
        """Commands and memory after a sample at this departure s from the state."""
        x, clock = self._displaced_state(s, m), self.model.clock
        assert clock is not None
        clock.sample(clock.next_instant(x), x)
        return np.asarray(x[self.sampled_states])

    def _displaced_state(self, s: Array, m: int) -> Array:
        x = displaced(self.model, self.x, self.Z @ s[:m], self.Z @ s[m : 2 * m])
        x[self.continuous_states] += s[2 * m : self.n]
        x[self.sampled_states] += s[self.n :]
        return x
