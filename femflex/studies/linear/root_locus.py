"""Poles of the linear model of a case over one of its values: the root locus."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from femflex.arrays import ComplexArray
from femflex.case import Case
from femflex.studies.linear.linear_model import linear_model
from femflex.studies.varied_case import VariedCase


@dataclass(frozen=True, eq=False)
class RootLocus:
    """Poles (n_values, n) [1/s] of a case whose value at a key path takes each of `values`; a column is one branch."""

    path: str
    values: tuple[Any, ...]
    poles: ComplexArray


def root_locus(case: Case, path: str, values: Sequence[Any]) -> RootLocus:
    """The poles of a case about its equilibrium over the values at a key path, such as "joints.0.damping".

    Poles are assigned to branches from value to value by the least total change. Raises CaseError for a path or a value
    that the case does not take, ValueError where the number of states changes, and as `femflex.equilibrium`.
    """
    if not len(values):
        raise ValueError(f"a root locus over {path} got no values; give it at least one")
    rows: list[ComplexArray] = []
    varied = VariedCase.from_paths(case, [path])
    for value in values:
        model = linear_model(varied.system({path: value}), [], [])
        poles = model.eigenvalues()
        if rows and len(poles) != len(rows[-1]):
            raise ValueError(
                f"the model has {len(poles)} states at {path} = {value} and {len(rows[-1])} before; a root locus "
                "needs a value that changes none of them"
            )
        if rows:
            poles = poles[linear_sum_assignment(np.abs(rows[-1][:, None] - poles[None]))[1]]
        rows.append(poles)
    return RootLocus(path, tuple(values), np.array(rows, complex).reshape(len(rows), -1))
