"""Blocks of inertia and strain of shell elements; dofs: translations of all nodes, then their rotations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly import Part
from femflex.fem.shell.fields import ROWS
from femflex.fem.tables import DenseStrain, StrainBlock, StressAt, element_chunks, of

EVERY = slice(None)


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
        turned = np.cross(nodal[:, 1], self.V[elements][..., None], axis=2)
        layers = [np.einsum("qk,ekin->eqin", self.N, nodal[:, 0] + z * turned, optimize=True) for z in self.heights]
        return np.concatenate(layers, axis=1)

    def mass(self, elements: slice = EVERY) -> Array:
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

    def parts(self) -> tuple[Part, ...]:
        """Element matrices for assembly."""
        return (Part(self.dofs, self.mass),)


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

    coarse  elements -> the same over the points where their stretch is sampled, with gradients that can cancel the
            squares of slopes there; None: these are the block's own points
    """

    coarse: Callable[[slice], DenseStrain] | None = None

    def sampled(self, elements: slice) -> DenseStrain:
        """See StrainBlock."""
        if self.coarse is None:
            return self._own(elements)
        return replace(self.coarse(elements), stress=of(self.stress, elements))

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock: of second-order elements what the linear strain of the points of stretch lacks is added, and
        initial stress works at all points."""
        own = self._own(elements)
        initial = own.stress if stress is None else stress(own)
        if self.coarse is None:
            return (replace(own, stress=initial),)
        few, nothing = self.coarse(elements), np.zeros((1, 1, 1))
        straight = 0.0 * own.quadratic_map
        parts: tuple[StrainBlock, ...] = (
            replace(few, stress=nothing),
            replace(own, quadratic_map=straight, stress=nothing),
            replace(few, quadratic_map=straight, stress=nothing, elastic=-few.elastic),
        )
        return (*parts, replace(own, elastic=0.0 * own.elastic, stress=initial)) if initial.any() else parts

    def stiffness(self, elements: slice = EVERY) -> Array:
        """Element stiffness matrices (e, l, l) [N/m, N, N m] of the linear strain."""
        own = self._own(elements)
        l = own.dofs.shape[1]
        found = np.empty((len(own.dofs), l, l))
        for chunk in element_chunks(len(found), 30 * own.weight.shape[1] * l):
            found[chunk] = DenseStrain.stiffness(own._own_dense(chunk))
        return found

    def parts(self) -> tuple[Part, ...]:
        """Element matrices for assembly."""
        return (Part(self.dofs, self.stiffness),)

    def _own(self, elements: slice) -> ShellStrain:
        elastic, G, stress = of(self.elastic, elements), of(self.G, elements), of(self.stress, elements)
        return replace(
            self,
            dofs=self.dofs[elements],
            weight=self.weight[elements],
            elastic=elastic,
            G=G,
            stress=stress,
            coarse=None,
        )

    def _own_dense(self, elements: slice) -> DenseStrain:
        return DenseStrain(
            self.dofs[elements],
            self.weight[elements],
            of(self.elastic, elements),
            self.linear_map,
            self.quadratic_map,
            of(self.G, elements),
        )
