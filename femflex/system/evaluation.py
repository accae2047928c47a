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

FOLDER = "effectors/"


def evaluation_order(given: Sequence[T]) -> list[T]:
    """Effectors, or controllers, in their order of evaluation; what stands in a circle is left out."""
    waits = {one.name: _awaited(one, given) for one in given}
    out: list[T] = []
    left = list(given)
    while ready := next((one for one in left if not waits[one.name] & {other.name for other in left}), None):
        out.append(ready)
        left.remove(ready)
    return out


def circle_problems(effectors: Sequence[Effector | Controller]) -> list[str]:
    """Sentences on algebraic loops."""
    return [
        *_circle([one for one in effectors if isinstance(one, Effector)], "channels"),
        *_circle([one for one in effectors if isinstance(one, Controller)], "commands of the same instant"),
    ]


def _circle(given: Sequence[T], what: str) -> list[str]:
    placed = {one.name for one in evaluation_order(given)}
    left = [one for one in given if one.name not in placed]
    if not left:
        return []
    waits = {one.name: _awaited(one, given) for one in left}
    path: list[str] = []
    following: str = left[0].name
    while following not in path:
        path.append(following)
        following = min(waits[following] - placed)
    names = " -> ".join([*path[path.index(following) :], following])
    return [
        f"algebraic loop: {names} take each other's {what}, so none of them can be evaluated first; take a state in "
        "place of a channel somewhere in the loop (a lag, a filter, a sensor with a period), or make one block of them"
    ]


def _awaited(one: Effector | Controller, given: Sequence[Effector] | Sequence[Controller]) -> set[str]:
    """Names of the others that come before."""
    if isinstance(one, Effector):
        offered = {f"{e.name}.{c}": e.name for e in given if isinstance(e, Effector) for c in e.channels}
        taken = {offered[name] for name in one.inputs if name in offered}
    else:
        offered = {f"{FOLDER}{c.name}/{k}": c.name for c in given if isinstance(c, Controller) for k in c.commands}
        taken = {offered[path] for path in one.sensors if path in offered} - {one.name}
    return taken
