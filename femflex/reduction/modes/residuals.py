"""Residual vectors: what the vibration modes of a set leave out of the static response to known loads.

Attachment modes (R. R. Craig and A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, section
17.2), of a free structure with inertia relief. With them a set represents a clamp, a joint or a carried body at the
loaded place exactly in statics.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from hashlib import sha256

import numpy as np

from femflex.arrays import Array, BoolArray
from femflex.fem.structure import Structure
from femflex.reduction.boundary.rigid import DIRECTIONS
from femflex.reduction.modes.damping import UNANSWERED
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.statics import static_response
from femflex.reduction.modes.vibration import load_vectors, ritz

ANSWERED = 1e-8  # part of a load, or of its static response, left over by the set below which it is represented fully
UNMOVED = 0.01  # part of the strain energy of the answer to a load below which it moves no mode of a set
RANK = 1e-10  # mass of a combination of unit-mass residual vectors below which it depends on the others
EXACT = ("vibration", "free-free")  # kinds of shapes that are modes of the structure with the set's supports


def with_attachment(
    structure: Structure,
    modes: ModeSet,
    directions: Sequence[str] = DIRECTIONS,
    loads: Mapping[str, Sequence[str]] | None = None,
    others: Array | None = None,
) -> ModeSet:
    """A set with static shapes added: what the truncated modes leave out of the response to known loads.

    directions  the clamp accelerates in them: loads M R of a body-frame acceleration (inertia attachment). Two such
                shapes in place of two modes bring hub-and-beam frequencies from 1e-5 to 1e-10 of the exact ones.
    loads       group -> directions of unit forces and moments there (attachment modes).
    others      load vectors (n_dof, k) besides
    The added shapes are M-orthonormal and M-orthogonal to the set, K-orthogonal to each other and to vibration modes;
    omega is that of the structure confined to them. Of a set without a clamp loads are balanced by inertia relief.
    """
    if directions and not modes.held.size:
        raise ValueError(
            "shapes of an accelerated clamp need a clamp; this set has none. Give a cantilever set, or loads alone."
        )
    F = load_vectors(structure, directions, loads or {})
    shapes = residual_vectors(structure, modes, F if others is None else np.column_stack([F, others]))
    omega, shapes = ritz(structure, combined(structure, shapes))
    alone = _unanswered(structure, modes, F if others is None else np.column_stack([F, others]), shapes)
    return replace(
        modes,
        phi=np.column_stack([modes.phi, shapes]),
        kinds=modes.kinds + tuple(UNANSWERED if one else "attachment" for one in alone),
        omega=np.append(modes.omega, omega),
        groups=(*modes.groups, *(group for group in loads or {} if group not in modes.groups)),
    )


def _unanswered(structure: Structure, modes: ModeSet, F: Array, shapes: Array) -> BoolArray:
    """(m,): which of the shapes (n_dof, m) none of those loads F (n_dof, k) works on that moves a mode of the set."""
    kept = [kind in EXACT and omega > 0 for kind, omega in zip(modes.kinds, modes.omega, strict=True)]
    if not any(kept) or not shapes.shape[1]:
        return np.zeros(shapes.shape[1], bool)
    moving = ((modes.phi[:, kept].T @ F / modes.omega[kept][:, None]) ** 2).sum(axis=0)  # strain energy, twice
    energy = np.einsum("in,in->n", shapes, structure.K @ shapes)
    work = (shapes.T @ F) ** 2 / energy[:, None]
    whole = moving + work.sum(axis=0)
    share = work / np.where(whole > 0, whole, 1.0)  # of each load's answer
    return np.asarray(share[:, moving > UNMOVED * whole].sum(axis=1) <= UNMOVED * share.sum(axis=1))


def residual_vectors(structure: Structure, modes: ModeSet, F: Array) -> Array:
    """Static responses (n_dof, k) [m, rad] to loads F (n_dof, k), M-orthogonal to the set; zero where the set holds
    them."""
    phi, M = modes.phi, structure.M
    exact = phi[:, [kind in EXACT for kind in modes.kinds]]
    free = np.delete(np.arange(structure.n_dof), modes.held)
    whole = np.linalg.norm(F[free], axis=0)
    acting = np.flatnonzero(whole)  # loads at a clamp move nothing
    found, whole = np.zeros_like(F), whole[acting]
    if not acting.size:
        return found
    x, F = _responses_beside(structure, modes, exact, F[:, acting])
    Mx = M @ x
    size = np.sqrt(np.einsum("in,in->n", x, Mx))
    for _ in range(2):
        x = x - phi @ (phi.T @ Mx)
        Mx = M @ x
    left = np.sqrt(np.einsum("in,in->n", x, Mx))
    nothing = (left <= ANSWERED * size) | (np.linalg.norm(F[free], axis=0) <= ANSWERED * whole)
    found[:, acting] = np.where(nothing, 0.0, x)
    return found


def _responses_beside(structure: Structure, modes: ModeSet, exact: Array, F: Array) -> tuple[Array, Array]:
    """Static responses (n_dof, k) to what is left of loads F (n_dof, k) by exact modes (n_dof, m), and those loads.

    Solved for the rest alone, it keeps its digits. A set and what judges it have loads in common: each is solved once.
    """
    rest = F - structure.M @ (exact @ (exact.T @ F))
    on = ("response", modes.held.tobytes(), modes.reference, sha256(exact.tobytes()).digest())
    keys = [(*on, sha256(load.tobytes()).digest()) for load in F.T]
    new = [k for k, key in enumerate(keys) if key not in structure.known]
    solved = dict(zip(new, static_response(structure, modes, rest[:, new]).T, strict=True)) if new else {}
    x = [structure.recalled(key, partial(solved.__getitem__, k)) for k, key in enumerate(keys)]
    return np.column_stack(x), rest


def combined(structure: Structure, x: Array) -> Array:
    """M-orthonormal combinations (n_dof, m) that span vectors x (n_dof, k), those that depend on others left out."""
    x = x[:, np.any(x, axis=0)]
    for _ in range(2):
        if not x.shape[1]:
            break
        x = x / np.sqrt(np.einsum("in,in->n", x, structure.M @ x))
        mass, ways = np.linalg.eigh(x.T @ (structure.M @ x))
        kept = mass > RANK
        x = x @ (ways[:, kept] / np.sqrt(mass[kept]))
    return x
