"""Check the signals that the tables of a case use, such as the command of a wheel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from femflex.case.case import Case
from femflex.noun.problems import Problem, suggestion_text
from femflex.system import Controller, Effector
from femflex.system.effector import ACCOUNTS

KEYS = ("command", "level", "rates", "angles", "slew_angle", "signal", "inputs", "error", "rate", "momentum")
REPORTED = ("effort", "power", *ACCOUNTS)  # of every effector, for sampled controllers and sensors


def signal_problems(case: Case, effectors: Sequence[Effector | Controller]) -> list[Problem]:
    """Problems of the signals "NAME.OUTPUT" that tables of a case use and that no effector or controller has."""
    # the memory and times of sampled controllers are not suggested
    signals = [
        f"{effector.name}.{s}"
        for effector in effectors
        for s in (effector.states if isinstance(effector, Effector) else effector.commands)
    ]
    signals += [
        f"{effector.name}.{channel}"
        for effector in effectors
        if isinstance(effector, Effector)
        for channel in effector.channels
    ]
    internal_signals = {f"{effector.name}.{output}" for effector in effectors for output in REPORTED}
    internal_signals |= {name for effector in effectors for name, _ in effector.state_names()}
    cable_prefixes = tuple(f"{name}." for name in case.effectors["cables"])  # cables with mass are built later
    return [
        Problem(where, f"found {name!r}, which is no signal; {_suggestion(case, name, signals)}")
        for where, name in requested_signals(case)
        if name not in signals and name not in internal_signals and not name.startswith(cable_prefixes)
    ]


def _suggestion(case: Case, name: str, signals: Sequence[str]) -> str:
    """A suggestion, as part of a sentence: an output of the table of that name, or the most similar signal."""
    outputs = [signal for signal in signals if signal.startswith(f"{name}.")]
    likely = f"{name}.value" if name in case.effectors["signals"] else outputs[0] if outputs else ""
    return f"did you mean {likely!r}?" if likely else suggestion_text(name, signals)


def requested_signals(case: Case) -> Iterator[tuple[str, str]]:
    """Key path and name of every signal that a table uses, but names that stand for all outputs of a table."""
    nouns = {name: noun for named in case.effectors.values() for name, noun in named.items()}
    sources = {name for name, noun in nouns.items() if noun.gives_signals}
    for kind, named in case.effectors.items():
        for label, table in named.items():
            for key in KEYS:
                value = getattr(table, key, None)
                for name in value if isinstance(value, list | tuple) else [value]:
                    if isinstance(name, str) and not (kind == "controllers" and name in sources):
                        is_vector = getattr(table, "kind", "") == "vector"
                        yield f"{kind}.{label}.{key}", f"{name}.x" if is_vector else name
    for k, joint in enumerate(case.joints):
        if joint.release_at is not None:
            yield f"joints[{joint.name or joint.child or k}].release_at.signal", joint.release_at.signal
