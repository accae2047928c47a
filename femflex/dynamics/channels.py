"""Channels that a run of a system reports, and the slice of an observed row that each fills."""

from __future__ import annotations

import numpy as np

from femflex.dynamics.effectors.states import state_channels
from femflex.dynamics.force_terms import force_terms
from femflex.dynamics.forces.orbit_force import orbit_channels
from femflex.dynamics.joints.channels import joint_channels
from femflex.dynamics.joints.gimbal_lock import lock_channels
from femflex.dynamics.joints.law_report import law_channels
from femflex.dynamics.joints.reactions import reaction_channels
from femflex.dynamics.lowering.layout import ENERGY_EFFECTOR, ENERGY_LOAD
from femflex.dynamics.lowering.lower import reported_markers
from femflex.dynamics.reports import monitors
from femflex.dynamics.reports import observe as seen
from femflex.dynamics.reports.contacts import contact_channels
from femflex.dynamics.reports.displacements import displacement_channels, is_deformable_marker
from femflex.dynamics.reports.local_forces import local_force_channels
from femflex.dynamics.reports.momenta import momenta_channels
from femflex.dynamics.reports.sights import sight_channels
from femflex.dynamics.reports.static_stretch import stretching_markers
from femflex.dynamics.reports.variations import variation_channels
from femflex.dynamics.terms.prescribed_motion_report import prescribed_motion_channels
from femflex.rotations import EULER_PARAMETERS, is_extrinsic, is_symmetric, letters_of
from femflex.system import Channel, Effector, System
from femflex.system.segments import marker_label

XYZ = ("x", "y", "z")
EULER = ("e0", "e1", "e2", "e3")
ANGLE_WORDS = {"x": "pitch", "y": "yaw", "z": "roll"}  # about the axes of the orbital frame


def conservative_loads(system: System) -> list[str]:
    """Names of the loads whose potential is part of the energy."""
    return [load.name for load in system.loads if load.conservative and system.orbit is None]


def is_supplied(system: System) -> bool:
    """Return whether an element may supply power: a load whose potential is not part of the energy, or an effector."""
    effectors = (e for e in system.effectors if isinstance(e, Effector))
    supplied = any(effector.acts or "supplied" in effector.accounts for effector in effectors)
    return supplied or len(conservative_loads(system)) < len(system.loads)


def has_springs(system: System) -> bool:
    """Whether joints or springs store energy."""
    return any(joint.stiffness.any() or joint.laws or joint.latches for joint in system.joints) or bool(system.springs)


def stores_in_effectors(system: System) -> bool:
    """Whether an effector accounts for stored energy."""
    return any(isinstance(e, Effector) and "energy" in e.accounts for e in system.effectors)


def row_length(system: System) -> int:
    """Numbers per observed instant."""
    counts = len(system.bodies) * seen.ROW_BODY + len(reported_markers(system)) * seen.ROW_MARKER
    terms = (channel for term in force_terms() for channel in term.channels(system).values())
    return monitors.ROW_FIXED + counts + sum(int(np.prod(channel.shape)) for channel in terms)


