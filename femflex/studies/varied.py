"""A case whose values change from one evaluation to the next, its bodies built once where only numbers change."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from femflex.assembly import build_part
from femflex.assembly.shared import shared_structures
from femflex.case import Case, with_values
from femflex.pipeline.balanced import decided_at_rest
from femflex.pipeline.decisions import decided
from femflex.system import Part, System
from femflex.warning import PhysicsWarning

BUILDING = ("bodies", "materials", "sections")  # tables that change bodies; without them these are built once


@dataclass(frozen=True, eq=False)
class VariedCase:
    """The case before its values are changed, and its bodies; none where the values change more than rigid ones.

    rigid: names of the bodies that are built anew every time.
    """

    case: Case
    bodies: Mapping[str, Part] | None
    rigid: tuple[str, ...] = ()

    @classmethod
    def of(cls, case: Case, paths: Iterable[str]) -> VariedCase:
        """The case whose values at these key paths change; bodies have the strain and shapes the case chooses now."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)
            changed = [path.split(".") for path in paths if path.partition(".")[0] in BUILDING]
            rigid = [keys[1] for keys in changed if keys[0] == "bodies" and _is_rigid(case, keys)]
            if len(rigid) < len(changed):
                return cls(case, None)
            chosen = decided(case, loaded=False).case
            with shared_structures():
                parts = {name: build_part(chosen, name) for name in chosen.bodies}
            return cls(case, parts, tuple(dict.fromkeys(rigid)))

    def bodies_of(self, case: Case) -> Mapping[str, Part] | None:
        """The bodies of the changed case; None where it is to build and choose all of them."""
        if self.bodies is None:
            return None
        return {**self.bodies, **{name: build_part(case, name) for name in self.rigid}}

    def system(self, values: Mapping[str, Any]) -> System:
        """The system with these values at their key paths. Raises CaseError where the case does not take them."""
        case = with_values(self.case, values)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)
            return decided_at_rest(case, self.bodies_of(case)).system


def _is_rigid(case: Case, keys: list[str]) -> bool:
    """Whether a key path ends within the table of a rigid body."""
    return len(keys) > 2 and keys[1] in case.bodies and case.bodies[keys[1]].kind == "rigid"
