"""The effectors that a case may name, by the heading of their tables."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pkgutil import walk_packages
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femflex.effectors.noun import EffectorNoun

_NOUNS: dict[str, dict[str, type[EffectorNoun]]] = {}


def register(heading: str, noun: type[EffectorNoun]) -> None:
    """Let cases have tables of this noun, headed [heading.NAME].

    Several nouns of one heading are told apart by their field `kind`, a literal. A later noun of the same class name
    takes the place of an earlier one.
    """
    _NOUNS.setdefault(heading, {})[noun.__name__] = noun


def forget(heading: str) -> None:
    """Take the nouns of this heading away from cases."""
    del _NOUNS[heading]


def nouns() -> Mapping[str, tuple[type[EffectorNoun], ...]]:
    """Heading -> nouns of every effector that a case may name: those of femflex, and those defined elsewhere."""
    package = import_module("femflex.effectors")
    for module in walk_packages(package.__path__, f"{package.__name__}."):
        import_module(module.name)
    return {heading: tuple(kinds.values()) for heading, kinds in _NOUNS.items()}
