"""How the lowest shape of a flat sheet changes as it bends far: static states, up to a deflection.

A sheet of width b, thickness h and curvature k keeps the crosswise curvature of its vibration modes while b^2 k / h is
small (Searle's parameter). Bent further it becomes a cylinder but for strips along its edges. What it has become there
does not show at rest: with the third derivative at rest (`third_derivatives`) a sheet with b^2 k / h of 100 is 6 % too
stiff, with the change found at a deflection of 0.2 of its size 0.3 % at most, at smaller bends too.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.large_deflection.bent_states import held_at, over_mass, state_energy
from femflex.reduction.large_deflection.derivatives import scaled_derivatives
from femflex.reduction.modes.modeset import ModeSet

FURTHER = 4.0  # deflection of a state over that of the one before, at most: odd and even parts of the one foretell it
ON_THE_WAY = 1e-2  # last Newton step over the displacement, of states that only lead on
AT_THE_END = 1e-6  # of the last: stretch left in its odd part would store far more than bending
STRETCHED = 3.0  # energy over that of small bends from which a structure stretches, and is no sheet that bends freely


def changed_by_bending(structure: Structure, one: ModeSet, start: float, deflection: float) -> Array | None:
    """Displacements (n_dof,) that a shape turns into when it is bent by a deflection [m] either way, their odd part.

    one: the set of the shape alone, clamped. start [m]: deflection of the first state on the way there, at which bends
    begin to differ from small ones. Where further states are not found, or stretch, the last before them. None where
    the first one stretches: bending is not what holds the structure. Raises ValueError when the first is not found.
    """
    phi = one.phi[:, 0]
    moved = float(np.linalg.norm((structure.translation @ phi).reshape(-1, 3), axis=1).max())
    stiffness = float(over_mass(structure, one)[0] * (phi @ (structure.M @ phi)))
    count = max(int(np.ceil(np.log(deflection / start) / np.log(FURTHER))), 1)
    amplitudes = np.geomspace(min(start, deflection), deflection, count + 1) / moved
    odd, even = phi * amplitudes[0], scaled_derivatives(structure, one)[:, 0] * stiffness * amplitudes[0] ** 2 / 2
    before = amplitudes[0]
    for q in amplitudes:
        try:
            ahead, back = _both_ways(structure, one, q, odd * (q / before), even * (q / before) ** 2)
        except ValueError:
            if q == amplitudes[0]:
                raise
            break
        if state_energy(structure, ahead) > STRETCHED * stiffness * q**2 / 2:
            if q == amplitudes[0]:
                return None
            break
        odd, even, before = (ahead - back) / 2, (ahead + back) / 2, q
    ahead, back = _both_ways(structure, one, before, odd, even, AT_THE_END)
    return np.asarray((ahead - back) / 2)


def _both_ways(
    structure: Structure, one: ModeSet, q: float, odd: Array, even: Array, settled: float = ON_THE_WAY
) -> tuple[Array, Array]:
    """The states with amplitude q and -q, from guesses of their odd and even part."""
    ahead = held_at(structure, one, np.array([q]), odd + even, settled)
    back = held_at(structure, one, np.array([-q]), 2 * even - ahead, settled)
    return ahead, back
