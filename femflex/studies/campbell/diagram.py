"""The Campbell diagram of a craft: branches of frequencies over the speed of a steady spin, named and followed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array, BoolArray, ComplexArray, IntArray
from femflex.dynamics.linear.character import numbered_names
from femflex.dynamics.linear.rigid_motions import WOBBLE
from femflex.dynamics.linear.small_motions import GROWING
from femflex.studies.campbell.crossings import Crossing, crossings
from femflex.studies.campbell.matching import Match
from femflex.studies.campbell.sweep import Spin, spins
from femflex.system import System

SAME = 1e-9  # relative difference of two speeds that are the same
UNDAMPED = 1e-9  # damping ratio that is rounding of the eigenvalues


@dataclass(frozen=True, eq=False)
class Branch:
    """One vibration, tracked over the speeds of a diagram by the MAC of its shape.

    name            character at the first speed, and number among those of the same character: "flap 1"
    eigenvalues     (n,) [1/s], nan where it could not be tracked
    characters      (n,) character at each speed (`femflex.dynamics.linear.character`)
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

    def to_dict(self) -> dict[str, Any]:
        """Everything in plain numbers, lists and text."""
        return {
            "over": self.value or "speed",
            "unit": self.unit,
            "speeds": self.speeds.tolist(),
            "asked": self.requested.tolist(),
            "branches": [
                {
                    "name": branch.name,
                    "frequency": branch.frequencies.tolist(),
                    "damping_ratio": branch.damping_ratios.tolist(),
                    "growth": branch.eigenvalues.real.tolist(),
                    "stable": (~branch.growing).tolist(),
                    "character": list(branch.characters),
                }
                for branch in self.branches
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

    modes: every branch that is among this many lowest ones at some speed is tracked. at: time [s] of the loads.
    Raises ValueError for a craft that cannot spin steadily, EquilibriumError where it finds no equilibrium
    at the first or the last speed; critical speeds between them are skipped and marked.
    """
    matched_spins = list(spins(system, np.asarray(axis, float), speeds, modes, at, progress))
    return assembled_diagram(matched_spins, modes, orders, title)


def assembled_diagram(
    matched_spins: Sequence[tuple[Spin, Match | None]],
    modes: int,
    orders: Sequence[int],
    title: str = "",
    complete: bool = True,
) -> Campbell:
    """The diagram of consecutive spins: all of them, or those before an interruption."""
    steps = [spin for spin, _ in matched_spins]
    speeds = np.array([spin.speed for spin in steps])
    indices = branch_indices(matched_spins)
    grows = np.array(
        [any(k >= 0 and s.vibration.growing[k] for s, k in zip(steps, row, strict=True)) for row in indices]
    )
    indices = indices[((indices >= 0) & (indices < modes)).any(axis=1) | grows]
    branches = tuple(sorted((_branch(steps, row) for row in indices), key=_sort_key))
    named_branches = tuple(_with_names(branches))
    found_crossings = (
        []
        if not orders
        else [
            point
            for branch in named_branches
            for point in crossings(branch.name, speeds, branch.frequencies, list(orders))
        ]
    )
    requested = np.array([spin.requested for spin in steps])
    rigid = tuple(dict.fromkeys(motion.name for motion in steps[-1].vibration.known))
    critical = tuple(v for s in steps for v in (*s.passed, *([s.speed] if s.critical and s.requested else [])))
    found_crossings.sort(key=lambda crossing: crossing.speed)
    return Campbell(
        title, speeds, requested, named_branches, tuple(orders), tuple(found_crossings), complete, rigid, critical
    )


def branch_indices(matched_spins: Sequence[tuple[Spin, Match | None]]) -> IntArray:
    """Index (n_branches, n_spins) of every branch among the vibrations of each spin; -1 where it does not exist.

    A branch ends where no shape continues it, and starts at a shape that continues none: the wobble of a free craft and
    the motions of free joints are drift at rest, and oscillate when the craft spins.
    """
    rows = [[k] for k in range(len(matched_spins[0][0].vibration.eigenvalues))]
    for k, (spin, match_to_last) in enumerate(matched_spins[1:], start=1):
        assert match_to_last is not None
        for row in rows:
            row.append(int(match_to_last.to[row[-1]]) if row[-1] >= 0 else -1)
        continued = {row[-1] for row in rows}
        rows += [[-1] * k + [new] for new in range(len(spin.vibration.eigenvalues)) if new not in continued]
    return np.array(rows, np.int64).reshape(len(rows), len(matched_spins))


def _branch(steps: Sequence[Spin], row: IntArray) -> Branch:
    """The branch of these indices, without a name."""
    pairs = list(zip(steps, row, strict=True))
    values = np.array([s.vibration.eigenvalues[k] if k >= 0 else complex(np.nan, np.nan) for s, k in pairs])
    words = tuple(s.words[k] if k >= 0 else "" for s, k in pairs)
    growing = np.array([bool(k >= 0 and s.vibration.growing[k]) for s, k in pairs])
    if steps[0].speed == 0 and row[0] < 0 and words[1:2] == (WOBBLE,):
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
