"""The second-order load and displacement of a single shape, computed once per structure and shape."""

from __future__ import annotations

from hashlib import sha256

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.statics import static_response


def second_order_response(structure: Structure, shape: ModeSet) -> tuple[Array, Array]:
    """The load (dK/dphi) phi of a set of one shape, and the response K^-1 (dK/dphi) phi to it, (n_dof, 1) both.

    The shape is scaled to unit strain energy phi.K phi = 1. The negative response is the static derivative theta of the
    shape (`derivatives`).
    """
    key = ("own bend", shape.held.tobytes(), shape.reference, sha256(shape.phi.tobytes()).digest())
    result: tuple[Array, Array] = structure.recalled(key, lambda: _second_order_response(structure, shape))
    return result


def _second_order_response(structure: Structure, shape: ModeSet) -> tuple[Array, Array]:
    phi = shape.phi / np.sqrt(np.einsum("in,in->n", shape.phi, structure.K @ shape.phi))
    load = structure.internal_force.second_derivative(phi)
    return load, static_response(structure, shape, load)
