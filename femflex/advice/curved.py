"""What is said of curved bodies: derivatives taken at rest do not hold as far as they bend."""

from __future__ import annotations

from collections.abc import Callable

from femflex.body import StrainTensors
from femflex.fem.structure import Structure
from femflex.reduction import ModeSet, rise, softest, stretching

SOFTENED = 0.5  # tangent stiffness left at a bend, over that at rest, below which a body is called curved
REACHED = 3.0  # deflection over rise that responses should reach: beyond the state snapped through, at twice the rise


def softening_of(structure: Structure, modes: ModeSet) -> Callable[[float], tuple[float, float]] | None:
    """`softest` and `rise` of a clamped structure, sought when asked; the first 1 where it rises by more than asked."""
    if not (modes.held.size and modes.n_modes):
        return None

    def softening(most: float) -> tuple[float, float]:
        high = rise(structure)
        return (softest(structure, modes) if 0.0 < high <= most else 1.0), high

    return softening


def of_responses(structure: Structure, modes: ModeSet, tensors: StrainTensors) -> str:
    """What a set with responses does not hold: bends that the loads they answer do not bring about; nothing if little.

    It holds those that they do, whatever its other shapes store alone (`require_stretch`).
    """
    found = stretching(structure, modes, tensors)
    if found.sound:
        return ""
    return (
        f"its responses hold what their own loads do; other bends stretch it too much: its lowest shape, bent by "
        f"{found.deflection:.3g} m, stores {found.alone:.3g} times its linear energy, the structure "
        f"{found.relaxed:.3g} times that. Derivatives = 'auto' would hold those too, with more coordinates"
    )


def of_curved(structure: Structure, modes: ModeSet) -> str:
    """What should be said of derivatives at rest of a structure that softens as it bends; nothing where it does not."""
    left, high = softest(structure, modes), rise(structure)
    if left > SOFTENED or not high:
        return ""
    how = f"to {left:.0%} of that at rest" if left > 0 else "below zero: it snaps through"
    return (
        f"it is curved (it rises by {high:.3g} m), and bent one way a low shape's stiffness falls {how}, which "
        "derivatives taken at rest follow in part alone; for bends so far give strain = 'nonlinear' with "
        f"responses = 8, deflection = '{REACHED * high:.2g} m' and the load in `loads` or `attachment`"
    )
