"""Softening of shapes of a structure by deflections in other shapes: lateral buckling, and the derivatives it needs.

Deflected to a phi_j, with all derivatives dependent, a structure has the tangent

    K_ik + a^2 N_j,ik,      N_j,ik = 6 V3_jjik - theta_ij.K theta_kj - 1/2 theta_jj.K theta_ik

over its shapes: the derivatives compensate the stiffness that stretching adds in V3. If N_j has a negative eigenvalue
lambda, the eigenvector x loses all of its stiffness at a = 1 / sqrt(-lambda): deflected in its stiff plane, a strip
bends sideways and twists. A set without part of sum_i x_i theta_ij, for the strip its twist, buckles too late.
That twist stores less than the stretch of soft shapes, by the square of thickness over length.
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
from femflex.reduction.modes.vibration import ModeSet
from femflex.reduction.strain.tensors import pair_number, strain_tensors

FAR = 0.2  # largest deflection over the structure's size, the limit of the strain measure
PURE = 0.5  # share of the stiffness lost by derivatives that must not be compensated stretch
SLOWER = 0.5  # frequency of a derivative over that of the faster of its two shapes
LACKING = 5e-3  # share of the softening that may be omitted; half of it is the error of the buckling load


@dataclass(frozen=True, eq=False)
class Softening:
    """Deflections that reduce the stiffness of other shapes, in the order of their loads.

    bend     (k,)     number of the deflected shape j
    factor   (k,)     -lambda: the stiffness of the shapes x is reduced by a^2 times this
    shapes   (k, n)   x of unit energy over shapes of unit energy
    load     (k,)     of modal force, omega_j a, over the lowest
    """

    bend: NDArray[np.intp]
    factor: Array
    shapes: Array
    load: Array


def softening(structure: Structure, modes: ModeSet, theta: Array) -> Softening:
    """The Softening of a set of shapes by deflections up to FAR.

    theta (n_dof, n(n+1)/2): the `scaled_derivatives` of the set
    """
    n = modes.n_modes
    stiffness = np.einsum("in,in->n", modes.phi, structure.K @ modes.phi)
    phi = modes.phi / np.sqrt(stiffness)
    V3 = unpacked(strain_tensors(structure, phi).V3, n, 4)
    pair = pair_table(n)
    C, K = theta.T @ (structure.K @ theta), phi.T @ (structure.K @ phi)
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    moved = np.linalg.norm((structure.translation @ phi).reshape(-1, 3, n), axis=1).max(axis=0)
    omega = np.sqrt(over_mass(structure, modes))
    bends = []
    for j in range(n):
        derivative_part = C[np.ix_(pair[j], pair[j])]
        N = 6 * V3[j, j] - derivative_part - C[pair[j, j]][pair] / 2
        values, x = linalg.eigh((N + N.T) / 2, K)
        limit = np.maximum((moved[j] / (FAR * size)) ** 2, PURE * np.einsum("im,ik,km->m", x, derivative_part, x))
        bends += [(omega[j] / np.sqrt(-values[m]), j, -values[m], x[:, m]) for m in np.flatnonzero(-values > limit)]
    bends.sort(key=lambda entry: entry[0])
    load = np.array([entry[0] for entry in bends])
    return Softening(
        bend=np.array([entry[1] for entry in bends], np.intp),
        factor=np.array([entry[2] for entry in bends]),
        shapes=np.array([entry[3] for entry in bends]).reshape(-1, n),
        load=load / load.min(initial=np.inf),
    )


def pair_table(n: int) -> NDArray[np.intp]:
    """Index (n, n) of each pair among all i <= j in lexicographic order."""
    i, j = np.arange(n)[:, None], np.arange(n)
    return np.asarray(pair_number(np.minimum(i, j), np.maximum(i, j), n), np.intp)


def answers_to_bends(structure: Structure, modes: ModeSet, theta: Array, kept: Array) -> Array:
    """Combinations (n_dof, k) of derivatives to add to kept shapes, for the softening of shapes by deflections.

    theta (n_dof, n(n+1)/2): `scaled_derivatives` of the set; kept (n_dof, m) and the result are K-orthonormal, and
    M-orthogonal to the set. At most LACKING of the softening is omitted, and f times as much for deflections under a
    load f times the lowest. Derivatives SLOWER than one of their two shapes are not used: these are bending driven by
    a stretching shape, which bending shapes already represent.
    """
    bends = softening(structure, modes, theta)
    if not len(bends.bend):
        return kept[:, :0]
    pair = pair_table(modes.n_modes)
    weight = 1.0 / np.sqrt(bends.factor * bends.load)
    outside = theta - modes.phi @ (modes.phi.T @ (structure.M @ theta))
    outside *= _not_slower(structure, modes, outside)
    missing = np.column_stack([outside[:, pair[j]] @ x for j, x in zip(bends.bend, bends.shapes, strict=True)])
    missing = (missing - kept @ (kept.T @ (structure.K @ missing))) * weight
    energy, X = np.linalg.eigh(missing.T @ (structure.K @ missing))
    significant = np.flatnonzero(energy > LACKING)[::-1]
    return np.asarray(missing @ (X[:, significant] / np.sqrt(energy[significant])))


def _not_slower(structure: Structure, modes: ModeSet, outside: Array) -> BoolArray:
    """(n(n+1)/2,): whether each derivative (n_dof, n(n+1)/2) is not SLOWER than one of its pair i <= j."""
    i, j = np.triu_indices(modes.n_modes)
    square = over_mass(structure, modes)
    stiffness, mass = (np.einsum("in,in->n", outside, A @ outside) for A in (structure.K, structure.M))
    return np.asarray(stiffness >= SLOWER**2 * np.maximum(square[i], square[j]) * mass)
