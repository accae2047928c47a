"""Finite elements over the scaled length: shapes of deploying members without a family of admissible functions.

The member is divided into elements over xi = x / L: cubic Hermite polynomials for bending, quadratic ones along and
about the axis. The first vibration modes of this model at the reference length, with its own taper and tension, are the
shapes; they follow the length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array, IntArray

EVEN = 8  # elements where their ends are not given

HERMITE = (  # over s = 0 ... 1 of an element: deflection and slope per length at its ends
    np.polynomial.Polynomial([1, 0, -3, 2]),
    np.polynomial.Polynomial([0, 1, -2, 1]),
    np.polynomial.Polynomial([0, 0, 3, -2]),
    np.polynomial.Polynomial([0, 0, -1, 1]),
)
QUADRATIC = (  # values at the ends and in the middle
    np.polynomial.Polynomial([1, -3, 2]),
    np.polynomial.Polynomial([0, 4, -4]),
    np.polynomial.Polynomial([0, -1, 2]),
)


@dataclass(frozen=True)
class ElementFunctions:
    """Elements of a straight member, clamped at the exit, or pinned there if it has no bending stiffness.

    y, z, axial, torsion  how many vibration modes are kept for v(x), w(x), u(x), theta(x)
    elements              how many of equal length, or the inner ends of elements over the length, ascending
    string                elements of a tether: no slope is continuous, displacements are quadratic
    held                  whether the tip is held on the line of the member (strings)

    Raises ValueError where so many modes cannot be had from so few elements.
    """

    y: int = 0
    z: int = 0
    axial: int = 0
    torsion: int = 0
    elements: int | Sequence[float] = EVEN
    string: bool = False
    held: bool = False
    edges: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        n = self.elements
        edges = np.linspace(0.0, 1.0, n + 1) if isinstance(n, int) else np.array([0.0, *n, 1.0])
        if not len(edges) > 1 or np.any(np.diff(edges) <= 0.0):
            raise ValueError(
                f"elements of a deploying member are {self.elements}; give a number from 1, or the inner ends of "
                "elements, ascending between 0 and 1"
            )
        object.__setattr__(self, "edges", edges)
        counts = (self.y, self.z, self.axial, self.torsion)
        if min(counts) < 0 or not any(counts):
            raise ValueError(
                f"numbers of modes (y, z, axial, torsion) are {counts}; give at least one, and none negative"
            )
        for name, kept, bends in self._fields():
            if kept > (most := len(self._free_functions(bends, name in "yz"))):
                raise ValueError(
                    f"{kept} modes along {name} were requested; {len(edges) - 1} elements have {most}. Give more "
                    "elements or fewer modes"
                )

    @property
    def knots(self) -> Array:
        """Inner ends of the elements (k,), parts of the length [1]."""
        return self.edges[1:-1]

    @property
    def count(self) -> int:
        """Number of functions: degrees of freedom of the elements."""
        return sum(len(self._free_functions(bends, name in "yz")) for name, _, bends in self._fields())

    @property
    def max_count(self) -> int:
        """The largest number of modes of one field."""
        return max(self.y, self.z, self.axial, self.torsion)

    @property
    def blocks(self) -> list[tuple[IntArray, int]]:
        """Return the numbers (k,) of the functions of each field, and the number of its modes that are kept."""
        blocks, first = [], 0
        for name, kept, bends in self._fields():
            n = len(self._free_functions(bends, name in "yz"))
            blocks.append((np.arange(first, first + n), kept))
            first += n
        return blocks

    def fields(self, xi: Array, length: float, derivative: int = 0) -> Array:
        """Derivative by x (n_xi, 4, n) of u, v, w [m] and theta [rad] at x = xi length, xi (n_xi,) [1]."""
        values_of_fields, first = np.zeros((len(xi), 4, self.count)), 0
        rows = {"y": 1, "z": 2, "axial": 0, "torsion": 3}
        for name, _, bends in self._fields():
            values = self._values(xi, bends, derivative)[:, self._free_functions(bends, name in "yz")]
            values_of_fields[:, rows[name], first : first + values.shape[1]] = values / length**derivative
            first += values.shape[1]
        return values_of_fields

    def _fields(self) -> list[tuple[str, int, bool]]:
        """Name, number of modes, and whether slopes are continuous, of the fields that have modes."""
        counts = {"y": self.y, "z": self.z, "axial": self.axial, "torsion": self.torsion}
        return [(name, n, name in "yz" and not self.string) for name, n in counts.items() if n]

    def _free_functions(self, bends: bool, across: bool) -> IntArray:
        """The degrees of freedom of a field that its supports leave."""
        n = len(self.edges) - 1
        if bends:
            return np.arange(2, 2 * (n + 1))
        return np.arange(1, 2 * n + (0 if across and self.held else 1))

    def _values(self, xi: Array, bends: bool, derivative: int) -> Array:
        """All nodal functions of a field or their derivative by xi, (len(xi), n)."""
        n = len(self.edges) - 1
        local, step = (HERMITE, 2) if bends else (QUADRATIC, 2)
        out = np.zeros((len(xi), 2 * (n + 1) if bends else 2 * n + 1))
        inside = np.clip(np.searchsorted(self.edges, xi, side="right") - 1, 0, n - 1)
        size = np.diff(self.edges)[inside]
        s, rows = (xi - self.edges[inside]) / size, np.arange(len(xi))
        for k, polynomial in enumerate(local):
            value = (polynomial.deriv(derivative) if derivative else polynomial)(s) / size**derivative
            out[rows, step * inside + k] += value * size if bends and k % 2 else value
        return out
