"""The motion of a marker, kept in the work array: where constraints take place, velocity and acceleration from."""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.bodies.columns import columns_times, six_lanes, wrench_times_columns, write_marker_columns
from femflex.dynamics.bodies.shapes import markers_motion
from femflex.dynamics.lowering.constraint_layout import M_A, M_ARM, M_C, M_COLUMNS, M_E, M_O, M_R, M_V
from femflex.dynamics.lowering.layout import W_ACC, W_CIN, W_OMEGA, W_P, W_POS, W_VEL
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import lane, put_lane
from femflex.kernels.pairs import lane_vector, pair_of
from femflex.kernels.vectors import (
    ZERO,
    Vector,
    add,
    cross,
    load3,
    load9,
    product,
    scale,
    store3,
    store9,
    store_lane,
    sub,
    transpose,
    turn_back,
)


@inner
def move_marker(b: Record, marker: int, shape: int, spin: int, bends: int, m: int, pool: Array, work: Array) -> None:
    """Write a marker's axes, place, velocity, rate, and the part of its accelerations that udot does not give."""
    w = b["work"]
    C_iN, omega = load9(work, w + W_CIN), load3(work, w + W_OMEGA)
    r, C_iM = load3(pool, marker), load9(pool, marker + 3)
    v, turning, bias, lift = ZERO, ZERO, ZERO, ZERO
    if bends:
        displacement, v, bend, T, turning, bias, lift = markers_motion(pool, marker, shape, spin, bends, b, work)
        r, C_iM = add(r, displacement), product(bend, C_iM)
        write_marker_columns(b, work, m + M_COLUMNS, pool, shape, spin, T, ZERO)
    omega_r = cross(omega, r)
    store9(work, m + M_C, product(transpose(C_iN), C_iM))
    store3(work, m + M_R, add(load3(work, w + W_POS), turn_back(C_iN, r)))
    store3(work, m + M_V, turn_back(C_iN, add(load3(work, w + W_VEL), add(omega_r, v))))
    store3(work, m + M_O, turn_back(C_iN, add(omega, turning)))
    store3(work, m + M_A, add(lift, add(cross(omega, omega_r), scale(2.0, cross(omega, v)))))
    store3(work, m + M_E, add(bias, cross(omega, turning)))
    store3(work, m + M_ARM, r)


@inner
def accelerate_marker(b: Record, bends: int, m: int, work: Array) -> None:
    """Complete a marker's accelerations by those of its body and of the shapes, inertial components."""
    w = b["work"]
    C_iN, alpha = load9(work, w + W_CIN), load3(work, w + W_ACC + 4)
    a = add(load3(work, m + M_A), add(load3(work, w + W_ACC), cross(alpha, load3(work, m + M_ARM))))
    e = add(load3(work, m + M_E), alpha)
    if bends:
        lift = columns_times(work, m + M_COLUMNS, b["row"], b["accel"])
        a, e = add(a, lane_vector(lift[0])), add(e, lane_vector(lift[1]))
    store3(work, m + M_A, turn_back(C_iN, a))
    store3(work, m + M_E, turn_back(C_iN, e))


@inner
def push_marker(b: Record, force: Vector, torque: Vector, bends: int, m: int, work: Array) -> None:
    """Take a force and a torque at a marker, body components, off the body's wrench and off its coordinates' bias."""
    p, row = b["work"] + W_P, b["row"]
    store_lane(work, p, sub(load3(work, p), force))
    store_lane(work, p + 4, sub(load3(work, p + 4), add(torque, cross(load3(work, m + M_ARM), force))))
    if bends:
        wrench = pair_of(force, torque)
        for k in range(0, row, 4):
            power = wrench_times_columns(wrench, six_lanes(work, m + M_COLUMNS + k, row))
            put_lane(work, b["pn"] + k, lane(work, b["pn"] + k) - power)
