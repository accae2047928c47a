"""Connections besides the tree: loops, constraints, springs; where they act, and checks of them."""

from __future__ import annotations

from collections.abc import Sequence

from femflex.system.constraint import Nonholonomic
from femflex.system.joint import Joint
from femflex.system.loop import closure_problems
from femflex.system.orbit import Orbit
from femflex.system.spring import Spring

Tie = tuple[str, str, str, str | None, str]  # what it is called, body and marker, parent and its marker


def ties(loops: Sequence[Joint], constraints: Sequence[Nonholonomic], springs: Sequence[Spring]) -> list[Tie]:
    """Everything that acts between two markers."""
    out: list[Tie] = [(f"loop {j.label!r}", j.child, j.child_marker, j.parent, j.parent_marker) for j in loops]
    for c in constraints:
        if c.body is not None:
            out.append((f"constraint {c.name!r}", c.body, c.marker, c.parent, c.parent_marker))
    return out + [(f"spring {s.name!r}", s.body, s.marker, s.parent, s.parent_marker) for s in springs]


def tie_markers(
    loops: Sequence[Joint], constraints: Sequence[Nonholonomic], springs: Sequence[Spring]
) -> list[tuple[str, str, str]]:
    """(what, body, marker) of every end on a body."""
    out = []
    for who, body, marker, parent, parent_marker in ties(loops, constraints, springs):
        out.append((who, body, marker))
        if parent is not None:
            out.append((who, parent, parent_marker))
    return out


def tie_problems(
    loops: Sequence[Joint], constraints: Sequence[Nonholonomic], springs: Sequence[Spring], orbit: Orbit | None
) -> list[str]:
    """Sentences on loops, constraints and springs that cannot be."""
    out = [problem for loop in loops for problem in closure_problems(loop)]
    for who, body, _, parent, _ in ties(loops, constraints, springs):
        if body == parent:
            out.append(
                f"{who} joins body {body!r} to itself; name two bodies, or leave the parent out for the base frame"
            )
        if parent is None and orbit is not None and not orbit.free:
            out.append(
                f"{who} ties body {body!r} to the base frame, whose place a specified orbit does not fix; "
                "tie it to a body"
            )
    for kind, names in (
        ("loops or constraints", [j.label for j in loops] + [c.name for c in constraints]),
        ("springs", [s.name for s in springs]),
    ):
        doubles = sorted({n for n in names if names.count(n) > 1})
        out += [f"{names.count(n)} {kind} have the name {n!r}; give each a name of its own" for n in doubles]
    return out
