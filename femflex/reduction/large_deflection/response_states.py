"""What a structure does under loads on its way through large deflections: the states themselves as shapes.

The work of one load, a unit acceleration of the clamps or a unit force at a group, is raised both ways and, where the
structure snaps, taken back again (`load_path`). Combinations of the states that store most (proper orthogonal
decomposition by energy) hold such a way in far fewer shapes than modes and their derivatives do, for they are made of
it; other motions they do not hold.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.boundary.supported import supported
from femflex.reduction.large_deflection.load_path import largest_displacement, trace_load_path
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.vibration import answers_to_clamps, load_vectors, ritz

PUSH = 1e-3  # energy norm of a mode's answer to the push added to a load, over that of the load's own linear answer
PUSHED = 3  # of the lowest modes
RANK = 1e-12  # of the energy of one state, below which a combination adds nothing
LEFT_OUT = 1e-5  # of the energy of states without a push, in the mean, that is left to the shapes of buckled ones


def with_responses(
    structure: Structure,
    modes: ModeSet,
    count: int,
    deflection: float,
    directions: Sequence[str] = (),
    loads: Mapping[str, Sequence[str]] | None = None,
) -> ModeSet:
    """The set with `count` shapes added, M-orthonormal, of static responses to loads up to a deflection [m].

    directions: of x, y, z, in which the clamps are accelerated; loads: group -> directions of unit forces and moments
    there. With neither, the acceleration that moves the structure most. Each load goes both ways until some node has
    moved by `deflection`, the stiffer way as far as stores no more. Where that comes upon states without stability, a
    small push on the lowest modes goes with it too, one way and the other, for what is symmetric buckles to both
    sides. Where the load alone came upon saddles, the pushed states have buckled away from its own, and have the
    shapes that those leave over; elsewhere they are of its own kind and count as much. The kind of the shapes is
    "response"; omega is that of the structure confined to them, and `note` says of how many states they are and how
    far these reach.
    Raises ValueError without clamps, and when no state is found.
    """
    if not modes.held.size:
        raise ValueError("responses are static states of a clamped structure, and this set is of a free one; drop them")
    found = [_both_ways(structure, modes, F, deflection) for F in _sought(structure, modes, directions, loads or {})]
    plain, buckled = (np.concatenate(part) for part in zip(*found, strict=True))
    if not len(plain):
        raise ValueError(f"no static state was found on the way to a deflection of {deflection:.3g} m; lower it")
    n, phi = modes.n_modes, modes.phi
    for states, left_out in ((plain, LEFT_OUT), (buckled, 0.0), (plain, 0.0)):
        phi = np.column_stack([phi, _strongest(structure, phi, states, n + count - phi.shape[1], left_out)])
    omega, shapes = ritz(structure, phi[:, n:])
    kept, states = len(omega), np.concatenate([plain, buckled])
    reach = max(largest_displacement(structure, state) for state in states)
    note = f"{kept} response shapes of {len(states)} states bent by up to {reach:.3g} m"
    return replace(
        modes,
        phi=np.column_stack([modes.phi, shapes]),
        kinds=modes.kinds + ("response",) * kept,
        omega=np.append(modes.omega, omega),
        note="; ".join(part for part in (modes.note, note) if part),
    )


def _sought(
    structure: Structure, modes: ModeSet, directions: Sequence[str], loads: Mapping[str, Sequence[str]]
) -> Array:
    """Loads (k, n_dof)."""
    if directions or loads:
        return load_vectors(structure, directions, loads).T
    every, answers = answers_to_clamps(structure, modes)
    return every[:, [int(np.argmax([largest_displacement(structure, u) for u in answers.T]))]].T


def _strongest(structure: Structure, known: Array, states: Array, count: int, left_out: float) -> Array:
    """Combinations (n_dof, k <= count) of states (n, n_dof) outside known shapes, M-orthonormal with each other.

    Those first that store most, each state counting by the part of its own energy that is left; no more than leave
    `left_out` of it in the mean.
    """
    if not len(states) or count <= 0:
        return known[:, :0]
    elastic = structure.internal_force
    stored = np.array([elastic.energy(x) - float(structure.f0 @ x) for x in states])
    y = _outside(structure, known, states.T) / np.sqrt(stored)
    energy, X = np.linalg.eigh(y.T @ (structure.K @ y))
    energy, X = np.maximum(energy[::-1], 0.0), X[:, ::-1]
    left = (energy.sum() - np.cumsum(energy)) / len(stored)
    kept = min(count, int(np.sum(energy > RANK)), int(np.sum(left > left_out)) + 1)
    return ritz(structure, _outside(structure, known, y @ (X[:, :kept] / np.sqrt(energy[:kept]))))[1]


def _outside(structure: Structure, known: Array, shapes: Array) -> Array:
    """Shapes less their part in known ones, M-orthonormal, by mass."""
    return np.asarray(shapes - known @ (known.T @ (structure.M @ shapes)))


def _both_ways(structure: Structure, modes: ModeSet, load: Array, deflection: float) -> tuple[Array, Array]:
    """States (k, n_dof) under a load either way, the softer first, the other as far: its own, and buckled ones."""
    elastic = structure.internal_force
    u = supported(structure, modes.held).answers(load)
    u *= deflection / largest_displacement(structure, u)
    softer = -1.0 if float(elastic.second_derivative(u[:, None])[:, 0] @ u) > 0.0 else 1.0
    push, most = _push(structure, modes, u), np.inf
    plain, buckled = list[Array](), list[Array]()
    for sense in (softer, -softer):
        walked = trace_load_path(structure, modes, sense * load, 0.0 * push, deflection, most)
        plain += walked.states
        if walked.saddle or walked.snapped:
            for side in (push, -push):
                pushed = trace_load_path(structure, modes, sense * load, side, deflection, most).states
                (buckled if walked.saddle else plain).extend(pushed)
        most = max((elastic.energy(x) - float(structure.f0 @ x) for x in walked.states), default=np.inf)
    return np.array(plain).reshape(-1, structure.n_dof), np.array(buckled).reshape(-1, structure.n_dof)


def _push(structure: Structure, modes: ModeSet, u: Array) -> Array:
    """The small load (n_dof,) on the lowest vibration modes, added to one of linear answer u."""
    lowest = [k for k, kind in enumerate(modes.kinds) if kind == "vibration"][:PUSHED]
    phi = modes.phi[:, lowest]
    phi = phi / np.sqrt(np.einsum("in,in->n", phi, structure.K @ phi))
    return np.asarray(PUSH * np.sqrt(u @ (structure.K @ u)) * (structure.K @ phi).sum(axis=1))
