"""The levels of a study over segments: into how many bodies a line is cut."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from femflex.assembly import build_part
from femflex.case import Case
from femflex.case.body import FlexibleTable
from femflex.studies.ladder import Built, Ladder, Rung, varied
from femflex.system import Segments


def segment_ladder(case: Case, levels: Sequence[int] | None = None) -> Ladder:
    """The ladder over the number of segments, from a quarter of the case's own to four times it unless it says others.

    Raises ValueError when no body is cut, CaseError when one cannot be cut so.
    """
    names = segment_names(case)
    owns = {_number(case, name) for name in names}
    own = max(owns)
    wanted = levels or (case.study.segments if case.study is not None else None)
    counts = sorted({*(wanted or [max(1, own // 4), max(1, own // 2), own, 2 * own, 4 * own])})
    rungs = (Rung(k, float(k), partial(_built, case, names, k)) for k in counts)
    return Ladder(tuple(names), tuple(rungs), own if len(owns) == 1 else None)


def segment_names(case: Case) -> list[str]:
    """Names of the bodies a study over segments varies. Raises ValueError when there is none."""
    return varied(case, lambda table: isinstance(table, FlexibleTable) and bool(table.cut), "line cut into segments")


def _number(case: Case, name: str) -> int:
    """Segments of a body of the case."""
    table = case.bodies[name]
    assert isinstance(table, FlexibleTable) and table.cut is not None and table.cut.segments is not None
    return table.cut.segments


def _built(case: Case, names: Sequence[str], k: int) -> Built:
    parts = {name: build_part(case, name, segments=k) for name in names}
    pieces = [piece for part in parts.values() if isinstance(part, Segments) for piece in part.bodies]
    return Built(parts, sum(piece.n_modes for piece in pieces))
