"""Abaqus decks: input files of Abaqus and CalculiX, flat or of parts and instances."""

from __future__ import annotations

import re

from femflex.decks.abaqus.read import read_abaqus_deck
from femflex.decks.register import DeckReader, register

KEYWORDS = re.compile(
    r"^\s*\*\s*(HEADING|NODE|NGEN|ELEMENT|PART|INCLUDE|STEP|MATERIAL|PREPRINT|BOUNDARY|NSET|ELSET|RESTART)\b",
    re.I | re.M,
)


def recognises(text: str) -> bool:
    """Whether the beginning of a file is that of an Abaqus deck."""
    return KEYWORDS.search(text) is not None


register(DeckReader("Abaqus", (".inp",), recognises, read_abaqus_deck))
