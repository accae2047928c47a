"""Compiled evaluation of effectors: their inputs, calls of their functions, their forces, correction of their states.

Effectors of one group (see `effector_records.marker_groups`) share a place in the work array: the first of them writes
the motion of their marker, and each writes its own inputs after it.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.shapes import markers_motion
from femflex.dynamics.forces.effector_functions import N_ACCOUNTS
from femflex.dynamics.forces.effector_records import N_EFFECTOR, N_HANDLE, N_PORT, effector_at, handle_at, port_at
from femflex.dynamics.forces.gravity import Origin
from femflex.dynamics.forces.marker_forces import push_on_body
from femflex.dynamics.layout.records import W_CIN, W_OMEGA, W_POS, W_TAU, W_VEL, body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.entries import ACT, caller
from femflex.kernels.lanes import offset, put_lane, zero_lane
from femflex.kernels.vectors import (
    UNIT,
    ZERO,
    Vector,
    add,
    cross,
    load3,
    load9,
    product,
    store3,
    store9,
    sub,
    transpose,
    turn,
    turn_back,
)


@inner
def write_marker_motion(
    e: Record, k: int, p: Record, shift: Vector, drift: Vector, table: Table, pool: Array, work: Array
) -> None:
    """Write the motion of marker k of an effector, inertial components, and the numbers that its force needs."""
    b, m, seen = body_of(table, p["body"]), e["n_markers"], e["seen"]
    w = b["work"]
    C_iN, omega = load9(work, w + W_CIN), load3(work, w + W_OMEGA)
    r, C_iM, v = load3(pool, p["place"]), load9(pool, p["place"] + 3), ZERO
    rate = omega
    if p["bends"]:
        displacement, v, bend, T, turning, _, _ = markers_motion(
            pool, p["place"], p["shape"], p["spin"], p["bends"], b, work
        )
        r, C_iM, rate = add(r, displacement), product(bend, C_iM), add(omega, turning)
        store9(work, p["motion"] + 3, T)
    v = add(load3(work, w + W_VEL), add(cross(omega, r), v))
    store3(work, p["motion"], r)
    store3(work, seen + 3 * k, sub(add(load3(work, w + W_POS), turn_back(C_iN, r)), shift))
    store9(work, seen + 3 * m + 9 * k, product(transpose(C_iN), C_iM))
    store3(work, seen + 12 * m + 3 * k, sub(turn_back(C_iN, v), drift))
    store3(work, seen + 15 * m + 3 * k, turn_back(C_iN, rate))


@inner
def write_signals(e: Record, table: Table, work: Array) -> None:
    """Write the inputs of an effector."""
    first, z = e["seen"] + 18 * e["n_markers"] + 2 * e["n_freedoms"], header_of(table)["z"]
    for k in range(e["n_inputs"]):
        work[first + k] = work[z + table[e["inputs"] + k]]


@inner
def write_inputs(
    e: Record, first: int, q: Array, u: Array, origin: Origin, table: Table, pool: Array, work: Array
) -> None:
    """Write the inputs of an effector at the placed state, after those from `first` on."""
    if e["before"] < first:
        for k in range(e["n_markers"]):
            write_marker_motion(e, k, port_at(table, e["markers"] + N_PORT * k), *origin, table, pool, work)
    first_coordinate, n = e["seen"] + 18 * e["n_markers"], e["n_freedoms"]
    for k in range(n):
        handle = handle_at(table, e["freedoms"] + N_HANDLE * k)
        work[first_coordinate + k], work[first_coordinate + n + k] = q[handle["q"]], u[handle["u"]]
    write_signals(e, table, work)


call_act = caller(ACT)


@inner
def out_size(e: Record) -> int:
    """Numbers that an effector writes."""
    return 6 * e["n_markers"] + e["n_freedoms"] + e["n_z"] + e["n_channels"] + N_ACCOUNTS


@inner
def evaluate(t: float, e: Record, z: Array, out: int, pool: Array, work: Array) -> None:
    """Call an effector's function with its inputs and states z (n_z,); its results go to offset `out` of work."""
    if e["clears"] != 0:
        for k in range(0, out_size(e), 4):
            put_lane(work, out + k, zero_lane())
    call_act(e["act"], t, offset(work, e["seen"]), z, offset(pool, e["parameters"]), offset(work, out))


