"""The change of the lowest shape of a flat sheet in large deflections, from static states.

A sheet of width b, thickness h and curvature k keeps the transverse curvature of its vibration modes while b^2 k / h is
small (Searle's parameter). Beyond, it becomes a cylinder except for strips along its edges. This change cannot be
derived at rest: with the third derivative at rest (`third_derivatives`) a sheet with b^2 k / h of 100 is 6 % too
stiff, with the change found at a deflection of 0.2 of its size 0.3 % at most, at smaller bends too.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.large_deflection.bent_states import over_mass, state_at_amplitudes, state_energy
from femflex.reduction.large_deflection.derivatives import scaled_derivatives
from femflex.reduction.modes.modeset import ModeSet

FURTHER = 4.0  # largest deflection of a state over that of the previous one, whose odd and even parts predict it
ON_THE_WAY = 1e-2  # last Newton step over the displacement, for intermediate states
AT_THE_END = 1e-6  # likewise for the last state: residual stretch in its odd part would store far more than bending
STRETCHED = 3.0  # energy over the linear one, above which a structure stretches: it is no sheet that bends freely


def shape_at_deflection(structure: Structure, shape: ModeSet, start: float, deflection: float) -> Array | None:
    """The odd part (n_dof,) of the static displacements of a shape at a deflection [m] in either direction.

    shape: the clamped set of the shape alone. start [m]: deflection of the first state, where nonlinear effects begin.
    If further states are not found, or stretch, the last one before them is used. None if the first one stretches: then
    the stiffness is not that of bending. Raises ValueError if the first state is not found.
    """
    phi = shape.phi[:, 0]
    displacement = float(np.linalg.norm((structure.translation @ phi).reshape(-1, 3), axis=1).max())
    stiffness = float(over_mass(structure, shape)[0] * (phi @ (structure.M @ phi)))
    count = max(int(np.ceil(np.log(deflection / start) / np.log(FURTHER))), 1)
    amplitudes = np.geomspace(min(start, deflection), deflection, count + 1) / displacement
    odd, even = phi * amplitudes[0], scaled_derivatives(structure, shape)[:, 0] * stiffness * amplitudes[0] ** 2 / 2
    previous = amplitudes[0]
    for q in amplitudes:
        try:
            forward, backward = _states_in_both_directions(
                structure, shape, q, odd * (q / previous), even * (q / previous) ** 2
            )
        except ValueError:
            if q == amplitudes[0]:
                raise
            break
        if state_energy(structure, forward) > STRETCHED * stiffness * q**2 / 2:
            if q == amplitudes[0]:
                return None
            break
        odd, even, previous = (forward - backward) / 2, (forward + backward) / 2, q
    forward, backward = _states_in_both_directions(structure, shape, previous, odd, even, AT_THE_END)
    return np.asarray((forward - backward) / 2)


def _states_in_both_directions(
    structure: Structure, shape: ModeSet, q: float, odd: Array, even: Array, settled: float = ON_THE_WAY
) -> tuple[Array, Array]:
    """The states of amplitudes q and -q, from guesses of their odd and even part."""
    forward = state_at_amplitudes(structure, shape, np.array([q]), odd + even, settled)
    backward = state_at_amplitudes(structure, shape, np.array([-q]), 2 * even - forward, settled)
    return forward, backward
