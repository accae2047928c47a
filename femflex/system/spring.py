"""Springs between two markers, a force along the line that joins them: the table [[springs]] and the object."""

from __future__ import annotations

from typing import Annotated

from pydantic import model_validator

from femflex.noun.table import Name, Table, refuse
from femflex.noun.values import Quantity


class MarkerLink(Table):
    """An element between a marker of a body and a marker of another, or the origin of the base frame."""

    name: Name
    """Name in channels and messages."""
    body: str
    """Body on which it acts."""
    parent: str | None = None
    """The other body. Default: the base frame of [attitude]."""
    marker: str = "origin"
    """Marker of `body`."""
    parent_marker: str = "origin"
    """Marker of the other body."""

    @model_validator(mode="after")
    def _base_has_one_marker(self) -> MarkerLink:
        if self.parent is None and self.parent_marker != "origin":
            refuse(f"found parent_marker {self.parent_marker!r} without a parent; the base frame has only its origin")
        return self


class Spring(MarkerLink):
    """A spring and damper along the line between two markers."""

    stiffness: Annotated[float, Quantity("N/m", least=0.0)] = 0.0
    """Stiffness along the line between the markers."""
    damping: Annotated[float, Quantity("N s/m", least=0.0)] = 0.0
    """Damping coefficient along that line."""
    length: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """Length without spring force."""
