"""Advice: a choice for a body, or a physics warning about it, with its reason, computed value and limit."""

from __future__ import annotations

import json
import warnings
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.warning import PhysicsWarning

LINEAR_HINT = " (set strain = 'linear' for linear strain)"
UNLISTED = ("joints",)  # choices that the note on a body's shapes includes already


@dataclass(frozen=True)
class Advice:
    """One choice for a body, or one physics warning about it.

    body      its name; empty for the whole craft
    decision  its subject: "mesh", "strain", "shapes", "joints", "stretch", "bend",
              "compression", "buckling", "truncation", "support", "torque", "inertia", "output", "sampling", "craft"
    choice    the value as written in a case: "condensed", {"TIP": ["z", "ry"]}; None for a warning
    reason    text with both numbers
    value     computed value
    limit     its limit, in the same unit; None where there is no number
    doubt     whether it is a physics warning, and not a note on a choice
    category  class of the warning
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
        """The advice as the line that the command line prints for the body."""
        if self.decision != "strain":
            return self.reason
        return f"strain is {self.choice}: {self.reason}{LINEAR_HINT * (self.choice != 'linear')}"

    def data(self) -> dict[str, Any]:
        """The advice as a dict that JSON can hold, for result files and `--json`."""
        return {key: value for key, value in asdict(self).items() if key != "category"}


class WorstRow:
    """The row of a run in which a measure is largest so far: this measure, and other values there."""

    def __init__(self) -> None:
        self.measure, self.values = -np.inf, dict[str, Any]()

    def record(self, measure: Array, **values: Any) -> None:
        """Compare the measures (n_t,) of a block of rows; values: an array (n_t, ...) of each, or the same for all."""
        if len(measure) and measure[row := int(np.argmax(measure))] > self.measure:
            self.measure = float(measure[row])
            self.values = {key: value[row] if isinstance(value, np.ndarray) else value for key, value in values.items()}


def doubt(body: str, decision: str, reason: str, value: float | None = None, limit: float | None = None) -> Advice:
    """A physics warning about a body, without a choice."""
    return Advice(body, decision, None, reason, value, limit, doubt=True)


def notes_of(advice: Iterable[Advice], decisions: Collection[str] = ()) -> dict[str, str]:
    """Notes on each body without the warnings: one line for each, by name; on these decisions, or on all of them."""
    texts_by_body: dict[str, list[str]] = {}
    for entry in advice:
        if decisions and entry.decision not in decisions:
            continue
        if entry.body and not entry.doubt and entry.decision not in UNLISTED:
            texts_by_body.setdefault(entry.body, []).append(entry.text)
    return {name: "; ".join(texts) for name, texts in texts_by_body.items()}


def warn_of(advice: Iterable[Advice], stacklevel: int = 3) -> None:
    """Issue the physics warnings among the advice, each text once."""
    for entry in {entry.reason: entry for entry in advice if entry.doubt}.values():
        warning = entry.category(
            entry.decision, body_or_joint=entry.body, value=entry.value, limit=entry.limit, text=entry.reason
        )
        warnings.warn(warning, stacklevel=stacklevel)


def advice_text(advice: Iterable[Advice]) -> str:
    """Advice as the JSON text that a result file keeps in its attribute `advice`."""
    return json.dumps([entry.data() for entry in advice])


def advice_from(text: str) -> tuple[Advice, ...]:
    """The advice in the attribute `advice` of a result file. Raises ValueError for other text."""
    field_names = {field.name for field in fields(Advice)}
    try:
        entries: list[Mapping[str, Any]] = json.loads(text)
        return tuple(Advice(**{key: value for key, value in entry.items() if key in field_names}) for entry in entries)
    except (ValueError, TypeError, AttributeError) as error:
        raise ValueError(
            f"the attribute 'advice' of the result file is not as a run writes it: {text[:40]!r}"
        ) from error