@inner
def evaluate_effector(
    t: float,
    q: Array,
    u: Array,
    i: int,
    first: int,
    records: int,
    origin: Origin,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """Write the inputs of effector i, call it, and keep its state rates; those from `first` on are done already.

    origin: position and velocity as of `reference_motion`
    """
    head, e = header_of(table), effector_at(table, records + N_EFFECTOR * i)
    write_inputs(e, first, q, u, origin, table, pool, work)
    evaluate(t, e, offset(work, head["z"] + e["z"]), e["out"], pool, work)
    rates, zdot = e["out"] + 6 * e["n_markers"] + e["n_freedoms"], head["zdot"] + e["z"]
    for k in range(e["n_z"]):
        work[zdot + k] = work[rates + k]


@inner
def push_marker(p: Record, force: Vector, torque: Vector, table: Table, pool: Array, work: Array) -> None:
    """Put a force and a torque, inertial components, on the body of a marker."""
    b = body_of(table, p["body"])
    C_iN, r, T = load9(work, b["work"] + W_CIN), load3(work, p["motion"]), UNIT
    if p["bends"]:
        T = load9(work, p["motion"] + 3)
    rows = p["bends"], p["shape"], p["spin"]
    push_on_body(b, turn(C_iN, force), turn(C_iN, torque), r, T, rows, pool, work)


@inner
def apply_forces(i: int, first: int, last: int, records: int, table: Table, pool: Array, work: Array) -> None:
    """Put the forces of effector i on its bodies and joints.

    Within a group they are added up from `first` on, and the last of the group before `last` puts them on the body.
    """
    e = effector_at(table, records + N_EFFECTOR * i)
    m, out = e["n_markers"], e["out"]
    if m == 1:
        force, torque = load3(work, out), load3(work, out + 3)
        if e["before"] >= first:
            force, torque = add(force, load3(work, e["pushed"])), add(torque, load3(work, e["pushed"] + 3))
        if 0 <= e["after"] < last:
            store3(work, e["pushed"], force)
            store3(work, e["pushed"] + 3, torque)
        else:
            push_marker(port_at(table, e["markers"]), force, torque, table, pool, work)
    elif e["pushes"]:
        for k in range(m):
            force, torque = load3(work, out + 3 * k), load3(work, out + 3 * m + 3 * k)
            push_marker(port_at(table, e["markers"] + N_PORT * k), force, torque, table, pool, work)
    for k in range(e["n_freedoms"]):
        handle = handle_at(table, e["freedoms"] + N_HANDLE * k)
        tau = body_of(table, handle["body"])["work"] + W_TAU + handle["freedom"]
        work[tau] += work[out + 6 * m + k]
    if e["strained"] > 0:
        apply_strain(e, table, pool, work)


@inner
def strain_pull(e: Record, k: int, b: Record, i: int, pool: Array, work: Array, V1: int) -> float:
    """Generalised force on coordinate i of unit amplitude of component k, whose change of stiffness is at V1."""
    n, pull = b["n"], pool[e["pulls"] + k * b["n"] + i]
    if V1 >= 0:
        for j in range(n):
            pull += pool[V1 + n * i + j] * work[b["delta"] + j]
    return pull


@inner
def apply_strain(e: Record, table: Table, pool: Array, work: Array) -> None:
    """Put the forces of the strain that an effector induces on the coordinates of its body."""
    b, first = body_of(table, e["strained"]), e["out"] + 6 * e["n_markers"] + e["n_freedoms"] + e["n_z"]
    for k in range(e["n_strains"]):
        amplitude = work[first + k]
        if amplitude != 0.0:
            for i in range(b["n"]):
                work[b["pn"] + i] += amplitude * strain_pull(e, k, b, i, pool, work, table[e["stiffens"] + k])


@inner
def strain_accounts(e: Record, table: Table, pool: Array, work: Array) -> Vector:
    """Power that the induced strain gives to the motion, the energy of it, and the power that its change supplies."""
    b, first = body_of(table, e["strained"]), e["out"] + 6 * e["n_markers"] + e["n_freedoms"] + e["n_z"]
    power, energy, supplied = 0.0, 0.0, 0.0
    for k in range(e["n_strains"]):
        amplitude, rate = work[first + k], work[first + e["n_strains"] + k]
        stored = 0.0
        for i in range(b["n"]):
            pull = strain_pull(e, k, b, i, pool, work, table[e["stiffens"] + k])
            stored += 0.5 * (pull + pool[e["pulls"] + k * b["n"] + i]) * work[b["delta"] + i]
            power -= amplitude * pull * work[b["ddelta"] + i]
        energy += amplitude * stored
        supplied += rate * stored
    return power, energy, supplied


STEP = 1e-7  # of a state's size: difference for the Jacobian of its rates


@inner
def write_jacobian(t: float, e: Record, table: Table, pool: Array, work: Array) -> None:
    """J (n_z, n_z + 1) of an effector's own states, the last column free: by its own function, or by differences."""
    n, size = e["n_z"], out_size(e)
    z, base, rates = header_of(table)["z"] + e["z"], e["out"], 6 * e["n_markers"] + e["n_freedoms"]
    if e["jacobian"] != 0:
        jacobian = offset(work, e["out"] + size)
        for k in range(n * n):
            jacobian[k] = 0.0
        parameters = offset(pool, e["parameters"])
        call_act(e["jacobian"], t, offset(work, e["seen"]), offset(work, z), parameters, jacobian)
        for i in range(n):
            for j in range(n):
                work[e["matrix"] + (n + 1) * i + j] = jacobian[n * i + j]
        return
    for j in range(n):
        for k in range(n):
            work[e["trial"] + k] = work[z + k]
        step = STEP * max(abs(work[z + j]), pool[e["sizes"] + j])
        work[e["trial"] + j] += step
        evaluate(t, e, offset(work, e["trial"]), base + size, pool, work)
        for i in range(n):
            change = work[base + size + rates + i] - work[base + rates + i]
            work[e["matrix"] + (n + 1) * i + j] = change / step


@inner
def solve_small(a: Array, n: int) -> None:
    """Solve A x = b for [A | b] (n, n + 1) in place, x in the last column; by elimination with row exchanges."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[(n + 1) * i + k]) > abs(a[(n + 1) * best + k]):
                best = i
        for j in range(n + 1):
            a[(n + 1) * k + j], a[(n + 1) * best + j] = a[(n + 1) * best + j], a[(n + 1) * k + j]
        for i in range(k + 1, n):
            factor = a[(n + 1) * i + k] / a[(n + 1) * k + k]
            for j in range(k, n + 1):
                a[(n + 1) * i + j] -= factor * a[(n + 1) * k + j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            a[(n + 1) * k + n] -= a[(n + 1) * k + j] * a[(n + 1) * j + n]
        a[(n + 1) * k + n] /= a[(n + 1) * k + k]


@inner
def correct(t: float, e: Record, c_d: float, out: Array, table: Table, pool: Array, work: Array) -> None:
    """Solve (1 - c_d J) dz = out for the states of one effector, in place."""
    size = e["n_z"]
    write_signals(e, table, work)  # another of its group may have written there
    write_jacobian(t, e, table, pool, work)
    a = offset(work, e["matrix"])
    for j in range(size):
        for k in range(size):
            a[(size + 1) * j + k] = (1.0 if j == k else 0.0) - c_d * a[(size + 1) * j + k]
        a[(size + 1) * j + size] = out[e["z"] + j]
    solve_small(a, size)
    for j in range(size):
        out[e["z"] + j] = a[(size + 1) * j + size]
