"""Energies, momenta and the orbit of a placed system: the fixed part of a reported row."""

from __future__ import annotations

import math

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.varying import shape_motion
from femflex.dynamics.forces.gravity import Origin, find_center_of_mass, gravity_field, inertia_along
from femflex.dynamics.joints.motion import spring_energy
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.records import body_of, header_of
from femflex.dynamics.observe.row import ROW
from femflex.kernels.compiled import inner
from femflex.kernels.turns import angles_of, quaternion_of
from femflex.kernels.vectors import (
    ZERO,
    Vector,
    add,
    cross,
    dot,
    load3,
    load9,
    scale,
    store3,
    store4,
    sub,
    turn,
    turn_back,
)


@inner
def observe_energies(q: Array, row: Array, origin: Origin, table: Table, pool: Array, work: Array) -> None:
    """Orbit, attitude angles, energies, momenta and quaternion norm into the fixed part of a row.

    What force terms store stands there already.
    """
    head, (shift, drift) = header_of(table), origin
    mass = pool[head["mass"]]
    kinetic = elastic = spring = 0.0
    momentum, spin, center = ZERO, ZERO, ZERO
    norm = 0.0
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        w = b["work"]
        C = load9(work, w + at.W_CIN)
        m, s = pool[b["mass"]], load3(work, w + at.W_S)
        v = sub(load3(work, w + at.W_VEL), turn(C, drift))
        o = load3(work, w + at.W_OMEGA)
        ds, h, T_e, V_e = shape_motion(b, pool, work)
        Q = load9(work, w + at.W_Q)
        J_o = sub(scale(Q[0] + Q[4] + Q[8], o), turn(Q, o))
        p = add(scale(m, v), add(cross(o, s), ds))
        H_body = add(cross(s, v), add(J_o, h))  # about the body's origin
        kinetic += 0.5 * (dot(v, add(p, add(cross(o, s), ds))) + dot(o, J_o)) + dot(o, h) + T_e
        elastic += V_e
        spring += spring_energy(b, q, pool, work)
        p_N = turn_back(C, p)
        r = sub(load3(work, w + at.W_POS), shift)
        momentum = add(momentum, p_N)
        spin = add(spin, add(turn_back(C, H_body), cross(r, p_N)))
        center = add(center, add(scale(m, r), turn_back(C, s)))
        if b["ball"] == at.BALL_QUATERNION:
            j = b["q"] + b["n_slide"]
            w2, x2, y2, z2 = q[j] * q[j], q[j + 1] * q[j + 1], q[j + 2] * q[j + 2], q[j + 3] * q[j + 3]
            norm = max(norm, abs(math.sqrt(w2 + x2 + y2 + z2) - 1.0))
    spring += row[ROW.spring]
    center = scale(1.0 / mass, center)
    row[ROW.kinetic], row[ROW.elastic], row[ROW.spring] = kinetic, elastic, spring
    store3(row, ROW.momentum, momentum)
    store3(row, ROW.angular_momentum, sub(spin, cross(center, momentum)))
    store3(row, ROW.center_of_mass, center)
    row[ROW.quaternion_norm] = norm
    stored = row[ROW.load] + row[ROW.effector]
    observe_orbit(row, kinetic + elastic + spring + stored, spin, momentum, table, pool, work)
    observe_angles(body_of(table, 1), row, head, pool, work)


@inner
def observe_orbit(
    row: Array, energy: float, spin: Vector, momentum: Vector, table: Table, pool: Array, work: Array
) -> None:
    """Orbit state, gravity's energy, total energy and Jacobi integral.

    Uniform gravity: U = -m g.c, c the centre of mass from the inertial origin.
    Specified orbit: energy relative to O with U = 1/2 int r.(mu/a0^3)(1 - 3 l l) r dm; Jacobi = energy - Omega.H.
    Free orbit: total energy less that of the total mass on the Kepler orbit of O, formed without cancellation.
    """
    head = header_of(table)
    gravity = 0.0
    row[ROW.radius], row[ROW.true_anomaly] = 0.0, 0.0
    jacobi = 0.0
    for k in range(4):
        row[ROW.attitude + k] = 1.0 if k == 0 else 0.0
    if head["orbit"] != at.ORBIT_NONE:
        o, mu, mass = head["orbit_state"], pool[head["orbit_data"]], pool[head["mass"]]
        find_center_of_mass(table, pool, work)
        l, strength = gravity_field(table, pool, work)
        c = load3(work, head["total"])
        J_l, trace = inertia_along(l, c, table, pool, work)
        gravity = -0.5 * strength * (trace - 3.0 * dot(l, J_l))
        R, V = load3(work, o + 13), load3(work, o + 16)
        row[ROW.radius], row[ROW.true_anomaly] = work[o], work[o + 22]
        C_NO = load9(work, o + 4)
        store4(row, ROW.attitude, quaternion_of(C_NO))
        if head["orbit"] == at.ORBIT_FREE:
            R_c = add(R, c)
            radius, a0 = math.sqrt(dot(R, R)), math.sqrt(dot(R_c, R_c))
            gravity += mu * mass * dot(c, add(R, R_c)) / (radius * a0 * (radius + a0))
            energy += dot(V, momentum)
        jacobi = energy + gravity - dot(turn(C_NO, load3(work, o + 1)), spin)
    elif head["weighs"]:
        gravity = -pool[head["mass"]] * dot(load3(pool, head["gravity"]), load3(row, ROW.center_of_mass))
    row[ROW.gravity] = gravity
    row[ROW.energy] = energy + gravity
    row[ROW.jacobi] = jacobi


@inner
def observe_angles(b: Record, row: Array, head: Record, pool: Array, work: Array) -> None:
    """Attitude angles of the root joint's marker relative to the base frame, in the reported sequence."""
    store3(row, ROW.angles, angles_of(load9(work, b["work"] + at.W_CPQ), load3(pool, head["angle_axes"])))
