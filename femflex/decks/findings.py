"""Findings while a deck is read, besides the model: used and unused cards, notes, and problems with their lines."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

MAX_SHOWN = 20  # maximum number of problems in the text of a DeckError
BY_MATRICES = (
    "export mass and stiffness with the solver and give the body by its matrices (kind = 'matrices', how-to Matrices)"
)


def toml_key(name: str) -> str:
    """A name as a key of a case file, in quotation marks if needed."""
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else json.dumps(name)


@dataclass(frozen=True)
class Location:
    """A line of a file."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


@dataclass(frozen=True)
class UnusedCard:
    """Ignored cards of one kind: the consequence for the structure, and the location of the first card."""

    card: str
    count: int
    consequence: str
    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.count} {self.card}: {self.consequence} (first at {self.file}:{self.line})"


@dataclass
class Overrides:
    """Values in SI that a case gives in place of those of a deck, by key and name of a material, property or section.

    used: names that were found in the deck
    """

    values: Mapping[str, Mapping[str, Any]]
    used: set[str] = field(default_factory=set)

    def __call__(self, names: Sequence[str], values: Mapping[str, float], source: str) -> dict[str, float]:
        """The values with those of the case for any of the names, in any capitals. Raises ValueError for unknown
        keys."""
        new_values = dict(values)
        capitals = {name.upper() for name in names}
        for name in (name for name in self.values if name.upper() in capitals):
            self.used.add(name)
            for key, value in self.values[name].items():
                if key not in new_values:
                    raise ValueError(f"{source}: override of {name!r} names {key!r}; it has {sorted(new_values)}")
                new_values[key] = float(value)
        return new_values

    def report_unknown(self, findings: Findings, explanation: str) -> None:
        """Add a problem for every name that is not in the deck."""
        for name in self.values:
            if name not in self.used:
                findings.problem(f"override of {name!r}: the deck has no {explanation}")


class DeckError(ValueError):
    """A deck that cannot be used; the text lists the problems with file and line, `problems` has them all."""

    def __init__(self, name: str, problems: list[str]) -> None:
        self.problems = tuple(problems)
        shown = problems[:MAX_SHOWN] + ([f"and {len(problems) - MAX_SHOWN} more"] if len(problems) > MAX_SHOWN else [])
        head = (
            f"{name} cannot be used"
            if len(problems) == 1
            else f"{name} cannot be used; it has {len(problems)} problems"
        )
        super().__init__("\n".join([f"{head}:", *(f"  {problem}" for problem in shown)]))


@dataclass
class Findings:
    """Findings collected while a deck is read."""

    used: Counter[str] = field(default_factory=Counter)
    _notes: dict[str, list[str]] = field(default_factory=dict)  # text without its numbers -> notes with this text
    _problems: dict[tuple[str, str], tuple[str, int]] = field(default_factory=dict)  # kind, text -> first one, count
    _unused: dict[tuple[str, str], tuple[int, Location]] = field(default_factory=dict)

    def use(self, card: str, count: int = 1) -> None:
        """Count cards that are used."""
        self.used[card] += count

    def unused(self, card: str, consequence: str, location: Location, count: int = 1) -> None:
        """Count unused cards; consequence: effect on the structure in plain words."""
        previous_count, first = self._unused.get((card, consequence), (0, location))
        self._unused[card, consequence] = previous_count + count, first

    def problem(self, text: str, location: Location | None = None, card: str = "") -> None:
        """Add a problem that makes the deck unusable: one sentence, or the error of a card such as "CQUAD4 7".

        The same error of several cards of one kind is one problem with their count.
        """
        full_text = f"{card}: {text}" if card else text
        located_text = full_text if location is None else f"{location}: {full_text}"
        key = (card.split(" ")[0], text) if card else ("", located_text)
        first, count = self._problems.get(key, (located_text, 0))
        self._problems[key] = first, count + 1

    @property
    def problems(self) -> list[str]:
        """The problems, in order of detection."""
        return [
            first + (f" (and {count - 1} more {card})" if card and count > 1 else "")
            for (card, _), (first, count) in self._problems.items()
        ]

    def note(self, text: str) -> None:
        """Add a note about a decision made while reading that may matter."""
        similar = self._notes.setdefault(re.sub(r"[\d.,]+", "#", text), [])
        if text not in similar:
            similar.append(text)

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes, in order of detection; of notes that differ only in numbers, the first one with their count."""
        suffixes = (
            f" (and {len(similar) - 1} more like it)" if len(similar) > 1 else "" for similar in self._notes.values()
        )
        return tuple(similar[0] + suffix for similar, suffix in zip(self._notes.values(), suffixes, strict=True))

    def problem_no_properties(self, path: Path, definitions: str) -> None:
        """Add the problem that a deck has elements but none of the definitions that a structure needs (in words)."""
        self.problem(
            f"{path.name} has no {definitions} at all: it is a mesh. Use it as one: mesh = {json.dumps(path.name)} "
            f"with members in the case, or femflex new CASE.toml --mesh {path.name}"
        )

    def note_no_mass(
        self,
        densities: Iterable[float],
        names: Sequence[str],
        first_location: object,
        sections: Mapping[str, str] | None = None,
    ) -> str:
        """Note that no material has a density, and return the sentence; return "" if one has a density.

        names     names of the materials in overrides; first_location: location of the first material
        sections  name -> location of sections given by their stiffness, which have their own mass
        """
        if any(rho > 0 for rho in densities):
            return ""
        if sections:
            first, location = next(iter(sections.items()))
            text = (
                f"no section has a mass (the first is that of ELSET {first}, {location}): give DENSITY=, a mass per "
                "area, on *SHELL GENERAL SECTION, or overrides = "
                f"{{ {toml_key(first)} = {{ nonstructural_mass = ... }} }}"
            )
            self.note(text)
            return text
        if not names:
            return "it has no material, and no mass; give it point masses"
        text = (
            f"no material has a density (the first is {names[0]}, {first_location}): its elements have no mass. Give "
            f"one in the deck, or overrides = {{ {toml_key(names[0])} = {{ density = ... }} }}"
        )
        self.note(text)
        return text

    @property
    def left_out(self) -> tuple[UnusedCard, ...]:
        """The unused cards, by kind and consequence."""
        return tuple(
            UnusedCard(card, count, consequence, location.file, location.line)
            for (card, consequence), (count, location) in sorted(self._unused.items())
        )

    def check(self, path: Path) -> None:
        """Raise DeckError with all problems found so far."""
        if self.problems:
            raise DeckError(path.name, self.problems)
