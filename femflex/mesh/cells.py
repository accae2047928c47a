"""The cell types femflex understands, in meshio's names and node order (the order of VTK).

Every type is described by the positions of its nodes on the unit cell and by the monomials of its shape functions.
Interpolation, subdivision, generators and quality all follow from these two tables.

The unit cell of a pyramid is a cube (a, b, w) whose face w = 0 is one point, the apex: x = b w, y = a w, z = 1 - w.
There its shape functions, rational in x, y, z, are polynomials: 1, w and w a b with w a, w b for five nodes; those of
G. Bedrosian, Int. J. Num. Meth. Engng 35 (1992) 95, for thirteen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from femflex.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class CellType:
    """One cell type on its unit cell: [0, 1]^d, the unit simplex, triangle x line, or a pyramid's cube.

    nodes      (n, d)  positions of the nodes, corners first
    exponents  (n, d)  monomials x^a y^b z^c spanned by the shape functions
    corner     name of the cell with the same corners and no further nodes
    """

    name: str
    shape: str
    order: int
    nodes: Array
    exponents: IntArray
    corner: str

    @property
    def dimension(self) -> int:
        """Dimension of the cell: 0 a point, 1 a line, 2 a surface, 3 a solid."""
        return int(self.nodes.shape[1])

    @property
    def n_corners(self) -> int:
        """Number of corner nodes; they come first."""
        return CORNERS[self.shape]

    @cached_property
    def _coefficients(self) -> Array:
        return np.asarray(np.linalg.inv(_monomials(self.nodes, self.exponents)), np.float64)

    def interpolation(self, positions: Array) -> Array:
        """Shape functions (k, n) at positions (k, d) of the unit cell."""
        return np.asarray(_monomials(positions, self.exponents) @ self._coefficients, np.float64)

    def gradients(self, positions: Array) -> Array:
        """Derivatives (k, n, d) of the shape functions along the unit cell's axes at positions (k, d)."""
        parts = []
        for axis in range(self.dimension):
            power = self.exponents[:, axis]
            lowered = self.exponents.copy()
            lowered[:, axis] = np.maximum(power - 1, 0)
            parts.append((_monomials(positions, lowered) * power) @ self._coefficients)
        derivatives = np.stack(parts, axis=-1)
        # Rounding leaves a sum of about 1e-13; a sum other than zero would strain an element in rigid translation.
        return derivatives - derivatives.sum(axis=1, keepdims=True) / derivatives.shape[1]

    @property
    def ideal(self) -> Array:
        """Jacobian (d, d) [1] of the cell with equal edges; of a pyramid one for each corner of its base (4, d, d)."""
        return IDEAL[self.shape]

    @property
    def regular_corners(self) -> Array:
        """Positions (k, d) of the corners where the map from the unit cell is regular: all but a pyramid's apex."""
        return self.nodes[: self.n_corners - (self.shape == "pyramid")]

    @cached_property
    def mirrored(self) -> IntArray:
        """Order (n,), numbers of the nodes, that turns the cell inside out: its first two axes change places."""
        swapped = self.nodes[:, [1, 0, *range(2, self.dimension)]] if self.dimension > 1 else 1 - self.nodes
        distance = np.abs(swapped[:, None] - self.nodes[None]).sum(axis=2)
        return np.asarray(distance.argmin(axis=1))

    @cached_property
    def parents(self) -> list[IntArray]:
        """For each node beyond the corners, the numbers (k,) of the corners whose mean is its position in a cell with
        straight edges."""
        weights = CELL_TYPES[self.corner].interpolation(self.nodes[self.n_corners :])
        return [np.flatnonzero(row > 1e-9) for row in weights]


def _monomials(positions: Array, exponents: IntArray) -> Array:
    return np.asarray(np.prod(positions[:, None, :] ** exponents[None], axis=2))


