"""Bodies with what is said of them beside: for tests that read both."""

from __future__ import annotations

from typing import Any

from femflex.advice import warn_of
from femflex.body import FlexibleBody
from femflex.case import Case
from femflex.pipeline.decisions import advised_bodies, decided


class NotedBody:
    """A body and its note; all else is the body's."""

    def __init__(self, body: FlexibleBody, note: str) -> None:
        self.body, self.note = body, note

    def __getattr__(self, name: str) -> Any:
        return getattr(self.body, name)


class NotedSystem:
    """The system of a case, its bodies with their notes; doubts are given as warnings."""

    def __init__(self, case: Case) -> None:
        self.decided = decided(case)
        warn_of(self.decided.advice)
        self.system, notes = self.decided.system, self.decided.notes
        self.bodies = {name: NotedBody(body, notes.get(name, "")) for name, body in self.system.bodies.items()}

    def __getattr__(self, name: str) -> Any:
        return getattr(self.system, name)


def noted_body(case: Case, name: str, modes: int | None = None) -> Any:
    """The body of that name as it is in a run of the case, with what is said of it."""
    bodies, notes = advised_bodies(case, [name], modes)
    return NotedBody(bodies[name], notes.get(name, ""))


def noted_system(case: Case) -> Any:
    """The system of a case as `build_system` makes it, its bodies with what is said of them."""
    return NotedSystem(case)