def row_slices(system: System) -> dict[str, slice | int]:
    """Return the slice of an observed row that each channel fills."""
    s = monitors
    slices: dict[str, slice | int] = {
        "attitude/angles": slice(s.ROW_ANGLES, s.ROW_ANGLES + 3),
        "monitors/energy": s.ROW_ENERGY,
        "monitors/kinetic": s.ROW_KINETIC,
        "monitors/elastic": s.ROW_ELASTIC,
        "monitors/spring": s.ROW_SPRING,
        "monitors/momentum": slice(s.ROW_MOMENTUM, s.ROW_MOMENTUM + 3),
        "monitors/angular_momentum": slice(s.ROW_ANGULAR, s.ROW_ANGULAR + 3),
        "monitors/center_of_mass": slice(s.ROW_CENTER, s.ROW_CENTER + 3),
        "monitors/quaternion_norm": s.ROW_NORM,
    }
    if system.orbit is not None:
        slices |= {
            "orbit/radius": s.ROW_RADIUS,
            "orbit/true_anomaly": s.ROW_ANOMALY,
            "orbit/attitude": slice(s.ROW_ORBIT, s.ROW_ORBIT + 4),
            "monitors/gravity": s.ROW_GRAVITY,
        }
        if not system.orbit.free:
            slices["monitors/jacobi"] = s.ROW_JACOBI
    if system.environment.has_weight:
        slices["monitors/gravity"] = s.ROW_GRAVITY
    if conservative_loads(system):
        slices["monitors/load"] = s.ROW_STORED + ENERGY_LOAD
    if stores_in_effectors(system):
        slices["monitors/effector"] = s.ROW_STORED + ENERGY_EFFECTOR
    if is_supplied(system):
        slices["monitors/supplied"] = s.ROW_SUPPLIED
    position = s.ROW_FIXED
    for name in system.order:
        for key, start, stop in (("position", 0, 3), ("attitude", 3, 7), ("rate", 7, 10)):
            slices[f"bodies/{name}/{key}"] = slice(position + start, position + stop)
        position += seen.ROW_BODY
    for body, marker in reported_markers(system):
        for key, start in (("position", 0), ("velocity", 3), ("deflection", 6)):
            slices[f"markers/{marker_label(system.segments, body, marker)}/{key}"] = slice(
                position + start, position + start + 3
            )
        position += seen.ROW_MARKER
    for path, channel in (pair for term in force_terms() for pair in term.channels(system).items()):
        size = int(np.prod(channel.shape))
        slices[path] = slice(position, position + size) if channel.shape else position
        position += size
    return slices


