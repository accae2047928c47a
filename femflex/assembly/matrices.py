"""A body of a case from matrices in files."""

from __future__ import annotations

from functools import partial

import numpy as np

from femflex.assembly.acting_loads import ActingLoads
from femflex.assembly.structures import clamp_of, vibrating
from femflex.case.case import Case
from femflex.case.matrices import MatricesTable, MatrixFilesTable
from femflex.case.reduction import FreeFreeTable, NodalTable, StiffTable, Stretchable
from femflex.fem.matrix_structure import MatrixStructure
from femflex.matrices import MatrixModel, Sources, StatedMass, read_matrices
from femflex.matrices.body import matrix_body, without_rounding
from femflex.reduction import ModeSet, nodal, rigid_set
from femflex.reduction.matrices import MatrixBody
from femflex.reduction.modes.damping import Damping


def matrix_model(case: Case, table: MatricesTable) -> MatrixModel:
    """The MatrixModel of a body's files."""
    m = table.matrices
    sources = Sources(file=m) if isinstance(m, str) else _sources(m)
    model = read_matrices(sources, table.units, table.groups, case.path.parent)
    return model if table.spin is None else model.spinning(table.spin.rate, table.spin.axis)


def build_matrix_body(
    case: Case, table: MatricesTable, modes: int | None, damping: Damping | None, turning: set[str]
) -> MatrixBody:
    """The body of a table, with `modes` modes instead of the case's if given, and what its matrices leave open."""
    markers = {name: entry.group or name for name, entry in table.markers.items()}
    r = table.reduction
    named = [*getattr(r, "clamp", {}), *getattr(r, "interfaces", ()), *getattr(r, "loads", {})]
    named += [group for group in getattr(r, "joints", None) or {} if group not in named]
    stated = StatedMass(
        table.mass,
        None if table.center_of_mass is None else np.array(table.center_of_mass),
        None if table.inertia is None else np.array(table.inertia),
    )
    reduce = None if r is None else partial(_modes, table=table, modes=modes)
    return matrix_body(matrix_model(case, table), reduce, named, markers, damping, turning, stated)


def _modes(structure: MatrixStructure, table: MatricesTable, modes: int | None) -> ModeSet:
    r = table.reduction
    if isinstance(r, Stretchable):
        given = without_rounding(structure) if isinstance(r, FreeFreeTable) else structure
        return vibrating(given, r, modes, ActingLoads())
    if isinstance(r, NodalTable):
        return nodal(structure, clamp_of(r.clamp))
    assert isinstance(r, StiffTable)
    return rigid_set(structure.n_dof)


def _sources(m: MatrixFilesTable) -> Sources:
    """The files, with the same keys, and the names that are given."""
    given = m.model_dump()
    names = {role: name for role, name in given.pop("names").items() if name is not None}
    return Sources(**given, names=names)
