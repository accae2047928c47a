"""Choices and warnings from a System and a duration, never from the text of a case."""

from __future__ import annotations

from femflex.advice.advice import Advice, advice_from, advice_text, notes_of, warn_of
from femflex.advice.advise import advise

__all__ = ["Advice", "advice_from", "advice_text", "advise", "notes_of", "warn_of"]
