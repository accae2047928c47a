"""What a structure does under loads on its way through large deflections: the states themselves as shapes.

Static states x under lambda times one load, a uniform acceleration of the clamps along x, y or z,

    f(x) = f0 + lambda F,      F.x = s F.u,      K u = F,

with the work F.x held and not the load, so that a path goes on through limit points: a shallow arch or a curved panel
snaps through. Combinations of the states that store most (proper orthogonal decomposition by energy) hold such a path
in far fewer shapes than modes and their derivatives do, for they are made of it; other motions they do not hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femflex.fem.structure import Structure
from femflex.reduction.bent_states import solved
from femflex.reduction.clamps import free_dofs
from femflex.reduction.modes import ritz
from femflex.reduction.modeset import ModeSet
from femflex.reduction.rigid import rigid_shapes

Array = NDArray[np.float64]

STEPS = 8  # states on the way, at least
SMALLEST = 1 / 64  # of such a step: a path that cannot go on with it ends there
SETTLED = 1e-7  # last Newton step over the displacement
ITERATIONS = 15
RANK = 1e-12  # of the largest energy, below which a combination adds nothing


def with_responses(
    structure: Structure, modes: ModeSet, count: int, deflection: float, directions: Sequence[str] = ()
) -> ModeSet:
    """The set with `count` shapes added, M-orthonormal, of static responses to accelerations up to a deflection [m].

    directions: of x, y, z; left out, the one that moves the structure most. Each goes both ways until some node has
    moved by `deflection`. The kind of the shapes is "response";
    omega is that of the structure confined to them, and `note` says of how many states they are and how far these
    reach. Raises ValueError without clamps, and when no state is found.
    """
    if not modes.held.size:
        raise ValueError("responses are static states of a clamped structure, and this set is of a free one; drop them")
    sought = responses_to_accelerations(structure, modes, directions)
    states = [state for u in sought for state in _both_ways(structure, modes, u, deflection)]
    if not states:
        raise ValueError(f"no static state was found on the way to a deflection of {deflection:.3g} m; ask for less")
    x = np.column_stack([state for state, _ in states])
    y = (x - modes.phi @ (modes.phi.T @ (structure.M @ x))) / np.sqrt([energy for _, energy in states])
    energy, X = np.linalg.eigh(y.T @ (structure.K @ y))
    kept = min(count, int(np.sum(energy > RANK * energy[-1])))
    energy, X = energy[::-1][:kept], X[:, ::-1][:, :kept]
    shapes = y @ (X / np.sqrt(energy))
    omega, shapes = ritz(structure, shapes - modes.phi @ (modes.phi.T @ (structure.M @ shapes)))
    reach = max(_largest(structure, state) for state in x.T)
    note = f"{kept} response shapes of {len(states)} states bent by up to {reach:.3g} m"
    return replace(
        modes,
        phi=np.column_stack([modes.phi, shapes]),
        kinds=modes.kinds + ("response",) * kept,
        omega=np.append(modes.omega, omega),
        note="; ".join(part for part in (modes.note, note) if part),
    )


def responses_to_accelerations(structure: Structure, modes: ModeSet, directions: Sequence[str]) -> list[Array]:
    """Linear static displacements (n_dof,) under unit accelerations along axes; none named: where they are largest."""
    free = free_dofs(structure, modes.held)
    found = np.zeros((structure.n_dof, 3))
    load = structure.M @ rigid_shapes(structure)[:, :3]
    found[free] = solved(structure.K[free][:, free], load[free])
    if directions:
        return [found[:, "xyz".index(name)] for name in directions]
    return [found[:, int(np.argmax([_largest(structure, u) for u in found.T]))]]


def _both_ways(structure: Structure, modes: ModeSet, u: Array, deflection: float) -> list[tuple[Array, float]]:
    scaled = u * (deflection / _largest(structure, u))
    return [state for sign in (1.0, -1.0) for state in _path(structure, modes, sign * scaled, deflection)]


def _path(structure: Structure, modes: ModeSet, u: Array, deflection: float) -> list[tuple[Array, float]]:
    """States (n_dof,) under the load of u and their energies, until one has moved by the deflection or none is found.

    Steps of the held work are halved where Newton's method does not settle.
    """
    elastic, f0 = structure.internal_force, structure.f0
    out: list[tuple[Array, float]] = []
    x, factor, done, step = np.zeros_like(u), 0.0, 0.0, 1 / STEPS
    way = u.copy()
    while _largest(structure, x) < deflection and step >= SMALLEST / STEPS:
        found = _settled(structure, modes, u, x + step * way, factor, done + step)
        if found is None:
            step /= 2
            continue
        way = (found[0] - x) / step
        x, factor = found
        done, step = done + step, min(1 / STEPS, 1.5 * step)
        out.append((x, elastic.energy(x) - float(f0 @ x)))
    return out


def _settled(
    structure: Structure, modes: ModeSet, u: Array, x: Array, factor: float, part: float
) -> tuple[Array, float] | None:
    """State (n_dof,) and load factor near x where the load of u has done `part` of its linear work; None if none is."""
    elastic, free = structure.internal_force, free_dofs(structure, modes.held)
    load, work, x = (structure.K @ u)[free], part * float(u @ (structure.K @ u)), x.copy()
    for _ in range(ITERATIONS):
        rest = factor * load - (elastic.force(x) - structure.f0)[free]
        own, answer = solved(elastic.tangent(x)[free][:, free], np.column_stack([rest, load])).T
        more = (work - load @ (x[free] + own)) / (load @ answer)
        move = own + more * answer
        if not np.isfinite(move).all():
            return None
        x[free] += move
        factor += more
        if np.abs(move).max() <= SETTLED * np.abs(x).max():
            return x, factor
    return None


def _largest(structure: Structure, x: Array) -> float:
    """The largest displacement of a node [m]."""
    return float(np.linalg.norm((structure.translation @ x).reshape(-1, 3), axis=1).max())
