"""What a run reports at an instant: positions, attitudes, markers, loads and monitors, written row by row."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from femflex.dynamics.equations import place
from femflex.dynamics.forces import find_center_of_mass, gravity_field, inertia_along, load_wrench, write_forces
from femflex.dynamics.kinematics import combine
from femflex.dynamics.layout import (
    BALL_NONE,
    BALL_QUATERNION,
    ORBIT_FREE,
    ORBIT_NONE,
    W_CIN,
    W_CPQ,
    W_OMEGA,
    W_POS,
    W_Q,
    W_S,
    W_VEL,
    bodies_of,
    header_of,
    loads_of,
    markers_of,
)
from femflex.dynamics.turns import ZERO, angles_of, quaternion_of, vector_of
from femflex.dynamics.vectors import (
    Vector,
    add,
    cross,
    dot,
    inner,
    load3,
    load9,
    scale,
    store3,
    store4,
    sub,
    transpose,
    turn,
    turn_back,
)

Array = NDArray[np.float64]
Table = NDArray[np.int64]
Record = np.void

# one row: the fixed part, then per body position 3, attitude 4, rate 3; per marker position 3, velocity 3,
# deflection 3; per load force 3, torque 3
ROW_RADIUS, ROW_ANOMALY, ROW_ORBIT, ROW_ANGLES = 0, 1, 2, 6
ROW_KINETIC, ROW_ELASTIC, ROW_SPRING, ROW_GRAVITY, ROW_ENERGY, ROW_JACOBI = 9, 10, 11, 12, 13, 14
ROW_MOMENTUM, ROW_ANGULAR, ROW_CENTER, ROW_NORM = 15, 18, 21, 24
ROW_FIXED, ROW_BODY, ROW_MARKER, ROW_LOAD = 25, 10, 9, 6

_matrix, _vector, _integers = types.float64[:, ::1], types.float64[::1], types.int64[::1]
OBSERVE = types.void(_vector, _matrix, _matrix, _integers, _vector, _vector)


@inner
def origin(x: Array, table: Table, pool: Array, work: Array) -> tuple[Vector, Vector]:
    """Place and velocity, inertial components, of what positions and velocities are counted from.

    With an eliminated translation this is the centre of mass (which sits at O); otherwise the base origin.
    """
    bodies, head = bodies_of(table), header_of(table)
    if not bodies[1]["hidden"]:
        return ZERO, ZERO
    find_center_of_mass(table, pool, work)
    momentum = ZERO
    for i in range(1, len(bodies)):
        b = bodies[i]
        w = b["work"]
        ds = shape_motion(b, x, head["n_q"], pool, work)[0]
        p = add(cross(load3(work, w + W_OMEGA), load3(work, w + W_S)), ds)
        p = add(p, scale(pool[b["mass"]], load3(work, w + W_VEL)))
        momentum = add(momentum, turn_back(load9(work, w + W_CIN), p))
    return load3(work, head["total"]), scale(1.0 / pool[head["mass"]], momentum)


@inner
def observe_body(b: Record, row: Array, at: int, shift: Vector, work: Array) -> None:
    """Position, attitude (Euler parameters of C_NB) and rate of one body."""
    w = b["work"]
    store3(row, at, sub(load3(work, w + W_POS), shift))
    store4(row, at + 3, quaternion_of(transpose(load9(work, w + W_CIN))))
    store3(row, at + 7, load3(work, w + W_OMEGA))


@inner
def observe_marker(
    m: Record,
    bodies: Array,
    x: Array,
    nq: int,
    row: Array,
    at: int,
    shift: Vector,
    drift: Vector,
    pool: Array,
    work: Array,
) -> None:
    """Position and velocity of a marker, inertial components, and its deflection, body components."""
    b = bodies[m["body"]]
    w = b["work"]
    C = load9(work, w + W_CIN)
    u = combine(pool, m["shape"], b["n"], x, b["qe"])
    du = combine(pool, m["shape"], b["n"], x, nq + b["ue"])
    r = add(load3(pool, m["place"]), u)
    v = add(load3(work, w + W_VEL), add(cross(load3(work, w + W_OMEGA), r), du))
    store3(row, at, sub(add(load3(work, w + W_POS), turn_back(C, r)), shift))
    store3(row, at + 3, sub(turn_back(C, v), drift))
    store3(row, at + 6, u)


@inner
def observe_energies(
    x: Array, row: Array, shift: Vector, drift: Vector, table: Table, pool: Array, work: Array
) -> None:
    """Orbit, attitude angles, energies, momenta and quaternion norm into the fixed part of a row."""
    bodies, head = bodies_of(table), header_of(table)
    nq, mass = head["n_q"], pool[head["mass"]]
    kinetic = elastic = spring = 0.0
    momentum, spin, center = ZERO, ZERO, ZERO
    norm = 0.0
    for i in range(1, len(bodies)):
        b = bodies[i]
        w = b["work"]
        C = load9(work, w + W_CIN)
        m, s = pool[b["mass"]], load3(work, w + W_S)
        v = sub(load3(work, w + W_VEL), turn(C, drift))
        o = load3(work, w + W_OMEGA)
        ds, h, T_e, V_e = shape_motion(b, x, nq, pool, work)
        Q = load9(work, w + W_Q)
        J_o = sub(scale(Q[0] + Q[4] + Q[8], o), turn(Q, o))
        p = add(scale(m, v), add(cross(o, s), ds))
        about = add(cross(s, v), add(J_o, h))  # about the body's origin
        kinetic += 0.5 * (dot(v, add(p, add(cross(o, s), ds))) + dot(o, J_o)) + dot(o, h) + T_e
        elastic += V_e
        spring += spring_energy(b, x, pool, work)
        p_N = turn_back(C, p)
        r = sub(load3(work, w + W_POS), shift)
        momentum = add(momentum, p_N)
        spin = add(spin, add(turn_back(C, about), cross(r, p_N)))
        center = add(center, add(scale(m, r), turn_back(C, s)))
        if b["ball"] == BALL_QUATERNION:
            j = b["q"] + b["n_slide"]
            norm = max(norm, abs(math.sqrt(x[j] ** 2 + x[j + 1] ** 2 + x[j + 2] ** 2 + x[j + 3] ** 2) - 1.0))
    center = scale(1.0 / mass, center)
    row[ROW_KINETIC], row[ROW_ELASTIC], row[ROW_SPRING] = kinetic, elastic, spring
    store3(row, ROW_MOMENTUM, momentum)
    store3(row, ROW_ANGULAR, sub(spin, cross(center, momentum)))
    store3(row, ROW_CENTER, center)
    row[ROW_NORM] = norm
    observe_orbit(row, kinetic + elastic + spring, spin, momentum, table, pool, work)
    observe_angles(bodies[1], row, head, pool, work)


@inner
def observe_orbit(
    row: Array, energy: float, spin: Vector, momentum: Vector, table: Table, pool: Array, work: Array
) -> None:
    """Orbit state, gravity's energy, total energy and Jacobi integral.

    Specified orbit: energy relative to O with U = 1/2 int r.(mu/a0^3)(1 - 3 l l) r dm; Jacobi = energy - Omega.H.
    Free orbit: total energy less that of the total mass on the Kepler orbit of O, formed without cancellation.
    """
    head = header_of(table)
    gravity = 0.0
    row[ROW_RADIUS], row[ROW_ANOMALY] = 0.0, 0.0
    jacobi = 0.0
    for k in range(4):
        row[ROW_ORBIT + k] = 1.0 if k == 0 else 0.0
    if head["orbit"] != ORBIT_NONE:
        o, mu, mass = head["orbit_state"], pool[head["orbit_data"]], pool[head["mass"]]
        find_center_of_mass(table, pool, work)
        l, strength = gravity_field(table, pool, work)
        c = load3(work, head["total"])
        J_l, trace = inertia_along(l, c, table, pool, work)
        gravity = -0.5 * strength * (trace - 3.0 * dot(l, J_l))
        R, V = load3(work, o + 13), load3(work, o + 16)
        row[ROW_RADIUS], row[ROW_ANOMALY] = work[o], work[o + 3]
        C = load9(work, o + 4)
        store4(row, ROW_ORBIT, quaternion_of(C))
        if head["orbit"] == ORBIT_FREE:
            R_c = add(R, c)
            radius, a0 = math.sqrt(dot(R, R)), math.sqrt(dot(R_c, R_c))
            gravity += mu * mass * dot(c, add(R, R_c)) / (radius * a0 * (radius + a0))
            energy += dot(V, momentum)
        jacobi = energy + gravity - work[o + 1] * dot((C[0], C[3], C[6]), spin)
    row[ROW_GRAVITY] = gravity
    row[ROW_ENERGY] = energy + gravity
    row[ROW_JACOBI] = jacobi


@inner
def observe_angles(b: Record, row: Array, head: Record, pool: Array, work: Array) -> None:
    """Attitude angles of the root body's marker Q relative to the base frame, in the reported sequence."""
    store3(row, ROW_ANGLES, angles_of(load9(work, b["work"] + W_CPQ), load3(pool, head["angle_axes"])))


