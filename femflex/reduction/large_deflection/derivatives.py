"""Static modal derivatives: the second-order displacements of a structure that its modes deflect.

To second order the static shape that carries amplitudes q of shapes phi is

    x = phi_i q_i + 1/2 theta_ij q_i q_j,      K theta_ij = -(dK/dphi_j) phi_i,

symmetric in i and j because V has a third derivative. In a set of shapes theta compensates the stretch that bending
would otherwise store in V2 and V3 (Idelsohn and Cardona, Comput. Methods Appl. Mech. Engng 49 (1985) 253). The
behaviour at a deflection of several thicknesses cannot be derived at rest; there static states replace theta
(`bent_states`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from femflex.arrays import Array, BoolArray
from femflex.body.symmetric import unpacked
from femflex.fem.structure import Structure
from femflex.reduction.inertia.accelerations import answers_to_accelerations
from femflex.reduction.large_deflection.bent_states import bent_states, over_mass
from femflex.reduction.modes.vibration import ModeSet, ritz, static_response
from femflex.reduction.strain.condense import FASTER
from femflex.reduction.strain.tensors import pair_number, strain_tensors

RANK = 1e-12  # share of the largest energy below which a combination of derivatives adds nothing (1e-6 in amplitude)
FAR = 0.2  # deflection over the structure's size, up to which a set must not lock
LOCKED = 1e-4  # share of the bending energy there, by which omitted derivatives may stiffen it
LEFT_OUT = 1e-6  # share of the derivatives' energy that "auto" omits


def with_derivatives(
    structure: Structure, modes: ModeSet, keep: int | str = "auto", deflection: float | None = None
) -> ModeSet:
    """The set with static derivatives of all pairs of its shapes added, M-orthonormal, kind "derivative".

    The derivatives are made M-orthogonal to the set. Their combinations are ordered by the energy that they store when
    every shape has the amplitude of an equal static load, 1 / omega^2 (`load_weights`).
    deflection [m]: the shapes are computed from static states of the structure at this deflection instead of at rest,
    each state weighted by its share of energy.
    keep: number of added shapes. "auto" adds combinations until at most LEFT_OUT of the energy is omitted
    (`negligible_energy`), then dependent ones by which a spin or an accelerated base stiffens the set
    (`answers_to_accelerations`), and those by which one deflection softens other shapes, such as the twist of a strip
    (`answers_to_bends`). "all" adds all independent ones.
    omega of the added shapes is that of the structure confined to them; `note` states their number, the number of pairs
    and the omitted share. Raises ValueError if keep is another word or negative, and as `bent_states`.
    """
    all_derivatives = scaled_derivatives(structure, modes)
    pairs = outside_set(structure, modes, all_derivatives)
    theta, note = _weighted_candidates(structure, modes, pairs, keep, deflection)
    energy, X = np.linalg.eigh(theta.T @ (structure.K @ theta))
    energy, X = np.maximum(energy[::-1], 0.0), X[:, ::-1]
    count = number_kept(energy, keep, negligible_energy(structure, modes, energy))
    shapes = theta @ (X[:, :count] / np.sqrt(energy[:count]))
    omitted = float(energy[count:].sum() / max(energy.sum(), np.finfo(float).tiny))
    note = f"{count} derivative shapes for {note}, {omitted:.1e} of their energy left out"
    if keep == "auto":
        additional = answers_to_accelerations(structure, pairs[:, is_faster_than_pair(structure, modes, pairs)], shapes)
        shapes = np.column_stack([shapes, additional])
        note += f", and {additional.shape[1]} more for accelerations" if additional.shape[1] else ""
        additional = answers_to_bends(structure, modes, all_derivatives, shapes)
        shapes = np.column_stack([shapes, additional])
        note += (
            f", and {additional.shape[1]} more for deflections that soften other shapes" if additional.shape[1] else ""
        )
    omega, shapes = ritz(structure, outside_set(structure, modes, shapes))
    return modes.with_shapes(shapes, ("derivative",) * len(omega), omega, note)


def _weighted_candidates(
    structure: Structure, modes: ModeSet, pairs: Array, keep: int | str, deflection: float | None
) -> tuple[Array, str]:
    """Weighted second-order displacements (n_dof, k) outside the set, and a text on their origin."""
    if deflection is not None and modes.n_modes:
        y, energy = bent_states(structure, modes, deflection)
        return y / np.sqrt(energy), f"{y.shape[1]} states bent by {deflection:.3g} m"
    weights = 1.0 if keep == "all" else load_weights(structure, modes)
    return pairs * weights, f"{pairs.shape[1]} pairs"


def load_weights(structure: Structure, modes: ModeSet) -> Array:
    """Amplitudes q_i q_j (n(n+1)/2,) of pairs i <= j under equal loads of unit-mass shapes, over those of equal energy.

    Pairs of two shapes stand for i j and j i, hence the root of two. A third derivative is treated as being of the
    lowest frequency.
    """
    i, j = np.triu_indices(modes.n_modes)
    omega = np.sqrt(over_mass(structure, modes))
    omega[np.array(modes.kinds) == "third derivative"] = omega.min()
    return np.asarray(np.where(i == j, 1.0, np.sqrt(2.0)) * omega.min() ** 2 / (omega[i] * omega[j]))


def is_faster_than_pair(structure: Structure, modes: ModeSet, pairs: Array) -> BoolArray:
    """(n(n+1)/2,): whether each derivative (n_dof, n(n+1)/2) is FASTER than its pair i <= j.

    Such derivatives may be dependent (`dependent_derivatives`). That of a stretching and a bending shape is not faster:
    it bends.
    """
    i, j = np.triu_indices(modes.n_modes)
    omega = np.sqrt(over_mass(structure, modes))
    stiffness, mass = (np.einsum("in,in->n", pairs, A @ pairs) for A in (structure.K, structure.M))
    return np.asarray(stiffness >= (FASTER * (omega[i] + omega[j])) ** 2 * mass)


def outside_set(structure: Structure, modes: ModeSet, shapes: Array) -> Array:
    """The shapes (n_dof, k) [m, rad], made M-orthogonal to the set."""
    return shapes - modes.phi @ (modes.phi.T @ (structure.M @ shapes))


def negligible_energy(structure: Structure, modes: ModeSet, energy: Array) -> float:
    """The energy that "auto" may omit of combinations with energies (k,).

    Omitted combinations stiffen the body: for shapes of unit energy with amplitude q they store their energy times
    q^4 / 8, and bending stores q^2 / 2. The limit is LOCKED of bending with the lowest shape at a deflection of FAR,
    and LEFT_OUT of the sum of all energies.
    """
    share = LEFT_OUT * float(energy.sum())
    lowest = modes.phi[:, int(np.argmin(over_mass(structure, modes)))]
    displacement = np.linalg.norm((structure.translation @ lowest).reshape(-1, 3), axis=1).max()
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    bending = (FAR * size) ** 2 * float(lowest @ (structure.K @ lowest))
    return min(share, 4 * LOCKED * float(displacement) ** 2 / bending) if displacement > 0 else share


def number_kept(energy: Array, keep: int | str, leaving: float) -> int:
    """The number of combinations of derivatives to keep, of energies (k,) [1] in descending order.

    Dependent combinations are not kept. leaving: the energy that "auto" omits at most.
    """
    independent = int(np.sum(energy > RANK * energy[0])) if energy.size and energy[0] > 0 else 0
    if keep == "all":
        return independent
    if keep == "auto":
        omitted = energy.sum() - np.cumsum(energy)
        return min(independent, int(np.sum(omitted > leaving)) + 1)
    if isinstance(keep, str) or keep < 0:
        raise ValueError(f"the number of derivative shapes to keep is {keep!r}; give a number, 'auto' or 'all'.")
    return min(keep, independent)


def scaled_derivatives(structure: Structure, modes: ModeSet) -> Array:
    """theta_ij (n_dof, n(n+1)/2) of all pairs i <= j, for shapes of unit strain energy phi_i.K phi_i = 1."""
    stiffness = np.einsum("in,in->n", modes.phi, structure.K @ modes.phi)
    phi = modes.phi / np.sqrt(stiffness)
    i, j = np.triu_indices(modes.n_modes)
    load = structure.internal_force.second_derivative(phi, i, j)
    return -static_response(structure, modes, load)


# Softening of shapes of a structure by deflections in other shapes: lateral buckling, and the derivatives it needs.
#
# Deflected to a phi_j, with all derivatives dependent, a structure has the tangent
#
#     K_ik + a^2 N_j,ik,      N_j,ik = 6 V3_jjik - theta_ij.K theta_kj - 1/2 theta_jj.K theta_ik
#
# over its shapes: the derivatives compensate the stiffness that stretching adds in V3. If N_j has a negative eigenvalue
# lambda, the eigenvector x loses all of its stiffness at a = 1 / sqrt(-lambda): deflected in its stiff plane, a strip
# bends sideways and twists. A set without part of sum_i x_i theta_ij, for the strip its twist, buckles too late.
# That twist stores less than the stretch of soft shapes, by the square of thickness over length.


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
