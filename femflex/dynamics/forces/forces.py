"""Forces on the system: of motion and strain, gravity, joint springs and dampers, force terms; and their absence.

Force terms (see `femflex.dynamics.forces.force_term`) are called by address, with fixed signatures:

APPLY    apply(t, q, u, at, first, last, table, pool, work)
         Subtracts the forces of items first to last - 1 from the bias wrenches and the elastic bias of the placed
         bodies (`push_on_body`), and adds them to W_TAU of their joints. Items with states write the rates of these
         behind `zdot` of the header.
RESIST   resist(t, q, u, c_d, c_k, at, n, table, pool, work)
         Adds c_d D + c_k K of its n items to W_RESIST along the freedoms of joints, each slope where it is positive:
         what implicit integrators hold against motion. An approximation is enough.
RELAX    relax(t, given, c_d, out, at, n, table, pool, work)
         out (n_z,): (1 - c_d J)^-1 (zdot - given) of the states of its items, after `apply` at the same state.
REPORT   report(t, q, u, at, n, row, table, pool, work)
         Writes what is reported of its n items into `row`, in the order of the term's channels, and adds to
         `account_of` (A_*) the stored energy, the power that is lost for good, and the power that comes in from
         outside.

`at` is where the term's own records begin in the table. The state is placed; u points to (n_u,), the states z stand
behind `z` of the header in the work array.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.added_mass import add_added_bias
from femflex.dynamics.bodies.inertia import add_elastic_forces, write_velocity_forces, zero_forces
from femflex.dynamics.bodies.varying import add_flow_forces
from femflex.dynamics.forces.gravity import find_center_of_mass, gravity_field, local_field
from femflex.dynamics.joints.motion import write_spring_forces
from femflex.dynamics.layout.records import ORBIT_NONE, W_BIAS, W_RESIST, W_TAU, body_of, header_of, term_of
from femflex.kernels.compiled import inner
from femflex.kernels.entries import INTEGER, NUMBERS, POINTERS, REAL, VOID, caller
from femflex.kernels.lanes import offset
from femflex.kernels.pairs import put_pair, zero_pair
from femflex.kernels.vectors import ZERO

APPLY = VOID(REAL, NUMBERS, NUMBERS, INTEGER, INTEGER, INTEGER, *POINTERS)
RESIST = VOID(REAL, NUMBERS, NUMBERS, REAL, REAL, INTEGER, INTEGER, *POINTERS)
RELAX = VOID(REAL, NUMBERS, REAL, NUMBERS, INTEGER, INTEGER, *POINTERS)
REPORT = VOID(REAL, NUMBERS, NUMBERS, INTEGER, INTEGER, NUMBERS, *POINTERS)

call_apply, call_resist, call_relax, call_report = (caller(kind) for kind in (APPLY, RESIST, RELAX, REPORT))


@inner
def account_of(table: Table, work: Array) -> Array:
    """Numbers of the account, A_*."""
    return offset(work, header_of(table)["account"])


@inner
def apply_terms(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Put the forces of all force terms on the placed bodies."""
    for i in range(header_of(table)["n_terms"]):
        term = term_of(table, i)
        call_apply(term["apply"], t, q, u, term["at"], 0, term["n"], table, pool, work)


@inner
def write_resistance(
    t: float, q: Array, u: Array, c_d: float, c_k: float, table: Table, pool: Array, work: Array
) -> None:
    """Write c_d D + c_k K of all force terms along the freedoms of every joint."""
    head = header_of(table)
    for i in range(1, head["n_bodies"]):
        for k in range(6):
            work[body_of(table, i)["work"] + W_RESIST + k] = 0.0
    for i in range(head["n_terms"]):
        term = term_of(table, i)
        if term["resist"] != 0:
            call_resist(term["resist"], t, q, u, c_d, c_k, term["at"], term["n"], table, pool, work)


@inner
def write_forces(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Write every body's bias wrench and elastic bias, and the forces of sprung joints, at the placed state."""
    head = header_of(table)
    l, strength = ZERO, 0.0
    if head["orbit"] != ORBIT_NONE:
        find_center_of_mass(table, pool, work)
        l, strength = gravity_field(table, pool, work)
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        field, uniform = local_field(b, head, l, strength, pool, work)
        write_velocity_forces(b, pool, work, field, uniform)
        if b["flows"]:
            add_flow_forces(b, pool, work)
        if b["added"] > 0:
            add_added_bias(b, work)
        add_elastic_forces(b, pool, work)
        if b["sprung"]:
            write_spring_forces(b, q, u, pool, work)
    apply_terms(t, q, u, table, pool, work)


@inner
def clear_joint_forces(b: Record, work: Array) -> None:
    """Clear the joint forces."""
    for k in range(6):
        work[b["work"] + W_TAU + k] = 0.0


@inner
def clear_all_joint_forces(table: Table, work: Array) -> None:
    """Clear the joint forces of all bodies."""
    for i in range(1, header_of(table)["n_bodies"]):
        clear_joint_forces(body_of(table, i), work)


@inner
def clear_forces(table: Table, work: Array) -> None:
    """Leave the placed bodies without forces, joint forces and bias accelerations."""
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        zero_forces(b, work)
        put_pair(work, b["work"] + W_BIAS, zero_pair())
        clear_joint_forces(b, work)


@inner
def push_coordinates(forces: Array, table: Table, work: Array) -> None:
    """Add generalised forces (n_u) to those of joints and shapes."""
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        for j in range(b["n_h"] - (3 if b["hidden"] else 0)):
            work[b["work"] + W_TAU + j] += forces[b["u"] + j]
        for j in range(b["n"]):
            work[b["pn"] + j] -= forces[b["ue"] + j]
