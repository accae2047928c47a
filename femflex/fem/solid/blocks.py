"""Inertia and strain of isoparametric solid elements, which store only scalar shape functions and their gradients.

Dofs are the translations of the nodes, (node, component) in this order. The strain is that of Green and Lagrange,
E = (g + g^T + g^T g) / 2 with g_ia = du_i/dx_a, in the order xx, yy, zz, yz, xz, xy with engineering shears.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet, RefTri

from femflex.arrays import Array, IntArray
from femflex.fem.assembly import ElementMatrices
from femflex.fem.sections.materials import VOIGT
from femflex.fem.tables import StrainBlock, StressAt, rows_of_elements
from femflex.mesh.quality import quadrature

ALL_ELEMENTS = slice(None)


@dataclass(frozen=True, eq=False)
class SolidInertia:
    """Points of mass in solid elements: N (q, k) scalar shape functions at the points, the same in all elements."""

    dofs: IntArray
    dm: Array
    rho: Array
    N: Array

    def shapes(self, phi: Array, elements: slice) -> Array:
        """Displacement (e, q, 3, n) [m] of the points per column of phi (n_raw, n)."""
        dofs, (q, k), n = self.dofs[elements], self.N.shape, phi.shape[1]
        return np.matmul(self.N, phi[dofs].reshape(len(dofs), k, 3 * n)).reshape(len(dofs), q, 3, n)

    def scalar_mass(self, elements: slice = ALL_ELEMENTS) -> Array:
        """Element mass matrices of one component (e, k, k) [kg]: int N_k N_l dm."""
        k = self.N.shape[1]
        products = (self.N[:, :, None] * self.N[:, None, :]).reshape(-1, k * k)
        return (self.dm[elements] @ products).reshape(-1, k, k)

    def mass(self) -> Array:
        """Element mass matrices (e, l, l) [kg, kg m, kg m^2]."""
        scalar = self.scalar_mass()
        e, k = scalar.shape[:2]
        return np.einsum("ekl,ab->ekalb", scalar, np.eye(3)).reshape(e, 3 * k, 3 * k)

    def parts(self) -> tuple[ElementMatrices, ...]:
        """Element matrices for assembly: one matrix for the three components."""
        return (ElementMatrices(self.dofs.reshape(len(self.dofs), -1, 3), self.scalar_mass),)


@dataclass(frozen=True, eq=False)
class SolidStrain:
    """Points of strain in solid elements: G (e, q, 3, k) gradients of the scalar shape functions.

    dilatation  separate points for a part of the volumetric energy, for nearly incompressible materials
    enhanced    additional strains of bricks of eight nodes, so that they bend correctly
    """

    dofs: IntArray
    weight: Array
    elastic: Array
    linear_map: Array
    quadratic_map: Array
    G: Array
    stress: Array
    dilatation: Dilatation | None = None
    enhanced: Enhanced | None = None

    def gradients(self, phi: Array, elements: slice, most: int | None = None) -> Array:
        """Displacement gradients (e, q, 9, n) [1] du_i/dx_a, row 3 i + a, per column of phi (n_raw, n)."""
        e, q, _, k = self.G[elements].shape
        nodal = phi[self.dofs[elements]].reshape(e, k, -1)
        g = np.matmul(self.G[elements].reshape(e, 3 * q, k), nodal).reshape(e, q, 3, 3, -1)
        g = g.swapaxes(2, 3).reshape(e, q, 9, -1)
        if self.dilatation is not None:
            volume_gradients = np.matmul(_rows(self.dilatation.G[elements]), phi[self.dofs[elements]][:, None])
            g = np.concatenate([g, _dilatation_row(self.dilatation.spread, volume_gradients, g)], axis=2)
        if self.enhanced is not None:
            enhanced_rows = np.matmul(self.enhanced.of_elements(elements).rows(), phi[self.dofs[elements]][:, None])
            g = np.concatenate([g, enhanced_rows], axis=2)
        return g[:, :, :most]

    def rows(self, elements: slice, most: int | None = None) -> Array:
        """Displacement gradients (e, q, 9, 3 k) [1/m] per dof, or the first `most` of them."""
        rows = _rows(self.G[elements])
        if self.dilatation is not None:
            more = _dilatation_row(self.dilatation.spread, _rows(self.dilatation.G[elements]), rows)
            rows = np.concatenate([rows, more], axis=2)
        if self.enhanced is not None:
            rows = np.concatenate([rows, self.enhanced.of_elements(elements).rows()], axis=2)
        return rows[:, :, :most]

    def sampled(self, elements: slice) -> SolidStrain:
        """See StrainBlock; these are the points of the linear strain.

        Three Gauss points per direction are exact for E:E of a displacement that bends a hexahedron along one axis
        (degree 4 of 5); of the full triquadratic field five points change the energy of a bent strip by 1e-7. Four
        points of a tetrahedron sample the stretch where its quadratic field can cancel it.
        """
        return replace(
            self,
            dofs=self.dofs[elements],
            weight=self.weight[elements],
            elastic=rows_of_elements(self.elastic, elements),
            G=self.G[elements],
            stress=rows_of_elements(self.stress, elements),
            dilatation=self.dilatation and self.dilatation.of_elements(elements),
            enhanced=self.enhanced and self.enhanced.of_elements(elements),
        )

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock; a part of the volumetric energy has separate points."""
        sampled = self.sampled(elements)
        sampled = sampled if stress is None else replace(sampled, stress=stress(sampled))
        return (sampled,) if sampled.dilatation is None else sampled._split_dilatation(sampled.dilatation)

    def _split_dilatation(self, dilatation: Dilatation) -> tuple[SolidStrain, SolidStrain]:
        """Split the energy into the rest and the part of the volumetric energy that has separate points."""
        linear, quadratic, elastic = self.linear_map[:, :9], self.quadratic_map[:, :9, :9], self.elastic.copy()
        elastic[..., :3, :3] -= dilatation.bulk
        rest = replace(self, elastic=elastic, linear_map=linear, quadratic_map=quadratic, dilatation=None)
        trace, squares = linear[:3].sum(axis=0, keepdims=True), quadratic[:3].sum(axis=0, keepdims=True)
        bulk, no_stress = np.full((1, 1, 1, 1), dilatation.bulk), np.zeros((1, 1, 1))
        return rest, SolidStrain(self.dofs, dilatation.weight, bulk, trace, squares, dilatation.G, no_stress)

    def stiffness(self, elements: slice = ALL_ELEMENTS) -> Array:
        """Element stiffness matrices (e, l, l) [N/m, N, N m] of the linear strain.

        K_(k i)(l j) = sum_ab c_iajb int dN_k/dx_a dN_l/dx_b dV: nine scalar products, then the elastic tensor.
        """
        if self.dilatation is not None:
            rest, volume = self.sampled(elements)._split_dilatation(self.dilatation.of_elements(elements))
            return rest.stiffness() + volume.stiffness()
        G = self.G[elements]
        e, q, _, k = G.shape
        flat = G.reshape(e, q, 3 * k)
        products = np.matmul(flat.swapaxes(1, 2), flat * self.weight[elements][:, :, None])  # (a k), (b l)
        products = products.reshape(e, 3, k, 3, k).transpose(1, 3, 0, 2, 4).reshape(9, -1)
        linear = self.linear_map[:, :9]
        C = linear.T @ self.elastic[0, 0] @ linear  # (i a), (j b)
        by_pair = C.reshape(3, 3, 3, 3).transpose(0, 2, 1, 3).reshape(9, 9) @ products  # (i j), (a b)
        K = by_pair.reshape(3, 3, e, k, k).transpose(2, 3, 0, 4, 1).reshape(e, 3 * k, 3 * k)
        if self.enhanced is not None:
            enhanced = self.enhanced.of_elements(elements)
            K -= np.matmul(
                enhanced.response.swapaxes(1, 2),
                np.matmul(enhanced.stiffness(self.weight[elements], self.elastic), enhanced.response),
            )
        return K

    def parts(self) -> tuple[ElementMatrices, ...]:
        """Element matrices for assembly."""
        return (ElementMatrices(self.dofs, self.stiffness),)


