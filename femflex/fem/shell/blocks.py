"""Blocks of inertia and strain of shell elements; dofs: translations of all nodes, then their rotations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly import ElementMatrices
from femflex.fem.shell.fields import ROWS
from femflex.fem.tables import DenseStrain, StrainBlock, StressAt, element_chunks, rows_of_elements

ALL_ELEMENTS = slice(None)


@dataclass(frozen=True, eq=False)
class ShellInertia:
    """Points of mass of shells: on their surface, or pairs at +- the radius of gyration along the directors.

    dofs     (e, 6 k)
    dm, rho  (e, r q), (e, r q, 3)  layer by layer
    N        (q, k)                 scalar shape functions
    V        (e, k, 3)              directors of the nodes
    heights  (r,)                   of the layers [m]
    """

    dofs: IntArray
    dm: Array
    rho: Array
    N: Array
    V: Array
    heights: Array

    def shapes(self, phi: Array, elements: slice) -> Array:
        """Displacement (e, r q, 3, n) [m] of the points per column of phi (n_raw, n)."""
        dofs, k = self.dofs[elements], self.N.shape[1]
        nodal = phi[dofs].reshape(len(dofs), 2, k, 3, phi.shape[1])
        rotated = np.cross(nodal[:, 1], self.V[elements][..., None], axis=2)
        layers = [np.einsum("qk,ekin->eqin", self.N, nodal[:, 0] + z * rotated, optimize=True) for z in self.heights]
        return np.concatenate(layers, axis=1)

    def mass(self, elements: slice = ALL_ELEMENTS) -> Array:
        """Element mass matrices (e, l, l) [kg, kg m, kg m^2]."""
        k, r = self.N.shape[1], len(self.heights)
        dm = self.dm[elements].reshape(-1, r, len(self.N))
        products = (self.N[:, :, None] * self.N[:, None, :]).reshape(-1, k * k)
        moments = [np.einsum("erq,r->eq", dm, self.heights**p) @ products for p in range(3)]
        line, first, second = (m.reshape(-1, k, k) for m in moments)
        V = self.V[elements]
        lever = np.cross(np.eye(3), V[:, :, None]).swapaxes(2, 3)  # (e, k, i, j): (theta x V)_i = lever_ij theta_j
        M = np.zeros((len(dm), 2, k, 3, 2, k, 3))
        M[:, 0, :, :, 0] = np.einsum("ekl,ij->ekilj", line, np.eye(3))
        M[:, 0, :, :, 1] = np.einsum("ekl,elij->ekilj", first, lever)
        M[:, 1, :, :, 0] = np.einsum("ekl,ekji->ekilj", first, lever)
        M[:, 1, :, :, 1] = np.einsum("ekl,ekmi,elmj->ekilj", second, lever, lever, optimize=True)
        return M.reshape(len(dm), 6 * k, 6 * k)

    def parts(self) -> tuple[ElementMatrices, ...]:
        """Element matrices for assembly."""
        return (ElementMatrices(self.dofs, self.mass),)


def strain_maps() -> tuple[Array, Array]:
    """linear_map (8, 11) and quadratic_map (8, 11, 11) [1, m] over the gradients of shells: those of plates, with
    omega^2."""
    linear, quadratic = np.zeros((8, ROWS)), np.zeros((8, ROWS, ROWS))
    linear[0, 0] = linear[1, 3] = linear[2, 1] = linear[2, 2] = 1.0
    linear[3:, 6:] = np.eye(5)
    quadratic[0, 4, 4] = quadratic[1, 5, 5] = quadratic[2, 4, 5] = quadratic[2, 5, 4] = 1.0
    quadratic[:2, 1:3, 1:3] += np.array([[0.25, -0.25], [-0.25, 0.25]])  # omega = (v,x - u,y) / 2
    for strain, kappa in zip((3, 4, 5), (6, 7, 8), strict=True):
        quadratic[strain, kappa, [0, 3]] = quadratic[strain, [0, 3], kappa] = -1.0
    return linear, quadratic


@dataclass(frozen=True, eq=False)
class ShellStrain(DenseStrain):
    """Points of strain of shells.

    coarse  elements -> their strain at the points where stretch is sampled, with gradients that can cancel the squares
            of slopes there; None: these are the block's own points
    """

    coarse: Callable[[slice], DenseStrain] | None = None

    def sampled(self, elements: slice) -> DenseStrain:
        """See StrainBlock."""
        if self.coarse is None:
            return self.of_elements(elements)
        return replace(self.coarse(elements), stress=rows_of_elements(self.stress, elements))

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock; for second-order elements the linear strain at all points replaces that at the coarse ones,
        and initial stress acts at all points."""
        block = replace(self.of_elements(elements), coarse=None)
        initial = block.stress if stress is None else stress(block)
        if self.coarse is None:
            return (replace(block, stress=initial),)
        coarse_block, no_stress = self.coarse(elements), np.zeros((1, 1, 1))
        no_products = 0.0 * block.quadratic_map
        parts: tuple[StrainBlock, ...] = (
            replace(coarse_block, stress=no_stress),
            replace(block, quadratic_map=no_products, stress=no_stress),
            replace(coarse_block, quadratic_map=no_products, stress=no_stress, elastic=-coarse_block.elastic),
        )
        return (*parts, replace(block, elastic=0.0 * block.elastic, stress=initial)) if initial.any() else parts

    def stiffness(self, elements: slice = ALL_ELEMENTS) -> Array:
        """Element stiffness matrices (e, l, l) [N/m, N, N m] of the linear strain."""
        block = self.dense(elements)
        l = block.dofs.shape[1]
        matrices = np.empty((len(block.dofs), l, l))
        for chunk in element_chunks(len(matrices), 30 * block.weight.shape[1] * l):
            matrices[chunk] = block.of_elements(chunk).stiffness()
        return matrices

    def parts(self) -> tuple[ElementMatrices, ...]:
        """Element matrices for assembly."""
        return (ElementMatrices(self.dofs, self.stiffness),)
