"""A case evaluated with changing values; its bodies are built once if only numbers of rigid ones change."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from femflex.assembly import build_part
from femflex.assembly.shared import shared_structures
from femflex.case import Case, with_values
from femflex.pipeline.case_equilibrium import resolve_at_rest
from femflex.pipeline.decisions import resolve_choices
from femflex.system import Part, System
from femflex.warning import PhysicsWarning

BUILDING = ("bodies", "materials", "sections")  # tables that change bodies; without them these are built once


@dataclass(frozen=True, eq=False)
class VariedCase:
    """The case before its values are changed, and its bodies; None where the values change flexible bodies.

    rigid: names of the bodies that are built again every time.
    """

    case: Case
    bodies: Mapping[str, Part] | None
    rigid: tuple[str, ...] = ()

    @classmethod
    def from_paths(cls, case: Case, paths: Iterable[str]) -> VariedCase:
        """The case with changing values at these key paths; bodies have the strain and shapes that are selected now."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)
            changed = [path.split(".") for path in paths if path.partition(".")[0] in BUILDING]
            rigid = [
                keys[1]
                for keys in changed
                if keys[0] == "bodies"
                and (len(keys) > 2 and keys[1] in case.bodies and (case.bodies[keys[1]].kind == "rigid"))
            ]
            if len(rigid) < len(changed):
                return cls(case, None)
            resolved_case = resolve_choices(case, loaded=False).case
            with shared_structures():
                bodies = {name: build_part(resolved_case, name) for name in resolved_case.bodies}
            return cls(case, bodies, tuple(dict.fromkeys(rigid)))

    def bodies_of(self, case: Case) -> Mapping[str, Part] | None:
        """The bodies of the changed case; None where all of them must be built."""
        if self.bodies is None:
            return None
        return {**self.bodies, **{name: build_part(case, name) for name in self.rigid}}

    def system(self, values: Mapping[str, Any]) -> System:
        """The system with these values at their key paths. Raises CaseError where the case does not take them."""
        case = with_values(self.case, values)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)
            return resolve_at_rest(case, self.bodies_of(case)).system
