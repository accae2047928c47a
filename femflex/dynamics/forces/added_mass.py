"""Masses that effectors add at markers and to bodies (see `Effector.added_mass`), gathered on the bodies.

With the accelerations J (a, ddot delta) + bias of a marker, J = (S | columns) from those of the body's origin, a matrix
M adds J^T M J to the mass matrix of the body and J^T M bias to its forces.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.added_mass import ADD_MASS, MATRIX, SIX_ROWS, clear_added_mass, place_of_bias
from femflex.dynamics.bodies.shapes import markers_motion
from femflex.dynamics.bodies.slaves import write_marker_columns
from femflex.dynamics.forces.effector_calls import call_act, write_marker_motion
from femflex.dynamics.forces.effector_records import N_EFFECTOR, N_PORT, effector_at, port_at
from femflex.dynamics.forces.gravity import reference_motion
from femflex.dynamics.layout.records import W_CIN, W_OMEGA, body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.entries import entry
from femflex.kernels.formula import formula
from femflex.kernels.lanes import offset
from femflex.kernels.vectors import ZERO, Vector, add, cross, dot, load3, load9, scale, turn


@inner
def turned_mass(b: Record, matrix: Array, work: Array, out: int) -> None:
    """The mass (6, 6) at `matrix`, inertial components, in those of the body at work[out]."""
    C = load9(work, b["work"] + W_CIN)
    for half in range(2):
        for r in range(6):
            row = 6 * r + 3 * half
            x, y, z = turn(C, load3(matrix, row))
            work[out + row], work[out + row + 1], work[out + row + 2] = x, y, z
    for half in range(2):
        for c in range(6):
            column = out + 18 * half + c
            x, y, z = turn(C, (work[column], work[column + 6], work[column + 12]))
            work[column], work[column + 6], work[column + 12] = x, y, z


@formula
def times(work: Array, M: int, a: Vector, alpha: Vector) -> tuple[Vector, Vector]:
    """M (a, alpha) of the mass (6, 6) at work[M]: force and couple."""
    rows = [dot(load3(work, M + 6 * i), a) + dot(load3(work, M + 6 * i + 3), alpha) for i in range(6)]
    return (rows[0], rows[1], rows[2]), (rows[3], rows[4], rows[5])


@inner
def add_wrench(work: Array, at: int, force: Vector, couple: Vector) -> None:
    """Add a wrench to the six numbers of a row at work[at]."""
    for k in range(3):
        work[at + k] += force[k]
        work[at + 4 + k] += couple[k]


@inner
def add_marker_mass(p: Record, matrix: Array, table: Table, pool: Array, work: Array) -> None:
    """Add the mass (6, 6) at `matrix` of a marker, inertial components, to the body that carries it."""
    b = body_of(table, p["body"])
    n, row, bias = b["n"], b["row"], place_of_bias(b)
    columns, products, M = bias + 8 + row, bias + 8 + 7 * row, bias + 8 + 13 * row
    turned_mass(b, matrix, work, M)
    omega, r = load3(work, b["work"] + W_OMEGA), load3(work, p["motion"])
    a, alpha = cross(omega, cross(omega, r)), ZERO
    if p["bends"]:
        _, v, _, T, turning, swing, lift = markers_motion(pool, p["place"], p["shape"], p["spin"], p["bends"], b, work)
        a = add(a, add(scale(2.0, cross(omega, v)), lift))
        alpha = add(swing, cross(omega, turning))
        write_marker_columns(b, work, columns, pool, p["shape"], p["spin"], T, ZERO)
    for i in range(6):  # a unit acceleration of the body's origin
        unit = (1.0 if i % 3 == 0 else 0.0, 1.0 if i % 3 == 1 else 0.0, 1.0 if i % 3 == 2 else 0.0)
        force, couple = times(work, M, unit, ZERO) if i < 3 else times(work, M, cross(unit, r), unit)
        add_wrench(work, b["added"] + 8 * i, force, add(couple, cross(r, force)))
    force, couple = times(work, M, a, alpha)
    add_wrench(work, bias, force, add(couple, cross(r, force)))
    if p["bends"]:
        for k in range(n):
            c = columns + k
            along = force[0] * work[c] + force[1] * work[c + row] + force[2] * work[c + 2 * row]
            about = couple[0] * work[c + 3 * row] + couple[1] * work[c + 4 * row] + couple[2] * work[c + 5 * row]
            work[bias + 8 + k] += along + about
        for k in range(n):
            c, d = columns + k, products + k
            push, twist = times(
                work,
                M,
                (work[c], work[c + row], work[c + 2 * row]),
                (work[c + 3 * row], work[c + 4 * row], work[c + 5 * row]),
            )
            add_wrench(work, b["added"] + SIX_ROWS + b["stride"] * k + row, push, add(twist, cross(r, push)))
            for i in range(3):
                work[d + i * row], work[d + (i + 3) * row] = push[i], twist[i]
        for i in range(n):
            entry = b["added"] + SIX_ROWS + b["stride"] * i
            for s in range(6):
                c = work[columns + s * row + i]
                if c != 0.0:
                    for k in range(n):
                        work[entry + k] += c * work[products + s * row + k]


@inner
def add_body_mass(e: Record, table: Table, pool: Array, work: Array) -> None:
    """Add the constant mass of an effector to its body; its marker's bias acceleration is the centripetal one."""
    b = body_of(table, port_at(table, e["markers"])["body"])
    n, bias = b["n"], place_of_bias(b)
    M, size = e["body_mass"] + 3, 6 + n
    omega = load3(work, b["work"] + W_OMEGA)
    a = cross(omega, cross(omega, load3(pool, e["body_mass"])))
    for i in range(6):
        add_wrench(work, b["added"] + 8 * i, load3(pool, M + size * i), load3(pool, M + size * i + 3))
    for k in range(n):
        row, entry = M + size * (6 + k), b["added"] + SIX_ROWS + b["stride"] * k
        add_wrench(work, entry + b["row"], load3(pool, row), load3(pool, row + 3))
        for j in range(n):
            work[entry + j] += pool[row + 6 + j]
        work[bias + 8 + k] += dot(load3(pool, row), a)
    for i in range(3):
        work[bias + i] += dot(load3(pool, M + size * i), a)
        work[bias + 4 + i] += dot(load3(pool, M + size * (3 + i)), a)


@entry(ADD_MASS)
def write_added_masses(t: float, table: Table, pool: Array, work: Array) -> None:
    """Write the masses that all effectors add, at the placed state."""
    head = header_of(table)
    for i in range(1, head["n_bodies"]):
        if body_of(table, i)["added"] > 0:
            clear_added_mass(body_of(table, i), work)
    origin = reference_motion(table, pool, work)
    for i in range(head["n_wet"]):
        e = effector_at(table, head["wet"] + N_EFFECTOR * i)
        if e["body_mass"] > 0:
            add_body_mass(e, table, pool, work)
        if e["add_mass"] == 0:
            continue
        for k in range(e["n_markers"]):
            write_marker_motion(e, k, port_at(table, e["markers"] + N_PORT * k), *origin, table, pool, work)
        states = offset(work, head["z"] + e["z"])
        seen, parameters = offset(work, e["seen"]), offset(pool, e["parameters"])
        call_act(e["add_mass"], t, seen, states, parameters, offset(work, e["masses"]))
        for k in range(e["n_markers"]):
            port = port_at(table, e["markers"] + N_PORT * k)
            if body_of(table, port["body"])["added"] > 0:
                add_marker_mass(port, offset(work, e["masses"] + MATRIX * k), table, pool, work)
