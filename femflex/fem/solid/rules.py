"""Quadrature of solid cells: points on the unit cell for strains, and for products of shape functions (mass)."""

from __future__ import annotations

from functools import cache

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet, RefTri

from femflex.arrays import Array
from femflex.mesh.quality import quadrature

# Of strains and of mass: Gauss points per direction of hexahedra and pyramids; degree over tetrahedra; degree over
# triangles and Gauss points across them of wedges. All are exact for cells with straight edges and equal strain
# energies; those of tetrahedra and pyramids have positive weights alone.
GAUSS = {"hexahedron": (2, 2), "hexahedron20": (3, 3), "hexahedron27": (3, 3), "pyramid": (2, 3), "pyramid13": (3, 4)}
SIMPLEX = {"tetra": (1, 2), "tetra10": (2, 5)}
WEDGE = {"wedge": ((2, 2), (2, 2)), "wedge15": ((4, 3), (4, 3)), "wedge18": ((4, 3), (4, 3))}
CELLS = (*GAUSS, *SIMPLEX, *WEDGE)
# Points per direction of the reduced rule. At these eight a hexahedron of 20 nodes does not lock. Rows of single
# elements then have motions without stiffness; elements side by side in two directions have none.
REDUCED = {"hexahedron20": 2}


@cache
def strain_rule(cell: str, full: bool = True) -> tuple[Array, Array]:
    """Points (q, 3) and weights (q,) on the unit cell for its strain energy, or of the reduced rule; read only."""
    if not full and cell in REDUCED:
        points, weight = quadrature("hexahedron", REDUCED[cell])
        return _read_only(points, weight)
    return _rule(cell, 0)


@cache
def mass_rule(cell: str) -> tuple[Array, Array]:
    """Points (q, 3) and weights (q,) on the unit cell for its mass matrix; read only."""
    return _rule(cell, 1)


def _rule(cell: str, which: int) -> tuple[Array, Array]:
    if cell in GAUSS:
        points, weight = quadrature("hexahedron", GAUSS[cell][which])
    elif cell in SIMPLEX:
        positions, weight = get_quadrature(RefTet, SIMPLEX[cell][which])
        points = positions.T
    else:
        degree, n = WEDGE[cell][which]
        flat, area = get_quadrature(RefTri, degree)
        z, line_weight = quadrature("line", n)
        points = np.column_stack([np.repeat(flat.T, n, axis=0), np.tile(z, (len(area), 1))])
        weight = np.outer(area, line_weight).ravel()
    return _read_only(points, weight)


def _read_only(points: Array, weight: Array) -> tuple[Array, Array]:
    points.setflags(write=False)
    weight.setflags(write=False)
    return points, weight
