"""The skin: what is drawn of a body."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from femflex.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class Skin:
    """What is drawn of a body: a surface (or line, or points) and how each shape moves its points.

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
    def reach(self) -> Array:
        """How far each shape moves the point that it moves farthest (n,) [m per amplitude]."""
        return farthest(self.shapes)


def farthest(shapes: Array) -> Array:
    """Largest displacement (n,) [m per amplitude] of the places that shapes (n, p, 3) move."""
    return np.asarray(np.sqrt(np.einsum("spa,spa->sp", shapes, shapes).max(axis=1, initial=0.0)))
