"""Blocks of controllers: linear systems, quaternion feedback, and pulses, continuous or sampled.

A linear block is a StateSpace, dx/dt = A x + B u, y = C x + D u. `block` makes it an Effector that runs continuously,
its x among the states of the run, or with a period a Controller: sampled with its inputs held (exact discretisation,
zero order hold), outputs held between two samples.

Blocks are joined by their signals: "<block>.<output>". The order of evaluation is that of femflex.system.evaluation;
algebraic loops give an error.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.effectors import block_kernels
from femflex.noun.parametric import UNLIMITED
from femflex.system.controller import Controller
from femflex.system.effector import Effector
from femflex.system.evaluation import CHANNEL_FOLDER

OFF = 1e-9  # part of a period below which a pulse is none


class StateSpace(NamedTuple):
    """dx/dt = A x + B u, y = C x + D u: A (n, n), B (n, m), C (p, n), D (p, m)."""

    A: Array
    B: Array
    C: Array
    D: Array


def state_space(A: ArrayLike, B: ArrayLike, C: ArrayLike, D: ArrayLike) -> StateSpace:
    """The block of these matrices. Raises ValueError for sizes that do not fit."""
    D = np.atleast_2d(np.asarray(D, float))
    p, m = D.shape
    A = np.asarray(A, float).reshape(-1, max(1, math.isqrt(np.size(A))))
    n = len(A) if A.size else 0
    A, sizes = A.reshape(n, n) if A.size == n * n else A, {"A": (n, n), "B": (n, m), "C": (p, n)}
    matrices = {"A": A, "B": np.asarray(B, float), "C": np.asarray(C, float)}
    for key, shape in sizes.items():
        if matrices[key].size != shape[0] * shape[1]:
            raise ValueError(
                f"{key} of a block has shape {matrices[key].shape}; with D of shape {(p, m)} it needs {shape}"
            )
        matrices[key] = matrices[key].reshape(shape)
    if not all(np.all(np.isfinite(matrix)) for matrix in (*matrices.values(), D)):
        raise ValueError("the matrices of a block must be finite")
    return StateSpace(matrices["A"], matrices["B"], matrices["C"], D)


def gain(K: ArrayLike) -> StateSpace:
    """y = K u."""
    K = np.atleast_2d(np.asarray(K, float))
    return state_space([], [], [], K)


def pd(stiffness: ArrayLike, damping: ArrayLike) -> StateSpace:
    """y = -P e - D w for n errors e, then n rates w; gains (n,)."""
    P, D = np.atleast_1d(np.asarray(stiffness, float)), np.atleast_1d(np.asarray(damping, float))
    return gain(-np.hstack([np.diag(P), np.diag(D)]))


def pid(stiffness: ArrayLike, integral: ArrayLike, damping: ArrayLike) -> StateSpace:
    """y = -P e - I int e dt - D w for n errors e, then n rates w; gains (n,)."""
    P, I, D = (np.atleast_1d(np.asarray(value, float)) for value in (stiffness, integral, damping))
    n = len(P)
    return state_space(np.zeros((n, n)), np.hstack([np.eye(n), np.zeros((n, n))]), -np.diag(I), pd(P, D).D)


def low_pass(frequency: float, order: int = 1, damping: float = math.sqrt(0.5), channels: int = 1) -> StateSpace:
    """w/(s + w), or w^2/(s^2 + 2 zeta w s + w^2), with w = 2 pi frequency [Hz]; the same for every channel."""
    w = 2.0 * math.pi * frequency
    if not (frequency > 0.0 and damping > 0.0 and order in (1, 2)):
        raise ValueError(
            f"a low-pass of order {order} at {frequency:g} Hz: frequency and damping must be positive, order 1 or 2"
        )
    if order == 1:
        return _repeated(state_space([[-w]], [[w]], [[1.0]], [[0.0]]), channels)
    return _repeated(
        state_space([[0.0, 1.0], [-w * w, -2 * damping * w]], [[0.0], [w * w]], [[1.0, 0.0]], [[0.0]]), channels
    )


def notch(frequency: float, width: float = 1.0, depth: float = 0.0, channels: int = 1) -> StateSpace:
    """(s^2 + 2 depth width w s + w^2) / (s^2 + 2 width w s + w^2), w = 2 pi frequency [Hz]: gain `depth` at w."""
    w = 2.0 * math.pi * frequency
    if not (frequency > 0.0 and width > 0.0 and 0.0 <= depth < 1.0):
        raise ValueError(
            f"a notch at {frequency:g} Hz of width {width:g} and depth {depth:g}: frequency "
            "and width must be positive, depth from 0 to 1"
        )
    C = [[0.0, 2.0 * (depth - 1.0) * width * w]]
    return _repeated(state_space([[0.0, 1.0], [-w * w, -2 * width * w]], [[0.0], [1.0]], C, [[1.0]]), channels)


def observer(A: ArrayLike, B: ArrayLike, C: ArrayLike, feedback: ArrayLike, correction: ArrayLike) -> StateSpace:
    """State feedback over an observer: dx/dt = A x + B v + L (y - C x), v = -K x; input y, output v."""
    A, B, C = (np.atleast_2d(np.asarray(matrix, float)) for matrix in (A, B, C))
    K, L = (np.atleast_2d(np.asarray(matrix, float)) for matrix in (feedback, correction))
    n, n_v, n_y = len(A), len(K), len(C)
    shapes = {"A": (n, n), "B": (n, n_v), "C": (n_y, n), "feedback": (n_v, n), "correction": (n, n_y)}
    for (name, shape), matrix in zip(shapes.items(), (A, B, C, K, L), strict=True):
        if matrix.shape != shape:
            raise ValueError(
                f"matrices of an observer do not fit: {name} has shape {matrix.shape}; with {n} states (rows of A), "
                f"{n_y} inputs (rows of C) and {n_v} outputs (rows of feedback) it needs {shape}"
            )
    return state_space(A - B @ K - L @ C, L, -K, np.zeros((n_v, n_y)))


def allocation(effect: ArrayLike) -> StateSpace:
    """Commands of least size that together have a demanded effect: y = pinv(effect) u.

    effect (n_demands, n_actuators): what a unit of each command does, such as torque on the body; of a wheel -axis.
    Raises ValueError where some demand cannot be met.
    """
    E = np.atleast_2d(np.asarray(effect, float))
    if np.linalg.matrix_rank(E) < len(E):
        raise ValueError(
            f"{E.shape[1]} actuators produce {np.linalg.matrix_rank(E)} of {len(E)} demands independently; add "
            "actuators, or remove demands"
        )
    return gain(np.linalg.pinv(E))


def momentum_management(rate: float, effect: ArrayLike) -> StateSpace:
    """Return the torque demand -rate H for the momentum H = effect h of wheels with momenta h [1/s]."""
    return gain(-rate * np.atleast_2d(np.asarray(effect, float)))


def _repeated(block: StateSpace, channels: int) -> StateSpace:
    A, B, C, D = (np.asarray(np.kron(np.eye(channels), matrix), float) for matrix in block)
    return StateSpace(A, B, C, D)


def discretised(system: StateSpace, period: float) -> StateSpace:
    """Return x_(k+1) = A x_k + B u_k for inputs constant over each period [s]: exp([[A, B], [0, 0]] period)."""
    from scipy.linalg import expm

    A, B, C, D = system
    n, m = B.shape
    if not n or not period > 0.0:
        return system
    exponential = np.asarray(expm(np.block([[A, B], [np.zeros((m, n + m))]]) * period), float)
    return StateSpace(exponential[:n, :n], exponential[:n, n:], C, D)


def block(
    name: str,
    system: StateSpace,
    inputs: Sequence[str],
    outputs: Mapping[str, str] | Sequence[str],
    *,
    period: float | None = None,
    limit: ArrayLike = UNLIMITED,
    scaled: bool = False,
) -> Effector | Controller:
    """A linear block with named signals as inputs.

    outputs  name -> unit, or names
    period   None: continuous; else sampled every so often [s]
    limit    of each output, or of all;  scaled: beyond it all outputs are scaled down together, keeping their ratios
    Raises ValueError for counts that do not fit.
    """
    n, (p, m) = len(system.A), system.D.shape
    refuse_repeated(name, outputs)
    named = dict(outputs) if isinstance(outputs, Mapping) else dict.fromkeys(outputs, "1")
    if len(inputs) != m or len(named) != p:
        raise ValueError(
            f"block {name!r} takes {m} inputs and gives {p} outputs; found {len(inputs)} inputs and "
            f"{len(named)} outputs"
        )
    limits = np.broadcast_to(np.asarray(limit, float), (p,)).copy()
    if not np.all(limits > 0.0):
        raise ValueError(f"limits of block {name!r} are {limits.tolist()}; they must be positive")
    if scaled and np.all(limits >= UNLIMITED):
        raise ValueError(f"block {name!r} is scaled and has no limit; give the limit to which its outputs are scaled")
    if period is not None:
        law = SampledBlock(discretised(system, period), limits, scaled, paths_of(inputs))
        return Controller(name, law, period, law.paths, named, memory=np.zeros(n))
    numbers = [float(m), float(n), float(p), float(scaled)]
    A, B, C, D = system
    controller = Effector(
        name,
        block_kernels.state_space,
        states={f"x{k + 1}": "1" for k in range(n)},
        inputs=tuple(inputs),
        channels=named,
        parameters=np.concatenate([numbers, *(matrix.ravel() for matrix in (A, B, C, D)), limits]),
        kind="controller",
    )
    off = np.concatenate([numbers, *(matrix.ravel() for matrix in (A, B, 0.0 * C, 0.0 * D)), limits])
    return replace(controller, silent=partial(replace, controller, parameters=off))


def refuse_repeated(name: str, outputs: Mapping[str, str] | Sequence[str]) -> None:
    """Raise ValueError where two outputs of a block have one name."""
    if repeated := [output for k, output in enumerate(outputs) if output in list(outputs)[:k]]:
        raise ValueError(f"outputs of {name!r} hold {repeated[0]!r} twice; give each output a name of its own")


def paths_of(signals: Sequence[str]) -> tuple[str, ...]:
    """Return the channels of the result file for these signals."""
    return tuple(CHANNEL_FOLDER + "/".join(signal.rpartition(".")[::2]) for signal in signals)


@dataclass(frozen=True, eq=False)
class SampledBlock:
    """The law of a sampled linear block; memory is x. With states its matrices are those of x_(k+1) = A x_k + B u_k."""

    system: StateSpace
    limits: Array
    scaled: bool
    paths: tuple[str, ...]

    def __call__(self, t: float, sensors: Mapping[str, Array], memory: Array) -> tuple[Array, Array]:
        A, B, C, D = self.system
        u = np.array([float(sensors[path]) for path in self.paths])
        y = C @ memory + D @ u
        if self.scaled:
            y = y * min(1.0, float(np.min(self.limits / np.maximum(np.abs(y), 1e-300))))
        return np.clip(y, -self.limits, self.limits), A @ memory + B @ u if len(A) else memory


def attitude_feedback(
    name: str,
    error: Sequence[str],
    rate: Sequence[str],
    stiffness: ArrayLike,
    damping: ArrayLike,
    *,
    inertia: ArrayLike | None = None,
    momentum: Sequence[str] = (),
    limit: float = UNLIMITED,
    period: float | None = None,
) -> Effector | Controller:
    """Quaternion feedback: torque on the body -P e - D omega + omega x (J omega + H), outputs x, y, z [N m].

    error, rate  signals of an attitude and of a rate sensor in the same axes
    stiffness    P [N m/rad], damping D [N m s/rad]: a number, (3,) or (3, 3)
    inertia      J (3, 3), (3,): adds the gyroscopic torque; momentum: signals of H of wheels in the same axes
    limit        of each component [N m]
    period       None: continuous; else sampled [s]
    """
    P, D = _matrix(stiffness), _matrix(damping)
    J = np.zeros((3, 3)) if inertia is None else _matrix(inertia)
    inputs = (*error, *rate, *momentum)
    if len(inputs) not in (6, 9) or len(error) != 3:
        raise ValueError(
            f"block {name!r} takes three errors, three rates and three momenta or none; found {list(inputs)}"
        )
    outputs = dict.fromkeys("xyz", "N m")
    if period is not None:
        paths = paths_of(inputs)
        return Controller(name, SampledAttitude(P, D, J, limit, paths), period, paths, outputs)
    numbers = np.concatenate([[float(bool(momentum))], P.ravel(), D.ravel(), J.ravel(), [limit]])
    controller = Effector(
        name, block_kernels.attitude_feedback, inputs=inputs, channels=outputs, parameters=numbers, kind="controller"
    )
    off = np.concatenate([numbers[:1], np.zeros(27), numbers[28:]])
    return replace(controller, silent=partial(replace, controller, parameters=off))


@dataclass(frozen=True, eq=False)
class SampledAttitude:
    """The law of sampled quaternion feedback."""

    P: Array
    D: Array
    J: Array
    limit: float
    paths: tuple[str, ...]

    def __call__(self, t: float, sensors: Mapping[str, Array], memory: Array) -> tuple[Array, Array]:
        u = np.array([float(sensors[path]) for path in self.paths])
        e, omega, H = u[:3], u[3:6], u[6:] if len(u) > 6 else np.zeros(3)
        torque = -self.P @ e - self.D @ omega + np.cross(omega, self.J @ omega + H)
        return np.clip(torque, -self.limit, self.limit), memory


def _matrix(value: ArrayLike) -> Array:
    array = np.asarray(value, float)
    return array if array.shape == (3, 3) else np.diag(np.broadcast_to(array, (3,)))


def pulses(
    name: str, demands: Sequence[str], outputs: Sequence[str], full: ArrayLike, period: float, minimum_on: float = 0.0
) -> Controller:
    """On-off commands, 0 or 1, whose mean over each period is demand / full: pulse-width modulation at exact instants.

    A demand of either sign drives the thruster of positive effect only: give each thruster a demand of its own, such as
    an `allocation`. Pulses shorter than minimum_on [s] are left out; a demand beyond `full` is on throughout.
    """
    if not 0.0 <= minimum_on < period:
        raise ValueError(
            f"minimum_on of {name!r} is {minimum_on:g} s; it must lie between 0 and the period of {period:g} s"
        )
    refuse_repeated(name, outputs)
    n = len(demands)
    if n != len(outputs):
        raise ValueError(f"{name!r} has {n} demands and {len(outputs)} outputs; give as many of both")
    law = PulseWidths(paths_of(demands), np.broadcast_to(np.asarray(full, float), (n,)).copy(), period, minimum_on)
    return Controller(name, law, period, law.paths, dict.fromkeys(outputs, "1"), memory=np.full(n + 1, -1.0))


@dataclass(frozen=True, eq=False)
class PulseWidths:
    """The law of `pulses`. Memory: when each thruster goes off, and when the next period begins."""

    paths: tuple[str, ...]
    full: Array
    period: float
    minimum_on: float

    def __call__(self, t: float, sensors: Mapping[str, Array], memory: Array) -> tuple[Array, Array, float | None]:
        off, due = memory[:-1], memory[-1]
        if t >= due - OFF * self.period:
            due = t + self.period
            demand = np.array([float(sensors[path]) for path in self.paths])
            width = np.clip(demand / self.full, 0.0, 1.0) * self.period
            width[width < max(self.minimum_on, OFF * self.period)] = 0.0
            off = np.where(width >= self.period * (1.0 - OFF), np.inf, t + width)
        on = off > t * (1.0 + 1e-15) + 1e-300
        later = off[on & (off < due - OFF * self.period)]
        return (
            on.astype(float),
            np.concatenate([np.where(np.isinf(off), 1e300, off), [due]]),
            float(later.min()) if later.size else None,
        )
