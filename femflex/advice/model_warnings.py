"""Doubts of a craft that need no motion: places that joints hold, torques that bend nothing, mass that modes lack."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.bodies import KnownBodies
from femflex.advice.limits import CARRIED, DRIFT, DUST, LOWEST
from femflex.body import FlexibleBody
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.linearised import is_prescribed
from femflex.dynamics.lowering.layout import body_records
from femflex.reduction.boundary.rigid import DIRECTIONS
from femflex.reduction.origin import Meshed
from femflex.rotations import dcm_from_quaternion
from femflex.system import Effector, Joint, System
from femflex.system.connections import tie_markers

LINE = 1e-9  # least over largest moment of inertia about the centre of mass: mass on a line
NO_INERTIA = 1e-13  # eigenvalue of the scaled mass matrix: a motion that accelerations cannot be solved for
NOTABLE = 0.1  # of a body in that motion


def model_warnings(system: System, known: KnownBodies, duration: float) -> list[Advice]:
    """What is doubtful of a craft and its bodies, whatever they are going to do."""
    out = [*_held_elsewhere(system, known), *_dragged_supports(system, known), *_idle_torques(system)]
    out += [*_light_sets(system), *_loose_bodies(system), *_driven_orbit(system, duration), *_aliased(system)]
    return [*out, *_turns_without_inertia(system)]


def output_warnings(system: System, step: float) -> list[Advice]:
    """Modes of whole bodies that an output step [s] is too long to show."""
    pieces = {piece for parts in system.segments.values() for piece in parts}
    out = []
    for name, body in _once({name: body for name, body in system.bodies.items() if name not in pieces}):
        omega = body.omega[np.isfinite(body.omega) & (body.omega > 0)]
        if len(omega) and step > math.pi / omega[0]:
            text = (
                f"run: an output step of {step:.4g} s resolves up to {0.5 / step:.4g} Hz, and the first mode of body "
                f"{name!r} has {omega[0] / (2 * math.pi):.4g} Hz; its vibration is computed but not resolved in the "
                "output; lower run.output_step to see it"
            )
            out.append(doubt(name, "output", text, step, math.pi / omega[0]))
    return out


def _aliased(system: System) -> Iterator[Advice]:
    """First modes of whole bodies above half the sampling frequency of controllers: samples show them as slow ones."""
    effectors = [one for one in system.effectors if isinstance(one, Effector)]
    taken = {signal.partition(".")[0] for effector in effectors for signal in effector.inputs}
    driving = [one for one in system.controllers if one.name in taken]  # others only measure
    if not driving:
        return
    slowest = max(driving, key=lambda one: one.period)
    pieces = {piece for parts in system.segments.values() for piece in parts}
    for name, body in _once({name: body for name, body in system.bodies.items() if name not in pieces}):
        omega = body.omega[np.isfinite(body.omega) & (body.omega > 0)][:LOWEST]
        above = omega[omega > math.pi / slowest.period]
        if len(above):
            text = (
                f"{slowest.name}: samples every {slowest.period:.4g} s resolve up to {0.5 / slowest.period:.4g} Hz. "
                f"Body {name!r} has a mode of {above[0] / (2 * math.pi):.4g} Hz among its first {LOWEST}; a controller "
                "takes its vibration for a slower one and may drive it. Shorten the period, or check the damping of "
                "this mode in the run"
            )
            yield doubt(name, "sampling", text, math.pi / slowest.period, float(above[0]))


def _once(bodies: Mapping[str, FlexibleBody]) -> Iterator[tuple[str, FlexibleBody]]:
    """Bodies, of those alike the first."""
    seen: set[int] = set()
    for name, body in bodies.items():
        if id(body.moments) not in seen:
            seen.add(id(body.moments))
            yield name, body


def _used(system: System) -> set[tuple[str | None, str]]:
    """Body and marker of both ends of all joints, loops, constraints and springs."""
    used: set[tuple[str | None, str]] = {(joint.child, joint.child_marker) for joint in system.joints}
    used |= {(joint.parent, joint.parent_marker) for joint in system.joints}
    return used | {(body, marker) for _, body, marker in tie_markers(system.loops, system.constraints, system.springs)}


def _clamped(system: System, known: KnownBodies) -> Iterator[tuple[Joint, Meshed]]:
    """Joints whose children are meshed and clamped, and these; not that of a free root, which nothing holds."""
    for joint in system.joints:
        source = known[joint.child].origin.source if joint.child in known else None
        if _is_free(system, joint) or not isinstance(source, Meshed):
            continue
        if source.modes.held.size and source.modes.n_modes:
            yield joint, source


def _is_free(system: System, joint: Joint) -> bool:
    """Whether a joint leaves a body all its motion: on a specified orbit that is its attitude."""
    return joint.parent is None and not joint.prescribed and (joint.n_u == 6 or system.orbit is not None)


def _held_elsewhere(system: System, known: KnownBodies) -> Iterator[Advice]:
    """Joints that hold a body at a point that moves in its shapes, with nothing at their clamp.

    Shapes clamped at X and held at Y make a right model, but a stiff one: they know of no bending between the two
    but what a free end at Y does. Static shapes of loads at Y, or a joint at X, make it sound.
    """
    used = _used(system)
    for joint, source in _clamped(system, known):
        body, clamps = system.bodies[joint.child], source.modes.groups
        held, clamp = body.marker(joint.child_marker), body.markers.get(clamps[0])
        if clamp is None or any((joint.child, group) in used for group in clamps):
            continue
        group = source.places.get(joint.child_marker)
        if group is None or group in source.answered or not np.abs(held.phi).max(initial=0.0):
            continue
        distance = float(np.linalg.norm(held.position - clamp.position))
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


def _dragged_supports(system: System, known: KnownBodies) -> Iterator[Advice]:
    """Joints at one of several clamped groups whose own components leave some of its motion free.

    The joint turns the body with its marker, and with it the other groups, which the shapes hold still in its frame.
    """
    for joint, source in _clamped(system, known):
        group = source.places.get(joint.child_marker, joint.child_marker)
        others = [other for other in source.modes.groups if other != group]
        marker, support = system.bodies[joint.child].marker(joint.child_marker), source.supports.get(group)
        if support is None or not others:
            continue
        axes = np.asarray(support.axes)
        rows = np.vstack([axes @ marker.phi, axes @ marker.psi])
        size = np.repeat([np.abs(part).max(initial=0.0) for part in (marker.phi, marker.psi)], 3)
        moves = np.abs(rows).max(axis=1, initial=0.0) > DUST * size
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


def _idle_torques(system: System) -> Iterator[Advice]:
    """Torques at markers that the shapes of a body move, and none of which turns."""
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


def _light_sets(system: System) -> Iterator[Advice]:
    """Sets of vibration modes that carry little of the mass."""
    pieces = {piece for parts in system.segments.values() for piece in parts}
    for name, body in _once(system.bodies):
        if name in pieces or set(body.kinds) != {"vibration"}:
            continue
        carried = carried_mass(body)
        if carried < CARRIED:
            text = (
                f"bodies.{name}: the effective mass of its {body.n_modes} modes is at most {carried:.0%} of its mass "
                f"in any direction (limit {CARRIED:.0%}). Add modes, or `attachment` shapes for an accelerated root"
            )
            yield doubt(name, "mass", text, carried, CARRIED)


def carried_mass(body: FlexibleBody) -> float:
    """Largest fraction of the mass that the elastic coordinates carry in any direction."""
    body = body.without_slaves()
    s, Me = body.moments.first[1:], body.moments.elastic_mass()
    return float(np.linalg.eigvalsh(s.T @ np.linalg.solve(Me, s))[-1] / body.moments.mass)


def _loose_bodies(system: System) -> Iterator[Advice]:
    """Free bodies without a joint, in a craft whose other bodies have joints: one joint may have been forgotten."""
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


def _driven_orbit(system: System, duration: float) -> Iterator[Advice]:
    """Loads whose resultant would change an orbit that is specified."""
    orbit = system.orbit
    if orbit is None or orbit.free or not any(np.any(load.force) for load in system.loads):
        return
    model = compile_system(system)
    breaks = model.breaks[(model.breaks > 0.0) & (model.breaks < duration)]
    edges = np.unique(np.concatenate([np.linspace(0.0, duration, 201), breaks]))
    steps, gauss = np.diff(edges), np.array([-1.0, 1.0]) / math.sqrt(3.0)  # at the edges themselves loads may jump
    times = (edges[:-1, None] + steps[:, None] * (1.0 + gauss) / 2.0).ravel()
    seen = model.observe(times, np.repeat(model.x0[None], len(times), axis=0))
    C_NR = dcm_from_quaternion(seen[f"bodies/{system.root}/attitude"])
    total = np.zeros((len(times), 3))  # root body axes, so that a thruster counts as fixed in the craft
    for load in (load for load in system.loads if load.force.any()):
        turned = np.swapaxes(C_NR, 1, 2) @ dcm_from_quaternion(seen[f"bodies/{load.body}/attitude"])
        total += np.einsum("tab,tb->ta", turned, seen[f"loads/{load.name}/force"])
    mass = sum(body.moments.mass for body in system.bodies.values())
    impulse = np.repeat(steps / 2.0, 2) @ total
    change, speed = float(np.linalg.norm(impulse)) / mass, math.sqrt(orbit.mu / orbit.semi_major_axis)
    if change > DRIFT * speed:
        text = (
            f"the loads push the craft by up to {np.linalg.norm(total, axis=1).max():.4g} N, {change:.4g} m/s over "
            f"{duration:.4g} s, and its orbit is specified: the reference point O does not follow (limit "
            f"{DRIFT * speed:.2g} m/s, {DRIFT:g} of the orbital speed). Set orbit.kind = 'free'"
        )
        yield doubt("", "craft", text, change, DRIFT * speed)


def _turns_without_inertia(system: System) -> Iterator[Advice]:
    """Bodies whose mass lies on a line, such as tethers, that joints let turn about it: a run cannot solve for that."""
    lines = [name for name in system.order if _on_a_line(system.bodies[name])]
    if not lines:
        return
    model = compile_system(system)
    held, joints, own = is_prescribed(model), dict[str, list[int]](), list[int]()
    for name, record in zip(system.order, body_records(model.table)[1:], strict=True):
        joints[name] = [k for k in range(int(record["u"]), int(record["ue"])) if not held[k]]
        own += joints[name]
    M = model.mass_matrix(0.0, model.x0)[np.ix_(own, own)]
    size = np.sqrt(np.where(np.diag(M) > 0, np.diag(M), 1.0))
    values, vectors = np.linalg.eigh(M / size / size[:, None])
    for value, vector in zip(values, vectors.T, strict=True):
        turning = {name: float(np.abs(vector[np.isin(own, joints[name])]).max(initial=0.0)) for name in lines}
        if value < NO_INERTIA and max(turning.values()) > NOTABLE:
            name = max(turning, key=lambda one: turning[one])
            text = (
                f"bodies.{name}: its mass lies on a line, and its joints let it turn about this line without inertia: "
                f"the mass matrix, scaled to a diagonal of 1, has an eigenvalue of {abs(value):.2g} (limit "
                f"{NO_INERTIA:g}), so that the craft cannot be run. Give it a universal joint with both axes across "
                "the line, or inertia about it (key inertia of a rigid body, or a section)"
            )
            yield doubt(name, "inertia", text, float(value), NO_INERTIA)


def _on_a_line(body: FlexibleBody) -> bool:
    r, J = body.moments.center_of_mass(), body.moments.inertia()
    moments = np.linalg.eigvalsh(J - body.moments.mass * (r @ r * np.eye(3) - np.outer(r, r)))
    return bool(moments[0] <= LINE * moments[2])
