"""The full nonlinear elastic force of a Structure and its tangent, assembled from the strain table.

eps = L g + 1/2 g.Q g over generalised gradients g = G x, stress sigma = sigma0 + C eps, D = L + Q g = d eps / d g:

    V = int sigma0.eps + 1/2 eps.C eps      f = int G^T D^T sigma      K = int G^T (D^T C D + sigma.Q) G
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.assembly import Assembler, ElementMatrices
from femflex.fem.tables import StrainBlock, element_chunks


class InternalForce:
    """Elastic energy, force and tangent stiffness at displacements x (n_dof,) of independent dofs."""

    def __init__(self, strain: Sequence[StrainBlock], T: sparse.csr_array) -> None:
        self._strain, self._T = tuple(strain), T
        self._assembler = Assembler(T)  # one for all tangents, as it stores the connections of the dofs

    def energy(self, x: Array) -> float:
        """Strain energy V [J] of x (n_dof,) [m, rad], zero at x = 0."""
        return sum((state.energy() for _, state in self._states(x)), 0.0)

    def force(self, x: Array) -> Array:
        """dV/dx (n_dof,) [N, N m]; at x = 0 it is the unbalanced force of the initial stress."""
        raw = np.zeros(self._T.shape[0])
        for block, state in self._states(x):
            raw += np.bincount(block.dofs.ravel(), state.force().ravel(), len(raw))
        return np.asarray(self._T.T @ raw)

    def tangent(self, x: Array) -> sparse.csr_array:
        """d2V/dx2 (n_dof, n_dof) [N/m, N, N m], symmetric."""
        raw = self._T @ np.asarray(x, float)
        return self._assemble(lambda block: point_state(block, raw).stiffness())

    def geometric_stiffness(self, x: Array) -> sparse.csr_array:
        """Stiffness (n_dof, n_dof) [N/m, N, N m], symmetric, that the stress C L g of small displacements x adds."""
        return self._assemble(partial(geometric_stiffness_matrices, raw=self._T @ np.asarray(x, float)))

    def initial_stiffness(self) -> sparse.csr_array:
        """Stiffness (n_dof, n_dof) [N/m, N, N m], symmetric, that the initial stress adds at rest."""
        return self._assemble(lambda block: stress_matrices(block, block.stress))

    def initial_force(self) -> Array:
        """Unbalanced force (n_dof,) [N, N m] of the initial stress: the elastic force at rest."""
        raw = np.zeros(self._T.shape[0])
        for block in self._strain:
            for chunk in element_chunks(len(block.dofs), values_per_element(block)):
                for part in block.nonlinear(chunk):
                    if part.stress.any():
                        forces = initial_forces(part)
                        raw += np.bincount(part.dofs.ravel(), forces.ravel(), len(raw))
        return np.asarray(self._T.T @ raw)

    def work_of_stress(self, x: Array, phi: Array) -> Array:
        """phi^T `geometric_stiffness`(x) phi (p, k, k) of displacements x (n_dof, p), shapes phi (n_dof, k) [m, rad],
        without the matrices."""
        raw, raw_phi = self._T @ np.asarray(x, float), self._T @ phi
        total = np.zeros((x.shape[1], phi.shape[1], phi.shape[1]))
        for part in self._nonlinear_parts(phi.shape[1]):
            g = part.gradients(raw_phi, slice(None))
            stress = linear_stress(part, raw) * part.weight[..., None, None]
            for work, stress_of_shape in zip(total, np.moveaxis(stress, 3, 0), strict=True):
                inner = stress_times_quadratic_map(stress_of_shape, part.quadratic_map)
                work += np.matmul(g.swapaxes(2, 3), np.matmul(inner, g)).sum(axis=(0, 1))
        return total

    def quartic_energy(self, phi: Array) -> Array:
        """Part of fourth order (k,) [J] of the energy of shapes phi (n_dof, k), int e.C e / 2 with e = g.Q g / 2."""
        raw = self._T @ phi
        total = np.zeros(phi.shape[1])
        for part in self._nonlinear_parts(phi.shape[1]):
            g = part.gradients(raw, slice(None))
            eps = np.zeros((*g.shape[:2], len(part.quadratic_map), g.shape[3]))
            for s, row, column in zip(*np.nonzero(part.quadratic_map), strict=True):
                eps[:, :, s] += part.quadratic_map[s, row, column] / 2 * g[:, :, row] * g[:, :, column]
            energy = (eps * np.matmul(part.elastic, eps)).sum(axis=2)
            total += np.tensordot(part.weight, energy, 2) / 2
        return total

    def second_derivative(self, phi: Array, i: IntArray | None = None, j: IntArray | None = None) -> Array:
        """Derivative of the tangent along one shape times another at rest, (dK/da) b = (dK/db) a: (n_dof, k).

        a, b are the columns i (k,), j (k,) of phi (n_dof, n); without i and j each column is taken with itself.
        Gradients of a shape are computed once: G^T [L^T C (g_a.Q g_b) + Q g_a . C L g_b + Q g_b . C L g_a]. Initial
        stress has no effect.
        """
        if i is None or j is None:
            i = j = np.arange(phi.shape[1])
        raw = self._T @ phi
        out = np.zeros((len(raw), len(i)))
        for block in self._strain:
            for part in self._nonlinear_parts(len(i) + phi.shape[1], block):
                forces = second_derivative_forces(part, raw, i, j).reshape(part.dofs.size, -1)
                for column, force in zip(out.T, forces.T, strict=True):
                    column += np.bincount(part.dofs.ravel(), force, len(column))
        return np.asarray(self._T.T @ out)

    def _assemble(self, matrices_of: Callable[[StrainBlock], Array]) -> sparse.csr_array:
        return self._assembler.total(
            [ElementMatrices(block.dofs, _ChunkedMatrices(block, matrices_of)) for block in self._strain]
        )

    def _nonlinear_parts(self, columns: int, single_block: StrainBlock | None = None) -> Iterator[StrainBlock]:
        """Yield the parts of the blocks, or of one, whose strain is not all linear, in chunks for this number of
        columns."""
        for block in self._strain if single_block is None else (single_block,):
            size = values_per_element(block) + 8 * block.linear_map.shape[1] * block.weight.shape[1] * columns
            for chunk in element_chunks(len(block.dofs), size):
                yield from (part for part in block.nonlinear(chunk) if _is_nonlinear(part))

    def _states(self, x: Array) -> Iterator[tuple[StrainBlock, PointState]]:
        raw = self._T @ np.asarray(x, float)
        for block in self._strain:
            for chunk in element_chunks(len(block.dofs), values_per_element(block)):
                for part in block.nonlinear(chunk):
                    yield part, point_state(part, raw)


def values_per_element(block: StrainBlock) -> int:
    """Number of doubles that rows, stress and their products take at the points of one element."""
    s, g = block.linear_map.shape
    points = max(part.weight.shape[1] for part in block.nonlinear(slice(0, 1)))
    return points * (g * (g + 3 * block.dofs.shape[1]) + s * (s + g))


@dataclass(frozen=True, eq=False)
class PointState:
    """Strains, stresses and gradients at the points of a block for one displacement.

    weight (e, q)   G (e|1, q, g, l)   D (e, q, s, g)   C (e|1, q|1, s, s)   eps, sigma0, sigma (e, q, s)   Q (s, g, g)
    """

    weight: Array
    G: Array
    D: Array
    C: Array
    Q: Array
    eps: Array
    sigma0: Array
    sigma: Array

    def energy(self) -> float:
        """Energy of all points."""
        return float(np.sum(self.weight[..., None] * self.eps * (self.sigma0 + self.sigma)) / 2)

    def force(self) -> Array:
        """Element forces (e, l) [N, N m]."""
        push = np.matmul((self.weight[..., None] * self.sigma)[..., None, :], self.D)[..., 0, :]
        return np.einsum("eqg,eqgl->el", push, np.broadcast_to(self.G, (len(push), *self.G.shape[1:])), optimize=True)

    def stiffness(self) -> Array:
        """Element tangents (e, l, l) [N/m, N, N m]."""
        inner = np.matmul(self.D.swapaxes(2, 3), np.matmul(self.C, self.D))
        inner += np.einsum("eqs,sgh->eqgh", self.sigma, self.Q, optimize=True)
        weighted = np.matmul(inner * self.weight[..., None, None], self.G)
        e, l = len(weighted), weighted.shape[-1]
        flat = np.broadcast_to(self.G, weighted.shape).reshape(e, -1, l)
        return np.matmul(flat.swapaxes(1, 2), weighted.reshape(e, -1, l))


def point_state(block: StrainBlock, raw: Array) -> PointState:
    """The state of a block's points at raw displacements (n_raw,) [m, rad]."""
    all_elements = slice(None)
    g = block.gradients(raw[:, None], all_elements)[..., 0]
    Qg = np.einsum("sgh,eqh->eqsg", block.quadratic_map, g, optimize=True)
    D = block.linear_map + Qg
    eps = np.matmul(block.linear_map + Qg / 2, g[..., None])[..., 0]
    sigma0 = np.broadcast_to(block.stress, eps.shape)
    sigma = sigma0 + np.matmul(block.elastic, eps[..., None])[..., 0]
    return PointState(block.weight, block.rows(all_elements), D, block.elastic, block.quadratic_map, eps, sigma0, sigma)


