"""The register of readers of decks, by suffix and by contents."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from femflex.decks.deck import Deck
from femflex.decks.units import Units, units_of
from femflex.reading import reading, refuse_pointer

HEAD = 65536  # bytes of a file that are read to recognise its solver
ADVICE = "It may be cut short, damaged or of another solver; write it again from its source."
Values = Mapping[str, Mapping[str, Any]]
Reader = Callable[[Path, Units, Values], Deck]


@dataclass(frozen=True)
class DeckReader:
    """Recognition and reading of the decks of one solver.

    suffixes    of its files, lower case
    recognises  whether text from the beginning of a file belongs to such a deck
    read        (path, units, overrides) -> Deck; overrides: name of a property or material (pid_3, mat_1, or the name
                the deck gives it) -> {key -> value in SI}
    """

    solver: str
    suffixes: tuple[str, ...]
    recognises: Callable[[str], bool]
    read: Reader


READERS: dict[str, DeckReader] = {}  # by solver


def register(reader: DeckReader) -> None:
    """Register the reader for the decks of a solver."""
    READERS[reader.solver] = reader


def read_deck(path: str | Path, units: str | Units = "m-kg-s", overrides: Values | None = None) -> Deck:
    """The Deck of a file: its finite element model, in SI units.

    units      of the deck: length-mass-time or length-force-time ("mm-t-s", "in-lbf-s")
    overrides  values that replace the deck's: {"mat_1": {"E": 7e10}, "pid_3": {"thickness": 2e-3}}, in SI

    Raises ValueError (DeckError, with every problem and its file and line) if the deck cannot be used.
    """
    path = Path(path)
    if not path.is_file():
        alternatives = sorted(p.name for p in path.parent.glob(f"*{path.suffix}")) if path.parent.is_dir() else []
        raise ValueError(f"deck {path} does not exist; {path.parent} holds {alternatives or 'no such files'}.")
    refuse_pointer(path)
    reader, deck_units = reader_of(path), units_of(units)
    with reading(path, f"{reader.solver} deck", ADVICE):
        return reader.read(path, deck_units, overrides or {})


def reader_of(path: Path) -> DeckReader:
    """The reader that recognises the contents of a file; readers for its suffix are tried first.

    Raises ValueError if no reader recognises it.
    """
    with open(path, "rb") as opened:
        text = opened.read(HEAD).decode("utf-8", errors="replace")
    ordered = sorted(READERS.values(), key=lambda reader: path.suffix.lower() not in reader.suffixes)
    for reader in ordered:
        if reader.recognises(text):
            return reader
    solvers = "; ".join(f"{reader.solver} ({', '.join(reader.suffixes)})" for reader in READERS.values())
    raise ValueError(f"{path.name} is no deck of a known solver; known are {solvers}")
