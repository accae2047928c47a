"""Forces in the joints of the tree: force and torque on the child, from the equations summed from the tips.

Reported when a system asks for it (`System.reactions`): an instant costs about two rates.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.lowering.layout import W_CIN, W_P, body_records
from femflex.system import Channel, Joint, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


XYZ = ("x", "y", "z")


def joints_with_reactions(system: System) -> list[Joint]:
    """Return the joints that carry any force, in tree order: all but those free in all six motions."""
    return [joint for joint in map(system.joint_of, system.order) if joint.n_u - len(joint.prescribed) < 6]


def reaction_channels(system: System) -> dict[str, Channel]:
    """Return path, unit and meaning of the forces in joints, if the system asks for them."""
    out = {}
    for joint in joints_with_reactions(system) if system.reactions else []:
        where = f"{joint.child}.{joint.child_marker}"
        text = f"that joint {joint.label} exerts on {joint.child} at {where}"
        out[f"joints/{joint.label}/force"] = Channel("N", f"force {text}", (3,), XYZ, "inertial")
        out[f"joints/{joint.label}/torque"] = Channel("N m", f"torque {text}", (3,), XYZ, "inertial")
    return out


def observe_reactions(model: Model, times: Array, states: Array) -> dict[str, Array]:
    """The channels of `reaction_channels` at times (n_t,) and states (n_t, n_x) of the model.

    All that a joint passes on: constraint forces, and what its springs, dampers and specified motions do along its
    freedoms. Redundant loops share their load as the smallest multipliers say. A model from which terms are left out
    has none.
    """
    records, order = body_records(model.table), model.system.order
    wrenches = np.empty((len(times), len(order), 6))  # at the bodies' origins, body components
    turns = np.empty((len(times), len(order), 3, 3))
    blocks = records["work"][1:, None]
    wrench_at, turn_at = blocks + W_P + np.array([0, 1, 2, 4, 5, 6]), blocks + W_CIN + np.arange(9)
    for j in range(len(times)):
        udot = model.parts(model.state_rate(times[j], states[j]))[1]
        model.gather(times[j], states[j], udot)
        wrenches[j], turns[j] = model.work[wrench_at], model.work[turn_at].reshape(-1, 3, 3)
    out = {}
    for joint in joints_with_reactions(model.system):
        i = order.index(joint.child)
        body, first = model.system.bodies[joint.child], int(records[1 + i]["qe"])
        marker = body.marker(joint.child_marker)
        arm = marker.position + body.amplitudes(states[:, first : first + body.n_modes]) @ marker.phi.T
        force, torque = wrenches[:, i, :3], wrenches[:, i, 3:] - np.cross(arm, wrenches[:, i, :3])
        out[f"joints/{joint.label}/force"] = np.einsum("tji,tj->ti", turns[:, i], force)
        out[f"joints/{joint.label}/torque"] = np.einsum("tji,tj->ti", turns[:, i], torque)
    return out
