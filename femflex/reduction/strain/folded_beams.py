"""Warning where slender beams that meet at an angle keep so many coordinates that condensed strain may lock.

A leg that bends pulls the next one in by its foreshortening. If many coordinates are kept, some of them take part in
this by bending of fast modes, which the dependent shapes compensate to second order only (`condense.carried_along`).
The remainder grows with the square of the slenderness. At a slenderness of 1000 an L-frame bent in its plane by 7 % of
its size is within 0.4 % of the full finite-element model with 4 modes, and in error by 7 % and more with 12 to 18; at
100 it is within 0.2 % with any number.
"""

from __future__ import annotations

import math
import warnings

from femflex.fem.beam.corners import corner_nodes
from femflex.fem.structure import Structure
from femflex.fem.tension.strain import TensionStrain
from femflex.reduction.limits import FOLD_ANGLE, SLENDER_FRAME
from femflex.warning import PhysicsWarning

COORDINATES = 8  # kept in addition to the dependent ones


def warn_of_folded_beams(structure: Structure, coordinates: int) -> None:
    """Warn of a condensed body whose slender beams meet at an angle and that keeps more than COORDINATES of them."""
    if coordinates <= COORDINATES or not len(corner_nodes(structure.mesh, structure.numbering.members, FOLD_ANGLE)):
        return
    slenderness = beam_slenderness(structure)
    if slenderness <= SLENDER_FRAME:
        return
    warnings.warn(
        "slender beams that meet at an angle, length over radius of gyration "
        f"{slenderness:.4g} (limit {SLENDER_FRAME:g}), with condensed strain and {coordinates} coordinates (limit "
        f"{COORDINATES}): the body may be too stiff where it bends in the plane of the angle. Keep fewer modes, or use "
        "strain = 'nonlinear' or segments",
        PhysicsWarning,
        stacklevel=4,
    )


def beam_slenderness(structure: Structure) -> float:
    """Length of all beams over the least radius of gyration in bending, sqrt(EI / EA)."""
    length, least = 0.0, math.inf
    for block, places in zip(structure.strain, structure.places, strict=True):
        bends = len(block.linear_map) > 1 and not isinstance(block, TensionStrain)  # no rod, no tether
        if places is not None and places.kind == "line" and bends:
            part = block.sampled(slice(None))
            length += float(part.weight.sum())
            EA, EI = part.elastic[..., 0, 0], (part.elastic[..., 1, 1], part.elastic[..., 2, 2])
            least = min(least, *(float((one / EA).min()) for one in EI))
    return length / math.sqrt(least) if 0 < least < math.inf else 0.0
