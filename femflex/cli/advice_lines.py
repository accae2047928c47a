"""Notes on the bodies of a system, their strain and their shapes, as text and JSON: the same from every verb."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.tables import print_folded

if TYPE_CHECKING:
    from femflex.pipeline.decisions import ResolvedCase


Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print also tables of detail and reasons of choices.")]


def print_notes(notes: Mapping[str, str], verbose: bool) -> None:
    """Print the notes in a verbose output, a folded line for each body that has one."""
    for name, note in notes.items():
        if note and verbose:
            print_folded(f"body        {name}: {note}")


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
