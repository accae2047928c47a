"""Runs of dofs that always come together in the elements, such as the three translations of a node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import BoolArray, IntArray


@dataclass(frozen=True, eq=False)
class Runs:
    """Dofs of elements (e, l) as runs of consecutive ones.

    first   (n_runs,)  first dof of every run, ascending
    size    (n_runs,)  its number of dofs
    number  (e, r)     runs of the elements
    column  (l,)       index of the element's run that a column belongs to
    within  (l,)       its position in the run
    """

    first: IntArray
    size: IntArray
    number: IntArray
    column: IntArray
    within: IntArray


def find_runs(dofs: IntArray, n_dof: int) -> Runs:
    """The longest runs of columns of dofs (e, l), numbers, that are consecutive in all elements and share none with
    another."""
    starts = np.concatenate([[True], ~(np.diff(dofs, axis=1) == 1).all(axis=0)])
    runs = _runs_from(dofs, starts, n_dof)
    owner = np.full(n_dof, -1, np.int64)
    owner[dofs] = runs.number[:, runs.column]
    length = np.bincount(runs.column)
    disjoint = (owner[dofs] == runs.number[:, runs.column]).all() and (runs.size[runs.number] == length).all()
    return runs if disjoint else _runs_from(dofs, np.ones(dofs.shape[1], bool), n_dof)


def _runs_from(dofs: IntArray, starts: BoolArray, n_dof: int) -> Runs:
    column = np.cumsum(starts) - 1
    begin = np.flatnonzero(starts)
    size_at = np.zeros(n_dof, np.int64)
    size_at[dofs[:, begin]] = np.diff(begin, append=len(starts))
    first = np.flatnonzero(size_at)
    number_at = np.cumsum(size_at > 0) - 1
    return Runs(first, size_at[first], number_at[dofs[:, begin]], column, np.arange(len(starts)) - begin[column])
