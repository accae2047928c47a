"""Effectors given by name: what a System holds of them, and what they change of the bodies that carry them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.system.controller import Controller
from femflex.system.effector import Effector
from femflex.system.orbit import EARTH_RADIUS, Orbit
from femflex.system.segments import Part, body_of_part, with_body_of_part
from femflex.system.system import System
from femflex.system.variation import Variation


class Context(NamedTuple):
    """References of a noun: the other nouns, the bodies, the folder for files that it names, and the environment.

    epoch, radius, gravity: those of the Environment, days since J2000 at t = 0 or None, [m], and (3,) [m/s^2]
    """

    nouns: Mapping[str, Any] = {}
    folder: Path = Path()
    bodies: Mapping[str, Part] = {}
    orbit: Orbit | None = None
    epoch: float | None = None
    radius: float = EARTH_RADIUS
    gravity: Array = np.zeros(3)


ALONE = Context()
Acting = Effector | Controller
Attempt = Callable[..., Any]  # (name, function, *arguments) -> its result, or None where it reports an error


def without_reports(name: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """The result of a function, whose errors are those of the caller."""
    return function(*arguments)


def acting_on(
    parts: Mapping[str, Part], nouns: Mapping[str, Any], context: Context, attempt: Attempt = without_reports
) -> tuple[list[Acting], dict[str, Part]]:
    """The effectors of nouns by name, in their order, and the bodies with what these add to them or take out of them.

    An Effector or Controller among the nouns stands for itself.
    """
    effectors: list[Acting] = []
    bodies = dict(parts)
    for name, noun in nouns.items():
        if isinstance(noun, Effector | Controller):
            effectors.append(noun)
            continue
        built = attempt(name, noun.effectors, name, context)
        effectors += built or ()
        carrier = getattr(noun, "body", None)
        if built is not None and carrier in bodies:
            bodies[carrier] = attempt(name, _carrier, bodies[carrier], name, noun) or bodies[carrier]
    return effectors, bodies


def _carrier(part: Part, name: str, noun: Any) -> Part:
    """The body, or the segment of it with the noun's marker, as the noun changes it."""
    marker = getattr(noun, "marker", "origin")
    body = body_of_part(part, marker)
    changed = noun.carrier(name, body)
    return part if changed is body else with_body_of_part(part, marker, changed)


def variations_of(parts: Mapping[str, Part], nouns: Mapping[str, Any]) -> dict[str, Variation]:
    """Variations of the bodies that carry these nouns, such as tanks that are emptied. Raises ValueError."""
    out: dict[str, Variation] = {}
    for kind in dict.fromkeys(type(noun) for noun in nouns.values() if hasattr(noun, "variations")):
        out |= kind.variations(parts, {name: noun for name, noun in nouns.items() if type(noun) is kind})
    return out


def with_effectors(system: System, nouns: Mapping[str, Any], folder: Path = Path()) -> System:
    """The system with effectors given by name, and with its bodies as these change them.

    nouns   name -> noun of femflex.effectors, Effector or Controller
    folder  that contains files which nouns name
    Raises ValueError for values that do not fit together, and for names, bodies and markers that do not exist.
    """
    environment = system.environment
    own = environment.epoch, environment.radius, environment.gravity
    context = Context(nouns, folder, system.bodies, system.orbit, *own)
    effectors, bodies = acting_on(system.bodies, nouns, context)
    varying = variations_of(bodies, nouns) | system.varying
    whole = {name: body for name, body in bodies.items() if isinstance(body, FlexibleBody)}
    return replace(system, effectors=(*system.effectors, *effectors), bodies=whole, varying=varying)
