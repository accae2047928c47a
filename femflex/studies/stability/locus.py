"""Poles or multipliers over one value, branch by branch, and the values at which stability changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from femflex.arrays import Array, ComplexArray, IntArray
from femflex.studies.stability.judgement import NONE, Judgement, none

Progress = Callable[[float], object]

HALVINGS = 30  # of the interval in which stability changes


@dataclass(frozen=True, eq=False)
class Locus:
    """Branches (n, k) of poles [1/s] or multipliers over values (n,), NaN where there are none.

    of        "poles" or "multipliers";  name, unit  of the value
    kinds     (n,) see `femflex.studies.stability.judgement`;  growth (n,) [1/s]
    critical  values at which stability changes
    names     (k,) of the modes that branches begin as, "" where they are not known
    trivial   names of the multipliers that are 1 by symmetry, at the first value; split their largest distance from 1
              among the eigenvalues of the whole matrix at any value
    lost      value at which the equilibrium that was there before is not found; those beyond it are not looked at
    """

    of: str
    name: str
    unit: str
    values: Array
    branches: ComplexArray
    kinds: IntArray
    growth: Array
    critical: tuple[float, ...]
    names: tuple[str, ...] = ()
    trivial: tuple[str, ...] = ()
    split: float = 0.0
    lost: float | None = None


def stability_locus(
    judge: Callable[[float], Judgement],
    values: Sequence[float],
    name: str = "value",
    unit: str = "",
    of: str = "poles",
    progress: Progress | None = None,
) -> Locus:
    """The locus of a judgement over rising values.

    Branches go from value to value by the least change of all together; a change of stability between two values is
    found by bisection. Raises ValueError where nothing can be judged at any value, and where the number of poles
    changes.
    """
    found, lost = _judged(judge, values, progress)
    good = [one for one in found if one.kind != NONE]
    if not good:
        raise ValueError(f"nothing can be judged at any value of {name}; at the first: {found[0].problem}")
    rows = _branches(values, found, name, of)
    critical = []
    for k in range(len(values) - 1):
        if NONE not in (found[k].kind, found[k + 1].kind) and found[k].stable != found[k + 1].stable:
            critical.append(_change(judge, float(values[k]), float(values[k + 1]), found[k].stable))
    kinds, growth = np.array([one.kind for one in found]), np.array([one.growth for one in found])
    return Locus(
        of, name, unit, np.asarray(values, float), np.array(rows), kinds, growth, tuple(critical),
        good[0].names(), good[0].trivial, max(one.split for one in good), lost,
    )  # fmt: skip


def _judged(
    judge: Callable[[float], Judgement], values: Sequence[float], progress: Progress | None
) -> tuple[list[Judgement], float | None]:
    """The judgement at every value, and the value at which an equilibrium is lost: at it and beyond, there is none.

    Without an equilibrium under its loads a craft may have one without them, which is another: as many loads act all
    along.
    """
    found: list[Judgement] = []
    for k, value in enumerate(values):
        one = judge(float(value))
        if found and found[-1].about is not None and (one.lost or one.loads < found[-1].loads):
            return [*found, *[none("the equilibrium is lost", True)] * (len(values) - k)], float(value)
        found.append(one)
        if progress is not None:
            progress(float(k + 1))
    most = max(one.loads for one in found)
    return [one if one.loads == most else none("no equilibrium under the loads", True) for one in found], None


def _branches(values: Sequence[float], found: list[Judgement], name: str, of: str) -> list[ComplexArray]:
    """Poles or multipliers (k,) at every value, branch by branch; NaN where a branch is a known motion, or nothing is.

    A known motion, such as that of a joint without a damper, is no pole, and becomes one with the damper: from 0.
    Raises ValueError where the number of states changes.
    """
    good = [one for one in found if one.kind != NONE]
    count, size = max(len(one.values) for one in good), good[0].size
    rows: list[ComplexArray] = []
    last: ComplexArray | None = None
    for value, one in zip(values, found, strict=True):
        if one.kind == NONE:
            rows.append(np.full(count, np.nan + 0j))
            continue
        if one.size != size:
            raise ValueError(
                f"the craft has {one.size} states at {name} = {value:g} and {size} before, and so other {of}; a locus "
                "needs a value that changes none of them"
            )
        row = np.concatenate([one.values, np.full(count - len(one.values), np.nan + 0j)])
        if last is not None:
            row = row[linear_sum_assignment(np.abs(np.nan_to_num(last)[:, None] - np.nan_to_num(row)[None]))[1]]
        last = row
        rows.append(row)
    return rows


def _change(judge: Callable[[float], Judgement], low: float, high: float, stable: bool) -> float:
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if judge(middle).stable == stable else (low, middle)
    return (low + high) / 2
