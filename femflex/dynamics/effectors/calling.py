"""Calls of the functions of effectors, and their forces on bodies and joints."""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.effectors.effector_functions import N_ACCOUNTS
from femflex.dynamics.effectors.effector_inputs import write_inputs
from femflex.dynamics.effectors.records import N_EFFECTOR, N_HANDLE, N_PORT, effector_at, handle_at, port_at
from femflex.dynamics.forces.marker_forces import push_on_body
from femflex.dynamics.lowering.layout import W_CIN, W_TAU, body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.entries import ACT, caller
from femflex.kernels.lanes import offset, put_lane, zero_lane
from femflex.kernels.vectors import UNIT, Vector, add, load3, load9, store3, turn

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
    origin: tuple[Vector, Vector],
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
    push_on_body(b, turn(C_iN, force), turn(C_iN, torque), r, T, p["bends"], p["shape"], p["spin"], pool, work)


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
    else:
        for k in range(m):
            force, torque = load3(work, out + 3 * k), load3(work, out + 3 * m + 3 * k)
            push_marker(port_at(table, e["markers"] + N_PORT * k), force, torque, table, pool, work)
    for k in range(e["n_freedoms"]):
        handle = handle_at(table, e["freedoms"] + N_HANDLE * k)
        tau = body_of(table, handle["body"])["work"] + W_TAU + handle["freedom"]
        work[tau] += work[out + 6 * m + k]
