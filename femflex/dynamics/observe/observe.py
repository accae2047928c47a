"""Report of a run at an instant: positions, attitudes, markers, loads and monitors, written row by row."""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.shapes import combined, marker_velocity
from femflex.dynamics.forces.forces import account_of, call_report
from femflex.dynamics.forces.gravity import Origin, reference_motion
from femflex.dynamics.joints.prescribed_motion import prescribed_state
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.records import body_of, header_of, marker_of, term_of
from femflex.dynamics.observe.monitors import observe_energies
from femflex.dynamics.observe.row import BODY_WIDTH, FIXED_WIDTH, IN_BODY, IN_MARKER, MARKER_WIDTH, ROW
from femflex.dynamics.rate.auxiliary_states import copy_auxiliary_states
from femflex.dynamics.rate.rate import place_bodies
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.entries import ARRAYS, MATRIX, VECTOR, VOID
from femflex.kernels.lanes import offset, pointer
from femflex.kernels.turns import quaternion_of
from femflex.kernels.vectors import Vector, add, cross, load3, load9, store3, store4, sub, transpose, turn_back

OBSERVE = VOID(VECTOR, MATRIX, MATRIX, *ARRAYS)


@inner
def observe_body(b: Record, row: Array, position: int, shift: Vector, work: Array) -> None:
    """Position, attitude (Euler parameters of C_NB) and rate of one body."""
    w = b["work"]
    store3(row, position + IN_BODY.position, sub(load3(work, w + at.W_POS), shift))
    store4(row, position + IN_BODY.attitude, quaternion_of(transpose(load9(work, w + at.W_CIN))))
    store3(row, position + IN_BODY.rate, load3(work, w + at.W_OMEGA))


@inner
def observe_marker(
    m: Record, row: Array, position: int, origin: Origin, table: Table, pool: Array, work: Array
) -> None:
    """Position and velocity of a marker, inertial components, and its deflection, body components."""
    b = body_of(table, m["body"])
    w = b["work"]
    C = load9(work, w + at.W_CIN)
    u = combined(pool, m["shape"], b["wide"], work, b["delta"])
    du = marker_velocity(pool, m["place"], m["shape"], m["bends"], b, work)
    r = add(load3(pool, m["place"]), u)
    v = add(load3(work, w + at.W_VEL), add(cross(load3(work, w + at.W_OMEGA), r), du))
    store3(row, position + IN_MARKER.position, sub(add(load3(work, w + at.W_POS), turn_back(C, r)), origin[0]))
    store3(row, position + IN_MARKER.velocity, sub(turn_back(C, v), origin[1]))
    store3(row, position + IN_MARKER.deflection, u)


@inner
def observe_terms(
    t: float, q: Array, u: Array, row: Array, position: int, origin: Origin, table: Table, pool: Array, work: Array
) -> None:
    """Write the channels of force terms into the row from a position on, energies and powers into its fixed part."""
    head, account = header_of(table), account_of(table, work)
    store3(account, at.A_SHIFT, origin[0])
    store3(account, at.A_DRIFT, origin[1])
    for k in range(ROW.spring, FIXED_WIDTH):
        row[k] = 0.0
    for i in range(head["n_terms"]):
        term = term_of(table, i)
        account[at.A_ENERGY] = account[at.A_DISSIPATION] = account[at.A_SUPPLIED] = 0.0
        call_report(term["report"], t, q, u, term["at"], term["n"], offset(row, position), table, pool, work)
        row[ROW.spring + term["energy"]] += account[at.A_ENERGY]
        row[ROW.dissipation] += account[at.A_DISSIPATION]
        row[ROW.supplied] += account[at.A_SUPPLIED]
        position += term["reported"]


@kernel(OBSERVE)
def observe(times: Array, states: Array, rows: Array, table: Table, pool: Array, work: Array) -> None:
    """Fill rows (n_t, n_row) from times (n_t,) and states (n_t, n_x)."""
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    head = header_of(records)
    for j in range(len(times)):
        q, row = pointer(states[j]), pointer(rows[j])
        u = offset(q, head["n_q"])
        copy_auxiliary_states(u, records, scratch)
        if head["n_holds"] > 0:
            q, u = prescribed_state(times[j], q, u, records, numbers, scratch)
        place_bodies(times[j], q, u, records, numbers, scratch)
        origin = reference_motion(records, numbers, scratch)
        position = FIXED_WIDTH + BODY_WIDTH * (head["n_bodies"] - 1) + MARKER_WIDTH * head["n_markers"]
        observe_terms(times[j], q, u, row, position, origin, records, numbers, scratch)
        observe_energies(q, row, origin, records, numbers, scratch)
        position = FIXED_WIDTH
        for i in range(1, head["n_bodies"]):
            observe_body(body_of(records, i), row, position, origin[0], scratch)
            position += BODY_WIDTH
        for i in range(head["n_markers"]):
            observe_marker(marker_of(records, i), row, position, origin, records, numbers, scratch)
            position += MARKER_WIDTH