def channels_of(system: System) -> dict[str, Channel]:
    """Return path, unit, meaning and frame of every channel of a run; those zero by construction are left out."""
    q, u, z = system.coordinate_names(), system.velocity_names(), system.state_names()
    where = "from O" if system.orbit else "from the inertial origin"
    sequence = system.libration_sequence
    angles, kind = letters_of(sequence), "extrinsic" if is_extrinsic(sequence) else "intrinsic"
    names = ANGLE_WORDS if system.frame.kind == "orbital" else {axis: axis for axis in "xyz"}
    words = tuple(f"{a}{k + 1}" if is_symmetric(sequence) else names[a] for k, a in enumerate(angles))
    out = {
        "q": Channel(_units(q), "coordinates", (len(q),), tuple(name for name, _ in q)),
        "u": Channel(_units(u), "quasi-velocities", (len(u),), tuple(name for name, _ in u)),
        "attitude/angles": Channel(
            "rad", f"attitude of {system.root} from the {system.frame.kind} frame, {kind} {angles}", (3,), words
        ),
        "monitors/energy": Channel("J", "total energy"),
        "monitors/kinetic": Channel("J", "kinetic energy relative to O" if system.orbit else "kinetic energy"),
        "monitors/momentum": Channel("kg m/s", "linear momentum", (3,), XYZ, "inertial"),
        "monitors/angular_momentum": Channel(
            "kg m^2/s", "angular momentum about the centre of mass", (3,), XYZ, "inertial"
        ),
        "monitors/center_of_mass": Channel("m", f"centre of mass {where}", (3,), XYZ, "inertial"),
    }
    if any(body.n_shapes for body in system.bodies.values()) or system.varying:
        out["monitors/elastic"] = Channel("J", "strain energy")
    if has_springs(system):
        out["monitors/spring"] = Channel("J", "energy of joint springs")
    if any(joint.ball == EULER_PARAMETERS for joint in system.joints):
        out["monitors/quaternion_norm"] = Channel("1", "largest departure of Euler parameters from unit length")
    if z:
        out["z"] = Channel(
            _units(z), "states of latches, effectors and controllers", (len(z),), tuple(name for name, _ in z)
        )
    if conservative_loads(system):
        out["monitors/load"] = Channel("J", "energy of forces that are constant in inertial axes, -F.r")
    if system.environment.has_weight:
        out["monitors/gravity"] = Channel("J", "energy of the weight, -m g.c from the inertial origin")
    if system.orbit is not None:
        out |= {
            "orbit/radius": Channel("m", "distance of O from the Earth's centre"),
            "orbit/true_anomaly": Channel("rad", "true anomaly of O"),
            "orbit/attitude": Channel("1", "Euler parameters of the orbital frame, C_NO", (4,), EULER),
            "monitors/gravity": Channel("J", "energy of the gravity gradient"),
        }
        if not system.orbit.free:
            out["monitors/jacobi"] = Channel("J", "Jacobi integral, constant on a specified circular orbit")
    for name in system.order:
        out |= {
            f"bodies/{name}/position": Channel("m", f"origin of {name} {where}", (3,), XYZ, "inertial"),
            f"bodies/{name}/attitude": Channel("1", f"Euler parameters of {name}, C_NB", (4,), EULER),
            f"bodies/{name}/rate": Channel("rad/s", f"inertial rate of {name}", (3,), XYZ, "body"),
            f"bodies/{name}/delta": Channel(
                "kg^1/2 m", f"amplitudes of the shapes of {name}", (system.bodies[name].n_shapes,)
            ),
        }
    for name in system.segments:
        out |= {
            f"bodies/{name}/position": Channel("m", f"origin of {name}, undeformed, {where}", (3,), XYZ, "inertial"),
            f"bodies/{name}/attitude": Channel("1", f"Euler parameters of {name}, undeformed, C_NB", (4,), EULER),
        }
    stretching = stretching_markers(system)
    for body, marker in reported_markers(system):
        label = marker_label(system.segments, body, marker)
        described = (
            "elastic displacement, static stretch included," if (body, marker) in stretching else "elastic displacement"
        )
        out |= {
            f"markers/{label}/position": Channel("m", f"position of {label} {where}", (3,), XYZ, "inertial"),
            f"markers/{label}/velocity": Channel("m/s", f"velocity of {label} {where}", (3,), XYZ, "inertial"),
        }
        if is_deformable_marker(system, body, marker) or label != f"{body}.{marker}":
            text = f"{described} of {label} in its own body; `displacement` includes joints"
            out[f"markers/{label}/deflection"] = Channel("m", text, (3,), XYZ, "body")
    out |= displacement_channels(system)
    out |= joint_channels(system) | lock_channels(system) | variation_channels(system)
    for term in force_terms():
        zeros = term.zeros(system)
        out |= {path: channel for path, channel in term.channels(system).items() if path not in zeros}
    out |= state_channels(system)
    if stores_in_effectors(system):
        out["monitors/effector"] = Channel("J", "energy stored by effectors")
    if is_supplied(system):
        out["monitors/supplied"] = Channel("W", "power of loads without a potential and of effectors")
    out |= prescribed_motion_channels(system) | law_channels(system) | orbit_channels(system)
    out |= sight_channels(system) | contact_channels(system)
    out |= constraint_channels(system) | reaction_channels(system) | local_force_channels(system)
    return out | momenta_channels(system)


def constraint_channels(system: System) -> dict[str, Channel]:
    """Return the channels of loops and constraints; none for a system without any."""
    if not (system.loops or system.constraints):
        return {}
    out = {
        "monitors/constraint_position": Channel("m", "largest gap of the loops, angles times the bodies' size"),
        "monitors/constraint_velocity": Channel("m/s", "largest velocity residual (rad/s in rows of angles)"),
        "monitors/constraint_rank": Channel("1", "number of independent constraint rows"),
    }
    for c in system.constraints:
        if c.body is None:
            out[f"constraints/{c.name}/multipliers"] = Channel("1", "multipliers lambda of A^T lambda", (c.n_rows,))
    reactions = [(f"loops/{j.label}", j.child, j.child_marker) for j in system.loops]
    reactions += [(f"constraints/{c.name}", c.body, c.marker) for c in system.constraints if c.body is not None]
    for path, body, marker in reactions:
        out |= {
            f"{path}/force": Channel("N", f"force of the constraint on {body}", (3,), XYZ, "inertial"),
            f"{path}/torque": Channel("N m", f"its torque on {body} about {body}.{marker}", (3,), XYZ, "inertial"),
        }
    return out


def _units(pairs: list[tuple[str, str]]) -> str:
    return ", ".join(unit for _, unit in pairs)
