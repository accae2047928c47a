"""The Campbell diagram of a craft: branches of frequencies over the speed of a steady spin, named and followed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array, BoolArray, ComplexArray, IntArray
from femflex.dynamics.equilibria.character import WOBBLE, numbered_names
from femflex.dynamics.equilibria.small_motions import GROWING
from femflex.studies.campbell.crossings import Crossing, crossings
from femflex.studies.campbell.matching import Match
from femflex.studies.campbell.sweep import Spin, spins
from femflex.system import System

SAME = 1e-9  # relative difference of two speeds that are the same
UNDAMPED = 1e-9  # damping ratio that is rounding of the eigenvalues


@dataclass(frozen=True, eq=False)
class Branch:
    """One vibration, followed over the speeds of a diagram by the likeness of its shape.

    name            what it is at the first speed, and its number among those alike: "flap 1"
    eigenvalues     (n,) [1/s], nan where it could not be followed
    characters      (n,) what it is at each speed: one of WORDS
    growing         (n,) whether it grows there
    """

    name: str
    eigenvalues: ComplexArray
    characters: tuple[str, ...]
    growing: BoolArray

    @property
    def frequencies(self) -> Array:
        """(n,) [Hz] in the spinning frame; 0 where it does not swing."""
        return np.asarray(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """Part (n,) [1] of critical; below 0 grows; nan where it does not swing; what is but rounding is none."""
        size = np.abs(self.eigenvalues)
        ratios = -self.eigenvalues.real / np.where(size > 0, size, 1.0)
        ratios = np.where(np.abs(ratios) < UNDAMPED, 0.0, ratios)
        return np.where(self.eigenvalues.imag > 0, ratios, np.nan)

    @property
    def fastest(self) -> tuple[int, float]:
        """Place among the speeds where it grows fastest, and the time [s] in which it grows by a factor e there."""
        k = int(np.argmax(np.where(self.growing, self.eigenvalues.real, -np.inf)))
        return k, 1.0 / float(self.eigenvalues[k].real)

    @property
    def becomes(self) -> str:
        """What it is at the last speed where that is something else than its name says; else nothing."""
        last = self.characters[-1]
        return "" if self.name.startswith(last) else last


@dataclass(frozen=True, eq=False)
class Campbell:
    """Frequencies over the speed of a steady spin, as seen in the spinning frame.

    speeds     (n,) [rad/s], those requested and those in between that branches were followed through
    asked      (n,) which were requested
    branches   by rising frequency at the first speed
    orders     multiples of the speed that are looked at
    crossings  of branches with them
    complete   False when it was broken off
    value      key path of the value of the case that stands in place of the speed, "" for the speed
    unit       of the speeds or values
    critical   requested speeds at which the stiffness is singular, or there is no equilibrium
    rigid      names of the motions that neither grow nor decay and are no branches: drift, tilt of the spin axis
    """

    title: str
    speeds: Array
    asked: BoolArray
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
        for one in self.branches:
            if one.name == name:
                return one
        known = ", ".join(one.name for one in self.branches)
        raise KeyError(f"branch {name!r} is not in the diagram; it has {known}")

    def frequency(self, branch: str, speed: float) -> float:
        """Frequency [Hz] of a branch at one of the speeds [rad/s]. Raises KeyError for another."""
        at = int(np.argmin(np.abs(self.speeds - speed)))
        if abs(self.speeds[at] - speed) > SAME * max(float(self.speeds[-1]), 1e-300):
            raise KeyError(
                f"{speed:.6g} rad/s is none of the diagram's speeds, from {self.speeds[0]:.6g} to "
                f"{self.speeds[-1]:.6g} rad/s; the nearest is {self.speeds[at]:.6g} rad/s"
            )
        return float(self.branch(branch).frequencies[at])

    def to_dict(self) -> dict[str, Any]:
        """Everything in plain numbers, lists and text."""
        return {
            "over": self.value or "speed",
            "unit": self.unit,
            "speeds": self.speeds.tolist(),
            "asked": self.asked.tolist(),
            "branches": [
                {
                    "name": one.name,
                    "frequency": one.frequencies.tolist(),
                    "damping_ratio": one.damping_ratios.tolist(),
                    "growth": one.eigenvalues.real.tolist(),
                    "stable": (~one.growing).tolist(),
                    "character": list(one.characters),
                }
                for one in self.branches
            ],
            "crossings": [vars(crossing) for crossing in self.crossings],
            "rigid": list(self.rigid),
            "critical": list(self.critical),
            "growth_threshold": GROWING,
            "complete": self.complete,
        }


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

    modes: followed is every branch that is among so many lowest at some speed. at: time [s] whose loads are meant.
    Raises ValueError for a craft that cannot spin steadily, EquilibriumError where it finds no equilibrium
    at the first or the last speed; critical speeds between them are passed and marked.
    """
    found = list(spins(system, np.asarray(axis, float), speeds, modes, at, progress))
    return assembled_diagram(found, modes, orders, title)


