"""Decks: input files of other finite element solvers, with properties, connections and supports, as structures.

A deck of another solver is one new folder whose package registers a `DeckReader`.
"""

from __future__ import annotations

from femflex.decks import abaqus as abaqus
from femflex.decks import nastran as nastran
from femflex.decks.deck import Deck
from femflex.decks.findings import DeckError, UnusedCard
from femflex.decks.register import READERS, DeckReader, read_deck
from femflex.decks.units import Units, units_of

__all__ = ["READERS", "Deck", "DeckError", "DeckReader", "Units", "UnusedCard", "read_deck", "units_of"]
