"""The levels of a study over derivative shapes: how many of them nonlinear bodies keep in addition to their modes."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import partial

from femflex.body import FlexibleBody
from femflex.case import Case
from femflex.case.body import BodyTable, FlexibleTable
from femflex.case.reduction import Stretchable
from femflex.pipeline.case_bodies import build_body
from femflex.studies.ladder import Built, Ladder, Rung, varied
from femflex.warning import PhysicsWarning

COUNTS = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48)  # tried when none are named, as far as there are so many
EVERY = 10**6  # more than there can be


def derivative_ladder(case: Case, levels: Sequence[int] | None = None) -> Ladder:
    """The ladder over the number of derivative shapes, modes as the case has them.

    Raises ValueError when no body has nonlinear strain and shapes to derive from, CaseError when one cannot be built.
    """
    names = derivative_names(case)
    owns = {_number(build_body(case, name)) for name in names}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # EVERY is more than any set has
        most = max(_number(build_body(with_derivatives_of(case, names, EVERY), name)) for name in names)
    counts = sorted(
        {*(levels or [k for k in COUNTS if k < most] + [most])} - ({0} if _condensed(case, names) else set())
    )
    rungs = (Rung(n, 1.0 + n**2, partial(_built, case, names, n)) for n in counts)
    return Ladder(tuple(names), tuple(rungs), owns.pop() if len(owns) == 1 else None, most)


def derivative_names(case: Case) -> list[str]:
    """Names of the bodies a study over derivative shapes varies. Raises ValueError when there is none."""
    return varied(case, _can, "nonlinear strain with derivatives to vary")


def with_derivatives_of(case: Case, names: Sequence[str], n: int) -> Case:
    """The case with so many derivative shapes in these bodies."""
    bodies = dict(case.bodies)
    for name in names:
        table = bodies[name]
        assert isinstance(table, FlexibleTable) and table.reduction is not None
        reduction = table.reduction.model_copy(update={"derivatives": n or "none"})
        bodies[name] = table.model_copy(update={"reduction": reduction})
    return case.model_copy(update={"bodies": bodies})


def _can(table: BodyTable) -> bool:
    if not isinstance(table, FlexibleTable) or table.cut is not None or table.strain in (None, "linear"):
        return False
    return isinstance(table.reduction, Stretchable)


def _condensed(case: Case, names: Sequence[str]) -> bool:
    """Whether a body lets its derivatives follow, and so needs one."""
    return any(getattr(case.bodies[name], "strain", None) == "condensed" for name in names)


def _number(body: FlexibleBody) -> int:
    return body.kinds.count("derivative")


def _built(case: Case, names: Sequence[str], n: int) -> Built:
    other = with_derivatives_of(case, names, n)
    bodies = {name: build_body(other, name) for name in names}
    built = Built(bodies, 0)
    return Built(bodies, sum(body.n_modes for body in bodies.values()) + built.followers)
