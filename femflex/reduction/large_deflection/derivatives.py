"""Static modal derivatives: how a structure must stretch when its modes bend it.

To second order the static shape that carries amplitudes q of shapes phi is

    x = phi_i q_i + 1/2 theta_ij q_i q_j,      K theta_ij = -(dK/dphi_j) phi_i,

symmetric in i and j because V has a third derivative. In a set of shapes theta takes the stretch back that bending
would otherwise store in V2 and V3 (Idelsohn and Cardona, Comput. Methods Appl. Mech. Engng 49 (1985) 253). What a
structure does at a deflection of several thicknesses it does not show at rest; there its static states take the place
of theta (`bent_states`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.arrays import Array, BoolArray
from femflex.fem.structure import Structure
from femflex.reduction.inertia.accelerations import answers_to_accelerations
from femflex.reduction.large_deflection.bent_states import bent_states, over_mass
from femflex.reduction.large_deflection.softening import answers_to_bends
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.statics import static_response
from femflex.reduction.modes.vibration import ritz
from femflex.reduction.strain.following import FASTER

RANK = 1e-12  # share of the largest energy below which a combination of derivatives adds nothing (1e-6 in amplitude)
FAR = 0.2  # deflection over the structure's size up to which it is to bend without locking
LOCKED = 1e-4  # of the bending energy there, by which left out derivatives may stiffen it
LEFT_OUT = 1e-6  # share of the derivatives' energy that "auto" leaves out


def with_derivatives(
    structure: Structure, modes: ModeSet, keep: int | str = "auto", deflection: float | None = None
) -> ModeSet:
    """The set with static derivatives of all pairs of its shapes added, M-orthonormal, kind "derivative".

    The set is taken out of the derivatives, and of their combinations those come first that store most energy when
    every shape carries the amplitude of an equal static load, 1 / omega^2 (`load_weights`). deflection [m]: the shapes
    are taken from the static states of the structure bent so far instead of at rest, each state counting by its part of
    that state's energy. keep: how many; "auto": until at most LEFT_OUT of that energy is left out (`spared`), those
    more that follow and through which a spin or an accelerated base stiffens the set (`answers_to_accelerations`), and
    those through which one bend softens another, such as the twist of a strip (`answers_to_bends`); "all" that are
    independent, whatever they store. omega of the added shapes is that of the structure confined to them. `note` says
    how many of how many pairs were kept, and the share left out. Raises ValueError when keep is another word, or below
    zero, and as `bent_states`.
    """
    whole = scaled_derivatives(structure, modes)
    pairs = without(structure, modes, whole)
    theta, note = _followers(structure, modes, pairs, keep, deflection)
    energy, X = np.linalg.eigh(theta.T @ (structure.K @ theta))
    energy, X = np.maximum(energy[::-1], 0.0), X[:, ::-1]
    count = number_kept(energy, keep, spared(structure, modes, energy))
    shapes = theta @ (X[:, :count] / np.sqrt(energy[:count]))
    left = float(energy[count:].sum() / max(energy.sum(), np.finfo(float).tiny))
    note = f"{count} derivative shapes for {note}, {left:.1e} of their energy left out"
    if keep == "auto":
        answers = answers_to_accelerations(structure, pairs[:, followed(structure, modes, pairs)], shapes)
        shapes = np.column_stack([shapes, answers])
        note += f", and {answers.shape[1]} more for accelerations" if answers.shape[1] else ""
        answers = answers_to_bends(structure, modes, whole, shapes)
        shapes = np.column_stack([shapes, answers])
        note += f", and {answers.shape[1]} more for deflections that soften other shapes" if answers.shape[1] else ""
    omega, shapes = ritz(structure, without(structure, modes, shapes))
    return replace(
        modes,
        phi=np.column_stack([modes.phi, shapes]),
        kinds=modes.kinds + ("derivative",) * len(omega),
        omega=np.append(modes.omega, omega),
        note="; ".join(part for part in (modes.note, note) if part),
    )


def _followers(
    structure: Structure, modes: ModeSet, pairs: Array, keep: int | str, deflection: float | None
) -> tuple[Array, str]:
    """Displacements (n_dof, k) outside the set that its bending brings about, weighted, and of what they are."""
    if deflection is not None and modes.n_modes:
        y, energy = bent_states(structure, modes, deflection)
        return y / np.sqrt(energy), f"{y.shape[1]} states bent by {deflection:.3g} m"
    weights = 1.0 if keep == "all" else load_weights(structure, modes)
    return pairs * weights, f"{pairs.shape[1]} pairs"


def load_weights(structure: Structure, modes: ModeSet) -> Array:
    """Amplitudes q_i q_j (n(n+1)/2,) of pairs i <= j under equal loads of unit-mass shapes, over those of equal energy.

    Pairs of two shapes stand for i j and j i, hence the root of two. A third derivative goes with the lowest shape.
    """
    i, j = np.triu_indices(modes.n_modes)
    omega = np.sqrt(over_mass(structure, modes))
    omega[np.array(modes.kinds) == "third derivative"] = omega.min()
    return np.asarray(np.where(i == j, 1.0, np.sqrt(2.0)) * omega.min() ** 2 / (omega[i] * omega[j]))


def followed(structure: Structure, modes: ModeSet, pairs: Array) -> BoolArray:
    """Which derivatives (n_dof, n(n+1)/2) (numbers of columns) are FASTER than their pair i <= j (`able_to_follow`).

    The derivative of a stretching and a bending shape is not: it bends.
    """
    i, j = np.triu_indices(modes.n_modes)
    omega = np.sqrt(over_mass(structure, modes))
    stiffness, mass = (np.einsum("in,in->n", pairs, A @ pairs) for A in (structure.K, structure.M))
    return np.asarray(stiffness >= (FASTER * (omega[i] + omega[j])) ** 2 * mass)


def without(structure: Structure, modes: ModeSet, shapes: Array) -> Array:
    """The shapes (n_dof, k) [m, rad] less their part in the set, by mass."""
    return shapes - modes.phi @ (modes.phi.T @ (structure.M @ shapes))


def spared(structure: Structure, modes: ModeSet, energy: Array) -> float:
    """The energy that "auto" may leave out of combinations with energies (k,).

    What is left out stretches: of shapes of unit energy with amplitude q it stores q^4 / 8 as often, against q^2 / 2
    of bending. At most LOCKED of bending where the lowest shape is bent by FAR, and at most LEFT_OUT of all energies.
    """
    share = LEFT_OUT * float(energy.sum())
    lowest = modes.phi[:, int(np.argmin(over_mass(structure, modes)))]
    moved = np.linalg.norm((structure.translation @ lowest).reshape(-1, 3), axis=1).max()
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    square = (FAR * size) ** 2 * float(lowest @ (structure.K @ lowest))
    return min(share, 4 * LOCKED * float(moved) ** 2 / square) if moved > 0 else share


def number_kept(energy: Array, keep: int | str, leaving: float) -> int:
    """How many combinations of derivatives with these energies (k,) [1], descending, are kept; none that adds nothing.

    leaving: energy that "auto" leaves out at most.
    """
    independent = int(np.sum(energy > RANK * energy[0])) if energy.size and energy[0] > 0 else 0
    if keep == "all":
        return independent
    if keep == "auto":
        left = energy.sum() - np.cumsum(energy)
        return min(independent, int(np.sum(left > leaving)) + 1)
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
