"""Response shapes: static states of a structure under loads up to large deflections, combined into shapes.

The work of one load, a unit acceleration of the clamps or a unit force at a group, is raised in both directions and
lowered again if the structure snaps (`load_path`). The combinations of states that store most energy (proper orthogonal
decomposition by energy) represent this motion with far fewer shapes than modes and their derivatives; they do not
represent other motions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.boundary.supported import supported
from femflex.reduction.large_deflection.load_path import largest_displacement, trace_load_path
from femflex.reduction.modes.vibration import ModeSet, load_vectors, responses_to_clamp_accelerations, ritz

PUSH = 1e-3  # energy norm of a mode's response to the small load, over that of the linear response to the load
PUSHED = 3  # number of the lowest modes that the small load excites
RANK = 1e-12  # of the energy of one state, below which a combination adds nothing
LEFT_OUT = 1e-5  # mean share of the energy of states without the small load that shapes may omit


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
    there. The default is the acceleration that moves the structure most. Each load acts in both directions until some
    node has moved by `deflection`; in the stiffer direction only up to the same energy. If unstable states occur, a
    small additional load on the lowest modes is applied in both directions, because a symmetric structure buckles to
    both sides. If the load alone led to saddles, the states with the small load have buckled, and the remaining shapes
    are computed from them; otherwise they are equivalent to those of the load alone. The kind of the shapes is
    "response"; omega is that of the structure confined to them, and `note` states the number of states and their
    largest deflection. Raises ValueError without clamps, and if no state is found.
    """
    if not modes.held.size:
        raise ValueError("responses are static states of a clamped structure, and this set is of a free one; drop them")
    states_of_loads = [
        _states_in_both_directions(structure, modes, F, deflection)
        for F in _requested_loads(structure, modes, directions, loads or {})
    ]
    plain, buckled = (np.concatenate(part) for part in zip(*states_of_loads, strict=True))
    if not len(plain):
        raise ValueError(f"no static state was found on the way to a deflection of {deflection:.3g} m; lower it")
    n, phi = modes.n_modes, modes.phi
    for states, left_out in ((plain, LEFT_OUT), (buckled, 0.0), (plain, 0.0)):
        phi = np.column_stack([phi, _shapes_of_most_energy(structure, phi, states, n + count - phi.shape[1], left_out)])
    omega, shapes = ritz(structure, phi[:, n:])
    n_added, states = len(omega), np.concatenate([plain, buckled])
    reach = max(largest_displacement(structure, state) for state in states)
    note = f"{n_added} response shapes of {len(states)} states bent by up to {reach:.3g} m"
    return modes.with_shapes(shapes, ("response",) * n_added, omega, note)


def _requested_loads(
    structure: Structure, modes: ModeSet, directions: Sequence[str], loads: Mapping[str, Sequence[str]]
) -> Array:
    """The loads (k, n_dof), by default the acceleration of the clamps that moves the structure most."""
    if directions or loads:
        return load_vectors(structure, directions, loads).T
    accelerations, responses = responses_to_clamp_accelerations(structure, modes)
    return accelerations[:, [int(np.argmax([largest_displacement(structure, u) for u in responses.T]))]].T


def _shapes_of_most_energy(structure: Structure, known: Array, states: Array, count: int, left_out: float) -> Array:
    """Combinations (n_dof, k <= count) of states (n, n_dof) outside known shapes, M-orthonormal with each other.

    They are ordered by energy, relative to that of each state; as many as omit at most `left_out` of it in the mean.
    """
    if not len(states) or count <= 0:
        return known[:, :0]
    elastic = structure.internal_force
    stored = np.array([elastic.energy(x) - float(structure.f0 @ x) for x in states])
    y = _outside_shapes(structure, known, states.T) / np.sqrt(stored)
    energy, X = np.linalg.eigh(y.T @ (structure.K @ y))
    energy, X = np.maximum(energy[::-1], 0.0), X[:, ::-1]
    omitted = (energy.sum() - np.cumsum(energy)) / len(stored)
    count_kept = min(count, int(np.sum(energy > RANK)), int(np.sum(omitted > left_out)) + 1)
    return ritz(structure, _outside_shapes(structure, known, y @ (X[:, :count_kept] / np.sqrt(energy[:count_kept]))))[1]


def _outside_shapes(structure: Structure, known: Array, shapes: Array) -> Array:
    """The shapes, made M-orthogonal to known M-orthonormal ones."""
    return np.asarray(shapes - known @ (known.T @ (structure.M @ shapes)))


def _states_in_both_directions(
    structure: Structure, modes: ModeSet, load: Array, deflection: float
) -> tuple[Array, Array]:
    """States (k, n_dof) under a load in both directions, first the softer one: without and with buckling."""
    elastic = structure.internal_force
    u = supported(structure, modes.held).answers(load)
    u *= deflection / largest_displacement(structure, u)
    softer = -1.0 if float(elastic.second_derivative(u[:, None])[:, 0] @ u) > 0.0 else 1.0
    push, energy_limit = _push(structure, modes, u), np.inf
    plain, buckled = list[Array](), list[Array]()
    for sense in (softer, -softer):
        path = trace_load_path(structure, modes, sense * load, 0.0 * push, deflection, energy_limit)
        plain += path.states
        if path.saddle or path.snapped:
            for side in (push, -push):
                states = trace_load_path(structure, modes, sense * load, side, deflection, energy_limit).states
                (buckled if path.saddle else plain).extend(states)
        energy_limit = max((elastic.energy(x) - float(structure.f0 @ x) for x in path.states), default=np.inf)
    return np.array(plain).reshape(-1, structure.n_dof), np.array(buckled).reshape(-1, structure.n_dof)


def _push(structure: Structure, modes: ModeSet, u: Array) -> Array:
    """The small load (n_dof,) on the lowest vibration modes, for a load with the linear response u."""
    lowest = [k for k, kind in enumerate(modes.kinds) if kind == "vibration"][:PUSHED]
    phi = modes.phi[:, lowest]
    phi = phi / np.sqrt(np.einsum("in,in->n", phi, structure.K @ phi))
    return np.asarray(PUSH * np.sqrt(u @ (structure.K @ u)) * (structure.K @ phi).sum(axis=1))
