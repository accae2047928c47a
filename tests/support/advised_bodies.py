"""Bodies with what is reported of them, as `note`: for tests that read both."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from femflex.advice.advice import warn_of
from femflex.body import FlexibleBody
from femflex.case import Case
from femflex.pipeline.case_bodies import advised_bodies
from femflex.pipeline.decisions import resolve_choices


def noted(body: FlexibleBody, note: str) -> Any:
    """A copy of the body that has the note as an attribute more."""
    body = replace(body)
    object.__setattr__(body, "note", note)
    return body


def noted_body(case: Case, name: str, modes: int | None = None) -> Any:
    """The body of that name as it is in a run of the case, with what is said of it."""
    bodies, notes = advised_bodies(case, [name], modes)
    return noted(bodies[name], notes.get(name, ""))


def noted_system(case: Case) -> Any:
    """The system of a case as `build_system` makes it, its bodies with what is said of them."""
    found = resolve_choices(case)
    warn_of(found.advice)
    notes = found.notes
    bodies = {name: noted(body, notes.get(name, "")) for name, body in found.system.bodies.items()}
    return replace(found.system, bodies=bodies)
