"""Whether a set of shapes can stretch: what its lowest shape stores when it bends, against what it should."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.body import StrainTensors
from femflex.fem.structure import Structure
from femflex.reduction.large_deflection.derivatives import scaled_derivatives
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.strain.tensors import strain_tensors

DEFLECTION = 0.01  # of the structure's size, at which a set is assessed
STIFFER = 0.1  # share of the linear energy that a set may store on top of the relaxed structure
STEPS = 30


@dataclass(frozen=True)
class Stretching:
    """Energy of the lowest shape, its largest displacement being `deflection` [m], over its linear energy.

    alone    with the set's own other shapes free to relax
    relaxed  with the shape's static derivative in the set
    """

    deflection: float
    alone: float
    relaxed: float

    @property
    def sound(self) -> bool:
        """Whether the set relaxes nearly as far as it should."""
        return self.alone <= self.relaxed + STIFFER


def stretching(
    structure: Structure, modes: ModeSet, tensors: StrainTensors, deflection: float = DEFLECTION
) -> Stretching:
    """The Stretching of a set and its strain tensors at a deflection given as a part of the structure's size."""
    first = int(np.argmin(np.diag(tensors.V1)))
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    moved = np.linalg.norm((structure.translation @ modes.phi[:, first]).reshape(-1, 3), axis=1).max()
    amount = deflection * size / moved
    own = modes.picked([first])
    pair = np.column_stack([own.phi, _apart(structure, own.phi, scaled_derivatives(structure, own))])
    linear = tensors.V1[first, first] * amount**2 / 2
    ratios = (
        relaxed_energy(which, at, amount) / linear
        for which, at in ((tensors, first), (strain_tensors(structure, pair), 0))
    )
    return Stretching(deflection * size, *ratios)


def require_stretch(structure: Structure, modes: ModeSet, tensors: StrainTensors) -> None:
    """Raise ValueError when the set cannot stretch, with both numbers."""
    if lack := missing_stretch(structure, modes, tensors):
        has = modes.kinds.count("derivative")
        way = "Add static derivatives (derivatives = 'auto')"
        if has:
            number = "one static derivative is" if has == 1 else f"{has} static derivatives are"
            way = f"Its {number} too few: keep more of them (derivatives = 'auto', 'all' or a larger number)"
        raise ValueError(f"{lack}. {way}, or take the set as it is (derivatives = 'none').")


def missing_stretch(structure: Structure, modes: ModeSet, tensors: StrainTensors) -> str:
    """That a set cannot stretch, with both numbers; nothing where it can."""
    found = stretching(structure, modes, tensors)
    if found.sound:
        return ""
    return (
        f"{modes.n_modes} shapes ({', '.join(dict.fromkeys(modes.kinds))}) cannot stretch: with nonlinear strain the "
        f"lowest one, bent by {found.deflection:.3g} m, stores {found.alone:.3g} times its linear strain energy; "
        f"the full structure stores {found.relaxed:.4g} times that energy"
    )


def relaxed_energy(tensors: StrainTensors, held: int, amount: float) -> float:
    """Least energy [J] over the other coordinates with one held at an amount, by Newton steps from zero."""
    d = np.zeros(len(tensors.f0))
    d[held] = amount
    others = np.flatnonzero(np.arange(len(d)) != held)
    best = tensors.energy(d)
    for _ in range(STEPS):
        tangent = tensors.tangent(d)[np.ix_(others, others)]
        step = np.zeros_like(d)
        step[others] = -np.linalg.lstsq(tangent, tensors.force(d)[others], rcond=None)[0]
        tried = [(tensors.energy(d + part * step), part) for part in (1.0, 0.25, 0.05)]
        lowest, part = min(tried)
        if lowest >= best:
            break
        d, best = d + part * step, lowest
    return best


def _apart(structure: Structure, phi: Array, derivatives: Array) -> Array:
    """Derivatives (n_dof, k) without their part along phi (n_dof, 1), by mass, as sets hold them.

    That of a curved body has one, and would unbend it while the shape's own amplitude is held.
    """
    pulled = structure.M @ phi
    return np.asarray(derivatives - phi @ (pulled.T @ derivatives) / (pulled.T @ phi))
