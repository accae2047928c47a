"""Inputs of effectors: the motion of their markers, their translations and rotations, and their input signals.

Effectors of one group (see `femflex.dynamics.effectors.lowering.marker_groups`) share a place in the work array: the
first of them writes the motion of their marker, and each writes its own inputs after it.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.shapes import markers_motion
from femflex.dynamics.effectors.records import N_HANDLE, N_PORT, handle_at, port_at
from femflex.dynamics.lowering.layout import W_CIN, W_OMEGA, W_POS, W_VEL, body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import (
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
    e: Record, first: int, q: Array, u: Array, origin: tuple[Vector, Vector], table: Table, pool: Array, work: Array
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
