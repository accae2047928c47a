"""The Campbell diagram of a craft: branches of frequencies over the speed of a steady spin, named and followed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from femflex.arrays import Array, BoolArray, ComplexArray, IntArray
from femflex.linear.character import motion_character, numbered_names
from femflex.linear.equilibrium import EquilibriumError, equilibrium
from femflex.linear.rigid_motions import WOBBLE
from femflex.linear.still import frozen_system
from femflex.studies.tracking import Step, branch_indices, tracked_steps
from femflex.system import Frame, System, started

SAME = 1e-9  # relative difference of two speeds that are the same
UNDAMPED = 1e-9  # damping ratio that is rounding of the eigenvalues
ROUNDING = 1e-12  # of a squared frequency: a sample this close to a multiple of the spin is a crossing itself
BESIDE = 1e-6  # of a critical speed: how far below it the small motions are taken in its place
NOTHING = (
    "the craft has no vibration: its bodies are rigid, and its joints are welded, prescribed or without springs; a "
    "Campbell diagram needs a flexible body or a sprung joint"
)


@dataclass(frozen=True)
class Crossing:
    """A branch at the frequency of an excitation that comes `order` times in every turn."""

    branch: str
    order: int
    speed: float  # rad/s
    frequency: float  # Hz


@dataclass(frozen=True, eq=False)
class Branch:
    """One vibration, tracked over the speeds of a diagram by the MAC of its shape.

    name            character at the first speed, and number among those of the same character: "flap 1"
    eigenvalues     (n,) [1/s], nan where it could not be tracked
    characters      (n,) character at each speed (`femflex.linear.character`)
    growing         (n,) whether it grows there
    """

    name: str
    eigenvalues: ComplexArray
    characters: tuple[str, ...]
    growing: BoolArray

    @property
    def frequencies(self) -> Array:
        """Frequencies (n,) [Hz] in the spinning frame; 0 where it does not oscillate."""
        return np.asarray(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios (n,) [1]; negative for growth, nan without oscillation; rounding errors are set to zero."""
        size = np.abs(self.eigenvalues)
        ratios = -self.eigenvalues.real / np.where(size > 0, size, 1.0)
        ratios = np.where(np.abs(ratios) < UNDAMPED, 0.0, ratios)
        return np.where(self.eigenvalues.imag > 0, ratios, np.nan)

    @property
    def fastest(self) -> tuple[int, float]:
        """Index of the speed of fastest growth, and the time [s] in which it grows by a factor e there."""
        k = int(np.argmax(np.where(self.growing, self.eigenvalues.real, -np.inf)))
        return k, 1.0 / float(self.eigenvalues[k].real)

    @property
    def final_character(self) -> str:
        """Character at the last speed, if it differs from that in its name; else empty."""
        last_character = self.characters[-1]
        return "" if self.name.startswith(last_character) else last_character


@dataclass(frozen=True, eq=False)
class Campbell:
    """Frequencies over the speed of a steady spin, as seen in the spinning frame.

    speeds     (n,) [rad/s], the requested ones and intermediate ones, added to track branches
    requested  (n,) which were requested
    branches   by rising frequency at the first speed
    orders     multiples of the speed that are examined
    crossings  of branches with them
    complete   False when it was interrupted
    value      key path of the value of the case in place of the speed, "" for the speed
    unit       of the speeds or values
    critical   requested speeds at which the stiffness is singular, or there is no equilibrium
    rigid      names of the motions that neither grow nor decay and are no branches: drift, tilt of the spin axis
    """

    title: str
    speeds: Array
    requested: BoolArray
    branches: tuple[Branch, ...]
    orders: tuple[int, ...]
    crossings: tuple[Crossing, ...]
    complete: bool = True
    rigid: tuple[str, ...] = ()
    critical: tuple[float, ...] = ()
    value: str = ""
    unit: str = "rad/s"

    def branch(self, name: str) -> Branch:
        """The branch of that name. Raises KeyError with the known names."""
        for candidate in self.branches:
            if candidate.name == name:
                return candidate
        names = ", ".join(candidate.name for candidate in self.branches)
        raise KeyError(f"branch {name!r} is not in the diagram; it has {names}")

    def frequency(self, branch: str, speed: float) -> float:
        """Frequency [Hz] of a branch at one of the speeds [rad/s]. Raises KeyError for another."""
        nearest = int(np.argmin(np.abs(self.speeds - speed)))
        if abs(self.speeds[nearest] - speed) > SAME * max(float(self.speeds[-1]), 1e-300):
            raise KeyError(
                f"{speed:.6g} rad/s is none of the diagram's speeds, from {self.speeds[0]:.6g} to "
                f"{self.speeds[-1]:.6g} rad/s; the nearest is {self.speeds[nearest]:.6g} rad/s"
            )
        return float(self.branch(branch).frequencies[nearest])


