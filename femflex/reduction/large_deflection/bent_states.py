"""Static states of a structure whose shapes have large prescribed amplitudes, with their part outside the shapes.

    x(q) = argmin V(x) - f0.x      over all x with phi^T M x = q

with V the full nonlinear strain energy. To second order x = phi q + 1/2 theta_ij q_i q_j with the static derivatives
theta; at a deflection of several thicknesses the part outside the set, y(q) = x - phi q, has other shapes. They are
found as the dual modes are (K. Kim, V. Khanna, X. Q. Wang and M. P. Mignolet, Nonlinear reduced order modeling of flat
cantilevered structures, AIAA 2009-2492), but with prescribed amplitudes instead of loads: past a limit point there is
one state for each amplitude where there are several for a load.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.boundary.rigid import free_dofs
from femflex.reduction.boundary.supported import solve_tangent
from femflex.reduction.modes.vibration import ModeSet

STEPS = 4  # evenly spaced states up to each amplitude
SETTLED = 1e-6  # last Newton step over the displacement; the remaining error is its square
ITERATIONS = 30


def bent_states(structure: Structure, modes: ModeSet, deflection: float) -> tuple[Array, Array]:
    """Displacements y (n_dof, k) outside the set of static states, and their strain energies (k,).

    The amplitudes are those of equal static loads, 1 / omega^2; that of the lowest shape moves some node by
    `deflection` [m]. Every shape is deflected in both directions, alone and with every other, in STEPS steps: 8 n^2
    states, each of a few factorisations. Raises ValueError without clamps, or if a state is not found.
    """
    if not modes.held.size:
        raise ValueError(
            "derivatives at a deflection are static states of a clamped structure, and this set is of a free one; "
            "leave out the deflection, or clamp a group."
        )
    amplitudes = directions(structure, modes, deflection)
    states = [state for amplitude in amplitudes for state in _states_on_path(structure, modes, amplitude)]
    x = np.column_stack([state for state, _ in states])
    y = x - modes.phi @ (modes.phi.T @ (structure.M @ x))
    return y, np.array([energy for _, energy in states])


def directions(structure: Structure, modes: ModeSet, deflection: float) -> Array:
    """The amplitudes (2 n^2, n) [kg^1/2 m] of the last state of every path."""
    n = modes.n_modes
    weight = 1.0 / over_mass(structure, modes)
    lowest = int(np.argmax(weight))
    moved = np.linalg.norm((structure.translation @ modes.phi[:, lowest]).reshape(-1, 3), axis=1).max()
    single = np.diag(weight * deflection / (moved * weight[lowest]))
    of_one_shape = [sign * row for row in single for sign in (1.0, -1.0)]
    of_two_shapes = [
        a * single[i] + b * single[j] for i, j in combinations(range(n), 2) for a in (1, -1) for b in (1, -1)
    ]
    return np.array(of_one_shape + of_two_shapes).reshape(-1, n)


def _states_on_path(structure: Structure, modes: ModeSet, amplitude: Array) -> Iterator[tuple[Array, float]]:
    """The states (n_dof,) of the path to amplitudes (n,), and their energies."""
    x = np.zeros(structure.n_dof)
    for part in np.arange(1, STEPS + 1) / STEPS:
        x = state_at_amplitudes(structure, modes, part * amplitude, x + modes.phi @ amplitude / STEPS)
        yield x, state_energy(structure, x)


def state_at_amplitudes(
    structure: Structure, modes: ModeSet, amplitude: Array, x: Array, settled: float = SETTLED
) -> Array:
    """The static state (n_dof,) with amplitudes (n,) [kg^1/2 m], by Newton steps from x.

    settled: last step over the displacement. Raises ValueError if the state is not found.
    """
    elastic, free = structure.internal_force, free_dofs(structure, modes.held)
    A, x = (structure.M @ modes.phi)[free], x.copy()
    for _ in range(ITERATIONS):
        residual = (structure.f0 - elastic.force(x))[free]
        solution = solve_tangent(elastic.tangent(x)[free][:, free], np.column_stack([residual, A]))
        step, per_load = solution[:, 0], solution[:, 1:]
        step = step + per_load @ np.linalg.solve(A.T @ per_load, amplitude - A.T @ (x[free] + step))
        x[free] += step
        if not np.isfinite(step).all():
            break
        if np.abs(step).max() <= settled * np.abs(x).max():
            return x
    raise ValueError(
        f"the static state with amplitudes {amplitude.tolist()} of the {modes.n_modes} shapes was not found in "
        f"{ITERATIONS} steps; derive at a smaller deflection."
    )


def state_energy(structure: Structure, x: Array) -> float:
    """Strain energy of a state (n_dof,) less the work of the initial stress that the supports do not hold [J]."""
    return structure.internal_force.energy(x) - float(structure.f0 @ x)


def over_mass(structure: Structure, modes: ModeSet) -> Array:
    """Stiffness over mass of every shape (n,) [rad^2/s^2], its omega^2."""
    mass = np.einsum("in,in->n", modes.phi, structure.M @ modes.phi)
    return np.asarray(np.einsum("in,in->n", modes.phi, structure.K @ modes.phi) / mass)
