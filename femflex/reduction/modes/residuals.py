"""Residual vectors: the part of the static response to known loads that the vibration modes of a set lack.

Attachment modes (R. R. Craig and A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, section
17.2), for a free structure with inertia relief. With them a set represents a clamp, a joint or an attached body at the
loaded point exactly in statics.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from hashlib import sha256

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from femflex.arrays import Array, BoolArray
from femflex.fem.structure import Structure
from femflex.reduction.boundary.rigid import DIRECTIONS, independent_columns, rigid_shapes
from femflex.reduction.boundary.supported import supported
from femflex.reduction.modes.damping import UNANSWERED
from femflex.reduction.modes.vibration import ModeSet, load_vectors, ritz, static_response

ANSWERED = 1e-8  # residual share of a load, or of its static response, below which the set represents it fully
UNMOVED = (
    0.01  # share of the strain energy of a static response in the modes, below which the load does no work on them
)
RANK = 1e-10  # mass of a combination of unit-mass residual vectors, below which they are dependent
EXACT = ("vibration", "free-free")  # kinds of shapes that are modes of the structure with the set's supports


def with_attachment(
    structure: Structure,
    modes: ModeSet,
    directions: Sequence[str] = DIRECTIONS,
    loads: Mapping[str, Sequence[str]] | None = None,
    others: Array | None = None,
) -> ModeSet:
    """The set with static shapes added: the response to known loads that the truncated modes lack.

    directions  the clamp accelerates in them: loads M R of a body-frame acceleration (inertia attachment). Two such
                shapes in place of two modes bring hub-and-beam frequencies from 1e-5 to 1e-10 of the exact ones.
    loads       group -> directions of unit forces and moments there (attachment modes).
    others      additional load vectors (n_dof, k)
    The added shapes are M-orthonormal and M-orthogonal to the set, K-orthogonal to each other and to vibration modes;
    omega is that of the structure confined to them. In a set without a clamp, loads are balanced by inertia relief.
    """
    if directions and not modes.held.size:
        raise ValueError(
            "shapes of an accelerated clamp need a clamp; this set has none. Give a cantilever set, or loads alone."
        )
    F = load_vectors(structure, directions, loads or {})
    shapes = residual_vectors(structure, modes, F if others is None else np.column_stack([F, others]))
    omega, shapes = ritz(structure, independent_combinations(structure, shapes))
    without_work = _without_modal_work(structure, modes, F if others is None else np.column_stack([F, others]), shapes)
    kinds = (UNANSWERED if is_alone else "attachment" for is_alone in without_work)
    groups = (*modes.groups, *(group for group in loads or {} if group not in modes.groups))
    return replace(modes.with_shapes(shapes, kinds, omega), groups=groups)


def _without_modal_work(structure: Structure, modes: ModeSet, F: Array, shapes: Array) -> BoolArray:
    """(m,): whether each of the shapes (n_dof, m) is moved only by loads F (n_dof, k) that do no work on modes."""
    is_mode = [kind in EXACT and omega > 0 for kind, omega in zip(modes.kinds, modes.omega, strict=True)]
    if not any(is_mode) or not shapes.shape[1]:
        return np.zeros(shapes.shape[1], bool)
    modal_energy = ((modes.phi[:, is_mode].T @ F / modes.omega[is_mode][:, None]) ** 2).sum(
        axis=0
    )  # strain energy, twice
    energy = np.einsum("in,in->n", shapes, structure.K @ shapes)
    work = (shapes.T @ F) ** 2 / energy[:, None]
    energy_of_load = modal_energy + work.sum(axis=0)
    share = work / np.where(energy_of_load > 0, energy_of_load, 1.0)  # of each load's response
    return np.asarray(share[:, modal_energy > UNMOVED * energy_of_load].sum(axis=1) <= UNMOVED * share.sum(axis=1))


def residual_vectors(structure: Structure, modes: ModeSet, F: Array) -> Array:
    """Static responses (n_dof, k) [m, rad] to loads F (n_dof, k), M-orthogonal to the set.

    They are zero where the set represents the response.
    """
    phi, M = modes.phi, structure.M
    exact = phi[:, [kind in EXACT for kind in modes.kinds]]
    free = np.delete(np.arange(structure.n_dof), modes.held)
    size_of_load = np.linalg.norm(F[free], axis=0)
    loaded = np.flatnonzero(size_of_load)  # loads at a clamp move nothing
    vectors, size_of_load = np.zeros_like(F), size_of_load[loaded]
    if not loaded.size:
        return vectors
    x, F = _responses_outside_modes(structure, modes, exact, F[:, loaded])
    Mx = M @ x
    size = np.sqrt(np.einsum("in,in->n", x, Mx))
    for _ in range(2):
        x = x - phi @ (phi.T @ Mx)
        Mx = M @ x
    residual = np.sqrt(np.einsum("in,in->n", x, Mx))
    is_zero = (residual <= ANSWERED * size) | (np.linalg.norm(F[free], axis=0) <= ANSWERED * size_of_load)
    vectors[:, loaded] = np.where(is_zero, 0.0, x)
    return vectors


def _responses_outside_modes(structure: Structure, modes: ModeSet, exact: Array, F: Array) -> tuple[Array, Array]:
    """The parts of loads F (n_dof, k) outside exact modes (n_dof, m), and the static responses (n_dof, k) to them.

    The responses come first. Solving for this part alone avoids cancellation. Each load is solved once for all sets.
    """
    remaining = F - structure.M @ (exact @ (exact.T @ F))
    on = ("response", modes.held.tobytes(), modes.reference, sha256(exact.tobytes()).digest())
    keys = [(*on, sha256(load.tobytes()).digest()) for load in F.T]
    new = [k for k, key in enumerate(keys) if key not in structure.known]
    responses = dict(zip(new, static_response(structure, modes, remaining[:, new]).T, strict=True)) if new else {}
    x = [structure.recalled(key, partial(responses.__getitem__, k)) for k, key in enumerate(keys)]
    return np.column_stack(x), remaining


def independent_combinations(structure: Structure, x: Array) -> Array:
    """M-orthonormal combinations (n_dof, m) that span the vectors x (n_dof, k), which may be dependent."""
    x = x[:, np.any(x, axis=0)]
    for _ in range(2):
        if not x.shape[1]:
            break
        x = x / np.sqrt(np.einsum("in,in->n", x, structure.M @ x))
        mass, vectors = np.linalg.eigh(x.T @ (structure.M @ x))
        independent = mass > RANK
        x = x @ (vectors[:, independent] / np.sqrt(mass[independent]))
    return x


# Shapes in which a structure answers harmonic loads of one frequency, solved on all of its degrees of freedom.
#
# A craft moves harmonically at w. The displacement of a body relative to its clamp obeys (K (1 + i eta) - w^2 M) x = F
# f + w^2 M R a, with the forces f at its markers and the motion a of its clamp. It lies in the span of the responses to
# the columns of F and M R, whatever the rest of the craft does. A body reduced to these shapes therefore makes the
# motion of the whole craft at w that of its mesh, without error of reduction.


def with_harmonic_responses(
    structure: Structure, modes: ModeSet, F: Array, omega: float, stiffness: complex, mass: complex = 1.0
) -> ModeSet:
    """The span of a set and of the responses to loads F (n_dof, k) of a frequency omega [rad/s].

    stiffness, mass  factors [1] of K and M by damping: 1 + i eta of structural damping. The shapes are M-orthonormal
    modes of the structure confined to them, without rigid motion where nothing is held.
    """
    part = supported(structure, modes.held)
    D = sparse.csc_array(stiffness * part.K - omega**2 * mass * part.M)
    x = np.zeros((structure.n_dof, F.shape[1]), complex)
    x[part.free] = splu(D).solve(F[part.free].astype(complex))
    shapes = np.column_stack([x.real, x.imag])
    if not modes.held.size:
        R = rigid_shapes(structure)
        R = R[:, independent_columns(R)]
        MR = structure.M @ R
        shapes -= R @ np.linalg.solve(R.T @ MR, MR.T @ shapes)
    phi = independent_combinations(structure, modes.phi)
    for _ in range(2):
        shapes = shapes - phi @ (phi.T @ (structure.M @ shapes))
    size = np.sqrt(np.einsum("in,in->n", shapes, structure.M @ shapes))
    whole = np.sqrt(np.einsum("in,in->n", x.conj(), structure.M @ x).real)
    shapes = shapes[:, size > 1e-9 * np.concatenate([whole, whole])]
    own, phi = ritz(structure, np.column_stack([phi, independent_combinations(structure, shapes)]))
    return replace(modes, phi=phi, kinds=("attachment",) * len(own), omega=own)
