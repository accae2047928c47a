"""Branches tracked over a value: which vibration, or which eigenvalue, at one value continues which at the one before.

Vibrations are followed by the likeness of their shapes (Campbell diagrams, diagrams over a value), with further values
in between where shapes change fast; poles and multipliers without shapes by the least total change (root loci).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from femflex.arrays import Array, ComplexArray, IntArray
from femflex.linear.equilibrium import EquilibriumError
from femflex.linear.small_motions import SmallMotions

ONE = 1e-6  # relative difference of frequencies below which shapes may mix arbitrarily
SINGLE = 1e-2  # weight of the MAC of single shapes, which decides within a space of mixtures
STEADY = 3.0  # weight of frequency differences between values as close as possible, where no frequency jumps
NUDGE = 1e-6  # weight of frequency differences, which decides only between equal MACs
ALIKE = 0.8  # smallest MAC of a shape that is tracked from one value to the next
HALVINGS = 6  # of a step, at most: a change within a 64th of it counts as a crossing


@dataclass(frozen=True, eq=False)
class Step:
    """Small motions at one value of a diagram.

    value      speed [rad/s], or the value that is varied
    requested  whether it was requested, or is an intermediate one
    x          (n_x,) the equilibrium
    vibration  the small motions, with damping
    words      (n,) character of each of them, see `femflex.linear.character`
    critical   whether its stiffness is singular: the motions are those just below
    passed     requested values before this one that have no equilibrium
    links      the k-th vibration of the step before continues as the `links[k]`-th, -1 where it is lost; empty first
    """

    value: float
    requested: bool
    x: Array
    vibration: SmallMotions
    words: tuple[str, ...]
    critical: bool = False
    passed: tuple[float, ...] = ()
    links: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))


def tracked_steps(
    step_at: Callable[[float, Array | None, bool], Step],
    values: Sequence[float],
    count: int,
    progress: Callable[[float], None] | None = None,
    passing: bool = False,
) -> Iterator[Step]:
    """Small motions at every value in turn, linked with those of the value before.

    step_at: returns those at a value, from a state (n_x,) [SI] nearby, and whether the value was requested; passing: a
    value without equilibrium between others is skipped. If one of the `count` lowest shapes differs too much from that
    before, intermediate values are added.
    """
    last: Step | None = None
    passed: tuple[float, ...] = ()
    for value in values:
        try:
            step = replace(step_at(value, None if last is None else last.x, True), passed=passed)
        except EquilibriumError:
            if not passing or last is None or value == values[-1]:
                raise
            passed = (*passed, value)
            continue
        if last is None:
            yield step
        else:
            yield from _linked_steps(step_at, (last, step), count, 0 if passed else HALVINGS)
        last, passed = step, ()
        if progress is not None:
            progress(value)


def _linked_steps(
    step_at: Callable[[float, Array | None, bool], Step], ends: tuple[Step, Step], count: int, halvings: int
) -> Iterator[Step]:
    """The second of two steps, after as many intermediate ones as are needed to track shapes from one to the next."""
    lower, upper = ends
    links, worst = linked_vibrations(lower.vibration, upper.vibration, count, close=halvings == 0)
    if worst >= ALIKE or halvings == 0:
        yield replace(upper, links=links)
        return
    middle = step_at((lower.value + upper.value) / 2, lower.x, False)
    yield from _linked_steps(step_at, (lower, middle), count, halvings - 1)
    yield from _linked_steps(step_at, (middle, upper), count, halvings - 1)


def linked_vibrations(
    before: SmallMotions, after: SmallMotions, count: int, close: bool = False
) -> tuple[IntArray, float]:
    """The assignment (n_before,) with the largest MACs, and the least MAC among the `count` lowest of both.

    close: between two values so close that frequencies hardly change; each is assigned to one of similar frequency.
    """
    single, mixed = modal_assurance(before, after)
    a, b = np.abs(before.eigenvalues), np.abs(after.eigenvalues)
    difference = np.abs(a[:, None] - b) / np.maximum(np.maximum(a[:, None], b), 1e-300)
    rows, columns = linear_sum_assignment((STEADY if close else NUDGE) * difference - SINGLE * single - mixed)
    links = np.full(len(a), -1, np.int64)
    links[rows] = columns
    counted = (rows < count) | (columns < count)
    return links, float(mixed[rows, columns][counted].min(initial=1.0))


def modal_assurance(before: SmallMotions, after: SmallMotions) -> tuple[Array, Array]:
    """|conj(phi_i) . M phi_j|^2 (n_before, n_after) of mass-normalised shapes: the mass-weighted MAC.

    It is returned for single shapes, and with mixtures allowed. Shapes of one frequency, such as flap and lag of a
    round blade at rest, may be mixed arbitrarily, so the part of phi_j within their space counts.
    """
    cross = before.shapes.conj().T @ after.M @ after.shapes
    single = np.minimum(np.abs(cross) ** 2, 1.0)
    mixed = np.maximum(
        _assurance_of_mixtures(before, cross, single), _assurance_of_mixtures(after, cross.conj().T, single.T).T
    )
    return single, np.minimum(mixed, 1.0)


def _assurance_of_mixtures(vibration: SmallMotions, cross: ComplexArray, single: Array) -> Array:
    """MAC (n, n_other) with respect to the space of all shapes of the frequency of each."""
    size = np.abs(vibration.eigenvalues)
    differences = np.abs(vibration.eigenvalues[:, None] - vibration.eigenvalues)
    is_equal = differences <= ONE * np.maximum(size[:, None], size)
    out = single.copy()
    for k in np.flatnonzero(is_equal.sum(axis=1) > 1):
        equal_shapes = vibration.shapes[:, is_equal[k]]
        gram = equal_shapes.conj().T @ vibration.M @ equal_shapes
        coefficients = np.linalg.lstsq(gram, cross[is_equal[k]], rcond=1e-9)[0]
        out[k] = np.einsum("ij,ij->j", cross[is_equal[k]].conj(), coefficients).real
    return out


def branch_indices(steps: Sequence[Step]) -> IntArray:
    """Index (n_branches, n_steps) of every branch among the vibrations of each step; -1 where it does not exist.

    A branch ends where no shape continues it, and starts at a shape that continues none: the wobble of a free craft and
    the motions of free joints are drift at rest, and oscillate when the craft spins.
    """
    rows = [[k] for k in range(len(steps[0].vibration.eigenvalues))]
    for k, step in enumerate(steps[1:], start=1):
        for row in rows:
            row.append(int(step.links[row[-1]]) if row[-1] >= 0 else -1)
        continued = {row[-1] for row in rows}
        rows += [[-1] * k + [new] for new in range(len(step.vibration.eigenvalues)) if new not in continued]
    return np.array(rows, np.int64).reshape(len(rows), len(steps))


def tracked_values(rows: Sequence[ComplexArray]) -> ComplexArray:
    """Eigenvalues (n_values, n) with a branch in each column, by the least total change from row to row.

    A row of nan, where there is no value, is skipped; single ones, as of a pole that is not there yet, count as 0.
    """
    tracked: list[ComplexArray] = []
    last: ComplexArray | None = None
    for row in rows:
        if len(row) and not np.isfinite(row).any():
            tracked.append(row)
            continue
        if last is not None:
            row = row[linear_sum_assignment(np.abs(np.nan_to_num(last)[:, None] - np.nan_to_num(row)))[1]]
        last = row
        tracked.append(row)
    return np.array(tracked, complex).reshape(len(tracked), -1)