def second_derivative_forces(block: StrainBlock, raw: Array, i: IntArray, j: IntArray) -> Array:
    """Element forces (e, l, k) [N, N m] of `InternalForce.second_derivative`; raw (n_raw, n)."""
    rows = block.rows(slice(None))
    g = np.matmul(rows, raw[block.dofs][:, None])
    stress = np.matmul(block.elastic, np.matmul(block.linear_map, g))
    g_i, g_j, stress_i, stress_j = g[..., i], g[..., j], stress[..., i], stress[..., j]
    Q = (block.quadratic_map + block.quadratic_map.swapaxes(1, 2)) / 2
    bend = np.zeros((*g.shape[:2], len(Q), len(i)))
    push = np.zeros((*g.shape[:3], len(i)))
    for s, row, column in zip(*np.nonzero(Q), strict=True):
        value = Q[s, row, column]
        bend[:, :, s] += value * g_i[:, :, row] * g_j[:, :, column]
        push[:, :, row] += value * (g_i[:, :, column] * stress_j[:, :, s] + g_j[:, :, column] * stress_i[:, :, s])
    push += np.matmul(block.linear_map.T, np.matmul(block.elastic, bend))
    push *= block.weight[:, :, None, None]
    return np.matmul(rows.reshape(len(rows), -1, rows.shape[-1]).swapaxes(1, 2), push.reshape(len(push), -1, len(i)))