def campbell(
    system: System,
    speeds: Sequence[float],
    axis: ArrayLike = (0.0, 0.0, 1.0),
    *,
    modes: int = 6,
    orders: Sequence[int] = (1, 2, 3, 4),
    at: float | None = None,
    title: str = "",
    progress: Callable[[float], None] | None = None,
) -> Campbell:
    """The Campbell diagram of a system that spins steadily about an axis (3,), its speeds [rad/s] rising.

    modes: every branch that is among this many lowest ones at some speed is tracked. at: time [s] of the loads.
    Raises ValueError for a craft that cannot spin steadily, EquilibriumError where it finds no equilibrium
    at the first or the last speed; critical speeds between them are skipped and marked.
    """
    steps = list(spin_steps(system, np.asarray(axis, float), speeds, modes, at, progress))
    return assembled_diagram(steps, modes, orders, title)


def spin_steps(
    system: System,
    axis: Array,
    speeds: Sequence[float],
    count: int,
    at: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Iterator[Step]:
    """Every steady spin about the axis (3,) in turn, its vibrations linked with those of the one before.

    Speeds [rad/s] are added between two whose `count` lowest shapes differ too much. A critical speed, at which the
    stiffness of the spinning craft is singular, is skipped. Raises ValueError for a craft that cannot spin steadily or
    has nothing that vibrates, EquilibriumError where the first or the last speed has no equilibrium.
    """
    if system.loops:
        raise ValueError(
            f"{', '.join(repr(loop.label) for loop in system.loops)} close loops, and the shapes of a Campbell diagram "
            "are followed for trees of bodies alone; remove the loops, or use femflex equilibrium at single speeds"
        )
    if not any(body.n_modes for body in system.bodies.values()) and all(
        joint.n_u == len(joint.prescribed) for joint in system.joints
    ):
        raise ValueError(NOTHING)
    still = frozen_system(replace(system, frame=frame_of(axis, speeds[0])), at)

    def step_at(speed: float, state: Array | None, requested: bool) -> Step:
        try:
            return _steady_spin(still, axis, speed, state, requested)
        except EquilibriumError:
            if state is None:
                raise
            below = _steady_spin(still, axis, speed * (1.0 - BESIDE), state, requested)
            return replace(below, value=speed, critical=True)

    yield from tracked_steps(step_at, speeds, count, progress, passing=True)


def _steady_spin(system: System, axis: Array, speed: float, state: Array | None, requested: bool) -> Step:
    """The steady spin nearest to a state (n_x,) [SI], or to the initial one."""
    spun = replace(system, frame=frame_of(axis, speed))
    if state is not None:  # wheels coast in the steady state, and start as their tables say at every speed
        n = len(spun.coordinate_names()) + len(spun.velocity_names())
        spun = replace(started(spun, np.concatenate([state[:n], spun.initial_state()[n:]])), z0=spun.z0)
    try:
        balance = equilibrium(spun)
    except EquilibriumError as error:
        raise EquilibriumError(f"at a spin of {speed:.6g} rad/s {error}", error.last) from None
    motions = balance.motions.of_craft()
    if speed > 0 and not len(motions.eigenvalues):
        raise ValueError(NOTHING)
    return Step(speed, requested, balance.x, motions, motion_character(balance.model, motions, axis).words)


def frame_of(axis: Array, speed: float) -> Frame:
    """The base frame that spins about the axis (3,) [rad/s]."""
    return Frame("spinning", np.asarray(axis, float) / np.linalg.norm(axis) * speed)


def assembled_diagram(
    steps: Sequence[Step],
    modes: int,
    orders: Sequence[int],
    title: str = "",
    complete: bool = True,
    value: str = "",
    unit: str = "rad/s",
) -> Campbell:
    """The diagram of consecutive steps: all of them, or those before an interruption.

    value, unit: key path and unit of the value on its axis, for one over another value than the speed.
    """
    speeds, indices = np.array([step.value for step in steps]), branch_indices(steps)
    grows = np.array(
        [any(k >= 0 and s.vibration.growing[k] for s, k in zip(steps, row, strict=True)) for row in indices]
    )
    indices = indices[((indices >= 0) & (indices < modes)).any(axis=1) | grows]
    branches = tuple(_with_names(sorted((_branch(steps, row) for row in indices), key=_sort_key)))
    met = [point for b in branches for point in crossings(b.name, speeds, b.frequencies, list(orders))]
    rigid = tuple(dict.fromkeys(motion.name for motion in steps[-1].vibration.known))
    critical = tuple(v for s in steps for v in (*s.passed, *([s.value] if s.critical and s.requested else [])))
    return Campbell(
        title, speeds, np.array([step.requested for step in steps]), branches, tuple(orders),
        tuple(sorted(met, key=lambda crossing: crossing.speed)), complete, rigid, critical, value, unit,
    )  # fmt: skip


def _branch(steps: Sequence[Step], row: IntArray) -> Branch:
    """The branch of these indices, without a name."""
    pairs = list(zip(steps, row, strict=True))
    values = np.array([s.vibration.eigenvalues[k] if k >= 0 else complex(np.nan, np.nan) for s, k in pairs])
    words = tuple(s.words[k] if k >= 0 else "" for s, k in pairs)
    growing = np.array([bool(k >= 0 and s.vibration.growing[k]) for s, k in pairs])
    if steps[0].value == 0 and row[0] < 0 and words[1:2] == (WOBBLE,):
        values[0], words = 0.0, (WOBBLE, *words[1:])  # in proportion to the speed
    return Branch("", values, words, growing)


def _sort_key(branch: Branch) -> tuple[bool, tuple[float, ...]]:
    """Index of its first speed, and frequencies at the first speeds there: the order of branches."""
    existing = np.flatnonzero(np.isfinite(branch.eigenvalues.imag))
    values = np.abs(branch.eigenvalues[existing[0] : existing[0] + 2]) if len(existing) else np.zeros(0)
    return (int(existing[0]) if len(existing) else 0) > 0, tuple(round(float(v), 9) for v in np.nan_to_num(values))


def _with_names(branches: Sequence[Branch]) -> list[Branch]:
    """The branches with names: character at the first speed, and number among those of the same character.

    At the first speed flap and lag may have one frequency and be mixed; then the second speed decides.
    """
    words = []
    for branch in branches:
        characters = [word for word in branch.characters[: 2 + branch.characters.count("")] if word]
        words.append(characters[min(1, len(characters) - 1)])
    return [replace(branch, name=name) for branch, name in zip(branches, numbered_names(words), strict=True)]


def crossings(branch: str, speeds: Array, frequencies: Array, orders: list[int]) -> list[Crossing]:
    """The crossings of a branch's frequencies (n,) [Hz] over speeds (n,) [rad/s], by rising speed.

    Between speeds the squares are interpolated, which centrifugal stiffening makes nearly straight.
    """
    swings = frequencies > 0
    intervals = np.flatnonzero(np.diff(np.concatenate([[False], swings, [False]]).astype(int))).reshape(-1, 2)
    out = []
    for start, end in intervals:
        if end - start < 2:
            continue
        z, y = speeds[start:end] ** 2, (2 * np.pi * frequencies[start:end]) ** 2
        curve = CubicSpline(z, y) if len(z) > 3 else lambda square, z=z, y=y: np.interp(square, z, y)
        out += [point for order in orders for point in _crossings_of_order(branch, order, z, y, curve)]
    return sorted(out, key=lambda crossing: crossing.speed)


def _crossings_of_order(branch: str, order: int, z: Array, y: Array, curve: object) -> list[Crossing]:
    gap = np.where(np.abs(y - order**2 * z) > ROUNDING * y, y - order**2 * z, 0.0)
    squares = [float(s) for s in z[gap == 0]]
    for k in np.flatnonzero(gap[:-1] * gap[1:] < 0):
        squares.append(brentq(lambda s: float(curve(s)) - order**2 * s, z[k], z[k + 1]))  # type: ignore[operator]
    return [Crossing(branch, order, math.sqrt(s), order * math.sqrt(s) / (2 * math.pi)) for s in squares]
