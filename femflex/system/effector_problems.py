"""Checks of the effectors and controllers of a system: problems in sentences."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING

from femflex.system.controller import Controller
from femflex.system.effector import Effector
from femflex.system.evaluation import algebraic_loop_problems
from femflex.system.joint import Joint

if TYPE_CHECKING:
    from femflex.body import FlexibleBody


MAX_LISTED = 20  # known names in a sentence


def effector_problems(
    effectors: Sequence[Effector | Controller],
    bodies: dict[str, FlexibleBody],
    joints: Sequence[Joint],
    built_in: Sequence[str] = (),
) -> list[str]:
    """Return sentences on names that nothing in the system has. built_in: signals in addition to those of effectors."""
    names = [effector.name for effector in effectors]
    out = [
        f"{names.count(n)} effectors have the name {n!r}; give each a name of its own"
        for n in sorted(set(names))
        if names.count(n) > 1
    ]
    freedoms = movable_freedoms(joints)
    states = [name for effector in effectors for name, _ in effector.state_names()]
    # memory and times of sampled controllers are no signals to choose from
    listed = [f"{e.name}.{s}" for e in effectors for s in (e.states if isinstance(e, Effector) else e.commands)]
    signals = [*built_in, *listed, *(f"{e.name}.{c}" for e in effectors if isinstance(e, Effector) for c in e.channels)]
    inputs = {*signals, *states}
    for effector in effectors:
        if not isinstance(effector, Effector):
            continue
        who = kind_and_name(effector)
        for body, marker in effector.markers:
            if body not in bodies:
                out.append(f"body {body!r} of {who} does not exist; bodies are {sorted(bodies)}")
            elif marker not in bodies[body].markers:
                marker_names = sorted(bodies[body].markers)
                out.append(f"marker {marker!r} of {who} is not on body {body!r}; its markers are {marker_names}")
        out += [
            unknown_name_text(f"degree of freedom {name!r} of {who} is not a slide or turn of a joint", name, freedoms)
            for name in effector.freedoms
            if name not in freedoms
        ]
        out += [unknown_name_text(f"input {name!r} of {who} is neither a state nor a channel", name, signals)
                for name in dict.fromkeys(effector.inputs) if name not in inputs]  # fmt: skip
    return out or algebraic_loop_problems(effectors)


def kind_and_name(effector: Effector) -> str:
    """Return the kind of an effector and its name, as in "sensor 'star'"."""
    name = effector.name.removesuffix("_exact") if effector.kind == "sensor" else effector.name  # of a sampled sensor
    return f"{effector.kind} {name!r}"


def movable_freedoms(joints: Sequence[Joint]) -> list[str]:
    """Return names of joint coordinates along which effectors may act; on balls they act only by torques at markers."""
    return [
        name for joint in joints for name in joint.freedom_names()[: len(joint.translations) + len(joint.rotations)]
    ]


def unknown_name_text(what: str, name: str, known_names: Sequence[str]) -> str:
    """A sentence on a name that is not known, with the nearest one."""
    matches = get_close_matches(name, known_names, n=1)
    hint = f"did you mean {matches[0]!r}? " if matches else ""
    more = ", ..." if len(known_names) > MAX_LISTED else ""
    return f"{what}; {hint}known are {', '.join(known_names[:MAX_LISTED]) or 'none'}{more}"