@inner
def shape_motion(b: Record, x: Array, nq: int, pool: Array, work: Array) -> tuple[Vector, Vector, float, float]:
    """Momentum and angular momentum that the shapes' rates add, their own kinetic energy, and the strain energy."""
    n, rate = b["n"], nq + b["ue"]
    ds, h = ZERO, ZERO
    kinetic = strain = 0.0
    for k in range(n):
        d, q = x[rate + k], x[b["qe"] + k]
        B = b["B"]
        ds = add(ds, (d * work[B + k], d * work[B + n + k], d * work[B + 2 * n + k]))
        h = add(h, (d * work[B + 3 * n + k], d * work[B + 4 * n + k], d * work[B + 5 * n + k]))
        strain += pool[b["f0"] + k] * q
        for j in range(n):
            kinetic += 0.5 * d * pool[b["elastic_mass"] + k * n + j] * x[rate + j]
            strain += 0.5 * q * pool[b["stiffness"] + k * n + j] * x[b["qe"] + j]
    return ds, h, kinetic, strain


@inner
def spring_energy(b: Record, x: Array, pool: Array, work: Array) -> float:
    """Energy stored in the joint's springs."""
    if not b["sprung"]:
        return 0.0
    free = b["n_slide"] + b["n_turn"]
    total = 0.0
    for k in range(free):
        total += 0.5 * pool[b["spring"] + k] * (x[b["q"] + k] - pool[b["rest"] + k]) ** 2
    if b["ball"] != BALL_NONE:
        theta = vector_of(load9(work, b["work"] + W_CPQ))
        for k in range(3):
            total += 0.5 * pool[b["spring"] + free + k] * (theta[k] - pool[b["rest"] + free + k]) ** 2
    return total


@njit(OBSERVE, cache=True)
def observe(times: Array, states: Array, rows: Array, table: Table, pool: Array, work: Array) -> None:
    """Fill rows (n_t, n_row) from times (n_t,) and states (n_t, n_x)."""
    bodies, loads, markers, head = bodies_of(table), loads_of(table), markers_of(table), header_of(table)
    for j in range(len(times)):
        x, row = states[j], rows[j]
        place(times[j], x, table, pool, work)
        write_forces(times[j], x, table, pool, work)
        shift, drift = origin(x, table, pool, work)
        observe_energies(x, row, shift, drift, table, pool, work)
        at = ROW_FIXED
        for i in range(1, len(bodies)):
            observe_body(bodies[i], row, at, shift, work)
            at += ROW_BODY
        for i in range(len(markers)):
            observe_marker(markers[i], bodies, x, head["n_q"], row, at, shift, drift, pool, work)
            at += ROW_MARKER
        for i in range(len(loads)):
            force, torque, _, _ = load_wrench(times[j], loads[i], bodies, head, x, pool, work)
            store3(row, at, force)
            store3(row, at + 3, torque)
            at += ROW_LOAD
