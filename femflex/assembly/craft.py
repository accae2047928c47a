"""Build the effectors of a case, and add its wheels and propellant to the bodies that carry them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from femflex.assembly.signals import signal_problems
from femflex.case.case import Case
from femflex.noun.problems import CaseError, Problem
from femflex.system import Part, Variation
from femflex.system.acting import Acting, Context, acting_on, variations_of


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
