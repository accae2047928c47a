"""Notes on the bodies of a system, their strain and their shapes: the same from every verb."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from femflex.cli.tables import print_line

if TYPE_CHECKING:
    from femflex.pipeline.decisions import ResolvedCase


def print_notes(notes: Mapping[str, str]) -> None:
    """Print the notes, a folded line for each body that has one."""
    for name, note in notes.items():
        if note:
            print_line("body", f"{name}: {note}", [{"body": name, "note": note}])


def print_reasons(resolved: ResolvedCase, verbose: bool) -> None:
    """Print what the meshes and decks of bodies lack; verbose: and the reasons of all choices."""
    from femflex.advice import notes_of

    print_notes(notes_of(resolved.advice, () if verbose else ("mesh",)))
