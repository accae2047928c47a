"""The order in which effectors and controllers are evaluated, so that each finds the numbers of this instant.

An effector comes after those whose channels are its inputs, a sampled controller after those whose commands are among
its sensors. States need no order: they are known. Where several may come next, the one given first does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from femflex.system.controller import Controller
from femflex.system.effector import Effector

T = TypeVar("T", Effector, Controller)

CHANNEL_FOLDER = "effectors/"


def evaluation_order(items: Sequence[T]) -> list[T]:
    """Return effectors, or controllers, in their order of evaluation; those in a circle are left out."""
    waits = {item.name: _predecessors(item, items) for item in items}
    out: list[T] = []
    waiting = list(items)
    while ready := next(
        (item for item in waiting if not waits[item.name] & {remaining.name for remaining in waiting}), None
    ):
        out.append(ready)
        waiting.remove(ready)
    return out


def algebraic_loop_problems(effectors: Sequence[Effector | Controller]) -> list[str]:
    """Sentences on algebraic loops."""
    return [
        *_algebraic_loop([item for item in effectors if isinstance(item, Effector)], "channels"),
        *_algebraic_loop([item for item in effectors if isinstance(item, Controller)], "commands of the same instant"),
    ]


def _algebraic_loop(items: Sequence[T], what: str) -> list[str]:
    ordered = {item.name for item in evaluation_order(items)}
    cyclic = [item for item in items if item.name not in ordered]
    if not cyclic:
        return []
    waits = {item.name: _predecessors(item, items) for item in cyclic}
    path: list[str] = []
    following: str = cyclic[0].name
    while following not in path:
        path.append(following)
        following = min(waits[following] - ordered)
    names = " -> ".join([*path[path.index(following) :], following])
    states = [name for item in cyclic if item.name in path for name, _ in item.state_names()]
    hint = f", such as {states[0]}" if states and isinstance(cyclic[0], Effector) else ""
    return [
        f"algebraic loop: {names} take each other's {what}, so none of them can be evaluated first; take a state in "
        f"place of an output somewhere in the loop{hint} (of a lag, a filter, a sensor with a period), or make one "
        "block of them"
    ]


def _predecessors(item: Effector | Controller, items: Sequence[Effector] | Sequence[Controller]) -> set[str]:
    """Return the names of the others that come before."""
    if isinstance(item, Effector):
        offered = {f"{e.name}.{c}": e.name for e in items if isinstance(e, Effector) for c in e.channels}
        names = {offered[name] for name in item.inputs if name in offered}
    else:
        offered = {
            f"{CHANNEL_FOLDER}{c.name}/{k}": c.name for c in items if isinstance(c, Controller) for k in c.commands
        }
        names = {offered[path] for path in item.sensors if path in offered} - {item.name}
    return names
