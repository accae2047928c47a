"""Build the System of a case from its bodies, effectors and signals."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femflex.assembly.bodies import build_bodies
from femflex.assembly.deploying import with_deployment
from femflex.assembly.initial import initial_shape
from femflex.assembly.joints import build_joints, build_loops, root_joint
from femflex.case.case import Case
from femflex.noun.problems import CaseError, Problem, suggestion_text
from femflex.system import Controller, Effector, Frame, Load, Part, System, Variation, assembled
from femflex.system.acting import Acting, Context, acting_on, variations_of
from femflex.system.effector import ACCOUNTS


def system_of(case: Case, bodies: Mapping[str, Part] | None) -> System:
    """The System of a case with these bodies, or with its own (linear strain by default).

    The initial centre of mass, and a start from an equilibrium or from another run, are set later (`pipeline.start`).
    Raises CaseError with the inconsistencies of its tables.
    """
    parts, loads = bodies_and_loads(case, bodies)
    try:
        craft = build_craft(case, parts)
        joint, parts = root_joint(case, craft.parts)
        joints = (*(() if joint is None else (joint,)), *build_joints(case))
        orbit = case.orbit_with_rates()
        system = assembled(
            parts,
            joints,
            loads,
            frame=build_frame(case),
            orbit=orbit,
            libration_sequence=case.attitude.sequence,
            loops=build_loops(case),
            constraints=tuple(case.constraints),
            springs=tuple(case.springs),
            sights=tuple(case.sights),
            reactions=case.run.reactions,
            momenta=case.run.momenta,
            environment=case.environment_with_radius(),
            effectors=craft.effectors,
            varying=craft.varying,
        )
    except CaseError:
        raise
    except (ValueError, KeyError) as error:
        problems = [Problem("", line) for line in str(error.args[0]).splitlines()]
        raise CaseError(case.path.name, problems) from error
    return _with_kept_values(case, with_deployment(case, _with_initial(case, system)))


def problems_of_loads(case: Case) -> list[Problem]:
    """The problems of the CSV files of the loads of a case."""
    problems = []
    for load in case.loads:
        try:
            load.read_from(case.path.parent)
        except (ValueError, OSError) as error:
            problems.append(Problem(f"loads[{load.name}]", str(error)))
    return problems


def bodies_and_loads(case: Case, bodies: Mapping[str, Part] | None) -> tuple[dict[str, Part], tuple[Load, ...]]:
    """The bodies of a case (built if not given) and its loads. Raises CaseError with the problems of both together."""
    problems: list[Problem] = []
    parts: dict[str, Part] = {}
    try:
        parts = dict(bodies) if bodies is not None else build_bodies(case)
    except CaseError as error:
        problems += error.problems
    if problems := [*problems, *problems_of_loads(case)]:
        raise CaseError(case.path.name, problems)
    return parts, tuple(load.read_from(case.path.parent) for load in case.loads)


def _with_kept_values(case: Case, system: System) -> System:
    """The system with the list of initial values that closing the loops must not change (`initial.keep`)."""
    if case.initial is None or case.initial.keep is None:
        return system
    try:
        return replace(system, keep=tuple(case.initial.keep))
    except ValueError as error:
        raise CaseError(case.path.name, [Problem("initial.keep", str(error.args[0]))]) from error


def build_frame(case: Case) -> Frame:
    """The base frame: that of [attitude], or orbital with an orbit and inertial without."""
    kind = case.attitude.frame or ("inertial" if case.orbit.kind == "none" else "orbital")
    return Frame(kind, np.array(case.attitude.spin)) if case.attitude.spin is not None else Frame(kind)


def _with_initial(case: Case, system: System) -> System:
    delta, ddelta = {}, {}
    problems = []
    for name, table in case.bodies.items():
        if table.initial is None:
            continue
        body = system.bodies[name]
        joint_position = body.marker(system.joint_of(name).child_marker).position
        try:
            delta[name], ddelta[name] = initial_shape(table.initial, body, joint_position)
        except (ValueError, KeyError) as error:
            problems.append(Problem(f"bodies.{name}.initial", str(error.args[0])))
    if problems:
        raise CaseError(case.path.name, problems)
    return replace(system, delta0=delta, ddelta0=ddelta) if delta else system


@dataclass(frozen=True, eq=False)
class Craft:
    """The effectors and controllers of a case, its bodies with wheels and propellant, and their variable masses."""

    effectors: tuple[Acting, ...]
    parts: dict[str, Part]
    varying: dict[str, Variation]


def build_craft(case: Case, parts: Mapping[str, Part]) -> Craft:
    """The Craft of a case: its effectors, and its bodies with wheels and propellant.

    Raises CaseError with the problems of all tables together.
    """
    problems: list[Problem] = []
    headings = {name: f"{heading}.{name}" for heading, named in case.effectors.items() for name in named}
    nouns = {name: noun for named in case.effectors.values() for name, noun in named.items()}
    problems += [
        Problem(f"{heading}.{name}", f"found the name {name!r} a second time; {headings[name]} has it already")
        for heading, named in case.effectors.items()
        for name in named
        if headings[name] != f"{heading}.{name}"
    ]

    def attempt(name: str, make: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return make(*arguments)
        except (ValueError, KeyError) as error:
            problems.append(Problem(headings.get(name, name), str(error.args[0])))
            return None

    environment = case.environment_with_radius()
    own = environment.epoch, environment.radius, environment.gravity
    context = Context(nouns, case.path.parent, parts, case.orbit_with_rates(), *own)
    built, bodies = acting_on(parts, nouns, context, attempt)
    problems += [] if problems else signal_problems(case, built)
    tanks = {name: noun for name, noun in nouns.items() if getattr(noun, "body", "") in bodies}
    varying = (attempt("tanks", variations_of, bodies, tanks) or {}) if not problems else {}
    if problems:
        raise CaseError(case.path.name, problems)
    return Craft(tuple(built), bodies, varying)


def craft_notes(case: Case) -> list[str]:
    """Sentences on the mass and inertia that effectors add to their bodies, or take out of them."""
    notes = [noun.note(name) for named in case.effectors.values() for name, noun in named.items()]
    return [note for note in notes if note]


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
