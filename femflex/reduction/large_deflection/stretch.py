"""Check that a set of shapes can stretch: the energy of its lowest shape in bending, compared with the structure's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.body import StrainTensors
from femflex.fem.structure import Structure
from femflex.reduction.large_deflection.derivatives import scaled_derivatives
from femflex.reduction.modes.vibration import ModeSet
from femflex.reduction.strain.tensors import strain_tensors

DEFLECTION = 0.01  # of the structure's size, at which a set is assessed
STIFFER = 0.1  # share of the linear energy that a set may store on top of the relaxed structure
STEPS = 30


@dataclass(frozen=True)
class Stretching:
    """Energy of the lowest shape, its largest displacement being `deflection` [m], over its linear energy.

    alone    with the other shapes of the set relaxed
    relaxed  with the static derivative of the shape added
    """

    deflection: float
    alone: float
    relaxed: float

    @property
    def sound(self) -> bool:
        """Whether the set relaxes nearly as far as the structure."""
        return self.alone <= self.relaxed + STIFFER


def stretching(structure: Structure, modes: ModeSet, tensors: StrainTensors) -> Stretching:
    """The Stretching of a set and its strain tensors at DEFLECTION of the structure's size."""
    first = int(np.argmin(np.diag(tensors.V1)))
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    displacement = np.linalg.norm((structure.translation @ modes.phi[:, first]).reshape(-1, 3), axis=1).max()
    amount = DEFLECTION * size / displacement
    lowest = modes.picked([first])
    pair = np.column_stack(
        [lowest.phi, _without_part_along(structure, lowest.phi, scaled_derivatives(structure, lowest))]
    )
    linear = tensors.V1[first, first] * amount**2 / 2
    ratios = (
        relaxed_energy(energy_of, number, amount) / linear
        for energy_of, number in ((tensors, first), (strain_tensors(structure, pair), 0))
    )
    return Stretching(DEFLECTION * size, *ratios)


def require_stretch(structure: Structure, modes: ModeSet, tensors: StrainTensors) -> None:
    """Raise ValueError, with both energies, if the set cannot stretch."""
    if text := missing_stretch(structure, modes, tensors):
        count = modes.kinds.count("derivative")
        remedy = "Add static derivatives (derivatives = 'auto')"
        if count:
            number = "one static derivative is" if count == 1 else f"{count} static derivatives are"
            remedy = f"Its {number} too few: keep more of them (derivatives = 'auto', 'all' or a larger number)"
        raise ValueError(f"{text}. {remedy}, or take the set as it is (derivatives = 'none').")


def missing_stretch(structure: Structure, modes: ModeSet, tensors: StrainTensors) -> str:
    """A text on a set that cannot stretch, with both energies; empty if it can."""
    energies = stretching(structure, modes, tensors)
    if energies.sound:
        return ""
    return (
        f"{modes.n_modes} shapes ({', '.join(dict.fromkeys(modes.kinds))}) cannot stretch: with nonlinear strain the "
        f"lowest one, bent by {energies.deflection:.3g} m, stores {energies.alone:.3g} times its linear strain energy; "
        f"the full structure stores {energies.relaxed:.4g} times that energy"
    )


def relaxed_energy(tensors: StrainTensors, held: int, amount: float) -> float:
    """The least energy [J] over the other coordinates with one prescribed at an amount, by Newton steps from zero."""
    d = np.zeros(len(tensors.f0))
    d[held] = amount
    others = np.flatnonzero(np.arange(len(d)) != held)
    least = tensors.energy(d)
    for _ in range(STEPS):
        tangent = tensors.tangent(d)[np.ix_(others, others)]
        step = np.zeros_like(d)
        step[others] = -np.linalg.lstsq(tangent, tensors.force(d)[others], rcond=None)[0]
        trials = [(tensors.energy(d + part * step), part) for part in (1.0, 0.25, 0.05)]
        lowest, part = min(trials)
        if lowest >= least:
            break
        d, least = d + part * step, lowest
    return least


def _without_part_along(structure: Structure, phi: Array, derivatives: Array) -> Array:
    """Derivatives (n_dof, k), made M-orthogonal to phi (n_dof, 1), as in sets.

    The derivative of a curved body has a part along phi, which would unbend the body at a prescribed amplitude.
    """
    pulled = structure.M @ phi
    return np.asarray(derivatives - phi @ (pulled.T @ derivatives) / (pulled.T @ phi))