@dataclass(frozen=True, eq=False)
class Dilatation:
    """Points at which a part of the volumetric energy, bulk (tr E)^2 / 2, is integrated; they are so few that the
    element does not lock.

    G, weight  (e, m, 3, k), (e, m)  gradients of the shape functions at these points, and their volumes
    spread     (q, m)                from values at these points to the points of the other energy
    bulk       [Pa]
    """

    G: Array
    weight: Array
    spread: Array
    bulk: float

    def of_elements(self, elements: slice) -> Dilatation:
        """The points of these elements."""
        return replace(self, G=self.G[elements], weight=self.weight[elements])


@dataclass(frozen=True, eq=False)
class Enhanced:
    """Strains of incompatible displacements (1 - xi_m^2) a_m, m = 1, 2, 3, of bricks of eight nodes.

    Their gradients are those at the centre, j0 / j (-2 xi_m) a_m J0^-1, whose mean is zero: constant strain stays exact
    (R. L. Taylor, P. J. Beresford, E. L. Wilson, Int. J. Num. Meth. Engng 10 (1976) 1211). The nine a follow the nodes'
    displacements so that the energy of the linear strain is least.

    slope     (e, q, 3, 3)   gradient of each function, row m
    response  (e, 9, 3 k)    the a per dof
    """

    slope: Array
    response: Array

    def of_elements(self, elements: slice) -> Enhanced:
        """The strains of these elements."""
        return Enhanced(self.slope[elements], self.response[elements])

    def strains(self) -> Array:
        """Strains (e, q, 6, 9) [1] per a."""
        return enhanced_strains(self.slope)

    def rows(self) -> Array:
        """Strains (e, q, 6, 3 k) [1/m] per dof."""
        return np.matmul(self.strains(), self.response[:, None])

    def stiffness(self, weight: Array, elastic: Array) -> Array:
        """Stiffness (e, 9, 9) [N/m] of the a at points of weight (e, q) with the elastic matrix (1, 1, 6, 6)."""
        B = self.strains()
        return np.matmul(B.swapaxes(2, 3), np.matmul(elastic, B) * weight[:, :, None, None]).sum(axis=1)


