"""Poles or multipliers over one value, branch by branch, and the values at which stability changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from femflex.arrays import Array, ComplexArray, IntArray
from femflex.studies.stability.judgement import NONE, Judgement, no_judgement
from femflex.studies.tracking import tracked_values

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
    for (low, before), (high, after) in pairwise(zip(values, judgements, strict=True)):
        if NONE not in (before.kind, after.kind) and before.stable != after.stable:
            critical.append(_change(judge, float(low), float(high), before.stable))
    kinds, growth = (np.array([getattr(judgement, key) for judgement in judgements]) for key in ("kind", "growth"))
    return Locus(
        quantity, name, unit, np.asarray(values, float), rows, kinds, growth, tuple(critical),
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
        had_equilibrium = bool(judgements) and judgements[-1].about is not None
        if had_equilibrium and (judgement.lost or judgement.loads < judgements[-1].loads):
            return [*judgements, *[no_judgement("the equilibrium is lost", True)] * (len(values) - k)], float(value)
        judgements.append(judgement)
        if progress is not None:
            progress(float(k + 1))
    largest = max(judgement.loads for judgement in judgements)
    return [
        judgement if judgement.loads == largest else no_judgement("no equilibrium under the loads", True)
        for judgement in judgements
    ], None


def _branches(values: Sequence[float], judgements: list[Judgement], name: str, quantity: str) -> ComplexArray:
    """Poles or multipliers (k,) at every value, branch by branch; NaN where there is none.

    A known motion, such as that of a joint without a damper, is not among the poles; with the damper its pole starts
    from 0.
    Raises ValueError where the number of states changes.
    """
    valid = [judgement for judgement in judgements if judgement.kind != NONE]
    count, size = max(len(judgement.values) for judgement in valid), valid[0].size
    rows: list[ComplexArray] = []
    for value, judgement in zip(values, judgements, strict=True):
        if judgement.kind != NONE and judgement.size != size:
            raise ValueError(
                f"the craft has {judgement.size} states at {name} = {value:g} and {size} before, and so other "
                f"{quantity}; a locus needs a value that changes none of them"
            )
        own = judgement.values if judgement.kind != NONE else judgement.values[:0]
        rows.append(np.concatenate([own, np.full(count - len(own), np.nan + 0j)]))
    return tracked_values(rows)


def _change(judge: Callable[[float], Judgement], low: float, high: float, stable: bool) -> float:
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if judge(middle).stable == stable else (low, middle)
    return (low + high) / 2
