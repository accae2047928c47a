"""Strain and energy density of single shapes, to lowest order in their amplitude, for pictures of modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.body import FlexibleBody, Skin
from femflex.view.paint import EVERY, BodyPaint, quantity_of_colour


class ShapePaint:
    """A paint whose values reach 1 (or -1) where the chosen shape has its largest, at full amplitude."""

    def __init__(self, paint: BodyPaint) -> None:
        self._paint, self._largest = paint, 1.0
        self.signed = paint.quantity.number is not None

    def choose(self, y: Array) -> None:
        """Select a shape, with its full amplitudes y (n,) [kg^1/2 m]."""
        if self._paint.quantity.kind == EVERY:
            densities: dict[str, float] = {}
            for field_part, _ in self._paint.parts:
                densities[field_part.kind] = max(
                    densities.get(field_part.kind, 0.0), float(np.abs(field_part.energy(y[None])).max())
                )
            largest = {kind: density or 1.0 for kind, density in densities.items()}
            self._paint = replace(self._paint, quantity=replace(self._paint.quantity, largest=largest))
        self._largest = float(np.nanmax(np.abs(self._paint.values(y)), initial=0.0)) or 1.0

    def values(self, y: Array) -> NDArray[np.float32]:
        """Values (n_skin,) [1] at the points of the skin, parts of the largest."""
        return self._paint.values(y) / np.float32(self._largest)


def shape_paint(body: FlexibleBody, skin: Skin, colour: str) -> ShapePaint | None:
    """The paint of a body's shapes; None for "displacement". Raises ValueError as `view.paint.quantity_of_colour`."""
    if colour == "displacement":
        return None
    linear = tuple(
        replace(field_part, nonlinear=False, stress=0 * field_part.stress) for field_part in body.strain_field
    )
    return ShapePaint(BodyPaint.from_field(quantity_of_colour(colour, list(linear), "the body"), linear, skin))
