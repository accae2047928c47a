"""Levels of a study over the number of derivative shapes of nonlinear bodies, in addition to their modes."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import partial

from femflex.body import FlexibleBody
from femflex.case import Case
from femflex.case.body import BodyTable, FlexibleTable
from femflex.case.reduction import Stretchable
from femflex.pipeline.case_bodies import build_body
from femflex.studies.levels import Level, LevelBodies, LevelSet, varied_names
from femflex.warning import PhysicsWarning

COUNTS = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48)  # default numbers, up to the largest possible one
EVERY = 10**6  # more than any body can have


def derivative_levels(case: Case, levels: Sequence[int] | None = None) -> LevelSet:
    """The levels over the number of derivative shapes, with the case's number of modes.

    Raises ValueError when no body has nonlinear strain and shapes to derive from, CaseError when one cannot be built.
    """
    names = derivative_names(case)
    case_counts = {_derivative_count(build_body(case, name)) for name in names}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # EVERY is more than any set has
        largest = max(_derivative_count(build_body(with_derivative_count(case, names, EVERY), name)) for name in names)
    counts = sorted(
        {*(levels or [k for k in COUNTS if k < largest] + [largest])}
        - ({0} if _has_condensed_body(case, names) else set())
    )
    level_list = (Level(n, 1.0 + n**2, partial(_level_bodies, case, names, n)) for n in counts)
    return LevelSet(tuple(names), tuple(level_list), case_counts.pop() if len(case_counts) == 1 else None, largest)


def derivative_names(case: Case) -> list[str]:
    """Names of the bodies that a study over derivative shapes varies. Raises ValueError when there is none."""
    return varied_names(case, _has_derivatives, "nonlinear strain with derivatives to vary")


def with_derivative_count(case: Case, names: Sequence[str], n: int) -> Case:
    """The case with n derivative shapes in each of these bodies."""
    bodies = dict(case.bodies)
    for name in names:
        table = bodies[name]
        assert isinstance(table, FlexibleTable) and table.reduction is not None
        reduction = table.reduction.model_copy(update={"derivatives": n or "none"})
        bodies[name] = table.model_copy(update={"reduction": reduction})
    return case.model_copy(update={"bodies": bodies})


def _has_derivatives(table: BodyTable) -> bool:
    if not isinstance(table, FlexibleTable) or table.segmented_member is not None or table.strain in (None, "linear"):
        return False
    return isinstance(table.reduction, Stretchable)


def _has_condensed_body(case: Case, names: Sequence[str]) -> bool:
    """Whether a body is condensed, so that it needs at least one derivative shape."""
    return any(getattr(case.bodies[name], "strain", None) == "condensed" for name in names)


def _derivative_count(body: FlexibleBody) -> int:
    return body.kinds.count("derivative")


def _level_bodies(case: Case, names: Sequence[str], n: int) -> LevelBodies:
    changed = with_derivative_count(case, names, n)
    bodies = {name: build_body(changed, name) for name in names}
    level_bodies = LevelBodies(bodies, 0)
    return LevelBodies(bodies, sum(body.n_modes for body in bodies.values()) + level_bodies.followers)
