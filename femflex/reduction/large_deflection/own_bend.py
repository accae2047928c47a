"""What one shape's bending brings about of itself, found once per structure and shape."""

from __future__ import annotations

from hashlib import sha256

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.statics import static_response


def own_bend(structure: Structure, one: ModeSet) -> tuple[Array, Array]:
    """(dK/dphi) phi and K^-1 of it, (n_dof, 1) both, of a set of one shape, scaled to unit strain energy phi.K phi = 1.

    Less the second is the static derivative theta of the shape (`derivatives`).
    """
    key = ("own bend", one.held.tobytes(), one.reference, sha256(one.phi.tobytes()).digest())
    found: tuple[Array, Array] = structure.recalled(key, lambda: _own_bend(structure, one))
    return found


def _own_bend(structure: Structure, one: ModeSet) -> tuple[Array, Array]:
    phi = one.phi / np.sqrt(np.einsum("in,in->n", one.phi, structure.K @ one.phi))
    load = structure.internal_force.second_derivative(phi)
    return load, static_response(structure, one, load)
