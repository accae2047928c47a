"""Forces and moments at the joints of a craft's bodies in its modes of vibration."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.advice.elastic_motion import RestModes
from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.equilibria.rigid_motions import BodyMotion
from femflex.system import System
from femflex.system.connections import tie_markers

Loads = dict[str, dict[str, Array]]  # body -> marker -> force and moment (6, m), body axes


def joint_markers(system: System) -> dict[str, set[str]]:
    """Names of the markers of each body at joints, loops, constraints and springs."""
    markers: dict[str, set[str]] = {}
    for joint in system.joints:
        markers.setdefault(joint.child, set()).add(joint.child_marker)
        if joint.parent is not None:
            markers.setdefault(joint.parent, set()).add(joint.parent_marker)
    for _, body, marker in tie_markers(system.loops, system.constraints, system.springs):
        markers.setdefault(body, set()).add(marker)
    return markers


def joint_loads(modes: RestModes) -> Loads:
    """Loads on each body at its joints in the m modes of a craft.

    In a tree, what a joint transmits is the rate of momentum of all bodies beyond it. With loops or springs, the loads
    are the least that balance each body's own equations.
    """
    system = modes.system
    if tie_markers(system.loops, (), system.springs):
        return {name: _balancing_loads(modes, name, joint_markers(system)[name]) for name in modes.shapes}
    loads: Loads = {name: {} for name in system.bodies}
    momenta = {name: _momentum(system.bodies[name], modes.frames[name]) for name in system.order}
    for name in reversed(system.order):
        joint, rate = system.joint_of(name), -(modes.omega**2) * momenta[name]
        _add_load(loads, system, modes.frames, (name, joint.child_marker), rate)
        if joint.parent is not None:
            _add_load(loads, system, modes.frames, (joint.parent, joint.parent_marker), -rate)
            momenta[joint.parent] = momenta[joint.parent] + momenta[name]
    return loads


def _momentum(body: FlexibleBody, frame: BodyMotion) -> Array:
    """Momentum and angular momentum about the base frame's origin (6, m) of a body that moves as its frame says."""
    v, omega = frame.attitude.T @ frame.slide, frame.attitude.T @ frame.turn
    centre, C = body.moments.first[0], body.moments.acceleration_loads()
    p = body.moments.mass * v + np.cross(omega.T, centre).T + C[:, :3].T @ frame.shape
    h = np.cross(centre, v.T).T + body.moments.inertia() @ omega + C[:, 3:].T @ frame.shape
    p, h = frame.attitude @ p, frame.attitude @ h
    return np.vstack([p, h + np.cross(frame.position, p.T).T])


def _add_load(
    loads: Loads, system: System, frames: Mapping[str, BodyMotion], end: tuple[str, str], wrench: Array
) -> None:
    """Add a force and moment about the base frame's origin (6, m) to the loads of a body at a marker."""
    (name, marker), frame = end, frames[end[0]]
    place = frame.position + frame.attitude @ system.bodies[name].marker(marker).position
    force, moment = wrench[:3], wrench[3:] - np.cross(place, wrench[:3].T).T
    load = np.vstack([frame.attitude.T @ force, frame.attitude.T @ moment])
    loads[name][marker] = loads[name].get(marker, 0.0) + load


def _balancing_loads(modes: RestModes, name: str, markers: set[str]) -> dict[str, Array]:
    """The least loads at these markers of a body that balance its motion, each measured by its static energy."""
    body, frame, squares = modes.system.bodies[name], modes.frames[name], modes.omega**2
    root = np.vstack([frame.attitude.T @ frame.slide, frame.attitude.T @ frame.turn])
    inertia = body.moments.elastic_mass() @ modes.shapes[name] + body.moments.acceleration_loads() @ root
    F = np.column_stack([body.marker(marker).loads for marker in sorted(markers)])
    size = np.sqrt(np.maximum((F * np.linalg.lstsq(body.strain.V1, F, rcond=None)[0]).sum(axis=0), 0.0))
    size[size <= 1e-9 * size.max(initial=0.0)] = np.inf
    f = (
        np.linalg.lstsq(F / size, body.strain.V1 @ modes.shapes[name] - squares * inertia, rcond=None)[0]
        / size[:, None]
    )
    return {marker: f[6 * k : 6 * k + 6] for k, marker in enumerate(sorted(markers))}