CORNERS = {"point": 1, "line": 2, "triangle": 3, "quad": 4, "tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8}
_S3, _S6 = np.sqrt(3) / 2, np.sqrt(6) / 3
IDEAL: dict[str, Array] = {
    "point": np.eye(0),
    "line": np.eye(1),
    "triangle": np.array([[1, 0.5], [0, _S3]]),
    "quad": np.eye(2),
    "tetra": np.array([[1, 0.5, 0.5], [0, _S3, _S3 / 3], [0, 0, _S6]]),
    "hexahedron": np.eye(3),
    "wedge": np.array([[1, 0.5, 0], [0, _S3, 0], [0, 0, 1]]),
}

_UPWARD = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2  # of a pyramid's base from its centre, as x, y
IDEAL["pyramid"] = np.array([[[0, 1, x], [1, 0, y], [0, 0, -np.sqrt(0.5)]] for x, y in _UPWARD])

# Corners on the unit cell, then edges and faces in VTK's order by their corner numbers.
_SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
_CORNERS: dict[str, list[tuple[float, ...]]] = {
    "point": [()],
    "line": [(0,), (1,)],
    "triangle": [(0, 0), (1, 0), (0, 1)],
    "quad": [*_SQUARE],
    "tetra": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "hexahedron": [(*xy, z) for z in (0, 1) for xy in _SQUARE],
    "wedge": [(*xy, z) for z in (0, 1) for xy in ((0, 0), (1, 0), (0, 1))],
    "pyramid": [(0, 0, 1), (0, 1, 1), (1, 1, 1), (1, 0, 1), (0.5, 0.5, 0)],
}
EDGES: dict[str, list[tuple[int, int]]] = {
    "point": [],
    "line": [(0, 1)],
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quad": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetra": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    "hexahedron": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
    "wedge": [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    "pyramid": [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)],
}
# Corners of the faces of solids, counterclockwise seen from outside.
FACES: dict[str, list[list[int]]] = {
    "tetra": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    "hexahedron": [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]],
    "wedge": [[0, 2, 1], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
    "pyramid": [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
}
_QUAD_FACES: dict[str, list[tuple[int, ...]]] = {
    "quad": [(0, 1, 2, 3)],
    "hexahedron": [(0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7), tuple(range(8))],
    "wedge": [(0, 1, 3, 4), (1, 2, 4, 5), (2, 0, 5, 3)],
}


# w^c times polynomials of a and b: those for five nodes, then the additional ones for thirteen.
_PYRAMID = np.array(
    [(0, 0, 0), (1, 0, 1), (0, 1, 1), (0, 0, 1), (1, 1, 1)]
    + [(a, b, 2) for a, b in ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (1, 2))],
    np.int64,
)


def _exponents(shape: str, order: int, serendipity: bool) -> IntArray:
    """Monomials of full tensor or total degree; serendipity keeps those of superlinear degree <= 2."""
    if shape == "pyramid":
        return _PYRAMID[: 13 if order == 2 else 5]
    dimension = len(_CORNERS[shape][0])
    exponents = np.array(list(product(range(order + 1), repeat=dimension)), np.int64)
    keep = np.ones(len(exponents), bool)
    if shape in ("triangle", "tetra"):
        keep = exponents.sum(axis=1) <= order
    elif shape == "wedge":
        keep = exponents[:, :2].sum(axis=1) <= order
        if serendipity:  # 15 nodes: no middle nodes on the quadrilateral faces, so z^2 goes with 1, x, y only
            keep &= (exponents[:, 2] < 2) | (exponents[:, :2].sum(axis=1) < 2)
    elif serendipity:
        keep = np.where(exponents >= 2, exponents, 0).sum(axis=1) <= 2
    return exponents[keep]


def _cell_type(name: str, shape: str, order: int, faces: bool = False) -> CellType:
    corners = np.array(_CORNERS[shape], float)
    nodes = list(corners)
    if order == 2:
        nodes += [corners[list(edge)].mean(axis=0) for edge in EDGES[shape]]
        if shape == "pyramid":  # upright edges do not lean in their cube
            nodes[9:] = [np.array([*corner[:2], 0.5]) for corner in corners[:4]]
        if faces:
            nodes += [corners[list(face)].mean(axis=0) for face in _QUAD_FACES.get(shape, [])]
    serendipity = order == 2 and not faces and shape in ("quad", "hexahedron", "wedge")
    corner = "vertex" if shape == "point" else shape
    return CellType(name, shape, order, np.array(nodes), _exponents(shape, order, serendipity), corner)


CELL_TYPES: dict[str, CellType] = {
    cell.name: cell
    for cell in (
        _cell_type("vertex", "point", 1),
        _cell_type("line", "line", 1),
        _cell_type("line3", "line", 2),
        _cell_type("triangle", "triangle", 1),
        _cell_type("triangle6", "triangle", 2),
        _cell_type("quad", "quad", 1),
        _cell_type("quad8", "quad", 2),
        _cell_type("quad9", "quad", 2, faces=True),
        _cell_type("tetra", "tetra", 1),
        _cell_type("tetra10", "tetra", 2),
        _cell_type("hexahedron", "hexahedron", 1),
        _cell_type("hexahedron20", "hexahedron", 2),
        _cell_type("hexahedron27", "hexahedron", 2, faces=True),
        _cell_type("wedge", "wedge", 1),
        _cell_type("wedge15", "wedge", 2),
        _cell_type("wedge18", "wedge", 2, faces=True),
        _cell_type("pyramid", "pyramid", 1),
        _cell_type("pyramid13", "pyramid", 2),
    )
}
# by numbers of corners and of nodes
SIDE_CELLS = {(2, 2): "line", (2, 3): "line3", (3, 3): "triangle", (3, 6): "triangle6", (4, 4): "quad", (4, 8): "quad8",
              (4, 9): "quad9"}  # fmt: skip


def side_of(kind: CellType, corners: Sequence[int]) -> tuple[str, list[int]]:
    """The cell on a face or an edge between corners of a cell, in their order, and its nodes' numbers in that cell."""
    middles = {frozenset(parents.tolist()): j for j, parents in enumerate(kind.parents, kind.n_corners)}
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True)) if len(corners) > 2 else [corners]
    between = [middles[frozenset(part)] for part in (*edges, *([corners] if len(corners) == 4 else []))
               if frozenset(part) in middles]  # fmt: skip
    return SIDE_CELLS[len(corners), len(corners) + len(between)], [*corners, *between]
