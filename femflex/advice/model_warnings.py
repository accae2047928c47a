"""Warnings about a craft that need no motion: misplaced supports, torques without response, missing inertia."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.bodies import BodyOrigins
from femflex.advice.limits import (
    LINE_INERTIA_RATIO,
    LOWEST_MODES,
    MARKER_ROUNDING,
    NOTABLE_SHARE,
    ORBIT_CHANGE,
    SINGULAR_MASS,
)
from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.dynamics import compile_system
from femflex.dynamics.joints.places import joint_places
from femflex.dynamics.motion.freedoms import is_prescribed
from femflex.reduction.boundary.rigid import DIRECTIONS
from femflex.reduction.origin import Meshed
from femflex.rotations import dcm_from_quaternion
from femflex.system import Effector, Joint, System
from femflex.system.connections import tie_markers


def model_warnings(system: System, origins: BodyOrigins, duration: float) -> list[Advice]:
    """Physics warnings about a craft and its bodies that do not depend on the motion."""
    out = [
        *_joints_away_from_clamp(system, origins),
        *_supports_moving_with_joint(system, origins),
        *_torques_without_response(system),
    ]
    out += [
        *_unconnected_bodies(system),
        *_forces_on_specified_orbit(system, duration),
        *_aliased_modes(system),
    ]
    return [*out, *_rotations_without_inertia(system)]


def output_notes(system: System, step: float) -> list[Advice]:
    """Notes on bodies whose first mode an output step [s] does not resolve, as `-v` prints them."""
    pieces = {piece for parts in system.segments.values() for piece in parts}
    out = []
    for name, body in _distinct_bodies({name: body for name, body in system.bodies.items() if name not in pieces}):
        omega = body.omega[np.isfinite(body.omega) & (body.omega > 0)]
        if len(omega) and step > math.pi / omega[0]:
            text = (
                f"an output step of {step:.4g} s resolves up to {0.5 / step:.4g} Hz, and the first mode of body "
                f"{name!r} has {omega[0] / (2 * math.pi):.4g} Hz; its vibration is computed but not resolved in the "
                "output; lower run.output_step to see it"
            )
            out.append(Advice(name, "output", None, text, step, math.pi / omega[0]))
    return out


def _aliased_modes(system: System) -> Iterator[Advice]:
    """Warnings of bodies with first modes above half the sampling frequency of a controller, which aliases them."""
    effectors = [effector for effector in system.effectors if isinstance(effector, Effector)]
    inputs = {signal.partition(".")[0] for effector in effectors for signal in effector.inputs}
    # other controllers only measure, or follow the motion
    commanding = [each for each in system.controllers if each.name in inputs and not each.follows]
    if not commanding:
        return
    slowest = max(commanding, key=lambda controller: controller.period)
    pieces = {piece for parts in system.segments.values() for piece in parts}
    for name, body in _distinct_bodies({name: body for name, body in system.bodies.items() if name not in pieces}):
        omega = body.omega[np.isfinite(body.omega) & (body.omega > 0)][:LOWEST_MODES]
        above = omega[omega > math.pi / slowest.period]
        if len(above):
            text = (
                f"{slowest.name}: samples every {slowest.period:.4g} s resolve up to {0.5 / slowest.period:.4g} Hz. "
                f"Body {name!r} has a mode of {above[0] / (2 * math.pi):.4g} Hz among its first {LOWEST_MODES}; a "
                "controller "
                "samples it as a slower vibration and may excite it. Shorten the period, or check the damping of "
                "this mode in the run"
            )
            yield doubt(name, "sampling", text, math.pi / slowest.period, float(above[0]))


def _distinct_bodies(bodies: Mapping[str, FlexibleBody]) -> Iterator[tuple[str, FlexibleBody]]:
    """Names and bodies; of identical bodies only the first."""
    met: set[int] = set()
    for name, body in bodies.items():
        if id(body.moments) not in met:
            met.add(id(body.moments))
            yield name, body


def _connected_markers(system: System) -> set[tuple[str | None, str]]:
    """Body and marker of both ends of all joints, loops, constraints and springs."""
    markers: set[tuple[str | None, str]] = {(joint.child, joint.child_marker) for joint in system.joints}
    markers |= {(joint.parent, joint.parent_marker) for joint in system.joints}
    return markers | {
        (body, marker) for _, body, marker in tie_markers(system.loops, system.constraints, system.springs)
    }


def _clamped_children(system: System, origins: BodyOrigins) -> Iterator[tuple[Joint, Meshed]]:
    """Joints whose children are meshed and clamped, with the origin of the child; free roots are left out."""
    for joint in system.joints:
        source = origins[joint.child].origin.source if joint.child in origins else None
        if _is_free(system, joint) or not isinstance(source, Meshed):
            continue
        if source.modes.held.size and source.modes.n_modes:
            yield joint, source


def _is_free(system: System, joint: Joint) -> bool:
    """Whether a joint leaves a body free: all six degrees of freedom, or the attitude on a specified orbit."""
    return joint.parent is None and not joint.prescribed and (joint.n_u == 6 or system.orbit is not None)


def _joints_away_from_clamp(system: System, origins: BodyOrigins) -> Iterator[Advice]:
    """Warnings of joints that support a body away from the clamp of its shapes, with nothing attached to the clamp.

    With shapes clamped at X and a support at Y the model is valid, but too stiff: between X and Y the shapes can only
    bend as with a free end at Y. Static shapes of loads at Y, or a joint at X, correct this.
    """
    used_markers = _connected_markers(system)
    for joint, source in _clamped_children(system, origins):
        body, clamps = system.bodies[joint.child], source.modes.groups
        marker, clamp = body.marker(joint.child_marker), body.markers.get(clamps[0])
        if clamp is None or any((joint.child, group) in used_markers for group in clamps):
            continue
        group = source.places.get(joint.child_marker)
        if group is None or group in source.answered or not np.abs(marker.phi).max(initial=0.0):
            continue
        distance = float(np.linalg.norm(marker.position - clamp.position))
        omega = body.omega[np.isfinite(body.omega)]
        clamped = f"for the body clamped at {clamps[0]!r}"
        first = f"; its first frequency of {omega[0] / (2 * math.pi):.4g} Hz is {clamped}" if len(omega) else ""
        text = (
            f"bodies.{joint.child}: its shapes are clamped at {clamps[0]!r}, but joint "
            f"{joint.label!r} supports it at {joint.child_marker!r}, {distance:.4g} "
            f"m away, and nothing is attached to {clamps[0]!r}{first}. Clamp {joint.child_marker!r}, or add its static "
            f"shapes (loads = {{ {group} = [...] }})"
        )
        yield doubt(joint.child, "support", text, distance, 0.0)


def _supports_moving_with_joint(system: System, origins: BodyOrigins) -> Iterator[Advice]:
    """Warnings of joints at one of several clamped groups, whose clamp leaves some of its components free.

    The body frame moves with the joint's marker, and with it the other groups, at rest in that frame.
    """
    for joint, source in _clamped_children(system, origins):
        group = source.places.get(joint.child_marker, joint.child_marker)
        others = [name for name in source.modes.groups if name != group]
        marker, support = system.bodies[joint.child].marker(joint.child_marker), source.supports.get(group)
        if support is None or not others:
            continue
        axes = np.asarray(support.axes)
        rows = np.vstack([axes @ marker.phi, axes @ marker.psi])
        size = np.repeat([np.abs(part).max(initial=0.0) for part in (marker.phi, marker.psi)], 3)
        moves = np.abs(rows).max(axis=1, initial=0.0) > MARKER_ROUNDING * size
        free = [d for d, moved in zip(DIRECTIONS, moves, strict=True) if d not in support.components and moved]
        if free:
            text = (
                f"bodies.{joint.child}: its joint to {joint.parent or 'the base frame'} is at marker "
                f"{joint.child_marker!r}, whose clamp leaves {', '.join(free)} free. The body frame then moves with "
                f"that marker, and so do its other supports ({', '.join(map(repr, others))}). Remove "
                f"child_marker = {joint.child_marker!r}, so that the joint is at the body frame, in which all supports "
                f"are at rest; or clamp {', '.join(free)} at {group!r} too"
            )
            yield doubt(joint.child, "support", text, float(len(free)), 0.0)


def _torques_without_response(system: System) -> Iterator[Advice]:
    """Warnings of torques at markers that no shape of the body rotates."""
    for load in system.loads:
        body = system.bodies[load.body]
        marker = body.markers.get(load.marker)
        if marker is None or not np.any(load.torque) or not np.any(marker.phi) or np.any(marker.psi):
            continue
        text = (
            f"loads[{load.name}]: none of the {body.n_modes} shapes of body {load.body!r} rotates its marker "
            f"{load.marker!r}, so that the torque does not deform the body. Name a marker on several nodes, or add "
            "shapes that rotate it (`loads` in the reduction)"
        )
        yield doubt(load.body, "torque", text, 0.0)


def _unconnected_bodies(system: System) -> Iterator[Advice]:
    """Warnings of free bodies without a joint in a craft whose other bodies have joints: one may be missing."""
    parents = {joint.parent for joint in system.joints}
    tied = {body for _, body, _ in tie_markers(system.loops, system.constraints, system.springs)}
    others = [joint for joint in system.joints if not _is_free(system, joint)]
    for joint in system.joints:
        if _is_free(system, joint) and others and joint.child not in parents | tied:
            text = (
                f"bodies.{joint.child}: it has no joint and carries no body, while {len(others)} of the other bodies "
                "have a joint; it moves freely. If it is part of the craft, add a joint to the body that carries it"
            )
            yield doubt(joint.child, "craft", text, 0.0)


def _forces_on_specified_orbit(system: System, duration: float) -> Iterator[Advice]:
    """A warning of loads whose resultant would change an orbit that is specified."""
    orbit = system.orbit
    if orbit is None or orbit.free or not any(np.any(load.force) for load in system.loads):
        return
    model = compile_system(system)
    breaks = model.breaks[(model.breaks > 0.0) & (model.breaks < duration)]
    edges = np.unique(np.concatenate([np.linspace(0.0, duration, 201), breaks]))
    steps, gauss = np.diff(edges), np.array([-1.0, 1.0]) / math.sqrt(3.0)  # at the edges themselves loads may jump
    times = (edges[:-1, None] + steps[:, None] * (1.0 + gauss) / 2.0).ravel()
    channels = model.observe(times, np.repeat(model.x0[None], len(times), axis=0))
    C_NR = dcm_from_quaternion(channels[f"bodies/{system.root}/attitude"])
    total = np.zeros((len(times), 3))  # root body axes, so that a thruster counts as fixed in the craft
    for load in (load for load in system.loads if load.force.any()):
        turned = np.swapaxes(C_NR, 1, 2) @ dcm_from_quaternion(channels[f"bodies/{load.body}/attitude"])
        total += np.einsum("tab,tb->ta", turned, channels[f"loads/{load.name}/force"])
    mass = sum(body.moments.mass for body in system.bodies.values())
    impulse = np.repeat(steps / 2.0, 2) @ total
    change, speed = float(np.linalg.norm(impulse)) / mass, math.sqrt(orbit.mu / orbit.semi_major_axis)
    if change > ORBIT_CHANGE * speed:
        text = (
            f"the loads push the craft by up to {np.linalg.norm(total, axis=1).max():.4g} N, {change:.4g} m/s over "
            f"{duration:.4g} s, and its orbit is specified: the reference point O does not follow (limit "
            f"{ORBIT_CHANGE * speed:.2g} m/s, {ORBIT_CHANGE:g} of the orbital speed). Set orbit.kind = 'free'"
        )
        yield doubt("", "craft", text, change, ORBIT_CHANGE * speed)


def _rotations_without_inertia(system: System) -> Iterator[Advice]:
    """Warnings of bodies with all mass on a line, such as tethers, whose joints let them turn about this line."""
    lines = [name for name in system.order if _on_a_line(system.bodies[name])]
    if not lines:
        return
    model = compile_system(system)
    prescribed, joints, free = is_prescribed(model), dict[str, list[int]](), list[int]()
    for joint, _, u in joint_places(system):
        joints[joint.child] = [u + k for k in range(joint.n_u) if not prescribed[u + k]]
        free += joints[joint.child]
    M = model.mass_matrix(0.0, model.x0)[np.ix_(free, free)]
    size = np.sqrt(np.where(np.diag(M) > 0, np.diag(M), 1.0))
    values, vectors = np.linalg.eigh(M / size / size[:, None])
    coordinates = [coordinate.removesuffix("_rate") for coordinate, _ in system.velocity_names()]
    turned: dict[str, list[str]] = {}
    for value, vector in zip(values, vectors.T, strict=True):
        parts = {name: np.abs(vector) * np.isin(free, joints[name]) for name in lines}
        name = max(lines, key=lambda line: float(parts[line].max(initial=0.0)))
        moved = np.flatnonzero(parts[name] > NOTABLE_SHARE) if value < SINGULAR_MASS else ()
        turned.setdefault(name, []).extend(coordinates[free[k]] for k in moved)
    for name in (name for name in lines if turned.get(name)):
        place = "on a line, and its joints let it turn about this line"
        remedy = "a universal joint with both axes across the line"
        body = system.bodies[name]
        largest = np.abs(_central_inertia(body)).max()
        if not body.n_modes and largest <= LINE_INERTIA_RATIO * np.trace(body.moments.inertia()):
            place, remedy = "at a point, and its joint turns it", "a joint that only displaces it (kind = 'general')"
        text = (
            f"bodies.{name}: its mass lies {place} without inertia: the mass matrix, scaled to a diagonal of 1, has an "
            f"eigenvalue of {abs(values[0]):.2g} (limit {SINGULAR_MASS:g}), so that the craft cannot be run: nothing "
            f"determines the acceleration of {', '.join(dict.fromkeys(turned[name]))}. Give it {remedy}, or inertia "
            "(key inertia of a rigid body, or a section)"
        )
        yield doubt(name, "inertia", text, float(values[0]), SINGULAR_MASS)


def _on_a_line(body: FlexibleBody) -> bool:
    moments = np.linalg.eigvalsh(_central_inertia(body))
    return bool(moments[0] <= LINE_INERTIA_RATIO * moments[2])


def _central_inertia(body: FlexibleBody) -> Array:
    r, J = body.moments.center_of_mass(), body.moments.inertia()
    return J - body.moments.mass * (r @ r * np.eye(3) - np.outer(r, r))
