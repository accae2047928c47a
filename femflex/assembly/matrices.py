"""Build a body of a case from mass and stiffness matrices in files."""

from __future__ import annotations

from functools import partial

import numpy as np

from femflex.case.case import Case
from femflex.case.matrices import MatricesTable
from femflex.fem.matrix_structure import MatrixStructure
from femflex.matrices import MatrixModel, StatedMass, read_matrices
from femflex.matrices.body import matrix_body, without_rounding
from femflex.reduction import ModeSet
from femflex.reduction.matrices import MatrixBody
from femflex.reduction.methods import FreeFree, Nodal, Stiff, Stretchable


def matrix_model(case: Case, table: MatricesTable) -> MatrixModel:
    """The MatrixModel of the files of a body, with its spin."""
    model = read_matrices(table.matrices, table.units, table.groups, case.path.parent)
    return model if table.spin is None else model.spinning(table.spin.rate, table.spin.axis)


def build_matrix_body(case: Case, table: MatricesTable, modes: int | None, turning: set[str]) -> MatrixBody:
    """The body of a table, with `modes` modes instead of the case's if given, and notes on it."""
    markers = {name: entry.group or name for name, entry in table.markers.items()}
    r = table.reduction
    named = [*getattr(r, "clamp", {}), *getattr(r, "interfaces", ()), *getattr(r, "loads", {})]
    named += [group for group in getattr(r, "joints", None) or {} if group not in named]
    stated = StatedMass(
        table.mass,
        None if table.center_of_mass is None else np.array(table.center_of_mass),
        None if table.inertia is None else np.array(table.inertia),
    )
    reduce = None if r is None else partial(_modes_of_matrices, table=table, modes=modes)
    return matrix_body(matrix_model(case, table), reduce, named, markers, table.damping, turning, stated)


def _modes_of_matrices(structure: MatrixStructure, table: MatricesTable, modes: int | None) -> ModeSet:
    r = table.reduction
    if isinstance(r, Stretchable):
        smoothed = without_rounding(structure) if isinstance(r, FreeFree) else structure
        return r.vibration_set(smoothed, modes)
    assert isinstance(r, Nodal | Stiff)
    return r.shapes(structure)[1]
