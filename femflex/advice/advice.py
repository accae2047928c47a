"""A piece of advice: what was chosen for a body, or is doubtful of it, why, and the two numbers that it rests on."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from femflex.warning import PhysicsWarning

KEEPS = " (set strain = 'linear' for linear strain)"
SILENT = ("joints",)  # choices that the word on a body's shapes tells of


@dataclass(frozen=True)
class Advice:
    """One decision about a body, or one doubt of it.

    body      its name; empty for the whole craft
    decision  what it is about: "strain", "shapes", "joints", "stiffening", "bend",
              "buckling", "slack", "truncation", "support", "torque", "mass", "inertia", "output", "sampling", "craft"
    choice    what was chosen, as the tables of a case say it: "condensed", {"TIP": ["z", "ry"]}; None of a doubt
    reason    in words, with both numbers
    value     what was found, and
    limit     what it is held against, in the same unit; None where there is no number
    doubt     whether it is a warning of the physics, not a word on what was chosen
    category  of the warning, where it is one
    """

    body: str
    decision: str
    choice: Any
    reason: str
    value: float | None = None
    limit: float | None = None
    doubt: bool = False
    category: type[PhysicsWarning] = PhysicsWarning

    @property
    def text(self) -> str:
        """The advice as a line of what a verb prints of the body."""
        if self.decision != "strain":
            return self.reason
        return f"strain is {self.choice}: {self.reason}{KEEPS * (self.choice != 'linear')}"

    def data(self) -> dict[str, Any]:
        """The advice as JSON can hold it, for result files and `--json`."""
        return {key: value for key, value in asdict(self).items() if key != "category"}


def doubt(body: str, decision: str, reason: str, value: float | None = None, limit: float | None = None) -> Advice:
    """A warning of the physics of a body, without a choice."""
    return Advice(body, decision, None, reason, value, limit, doubt=True)


def notes_of(advice: Iterable[Advice]) -> dict[str, str]:
    """Notes on each body without the warnings: one line for each, by name."""
    found: dict[str, list[str]] = {}
    for one in advice:
        if one.body and not one.doubt and one.decision not in SILENT:
            found.setdefault(one.body, []).append(one.text)
    return {name: "; ".join(texts) for name, texts in found.items()}


def warn_of(advice: Iterable[Advice], stacklevel: int = 3) -> None:
    """Give the doubts as warnings, each text once."""
    for one in {one.reason: one for one in advice if one.doubt}.values():
        warning = one.category(one.decision, body_or_joint=one.body, value=one.value, limit=one.limit, text=one.reason)
        warnings.warn(warning, stacklevel=stacklevel)


def advice_text(advice: Iterable[Advice]) -> str:
    """Advice as the JSON text that a result file keeps in its attribute `advice`."""
    return json.dumps([one.data() for one in advice])


def advice_from(text: str) -> tuple[Advice, ...]:
    """The advice in the attribute `advice` of a result file. Raises ValueError for other text."""
    known = {field.name for field in fields(Advice)}
    try:
        found: list[Mapping[str, Any]] = json.loads(text)
        return tuple(Advice(**{key: value for key, value in one.items() if key in known}) for one in found)
    except (ValueError, TypeError, AttributeError) as error:
        raise ValueError(
            f"the attribute 'advice' of the result file is not as a run writes it: {text[:40]!r}"
        ) from error
