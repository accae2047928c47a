"""Steady spins of a craft one after the other, each found from the one before and close enough to be followed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.equilibria.character import motion_character
from femflex.dynamics.equilibria.equilibrium import EquilibriumError, equilibrium
from femflex.dynamics.equilibria.frozen import frozen_system
from femflex.dynamics.equilibria.small_motions import SmallMotions
from femflex.studies.campbell.matching import Match, match
from femflex.system import Frame, System, started

ALIKE = 0.8  # least likeness of the shapes that are followed from one speed to the next
BESIDE = 1e-6  # of a critical speed: how far below it the small motions are taken in its place
HALVINGS = 6  # of a step, at most: what changes within a 64th of it is passed as a crossing
NOTHING = (
    "the craft has no vibration: its bodies are rigid, and its joints are welded, prescribed or without springs; a "
    "Campbell diagram needs a flexible body or a sprung joint"
)


@dataclass(frozen=True, eq=False)
class Spin:
    """A steady spin and the small motions about it.

    speed      [rad/s]; the value, where a diagram is over another value than the speed
    asked      whether it is one of those that were requested, or one in between
    x          (n_x,) the equilibrium
    vibration  the small motions, with damping
    words      (n,) what each of them is, see `character`
    critical   whether its stiffness is singular: the motions are those just below
    passed     requested speeds before this one that have no equilibrium
    """

    speed: float
    asked: bool
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
    """Every steady spin about the axis (3,) in turn, with how its vibrations continue those of the one before.

    Between speeds [rad/s] at which one of the `count` lowest shapes is not like that of the speed before, more are
    looked at. A critical speed, at which the stiffness of the spinning craft is singular, is passed. Raises ValueError
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

    def at_speed(speed: float, near: Array | None, asked: bool) -> Spin:
        try:
            return spin(still, axis, speed, near, asked)
        except EquilibriumError:
            if near is None:
                raise
            return replace(spin(still, axis, speed * (1.0 - BESIDE), near, asked), speed=speed, critical=True)

    yield from walked(at_speed, speeds, count, progress, passing=True)


def walked(
    found_at: Callable[[float, Array | None, bool], Spin],
    values: Sequence[float],
    count: int,
    progress: Callable[[float], None] | None = None,
    passing: bool = False,
) -> Iterator[tuple[Spin, Match | None]]:
    """Small motions at every value in turn, with how they continue those of the value before.

    found_at: gives those at a value, near a state (n_x,) [SI], and whether the value was requested; passing: a
    value without equilibrium between others is left out. Between values at
    which one of the `count` lowest shapes is not like that before, more are looked at.
    """
    before: Spin | None = None
    passed: tuple[float, ...] = ()
    for value in values:
        try:
            found = replace(found_at(value, None if before is None else before.x, True), passed=passed)
        except EquilibriumError:
            if not passing or before is None or value == values[-1]:
                raise
            passed = (*passed, value)
            continue
        passed = ()
        if before is None:
            yield found, None
        else:
            yield from _between(found_at, (before, found), count, HALVINGS if not found.passed else 0)
        before = found
        if progress is not None:
            progress(value)


def spin(system: System, axis: Array, speed: float, near: Array | None = None, asked: bool = True) -> Spin:
    """The steady spin nearest to a state (n_x,) [SI], or to the initial one."""
    spun = replace(system, frame=frame_of(axis, speed))
    if near is not None:
        n = len(spun.coordinate_names()) + len(spun.velocity_names())
        at = np.concatenate([near[:n], spun.initial_state()[n:]])  # wheels coast in the steady state and have no states
        spun = replace(started(spun, at), z0=spun.z0)  # they start as their tables say at every speed
    try:
        rest = equilibrium(spun)
    except EquilibriumError as error:
        raise EquilibriumError(f"at a spin of {speed:.6g} rad/s {error}", error.last) from None
    motions = rest.motions.of_craft()
    if speed > 0 and not len(motions.eigenvalues):
        raise ValueError(NOTHING)
    return Spin(speed, asked, rest.x, motions, motion_character(rest.model, motions, axis).words)


def frame_of(axis: Array, speed: float) -> Frame:
    """The base frame that spins about the axis (3,) [rad/s]."""
    return Frame("spinning", np.asarray(axis, float) / np.linalg.norm(axis) * speed)


def _between(
    found_at: Callable[[float, Array | None, bool], Spin], ends: tuple[Spin, Spin], count: int, halvings: int
) -> Iterator[tuple[Spin, Match | None]]:
    """The second of two spins, and before it as many in between as it takes to follow shapes from one to the next."""
    first, last = ends
    found = match(first.vibration, last.vibration, count, close=halvings == 0)
    if found.worst >= ALIKE or halvings == 0:
        yield last, found
        return
    middle = found_at((first.speed + last.speed) / 2, first.x, False)
    yield from _between(found_at, (first, middle), count, halvings - 1)
    yield from _between(found_at, (middle, last), count, halvings - 1)
