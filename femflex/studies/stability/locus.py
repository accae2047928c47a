"""Poles or multipliers over one value, branch by branch, and the values at which stability changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from femflex.studies.stability.judgement import NONE, Judgement

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
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
    """

    of: str
    name: str
    unit: str
    values: Array
    branches: Complex
    kinds: NDArray[np.int64]
    growth: Array
    critical: tuple[float, ...]
    names: tuple[str, ...] = ()
    trivial: tuple[str, ...] = ()
    split: float = 0.0


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
    found: list[Judgement] = []
    for k, value in enumerate(values):
        found.append(judge(float(value)))
        if progress is not None:
            progress(float(k + 1))
    good = [one for one in found if one.kind != NONE]
    if not good:
        raise ValueError(f"nothing can be judged at any value of {name}; at the first: {found[0].problem}")
    rows, last = [], None
    for value, one in zip(values, found, strict=True):
        if one.kind == NONE:
            rows.append(np.full(len(good[0].values), np.nan + 0j))
            continue
        row = one.values
        if len(row) != len(good[0].values):
            raise ValueError(
                f"there are {len(row)} {of} at {name} = {value:g} and {len(good[0].values)} before; a locus needs a "
                "value that changes none of them"
            )
        if last is not None:
            row = row[linear_sum_assignment(np.abs(last[:, None] - row[None]))[1]]
        last = row
        rows.append(row)
    critical = []
    for k in range(len(values) - 1):
        if NONE not in (found[k].kind, found[k + 1].kind) and found[k].stable != found[k + 1].stable:
            critical.append(_change(judge, float(values[k]), float(values[k + 1]), found[k].stable))
    kinds, growth = np.array([one.kind for one in found]), np.array([one.growth for one in found])
    return Locus(
        of, name, unit, np.asarray(values, float), np.array(rows), kinds, growth, tuple(critical), good[0].names()
    )


def _change(judge: Callable[[float], Judgement], low: float, high: float, stable: bool) -> float:
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if judge(middle).stable == stable else (low, middle)
    return (low + high) / 2
