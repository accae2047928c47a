"""What the reading of a deck finds besides the model: cards used and not used, notes, and what is wrong, by line."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

SHOWN = 20  # problems of a deck that are written out


def toml_key(name: str) -> str:
    """A name as a key of a case file, in quotation marks where it needs them."""
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else json.dumps(name)


@dataclass(frozen=True)
class Place:
    """A line of a file."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


@dataclass(frozen=True)
class UnusedCard:
    """Cards of one kind that the structure is made without: what is so different, and where the first one stands."""

    card: str
    count: int
    consequence: str
    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.count} {self.card}: {self.consequence} (first at {self.file}:{self.line})"


class DeckError(ValueError):
    """A deck that cannot be used; the text holds every problem with its file and line, problems the single ones."""

    def __init__(self, name: str, problems: list[str]) -> None:
        self.problems = tuple(problems)
        shown = problems[:SHOWN] + ([f"and {len(problems) - SHOWN} more"] if len(problems) > SHOWN else [])
        head = (
            f"{name} cannot be used"
            if len(problems) == 1
            else f"{name} cannot be used; it has {len(problems)} problems"
        )
        super().__init__("\n".join([f"{head}:", *(f"  {problem}" for problem in shown)]))


@dataclass
class Findings:
    """Collected while a deck is read."""

    used: Counter[str] = field(default_factory=Counter)
    _notes: dict[str, list[str]] = field(default_factory=dict)  # text without its numbers -> those alike
    _problems: dict[tuple[str, str], tuple[str, int]] = field(default_factory=dict)  # kind, text -> first one, count
    _unused: dict[tuple[str, str], tuple[int, Place]] = field(default_factory=dict)

    def use(self, card: str, count: int = 1) -> None:
        """Count cards that are used."""
        self.used[card] += count

    def unused(self, card: str, consequence: str, place: Place, count: int = 1) -> None:
        """Count cards that are not used, with what that changes in plain words."""
        before, first = self._unused.get((card, consequence), (0, place))
        self._unused[card, consequence] = before + count, first

    def problem(self, text: str, place: Place | None = None, card: str = "") -> None:
        """Something that makes the deck unusable: one sentence; with a card, "CQUAD4 7", what is wrong with it.

        Cards of one kind with the same thing wrong are one problem with their count.
        """
        whole = f"{card}: {text}" if card else text
        said = whole if place is None else f"{place}: {whole}"
        key = (card.split(" ")[0], text) if card else ("", said)
        first, count = self._problems.get(key, (said, 0))
        self._problems[key] = first, count + 1

    @property
    def problems(self) -> list[str]:
        """The problems, in the order found."""
        return [
            first + (f" (and {count - 1} more {card})" if card and count > 1 else "")
            for (card, _), (first, count) in self._problems.items()
        ]

    def note(self, text: str) -> None:
        """Something that was decided in reading and that may matter."""
        alike = self._notes.setdefault(re.sub(r"[\d.,]+", "#", text), [])
        if text not in alike:
            alike.append(text)

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes, in the order found, with the first of those that differ by numbers alone and their count."""
        more = (f" (and {len(alike) - 1} more like it)" if len(alike) > 1 else "" for alike in self._notes.values())
        return tuple(alike[0] + text for alike, text in zip(self._notes.values(), more, strict=True))

    def problem_no_properties(self, path: Path, what: str) -> None:
        """Say that a deck has elements and none of what would make them a structure: what, in words."""
        self.problem(
            f"{path.name} has no {what} at all: it is a mesh. Use it as one: mesh = {json.dumps(path.name)} with "
            f"members in the case, or femflex new CASE.toml --mesh {path.name}"
        )

    def note_no_mass(
        self, densities: Iterable[float], names: Sequence[str], where: object, sections: Mapping[str, str] | None = None
    ) -> str:
        """Say that no material has a density; names: by which overrides name them, where: the first one stands.

        sections  name -> place of sections given by their stiffness, which have a mass of their own
        Returns the sentence, empty where one has a density.
        """
        if any(rho > 0 for rho in densities):
            return ""
        if sections:
            first, place = next(iter(sections.items()))
            text = (
                f"no section has a mass (the first is that of ELSET {first}, {place}): give DENSITY=, a mass per area, "
                f"on *SHELL GENERAL SECTION, or overrides = {{ {toml_key(first)} = {{ nonstructural_mass = ... }} }}"
            )
            self.note(text)
            return text
        if not names:
            return "it has no material, and no mass; give it point masses"
        text = (
            f"no material has a density (the first is {names[0]}, {where}): its elements have no mass. Give one in "
            f"the deck, or overrides = {{ {toml_key(names[0])} = {{ density = ... }} }}"
        )
        self.note(text)
        return text

    @property
    def left_out(self) -> tuple[UnusedCard, ...]:
        """The unused cards, by kind and consequence."""
        return tuple(
            UnusedCard(card, count, consequence, place.file, place.line)
            for (card, consequence), (count, place) in sorted(self._unused.items())
        )

    def check(self, path: Path) -> None:
        """Raise DeckError with all problems found so far."""
        if self.problems:
            raise DeckError(path.name, self.problems)