def enhanced_strains(slope: Array) -> Array:
    """Strains (e, q, 6, 9) of displacements a_m f_m with gradients slope (e, q, 3, 3) of the f_m, per (m, i) of a."""
    e, q = slope.shape[:2]
    gradients = np.zeros((e, q, 3, 3, 3, 3))  # i, x_j, m, i
    for i in range(3):
        gradients[:, :, i, :, :, i] = slope.swapaxes(2, 3)
    return strain_maps()[0] @ gradients.reshape(e, q, 9, 9)


def _rows(G: Array) -> Array:
    """Displacement gradients (e, q, 9, 3 k) [1/m] per dof of gradients G (e, q, 3, k) of the shape functions."""
    e, q, _, k = G.shape
    rows = np.zeros((e, q, 3, 3, k, 3))
    for i in range(3):
        rows[:, :, i, :, :, i] = G
    return rows.reshape(e, q, 9, 3 * k)


def _dilatation_row(weights: Array, volume_gradients: Array, g: Array) -> Array:
    """Dilatation (e, q, 1, n) interpolated by weights (q, m) from gradients (e, m, 9, n), minus that of g (e, q, 9,
    n)."""
    dilatation, local_dilatation = (part[:, :, 0] + part[:, :, 4] + part[:, :, 8] for part in (volume_gradients, g))
    return np.asarray(np.matmul(weights, dilatation) - local_dilatation)[:, :, None]


def strain_maps() -> tuple[Array, Array]:
    """linear_map (6, 9) and quadratic_map (6, 9, 9) [1] of the Green-Lagrange strain over g, row 3 i + a =
    du_i/dx_a."""
    linear, quadratic = np.zeros((6, 9)), np.zeros((6, 9, 9))
    for s, (a, b) in enumerate(VOIGT):
        linear[s, 3 * a + b] = linear[s, 3 * b + a] = 1.0
        for i in range(3):  # E_ab: g_ia g_ib / 2, twice that in a shear; eps takes half of the quadratic map
            quadratic[s, 3 * i + a, 3 * i + b] += 0.5 if a == b else 1.0
            quadratic[s, 3 * i + b, 3 * i + a] += 0.5 if a == b else 1.0
    return linear, quadratic


# Of strains and of mass: Gauss points per direction of hexahedra and pyramids; degree over tetrahedra; degree over
# triangles and Gauss points across them of wedges. All are exact for cells with straight edges and equal strain
# energies; those of tetrahedra and pyramids have positive weights alone.
GAUSS = {"hexahedron": (2, 2), "hexahedron20": (3, 3), "hexahedron27": (3, 3), "pyramid": (2, 3), "pyramid13": (3, 4)}
SIMPLEX = {"tetra": (1, 2), "tetra10": (2, 5)}
WEDGE = {"wedge": (2, 2), "wedge15": (4, 3), "wedge18": (4, 3)}  # of both
CELLS = (*GAUSS, *SIMPLEX, *WEDGE)
# Points per direction of the reduced rule. At these eight a hexahedron of 20 nodes does not lock. Rows of single
# elements then have motions without stiffness; elements side by side in two directions have none.
REDUCED = {"hexahedron20": 2}


def cell_rule(cell: str, use: int, reduced: bool = False) -> tuple[Array, Array]:
    """Points (q, 3) and weights (q,) on the unit cell for its strain (use 0; or the reduced rule) or mass (1)."""
    if reduced and cell in REDUCED:
        return quadrature("hexahedron", REDUCED[cell])
    if cell in GAUSS:
        return quadrature("hexahedron", GAUSS[cell][use])
    if cell in SIMPLEX:
        positions, weight = get_quadrature(RefTet, SIMPLEX[cell][use])
        return positions.T, weight
    degree, n = WEDGE[cell]
    flat, area = get_quadrature(RefTri, degree)
    z, line_weight = quadrature("line", n)
    points = np.column_stack([np.repeat(flat.T, n, axis=0), np.tile(z, (len(area), 1))])
    return points, np.outer(area, line_weight).ravel()
