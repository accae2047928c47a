"""The motion of a marker, kept in the work array: where constraints take place, velocity and acceleration from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.compiled import inner
from femflex.dynamics.constraint_layout import M_A, M_ARM, M_C, M_E, M_O, M_R, M_T, M_V
from femflex.dynamics.layout import W_ACC, W_CIN, W_OMEGA, W_POS, W_VEL
from femflex.dynamics.shapes import combined, markers_motion
from femflex.dynamics.vectors import (
    UNIT,
    ZERO,
    add,
    cross,
    load3,
    load9,
    product,
    scale,
    store3,
    store9,
    transpose,
    turn,
    turn_back,
)

Array = NDArray[np.float64]
Record = np.void


@inner
def move_marker(b: Record, place: int, shape: int, spin: int, bends: int, m: int, pool: Array, work: Array) -> None:
    """Write a marker's axes, place, velocity, rate, and the part of its accelerations that udot does not give."""
    w = b["work"]
    C_iN, omega = load9(work, w + W_CIN), load3(work, w + W_OMEGA)
    r, C_iM, T = load3(pool, place), load9(pool, place + 3), UNIT
    v, turning, bias = ZERO, ZERO, ZERO
    if bends:
        moved, v, bend, T, turning, bias = markers_motion(pool, shape, spin, b, work)
        r, C_iM = add(r, moved), product(bend, C_iM)
    omega_r = cross(omega, r)
    store9(work, m + M_C, product(transpose(C_iN), C_iM))
    store3(work, m + M_R, add(load3(work, w + W_POS), turn_back(C_iN, r)))
    store3(work, m + M_V, turn_back(C_iN, add(load3(work, w + W_VEL), add(omega_r, v))))
    store3(work, m + M_O, turn_back(C_iN, add(omega, turning)))
    store3(work, m + M_A, add(cross(omega, omega_r), scale(2.0, cross(omega, v))))
    store3(work, m + M_E, add(bias, cross(omega, turning)))
    store3(work, m + M_ARM, r)
    store9(work, m + M_T, T)


@inner
def accelerate_marker(b: Record, shape: int, spin: int, bends: int, m: int, pool: Array, work: Array) -> None:
    """Complete a marker's accelerations with those of its body and of the shapes, inertial components."""
    w, row, accel = b["work"], b["row"], b["accel"]
    C_iN, alpha = load9(work, w + W_CIN), load3(work, w + W_ACC + 4)
    a = add(load3(work, m + M_A), add(load3(work, w + W_ACC), cross(alpha, load3(work, m + M_ARM))))
    e = add(load3(work, m + M_E), alpha)
    if bends:
        a = add(a, combined(pool, shape, row, work, accel))
        e = add(e, turn(load9(work, m + M_T), combined(pool, spin, row, work, accel)))
    store3(work, m + M_A, turn_back(C_iN, a))
    store3(work, m + M_E, turn_back(C_iN, e))
