"""The skin of a body: the surface, lines or points that pictures show."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from femflex.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class Skin:
    """Surface (or line, or points) of a body that pictures show, and the displacement of its points per shape.

    points  (n_p, 3)      undeformed, body frame [m]; already offset to the section's rim or the plate's faces
    cells   type -> (n_c, nodes)   with meshio's cell names: "triangle", "quad", "line", "vertex"
    shapes  (n, n_p, 3)   displacement of each point per shape (u + theta x offset)
    growth  (n_p, 3)      of a body that deploys: displacement of each point per growth of its length, relative to the
                          length that it is drawn at; None of others
    """

    points: Array
    cells: dict[str, IntArray]
    shapes: Array
    growth: Array | None = None

    def __post_init__(self) -> None:
        for kind, nodes in self.cells.items():
            if nodes.size and not (nodes.min() >= 0 and nodes.max() < len(self.points)):
                raise ValueError(f"the cells {kind!r} of a skin name points that it does not have; expected 0 to n - 1")

    @cached_property
    def max_displacement(self) -> Array:
        """Largest displacement of a point by each shape (n,) [m per amplitude]."""
        return largest_displacements(self.shapes)


def largest_displacements(shapes: Array) -> Array:
    """Largest displacement (n,) [m per amplitude] among the points that shapes (n, p, 3) move."""
    return np.asarray(np.sqrt(np.einsum("spa,spa->sp", shapes, shapes).max(axis=1, initial=0.0)))
