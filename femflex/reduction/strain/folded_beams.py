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

import numpy as np

from femflex.arrays import Array
from femflex.fem.beam.corners import corner_nodes
from femflex.fem.plate.strain import PlateStrain
from femflex.fem.relaxed import RelaxedStrain
from femflex.fem.structure import Structure
from femflex.fem.tables import element_chunks
from femflex.fem.tension.strain import TensionStrain
from femflex.reduction.limits import FOLD_ANGLE, IN_PLANE_TURN, JUDGED_MODES, SLENDER_FRAME
from femflex.reduction.modes.vibration import ModeSet
from femflex.warning import PhysicsWarning

COORDINATES = 8  # kept in addition to the dependent ones
VIBRATING = ("vibration", "free-free", "craig-bampton")


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


# Folded and tubular plates whose facets turn in their own planes, which plates' second-order strain leaves out.
#
# Von Karman's membrane strains have the squares of w,x and w,y alone. A web that sways in its own plane turns about its
# normal by r = (v,x - u,y) / 2; the work of its membrane forces on r^2 / 2 is missing, and with it that part of what
# loads and spin stiffen or soften. For a square box column this is half: its Euler load would be twice too high.


def warn_of_in_plane_turns(structure: Structure, modes: ModeSet) -> None:
    """Warn where plates of a body with nonlinear or condensed strain turn in their own planes in its first modes."""
    vibrating = [k for k, kind in enumerate(modes.kinds) if kind in VIBRATING and modes.omega[k] > 0]
    which = sorted(vibrating, key=lambda k: modes.omega[k])[:JUDGED_MODES]
    parts = in_plane_parts(structure, modes.phi[:, which])
    if parts.max(initial=0.0) <= IN_PLANE_TURN:
        return
    hertz = modes.omega[which] / (2 * math.pi)
    text = ", ".join(f"{part:.0%} at {f:.4g} Hz" for f, part in zip(hertz, parts, strict=True))
    warnings.warn(
        "plates turn in their own planes (webs of boxes, walls of tubes), and their nonlinear strain omits the "
        f"squares of these rotations. Missing parts of the geometric stiffness: {text} (limit "
        f"{IN_PLANE_TURN:.0%}; a box column buckles at twice its load). Use shells, beams or solids, or segments with "
        "linear strain",
        PhysicsWarning,
        stacklevel=3,
    )


def in_plane_parts(structure: Structure, shapes: Array) -> Array:
    """Part (n,) of the squared slopes of plates in each shape (n_dof, n) that is rotation about their normals."""
    phi = structure.T @ shapes
    turning, slopes = np.zeros(phi.shape[1]), np.zeros(phi.shape[1])
    for given in structure.strain:
        block = given.block if isinstance(given, RelaxedStrain) else given
        if not isinstance(block, PlateStrain):
            continue
        for elements in element_chunks(len(block.weight), block.weight.shape[1] * 12 * max(1, phi.shape[1])):
            g, weight = block.gradients(phi, elements, 6), block.weight[elements]
            turning += np.einsum("eq,eqn->n", weight, ((g[:, :, 2] - g[:, :, 1]) / 2) ** 2)
            slopes += np.einsum("eq,eqin->n", weight, g[:, :, 4:6] ** 2)
    total = turning + slopes
    return np.asarray(turning / np.where(total > 0, total, 1.0))
