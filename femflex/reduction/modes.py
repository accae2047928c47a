"""Mode sets by eigen-solution: cantilever, free-free, and static shapes to stand beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from femflex.fem.eigen.canonical import canonical, signs
from femflex.fem.eigen.modes import dense_modes, factorised, lowest_modes
from femflex.fem.structure import Structure
from femflex.reduction.buckling import refuse_buckled
from femflex.reduction.clamps import Groups, free_dofs, held_dofs, names, refuse_unheld
from femflex.reduction.markers import marker_rows
from femflex.reduction.modeset import ModeSet
from femflex.reduction.rigid import DIRECTIONS, independent_columns, rigid_shapes

Array = NDArray[np.float64]
Index = NDArray[np.int64]

DEPENDENT = 1e-13  # least eigenvalue of the mass matrix of unit-mass shapes below which they are dependent
ANSWERED = 1e-8  # part of a load left over by the modes below which they answer it fully
TURN = 1e-3  # rotation times size below this part of the largest translation has no say in a shape's sign


def cantilever_modes(structure: Structure, clamp: Groups, n: int) -> ModeSet:
    """The n lowest vibration modes with the clamp groups fixed in the body frame (fixed-interface modes).

    clamp: group names, or name -> components held ("x", "y", "z", "rx", "ry", "rz"). A close pair at the end is kept
    whole, so there may be a few more (see `note`). Raises ValueError when the clamp leaves a motion without stiffness.
    """
    return fixed_modes(structure, held_dofs(structure, clamp), names(clamp), n)


def fixed_modes(structure: Structure, held: Index, groups: tuple[str, ...], n: int) -> ModeSet:
    """The n lowest vibration modes with these dofs held; groups is what holds them, for the reader."""
    refuse_buckled(structure, held)
    free = free_dofs(structure, held)
    modes = lowest_modes(structure.K[free][:, free], structure.M[free][:, free], n)
    if modes.null.shape[1]:
        loose = np.zeros((structure.n_dof, modes.null.shape[1]))
        loose[free] = modes.null
        refuse_unheld(structure, held, groups, loose)
    phi = np.zeros((structure.n_dof, len(modes.omega)))
    phi[free] = modes.phi
    phi = signed(structure, phi)
    return ModeSet(phi, ("vibration",) * phi.shape[1], modes.omega, groups, held, modes.note)


def condensed(structure: Structure, held: Index, boundary: Index, motions: Array) -> Array:
    """Dof vectors (n_dof, k) that follow boundary motions (n_boundary, k) statically, x_i = -K_ii^-1 K_ib x_b."""
    interior = free_dofs(structure, np.union1d(held, boundary))
    phi = np.zeros((structure.n_dof, motions.shape[1]))
    phi[boundary] = motions
    if interior.size and motions.shape[1]:
        K = structure.K[interior]
        phi[interior] = -factorised(K[:, interior]).solve(np.ascontiguousarray(K[:, boundary] @ motions))
    return phi


def free_free_modes(structure: Structure, n: int) -> ModeSet:
    """The n lowest elastic modes of the free structure, M-orthogonal to rigid motion.

    The body frame then follows the mean motion: no elastic coordinate moves the centre of mass or carries angular
    momentum to first order. Raises ValueError on a structure that is held, or is a mechanism.
    """
    modes = lowest_modes(structure.K, structure.M, n, free=True)
    R = rigid_shapes(structure)
    R = R[:, independent_columns(R)]
    n_null, n_rigid = modes.null.shape[1], R.shape[1]
    if n_null != n_rigid:
        refuse_unheld(structure, np.zeros(0, np.int64), (), modes.null)
    MR = structure.M @ R
    phi = modes.phi - R @ linalg.solve(R.T @ MR, MR.T @ modes.phi, assume_a="pos")
    phi = signed(structure, phi)
    return ModeSet(phi, ("free-free",) * phi.shape[1], modes.omega, note=modes.note)


def with_attachment(
    structure: Structure,
    modes: ModeSet,
    directions: Sequence[str] = DIRECTIONS,
    loads: Mapping[str, Sequence[str]] | None = None,
    others: Array | None = None,
) -> ModeSet:
    """A cantilever set with static shapes added: what the truncated modes leave out of the response to known loads.

    directions  the clamp accelerates in them: loads M R of a body-frame acceleration (inertia attachment). Two such
                shapes in place of two modes bring hub-and-beam frequencies from 1e-5 to 1e-10 of the exact ones.
    loads       group -> directions of unit forces and moments there (attachment modes).
    others      load vectors (n_dof, k) besides
    The added shapes are M- and K-orthogonal to the modes and to each other; omega is
    that of the structure confined to them.
    """
    if not modes.held.size:
        raise ValueError("attachment shapes are static and need a clamp; this set has none. Give a cantilever set.")
    free = free_dofs(structure, modes.held)
    F = load_vectors(structure, directions, loads or {})[free]
    F = F if others is None else np.column_stack([F, others[free]])
    solve = factorised(structure.K[free][:, free]).solve
    M, phi = structure.M[free][:, free], modes.phi[free]
    M_phi = M @ phi
    whole = np.linalg.norm(F, axis=0)
    F = F - M_phi @ (phi.T @ F)  # the modes answer this part already; solved for the rest alone, it keeps its digits
    F = F[:, np.linalg.norm(F, axis=0) > ANSWERED * whole]
    F = F / np.linalg.norm(F, axis=0)
    x = solve(np.ascontiguousarray(F))
    x = x - phi @ (M_phi.T @ x)
    x = x[:, independent_columns(x)]
    shapes = np.zeros((structure.n_dof, x.shape[1]))
    shapes[free] = x
    omega, shapes = ritz(structure, shapes)
    return replace(
        modes,
        phi=np.column_stack([modes.phi, shapes]),
        kinds=modes.kinds + ("attachment",) * len(omega),
        omega=np.append(modes.omega, omega),
        groups=(*modes.groups, *(group for group in loads or {} if group not in modes.groups)),
    )


def ritz(structure: Structure, phi: Array) -> tuple[Array, Array]:
    """Frequencies (n,) and M-orthonormal shapes (n_dof, n) of the structure confined to the span of phi."""
    size = np.sqrt(np.einsum("in,in->n", phi, structure.M @ phi))
    phi = phi / np.where(size > 0, size, 1.0)
    K, M = phi.T @ (structure.K @ phi), phi.T @ (structure.M @ phi)
    if phi.shape[1] and np.linalg.eigvalsh(M)[0] < DEPENDENT:
        raise ValueError(
            f"the {phi.shape[1]} shapes are not independent in the mass they move; leave out shapes that repeat "
            "others, or that move dofs without mass."
        )
    eigenvalues, X = dense_modes(K, M)
    return np.sqrt(np.maximum(eigenvalues, 0.0)), signed(structure, canonical(eigenvalues, phi @ X))


def signed(structure: Structure, phi: Array) -> Array:
    """The shapes with their largest node translation positive; where nodes hardly translate, the largest rotation."""
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    moved = np.concatenate([structure.translation @ phi, TURN * size * (structure.rotation @ phi)])
    return phi * signs(moved)


def answers_to_clamps(structure: Structure, modes: ModeSet) -> tuple[Array, Array]:
    """Loads (n_dof, 3) of unit accelerations of the clamps along x, y, z, and the linear answers to them."""
    free = free_dofs(structure, modes.held)
    loads = load_vectors(structure, "xyz", {})
    answers = np.zeros_like(loads)
    answers[free] = factorised(structure.K[free][:, free]).solve(np.ascontiguousarray(loads[free]))
    return loads, answers


def load_vectors(structure: Structure, directions: Sequence[str], loads: Mapping[str, Sequence[str]]) -> Array:
    """Load vectors (n_dof, k): inertia of unit accelerations, then unit forces and moments at groups."""
    unknown = [d for d in [*directions, *(d for given in loads.values() for d in given)] if d not in DIRECTIONS]
    if unknown:
        raise ValueError(f"directions {unknown} are not known; name some of {list(DIRECTIONS)}.")
    columns = [structure.M @ rigid_shapes(structure)[:, [DIRECTIONS.index(d) for d in directions]]]
    for group, given in loads.items():
        rows = marker_rows(structure, group)
        both = np.concatenate([rows.translation.toarray(), rows.rotation.toarray()])
        columns.append(both[[DIRECTIONS.index(d) for d in given]].T)
    return np.concatenate(columns, axis=1)
