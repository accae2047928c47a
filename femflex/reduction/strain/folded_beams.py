"""Warning where slender beams that meet at an angle keep so many coordinates that condensed strain may lock.

Where a leg bends, it draws the next one in. Of many kept coordinates some take part in that by bending of fast modes,
which the shapes that follow take back to second order alone (`condense.carried_along`). What is left over grows with
the square of the slenderness: an L-frame bent in its plane by 7 % of its size is within 0.4 % of all its elements with
4 modes, and 7 % off and more with 12 to 18 of them at a slenderness of 1000; within 0.2 % at 100 with any.
"""

from __future__ import annotations

import math
import warnings

from femflex.fem.beam.corners import corner_nodes
from femflex.fem.structure import Structure
from femflex.fem.tension.strain import TensionStrain
from femflex.warning import PhysicsWarning

SLENDER = 300.0  # length of all beams over the radius of gyration
COORDINATES = 8  # kept in addition to the dependent ones
ANGLE = 0.5  # sine; beams that meet at 18 degrees do not lock (0.2 %)


def warn_of_folded_beams(structure: Structure, coordinates: int) -> None:
    """Warn of a condensed body whose slender beams meet at an angle and that keeps more than COORDINATES of them."""
    if coordinates <= COORDINATES or not len(corner_nodes(structure.mesh, structure.numbering.members, ANGLE)):
        return
    slenderness = beam_slenderness(structure)
    if slenderness <= SLENDER:
        return
    warnings.warn(
        "slender beams that meet at an angle, length over radius of gyration "
        f"{slenderness:.4g} (limit {SLENDER:g}), with condensed strain and {coordinates} coordinates (limit "
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
