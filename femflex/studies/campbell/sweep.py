"""Steady spins of a craft one after the other, each found from the one before, and close enough to track modes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.linear.character import motion_character
from femflex.dynamics.linear.equilibrium import EquilibriumError, equilibrium
from femflex.dynamics.linear.small_motions import SmallMotions
from femflex.dynamics.linear.still import frozen_system
from femflex.studies.campbell.matching import Match, match_vibrations
from femflex.system import Frame, System, started

ALIKE = 0.8  # smallest MAC of a shape that is tracked from one speed to the next
BESIDE = 1e-6  # of a critical speed: how far below it the small motions are taken in its place
HALVINGS = 6  # of a step, at most: a change within a 64th of it counts as a crossing
NOTHING = (
    "the craft has no vibration: its bodies are rigid, and its joints are welded, prescribed or without springs; a "
    "Campbell diagram needs a flexible body or a sprung joint"
)


@dataclass(frozen=True, eq=False)
class Spin:
    """A steady spin and the small motions about it.

    speed      [rad/s]; the value, where a diagram is over another value than the speed
    requested  whether it was requested, or is an intermediate one
    x          (n_x,) the equilibrium
    vibration  the small motions, with damping
    words      (n,) character of each of them, see `character`
    critical   whether its stiffness is singular: the motions are those just below
    passed     requested speeds before this one that have no equilibrium
    """

    speed: float
    requested: bool
    x: Array
    vibration: SmallMotions
    words: tuple[str, ...]
    critical: bool = False
    passed: tuple[float, ...] = ()


def spins(
    system: System,
    axis: Array,
    speeds: Sequence[float],
    count: int,
    at: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Iterator[tuple[Spin, Match | None]]:
    """Every steady spin about the axis (3,) in turn, with the match of its vibrations with those of the one before.

    If one of the `count` lowest shapes differs too much from that of the speed before, intermediate speeds [rad/s] are
    added. A critical speed, at which the stiffness of the spinning craft is singular, is skipped. Raises ValueError
    for a craft that cannot spin steadily or has nothing that vibrates, EquilibriumError where the first or the last
    speed has no equilibrium.
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

    def at_speed(speed: float, state: Array | None, requested: bool) -> Spin:
        try:
            return spin(still, axis, speed, state, requested)
        except EquilibriumError:
            if state is None:
                raise
            return replace(spin(still, axis, speed * (1.0 - BESIDE), state, requested), speed=speed, critical=True)

    yield from tracked_motions(at_speed, speeds, count, progress, passing=True)


def tracked_motions(
    spin_at: Callable[[float, Array | None, bool], Spin],
    values: Sequence[float],
    count: int,
    progress: Callable[[float], None] | None = None,
    passing: bool = False,
) -> Iterator[tuple[Spin, Match | None]]:
    """Small motions at every value in turn, with their match with those of the value before.

    spin_at: returns those at a value, from a state (n_x,) [SI] nearby, and whether the value was requested; passing: a
    value without equilibrium between others is skipped. If one of the `count` lowest shapes differs too much from that
    before, intermediate values are added.
    """
    last_spin: Spin | None = None
    passed: tuple[float, ...] = ()
    for value in values:
        try:
            current_spin = replace(spin_at(value, None if last_spin is None else last_spin.x, True), passed=passed)
        except EquilibriumError:
            if not passing or last_spin is None or value == values[-1]:
                raise
            passed = (*passed, value)
            continue
        passed = ()
        if last_spin is None:
            yield current_spin, None
        else:
            yield from _with_intermediate_spins(
                spin_at, (last_spin, current_spin), count, HALVINGS if not current_spin.passed else 0
            )
        last_spin = current_spin
        if progress is not None:
            progress(value)


def spin(system: System, axis: Array, speed: float, state: Array | None = None, requested: bool = True) -> Spin:
    """The steady spin nearest to a state (n_x,) [SI], or to the initial one."""
    spun = replace(system, frame=frame_of(axis, speed))
    if state is not None:
        n = len(spun.coordinate_names()) + len(spun.velocity_names())
        initial = np.concatenate(
            [state[:n], spun.initial_state()[n:]]
        )  # wheels coast in the steady state and have no states
        spun = replace(started(spun, initial), z0=spun.z0)  # they start as their tables say at every speed
    try:
        balance = equilibrium(spun)
    except EquilibriumError as error:
        raise EquilibriumError(f"at a spin of {speed:.6g} rad/s {error}", error.last) from None
    motions = balance.motions.of_craft()
    if speed > 0 and not len(motions.eigenvalues):
        raise ValueError(NOTHING)
    return Spin(speed, requested, balance.x, motions, motion_character(balance.model, motions, axis).words)


def frame_of(axis: Array, speed: float) -> Frame:
    """The base frame that spins about the axis (3,) [rad/s]."""
    return Frame("spinning", np.asarray(axis, float) / np.linalg.norm(axis) * speed)


def _with_intermediate_spins(
    spin_at: Callable[[float, Array | None, bool], Spin], ends: tuple[Spin, Spin], count: int, halvings: int
) -> Iterator[tuple[Spin, Match | None]]:
    """The second of two spins, after as many intermediate ones as are needed to track shapes from one to the next."""
    lower, upper = ends
    link = match_vibrations(lower.vibration, upper.vibration, count, close=halvings == 0)
    if link.worst >= ALIKE or halvings == 0:
        yield upper, link
        return
    middle = spin_at((lower.speed + upper.speed) / 2, lower.x, False)
    yield from _with_intermediate_spins(spin_at, (lower, middle), count, halvings - 1)
    yield from _with_intermediate_spins(spin_at, (middle, upper), count, halvings - 1)