def assembled_diagram(
    found: Sequence[tuple[Spin, Match | None]],
    modes: int,
    orders: Sequence[int],
    title: str = "",
    complete: bool = True,
) -> Campbell:
    """The diagram of spins that follow each other, all or those there were when it was broken off."""
    steps = [spin for spin, _ in found]
    speeds = np.array([spin.speed for spin in steps])
    places = followed(found)
    grows = np.array(
        [any(k >= 0 and s.vibration.growing[k] for s, k in zip(steps, row, strict=True)) for row in places]
    )
    places = places[((places >= 0) & (places < modes)).any(axis=1) | grows]
    branches = tuple(sorted((_branch(steps, row) for row in places), key=_start))
    named = tuple(_named(branches))
    met = (
        []
        if not orders
        else [one for branch in named for one in crossings(branch.name, speeds, branch.frequencies, list(orders))]
    )
    asked = np.array([spin.asked for spin in steps])
    rigid = tuple(dict.fromkeys(motion.name for motion in steps[-1].vibration.known))
    critical = tuple(v for s in steps for v in (*s.passed, *([s.speed] if s.critical and s.asked else [])))
    met.sort(key=lambda crossing: crossing.speed)
    return Campbell(title, speeds, asked, named, tuple(orders), tuple(met), complete, rigid, critical)


def followed(found: Sequence[tuple[Spin, Match | None]]) -> IntArray:
    """Place (n_branches, n_spins), an index, of every branch among the vibrations of each spin; -1 where it is not
    there.

    A branch ends where no shape continues it, and begins where a shape continues none: the wobble of a free craft and
    the motions of free joints are drift at rest, and oscillate in the spin.
    """
    rows = [[k] for k in range(len(found[0][0].vibration.eigenvalues))]
    for k, (spin, link) in enumerate(found[1:], start=1):
        assert link is not None
        for row in rows:
            row.append(int(link.to[row[-1]]) if row[-1] >= 0 else -1)
        taken = {row[-1] for row in rows}
        rows += [[-1] * k + [new] for new in range(len(spin.vibration.eigenvalues)) if new not in taken]
    return np.array(rows, np.int64).reshape(len(rows), len(found))


def _branch(steps: Sequence[Spin], row: IntArray) -> Branch:
    """The branch at those places, yet without a name."""
    there = list(zip(steps, row, strict=True))
    values = np.array([s.vibration.eigenvalues[k] if k >= 0 else complex(np.nan, np.nan) for s, k in there])
    words = tuple(s.words[k] if k >= 0 else "" for s, k in there)
    growing = np.array([bool(k >= 0 and s.vibration.growing[k]) for s, k in there])
    if steps[0].speed == 0 and row[0] < 0 and words[1:2] == (WOBBLE,):
        values[0], words = 0.0, (WOBBLE, *words[1:])  # in proportion to the speed
    return Branch("", values, words, growing)


def _start(branch: Branch) -> tuple[bool, tuple[float, ...]]:
    """Place of its beginning, and frequencies at the first speeds there, by which branches are put in order."""
    begun = np.flatnonzero(np.isfinite(branch.eigenvalues.imag))
    values = np.abs(branch.eigenvalues[begun[0] : begun[0] + 2]) if len(begun) else np.zeros(0)
    return (int(begun[0]) if len(begun) else 0) > 0, tuple(round(float(v), 9) for v in np.nan_to_num(values))


def _named(branches: Sequence[Branch]) -> list[Branch]:
    """Each with its name: what it is at the first speed, and its number among those that are the same.

    At the very first speed flap and lag may be one frequency and any mixture; the second tells.
    """
    words = []
    for branch in branches:
        there = [word for word in branch.characters[: 2 + branch.characters.count("")] if word]
        words.append(there[min(1, len(there) - 1)])
    return [replace(branch, name=name) for branch, name in zip(branches, numbered_names(words), strict=True)]
