"""Signals that the tables of a case take, such as the command of a wheel, and those among them that are none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from femflex.case.case import Case
from femflex.case.problems import Problem, suggestion_text
from femflex.system import Controller, Effector
from femflex.system.effector import ACCOUNTS

KINDS = ("controllers", "sensors", "wheels", "gyros", "thrusters")
KEYS = ("command", "rates", "angles", "slew_angle", "signal", "inputs", "error", "rate", "momentum")
REPORTED = ("effort", "power", *ACCOUNTS)  # of every effector, for what samples


def signal_problems(case: Case, acting: Sequence[Effector | Controller]) -> list[Problem]:
    """The signals "NAME.OUTPUT" that the tables of a case take and that nothing of what acts gives."""
    # memory and times of sampled controllers are no signals to choose from
    known = [f"{one.name}.{s}" for one in acting for s in (one.states if isinstance(one, Effector) else one.commands)]
    known += [f"{one.name}.{channel}" for one in acting if isinstance(one, Effector) for channel in one.channels]
    others = {f"{one.name}.{output}" for one in acting for output in REPORTED}
    others |= {name for one in acting for name, _ in one.state_names()}
    heavy = tuple(f"{name}." for name in case.cables)  # with mass they are made later
    return [
        Problem(where, f"found {name!r}, which is no signal; {_meant(case, name, known)}")
        for where, name in taken_signals(case)
        if name not in known and name not in others and not name.startswith(heavy)
    ]


def _meant(case: Case, name: str, known: Sequence[str]) -> str:
    """Part of a sentence: the output of a table of that name, or the nearest known signal."""
    own = [one for one in known if one.startswith(f"{name}.")]
    first = f"{name}.value" if name in case.signals else own[0] if own else ""
    return f"did you mean {first!r}?" if first else suggestion_text(name, known)


def taken_signals(case: Case) -> Iterator[tuple[str, str]]:
    """Key path and name of every signal that a table takes; not those that stand for all outputs of what they name."""
    whole = {*case.sensors, *case.controllers, *case.signals}
    for kind in KINDS:
        for label, table in getattr(case, kind).items():
            for key in KEYS:
                value = getattr(table, key, None)
                for name in value if isinstance(value, list | tuple) else [value]:
                    if isinstance(name, str) and not (kind == "controllers" and name in whole):
                        yield f"{kind}.{label}.{key}", name
    for k, joint in enumerate(case.joints):
        if joint.release_at is not None:
            yield f"joints[{joint.name or joint.child or k}].release_at.signal", joint.release_at.signal
