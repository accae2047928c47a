"""Notes on the bodies of a system, their strain and their shapes, as text and JSON: the same from every verb."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.tables import print_folded

if TYPE_CHECKING:
    from femflex.pipeline.decisions import ResolvedCase


Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print also tables of detail and reasons of choices.")]


def print_notes(notes: Mapping[str, str]) -> None:
    """Print the notes, a folded line for each body that has one."""
    for name, note in notes.items():
        if note:
            print_folded(f"body        {name}: {note}")


def print_reasons(resolved: ResolvedCase, verbose: bool) -> None:
    """Print what the meshes and decks of bodies lack; verbose: and the reasons of all choices."""
    from femflex.advice import notes_of

    print_notes(notes_of(resolved.advice, () if verbose else ("mesh",)))


def strain_data(resolved: ResolvedCase) -> dict[str, dict[str, Any]]:
    """Return the strain of each elastic body, and the notes and the advice on it, as --json prints them."""
    notes = resolved.notes
    return {
        name: {
            "strain": body.strain_form,
            "note": notes.get(name, ""),
            "advice": [advice.data() for advice in resolved.advice if advice.body == name],
        }
        for name, body in resolved.system.bodies.items()
        if body.n_modes
    }
