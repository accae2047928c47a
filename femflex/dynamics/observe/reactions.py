"""Forces in joints: force and torque on the child, and those of joints and loops in the joint's own axes.

Joints of the tree are reported when a system asks for it (`System.reactions`): an instant costs about two rates.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.layout.records import W_CIN, W_P, body_records
from femflex.dynamics.observe.markers import marker_motion
from femflex.dynamics.observe.row import XYZ
from femflex.dynamics.report import Observation, Report
from femflex.system import Channel, Joint, System
from femflex.system.loop import closure

UNITS = {"force": "N", "torque": "N m"}


class Reactions(Report):
    """All that a joint passes on, from the equations summed from the tips.

    That is constraint forces, and what its springs, dampers and specified motions do along its freedoms. Redundant
    loops share their load as the smallest multipliers say. A model from which terms are left out has none.
    """

    def channels(self, system: System) -> dict[str, Channel]:
        out = {}
        for joint in joints_with_reactions(system):
            where = f"{joint.child}.{joint.child_marker}"
            for key, unit in UNITS.items():
                text = f"{key} that joint {joint.label} exerts on {joint.child} at {where}"
                out[f"joints/{joint.label}/{key}"] = Channel(unit, text, (3,), XYZ, "inertial")
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        model, system, times, states = seen.model, seen.system, seen.times, seen.states
        records, order = body_records(model.table), system.order
        wrenches = np.empty((len(times), len(order), 6))  # at the bodies' origins, body components
        turns = np.empty((len(times), len(order), 3, 3))
        blocks = records["work"][1:, None]
        wrench_at, turn_at = blocks + W_P + np.array([0, 1, 2, 4, 5, 6]), blocks + W_CIN + np.arange(9)
        for j in range(len(times)):
            udot = model.parts(model.state_rate(times[j], states[j]))[1]
            model.gather(times[j], states[j], udot)
            wrenches[j], turns[j] = model.work[wrench_at], model.work[turn_at].reshape(-1, 3, 3)
        for joint in joints_with_reactions(system):
            i = order.index(joint.child)
            marker = system.bodies[joint.child].marker(joint.child_marker)
            arm = marker.position + seen[f"bodies/{joint.child}/delta"] @ marker.phi.T
            force, torque = wrenches[:, i, :3], wrenches[:, i, 3:] - np.cross(arm, wrenches[:, i, :3])
            yield from (np.einsum("tji,tj->ti", turns[:, i], value) for value in (force, torque))


def joints_with_reactions(system: System) -> list[Joint]:
    """The joints that carry any force, in tree order: all but those free in all six motions; none unless asked for."""
    joints = map(system.joint_of, system.order) if system.reactions else ()
    return [joint for joint in joints if joint.n_u - len(joint.prescribed) < 6]


class LocalForces(Report):
    """Forces and torques in axes of the child's marker, turned as the child's shapes turn it.

    A component along the axis of a hinge is its torque; the others are bending moments of the child's root.
    """

    def channels(self, system: System) -> dict[str, Channel]:
        out = {}
        for path, joint in joints_with_forces(system).items():
            for key, unit in UNITS.items():
                text = f"{key} on {joint.child} in axes of {joint.child}.{joint.child_marker}"
                exerted = key == "force" or joint not in system.loops or len(closure(joint).pairs) > 0
                out[f"{path}/local_{key}"] = Channel(unit, text, (3,), XYZ, "marker", exerted)
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        for path, joint in joints_with_forces(seen.system).items():
            C_NM = marker_motion(seen.system, seen.times, seen, joint.child, joint.child_marker)[1]
            yield from (np.einsum("tij,ti->tj", C_NM, seen[f"{path}/{key}"]) for key in UNITS)


def joints_with_forces(system: System) -> dict[str, Joint]:
    """The joints and loops whose force and torque are reported, by the first parts of their channels' paths."""
    joints = {f"joints/{joint.label}": joint for joint in joints_with_reactions(system)}
    return joints | {f"loops/{loop.label}": loop for loop in system.loops}
