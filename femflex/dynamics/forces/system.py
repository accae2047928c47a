"""Forces on the system: of motion and strain, gravity, joint springs and dampers, force terms; and their absence."""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.flow import add_flow_forces
from femflex.dynamics.bodies.inertia import add_elastic_forces, write_velocity_forces, zero_forces
from femflex.dynamics.forces.calls import apply_terms
from femflex.dynamics.forces.gravity import find_center_of_mass, gravity_field, local_field
from femflex.dynamics.joints.forces import write_spring_forces
from femflex.dynamics.lowering.layout import ORBIT_NONE, W_BIAS, W_TAU, body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.pairs import put_pair, zero_pair
from femflex.kernels.vectors import ZERO


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
