"""Build the loops of a case."""

from __future__ import annotations

from femflex.case.case import Case
from femflex.noun.problems import CaseError, Problem, quoted_names
from femflex.system import Joint

CUT_JOINT_KEYS = {"kind", "child", "parent", "child_marker", "parent_marker", "name", "axis", "axes", "play"}


def build_loops(case: Case) -> tuple[Joint, ...]:
    """The cut joints of [[loops]]. Raises CaseError for keys that a cut joint does not have."""
    problems = []
    for table in case.loops:
        extra = sorted(table.model_fields_set - CUT_JOINT_KEYS)
        if extra:
            where = f"loops[{table.name or table.child}].{extra[0]}"
            text = (
                f"found {quoted_names(extra)}; a loop has no coordinates of its own. Set them on a joint of "
                "[[joints]], or cut the loop elsewhere"
            )
            problems.append(Problem(where, text))
    if problems:
        raise CaseError(case.path.name, problems)
    return tuple(table.joint(case.path.parent) for table in case.loops)
