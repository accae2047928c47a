"""A force and a torque at a marker, put on the bias of its body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import inner
from femflex.dynamics.arithmetic.lanes import lane, put
from femflex.dynamics.arithmetic.vectors import Matrix, Vector, add, cross, dot, load3, store_lane, sub, turn_back
from femflex.dynamics.bodies.shapes import rows3
from femflex.dynamics.lowering.layout import W_P

Array = NDArray[np.float64]
Record = np.void


@inner
def push(
    b: Record,
    force: Vector,
    torque: Vector,
    r: Vector,
    T: Matrix,
    bends: int,
    shape: int,
    spin: int,
    pool: Array,
    work: Array,
) -> None:
    """Take a force and a torque at a marker off the body's bias: wrench at the origin, phi^T force + (T psi)^T torque.

    All in body components; r from the origin to the marker, T the tangent of its own turn.
    """
    p, row = b["work"] + W_P, b["wide"]
    store_lane(work, p, sub(load3(work, p), force))
    store_lane(work, p + 4, sub(load3(work, p + 4), add(torque, cross(r, force))))
    if bends:
        turned = turn_back(T, torque)
        for k in range(0, row, 4):
            power = dot(force, rows3(pool, shape + k, row)) + dot(turned, rows3(pool, spin + k, row))
            put(work, b["pn"] + k, lane(work, b["pn"] + k) - power)