def geometric_stiffness_matrices(block: StrainBlock, raw: Array) -> Array:
    """Element matrices (e, l, l) [N/m, N, N m] of `InternalForce.geometric_stiffness`."""
    return stress_matrices(
        block, linear_stress(block, raw[:, None])[..., 0] if _is_nonlinear(block) else np.zeros((1, 1, 1))
    )


def _is_nonlinear(part: StrainBlock) -> bool:
    """Whether the strain of a part has a quadratic term and costs energy; a part that only carries initial stress costs
    none."""
    return bool(part.quadratic_map.any() and part.elastic.any())


def initial_forces(part: StrainBlock) -> Array:
    """Element forces (e, l) [N, N m] of `InternalForce.initial_force`."""
    push = (part.weight[..., None] * part.stress) @ part.linear_map
    most = int(np.flatnonzero(push.any(axis=(0, 1))).max(initial=0)) + 1
    rows, push = part.rows(slice(None), most), push[:, :, :most]
    return np.matmul(push.reshape(len(push), 1, -1), rows.reshape(len(rows), -1, rows.shape[-1]))[:, 0]


def linear_stress(block: StrainBlock, raw: Array) -> Array:
    """Stress (e, q, s, k) of the linear strain of raw displacements (n_raw, k) [m, rad]."""
    g = block.gradients(raw, slice(None))
    return np.asarray(np.matmul(block.elastic, np.matmul(block.linear_map, g)))


def stress_matrices(block: StrainBlock, stress: Array) -> Array:
    """Element matrices (e, l, l) [N/m, N, N m] int G^T (stress.Q) G of a stress (e|1, q|1, s).

    Only gradients whose products the stress multiplies are used; where all elements are alike, these products are too.
    """
    (e, q), l = block.weight.shape, block.dofs.shape[1]
    active = stress.any(axis=(0, 1)) & block.quadratic_map.any(axis=(1, 2))
    total = np.zeros((e, l, l))
    if not active.any():
        return total
    Q = block.quadratic_map[active]
    used = np.flatnonzero(Q.any(axis=(0, 1)) | Q.any(axis=(0, 2)))
    Q, G = Q[:, used][:, :, used], block.rows(slice(None), int(used[-1]) + 1)[:, :, used]
    columns = np.flatnonzero(G.any(axis=(0, 1, 2)))
    G, n = G[..., columns], len(columns)
    weighted = np.broadcast_to(stress[..., active], (e, q, len(Q))) * block.weight[..., None]
    if len(G) == 1 and e > 1:
        products = np.einsum("qgl,sgh,qhm->qslm", G[0], Q, G[0], optimize=True)
        matrices = (weighted.reshape(e, -1) @ products.reshape(-1, n * n)).reshape(e, n, n)
    else:
        inner = np.matmul(stress_times_quadratic_map(weighted, Q), G).reshape(e, -1, n)
        matrices = np.matmul(G.reshape(len(G), -1, n).swapaxes(1, 2), inner)
    total[:, columns[:, None], columns] = matrices
    return total


def stress_times_quadratic_map(stress: Array, Q: Array) -> Array:
    """stress.Q (e, q, g, g) of stresses (e, q, s) [N, N m, N/m or Pa]."""
    return np.asarray((stress.reshape(-1, len(Q)) @ Q.reshape(len(Q), -1)).reshape(*stress.shape[:2], *Q.shape[1:]))


class _ChunkedMatrices:
    """Element matrices for a slice of elements, computed in chunks whose points fit in memory."""

    def __init__(self, block: StrainBlock, matrices_of: Callable[[StrainBlock], Array]) -> None:
        self._block, self._matrices_of, self._size = block, matrices_of, values_per_element(block)

    def __call__(self, elements: slice) -> Array:
        start, stop, _ = elements.indices(len(self._block.dofs))
        parts = []
        for chunk in element_chunks(stop - start, self._size):
            elements_of_chunk = slice(start + chunk.start, start + chunk.stop)
            parts.append(sum(self._matrices_of(part) for part in self._block.nonlinear(elements_of_chunk)))
        return np.concatenate(parts)
