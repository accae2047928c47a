"""How bends of a structure soften its other shapes: what tips a strip over sideways, and by which derivatives.

Bent to a phi_j with all derivatives following, a structure has the tangent

    K_ik + a^2 N_j,ik,      N_j,ik = 6 V3_jjik - theta_ij.K theta_kj - 1/2 theta_jj.K theta_ik

over its shapes: what stretching adds in V3, the derivatives take away again. Where N_j has a negative eigenvalue
lambda, the bend takes all stiffness of the eigenvector x at a = 1 / sqrt(-lambda): bent in its stiff plane, a strip
bends sideways and twists. A set that lacks part of sum_i x_i theta_ij there, in the strip its twist, buckles too late.
That twist stores far less than the stretch of soft shapes, by the square of thickness over length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from femflex.arrays import Array, BoolArray
from femflex.body.symmetric import unpacked
from femflex.fem.structure import Structure
from femflex.reduction.large_deflection.bent_states import over_mass
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.strain.tensors import pair_number, strain_tensors

FAR = 0.2  # deflection over the structure's size up to which a bend is looked at; strain holds no further
PURE = 0.5  # of what derivatives take from a shape's stiffness, the part that is no stretch taken back
SLOWER = 0.5  # frequency of a derivative over that of the faster of its two shapes
LACKING = 5e-3  # part of what softens a shape that may be missing: half of it in the load at which it buckles


@dataclass(frozen=True, eq=False)
class Softening:
    """Bends that take the stiffness of some shape away, those under the lowest loads first.

    bend     (k,)     number of the shape j that is bent
    factor   (k,)     -lambda: a^2 times this is lost, of the stiffness of the shapes x
    shapes   (k, n)   x of unit energy over shapes of unit energy
    load     (k,)     of modal force, omega_j a, over the lowest
    """

    bend: NDArray[np.intp]
    factor: Array
    shapes: Array
    load: Array


def softening(structure: Structure, modes: ModeSet, theta: Array) -> Softening:
    """Softening [1] of a set of shapes by bends no larger than FAR, theta (n_dof, n(n+1)/2) its
    `scaled_derivatives`."""
    n = modes.n_modes
    stiffness = np.einsum("in,in->n", modes.phi, structure.K @ modes.phi)
    phi = modes.phi / np.sqrt(stiffness)
    V3 = unpacked(strain_tensors(structure, phi).V3, n, 4)
    pair = pair_table(n)
    C, K = theta.T @ (structure.K @ theta), phi.T @ (structure.K @ phi)
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    moved = np.linalg.norm((structure.translation @ phi).reshape(-1, 3, n), axis=1).max(axis=0)
    omega = np.sqrt(over_mass(structure, modes))
    found = []
    for j in range(n):
        taken = C[np.ix_(pair[j], pair[j])]
        N = 6 * V3[j, j] - taken - C[pair[j, j]][pair] / 2
        values, x = linalg.eigh((N + N.T) / 2, K)
        least = np.maximum((moved[j] / (FAR * size)) ** 2, PURE * np.einsum("im,ik,km->m", x, taken, x))
        found += [(omega[j] / np.sqrt(-values[m]), j, -values[m], x[:, m]) for m in np.flatnonzero(-values > least)]
    found.sort(key=lambda each: each[0])
    load = np.array([each[0] for each in found])
    return Softening(
        bend=np.array([each[1] for each in found], np.intp),
        factor=np.array([each[2] for each in found]),
        shapes=np.array([each[3] for each in found]).reshape(-1, n),
        load=load / load.min(initial=np.inf),
    )


def pair_table(n: int) -> NDArray[np.intp]:
    """Place (n, n), an index, of each pair among all i <= j in lexicographic order."""
    i, j = np.arange(n)[:, None], np.arange(n)
    return np.asarray(pair_number(np.minimum(i, j), np.maximum(i, j), n), np.intp)


def answers_to_bends(structure: Structure, modes: ModeSet, theta: Array, kept: Array) -> Array:
    """Combinations (n_dof, k) of derivatives that kept shapes lack for bends to soften other shapes as they should.

    theta (n_dof, n(n+1)/2): `scaled_derivatives` of the set; kept (n_dof, m) and what is found are K-orthonormal, and
    outside the set by mass. Of what softens a shape at most LACKING is left out, of bends under a load f times that of
    the lowest, f times as much. Derivatives are left out that are SLOWER than one of their two shapes: the bending that
    a stretching shape drives, of which bending shapes themselves hold enough.
    """
    found = softening(structure, modes, theta)
    if not len(found.bend):
        return kept[:, :0]
    pair = pair_table(modes.n_modes)
    weight = 1.0 / np.sqrt(found.factor * found.load)
    outside = theta - modes.phi @ (modes.phi.T @ (structure.M @ theta))
    outside *= _not_slower(structure, modes, outside)
    left = np.column_stack([outside[:, pair[j]] @ x for j, x in zip(found.bend, found.shapes, strict=True)])
    left = (left - kept @ (kept.T @ (structure.K @ left))) * weight
    energy, X = np.linalg.eigh(left.T @ (structure.K @ left))
    heard = np.flatnonzero(energy > LACKING)[::-1]
    return np.asarray(left @ (X[:, heard] / np.sqrt(energy[heard])))


def _not_slower(structure: Structure, modes: ModeSet, outside: Array) -> BoolArray:
    """Whether derivatives (n_dof, n(n+1)/2) are not SLOWER than one of the pair i <= j they belong to."""
    i, j = np.triu_indices(modes.n_modes)
    square = over_mass(structure, modes)
    stiffness, mass = (np.einsum("in,in->n", outside, A @ outside) for A in (structure.K, structure.M))
    return np.asarray(stiffness >= SLOWER**2 * np.maximum(square[i], square[j]) * mass)
