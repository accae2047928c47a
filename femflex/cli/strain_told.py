"""Which strain each body of a system has, and why: what every verb that builds bodies says of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from femflex.system import System


def strain_notes(system: System) -> dict[str, str]:
    """What is to be said of the strain of each whole body that has something to say."""
    pieces = {piece for parts in system.segments.values() for piece in parts}
    return {name: body.note for name, body in system.bodies.items() if body.note and name not in pieces}


def say_notes(notes: Mapping[str, str]) -> None:
    """Print them, a line for each body."""
    for name, note in notes.items():
        print(f"body        {name}: {note}")


def strain_data(system: System) -> dict[str, dict[str, Any]]:
    """Strain of each elastic body and what is said of it, as --json prints them."""
    return {
        name: {"strain": body.strain_form, "note": body.note} for name, body in system.bodies.items() if body.n_modes
    }
