"""Poles or multipliers over one value, branch by branch, and the values at which stability changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from femflex.arrays import Array, ComplexArray, IntArray
from femflex.studies.stability.judgement import NONE, Judgement, no_judgement

Progress = Callable[[float], object]

HALVINGS = 30  # of the interval in which stability changes


@dataclass(frozen=True, eq=False)
class Locus:
    """Branches (n, k) of poles [1/s] or multipliers over values (n,), NaN where there are none.

    quantity  "poles" or "multipliers";  name, unit  of the value
    kinds     (n,) see `femflex.studies.stability.judgement`;  growth (n,) [1/s]
    critical  values at which stability changes
    names     (k,) of the modes at the start of the branches, "" where they are not known
    trivial   names of the multipliers that are 1 by symmetry, at the first value; split their largest distance from 1
              among the eigenvalues of the whole matrix at any value
    lost      value at which the equilibrium is no longer found; larger values are not evaluated
    """

    quantity: str
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
    quantity: str = "poles",
    progress: Progress | None = None,
) -> Locus:
    """The locus of a judgement over rising values.

    Poles are assigned to branches from value to value by the least total change; a change of stability between two
    values is located by bisection. Raises ValueError if there is no judgement at any value, and if the number of poles
    changes.
    """
    judgements, lost = _judgements(judge, values, progress)
    valid = [judgement for judgement in judgements if judgement.kind != NONE]
    if not valid:
        raise ValueError(f"nothing can be judged at any value of {name}; at the first: {judgements[0].problem}")
    rows = _branches(values, judgements, name, quantity)
    critical = []
    for k in range(len(values) - 1):
        if (
            NONE not in (judgements[k].kind, judgements[k + 1].kind)
            and judgements[k].stable != judgements[k + 1].stable
        ):
            critical.append(_change(judge, float(values[k]), float(values[k + 1]), judgements[k].stable))
    kinds, growth = (
        np.array([judgement.kind for judgement in judgements]),
        np.array([judgement.growth for judgement in judgements]),
    )
    return Locus(
        quantity, name, unit, np.asarray(values, float), np.array(rows), kinds, growth, tuple(critical),
        valid[0].names(), valid[0].trivial, max(judgement.split for judgement in valid), lost,
    )  # fmt: skip


def _judgements(
    judge: Callable[[float], Judgement], values: Sequence[float], progress: Progress | None
) -> tuple[list[Judgement], float | None]:
    """The judgement at every value, and the value at which an equilibrium is lost: at it and beyond, there is none.

    A craft without an equilibrium under its loads may have another one without them; the number of loads that act must
    stay the same.
    """
    judgements: list[Judgement] = []
    for k, value in enumerate(values):
        judgement = judge(float(value))
        if (
            judgements
            and judgements[-1].about is not None
            and (judgement.lost or judgement.loads < judgements[-1].loads)
        ):
            return [*judgements, *[no_judgement("the equilibrium is lost", True)] * (len(values) - k)], float(value)
        judgements.append(judgement)
        if progress is not None:
            progress(float(k + 1))
    largest = max(judgement.loads for judgement in judgements)
    return [
        judgement if judgement.loads == largest else no_judgement("no equilibrium under the loads", True)
        for judgement in judgements
    ], None


def _branches(values: Sequence[float], judgements: list[Judgement], name: str, quantity: str) -> list[ComplexArray]:
    """Poles or multipliers (k,) at every value, branch by branch; NaN where there is none.

    A known motion, such as that of a joint without a damper, is not among the poles; with the damper its pole starts
    from 0.
    Raises ValueError where the number of states changes.
    """
    valid = [judgement for judgement in judgements if judgement.kind != NONE]
    count, size = max(len(judgement.values) for judgement in valid), valid[0].size
    rows: list[ComplexArray] = []
    last_row: ComplexArray | None = None
    for value, judgement in zip(values, judgements, strict=True):
        if judgement.kind == NONE:
            rows.append(np.full(count, np.nan + 0j))
            continue
        if judgement.size != size:
            raise ValueError(
                f"the craft has {judgement.size} states at {name} = {value:g} and {size} before, and so other "
                f"{quantity}; a locus needs a value that changes none of them"
            )
        row = np.concatenate([judgement.values, np.full(count - len(judgement.values), np.nan + 0j)])
        if last_row is not None:
            row = row[linear_sum_assignment(np.abs(np.nan_to_num(last_row)[:, None] - np.nan_to_num(row)[None]))[1]]
        last_row = row
        rows.append(row)
    return rows


def _change(judge: Callable[[float], Judgement], low: float, high: float, stable: bool) -> float:
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if judge(middle).stable == stable else (low, middle)
    return (low + high) / 2
