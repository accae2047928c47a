"""Nastran decks: bulk data and case control (MSC, NX, MYSTRAN and their kin)."""

from __future__ import annotations

import re

from femflex.decks.nastran.read import read_nastran_deck
from femflex.decks.register import DeckReader, register

CARDS = re.compile(
    r"^\s*(SOL[ ,=]|CEND\b|BEGIN\s+BULK|GRID[*, \t]|INCLUDE\s|NASTRAN\s|MAT1[*, ]|CORD2R|PARAM[ ,]"
    r"|C(QUAD4|TRIA3|BAR|TETRA|HEXA)[*, ]|P(SHELL|SOLID|COMP|BAR|BARL|BEAM|BUSH)[*, ])",
    re.I | re.M,
)


def recognises(text: str) -> bool:
    """Whether the beginning of a file is that of a Nastran deck, and not that of Abaqus or Ansys."""
    if re.search(r"^\s*\*(HEADING|NODE|ELEMENT|PART|INCLUDE|STEP)\b", text, re.I | re.M):
        return False
    if re.search(r"^(ID|APP|SOL)\s.*\n(.*\n)*?CEND", text[:4000], re.I):
        return True
    return CARDS.search(text) is not None


register(DeckReader("Nastran", (".bdf", ".nas", ".dat", ".dk"), recognises, read_nastran_deck))
