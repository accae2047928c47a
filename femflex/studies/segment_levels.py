"""Levels of a study over the number of segments into which a line is cut."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from femflex.assembly import build_part
from femflex.case import Case
from femflex.case.body import FlexibleTable
from femflex.studies.levels import Level, LevelBodies, LevelSet, varied_names
from femflex.system import Segments


def segment_levels(case: Case, levels: Sequence[int] | None = None) -> LevelSet:
    """The levels over the number of segments: by default from a quarter of the case's own number to four times it.

    Raises ValueError when no body is cut, CaseError when one cannot be cut so.
    """
    names = segment_names(case)
    case_counts = {_segment_count(case, name) for name in names}
    case_count = max(case_counts)
    requested = levels or (case.study.segments if case.study is not None else None)
    counts = sorted(
        {*(requested or [max(1, case_count // 4), max(1, case_count // 2), case_count, 2 * case_count, 4 * case_count])}
    )
    level_list = (Level(k, float(k), partial(_level_bodies, case, names, k)) for k in counts)
    return LevelSet(tuple(names), tuple(level_list), case_count if len(case_counts) == 1 else None)


def segment_names(case: Case) -> list[str]:
    """Names of the bodies that a study over segments varies. Raises ValueError when there is none."""
    return varied_names(
        case, lambda table: isinstance(table, FlexibleTable) and bool(table.segmented_member), "line cut into segments"
    )


def _segment_count(case: Case, name: str) -> int:
    """Number of segments of a body of the case."""
    table = case.bodies[name]
    assert (
        isinstance(table, FlexibleTable)
        and table.segmented_member is not None
        and table.segmented_member.segments is not None
    )
    return table.segmented_member.segments


def _level_bodies(case: Case, names: Sequence[str], k: int) -> LevelBodies:
    built_parts = {name: build_part(case, name, segments=k) for name in names}
    pieces = [
        piece for built_part in built_parts.values() if isinstance(built_part, Segments) for piece in built_part.bodies
    ]
    return LevelBodies(built_parts, sum(piece.n_modes for piece in pieces))
