"""Prescribed freedoms of joints: their places in the state, and their prescribed values."""

from __future__ import annotations

from typing import TYPE_CHECKING

from femflex.arrays import Array
from femflex.dynamics.joints.places import joint_places
from femflex.system import Joint, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


def prescribed_freedoms(joint: Joint) -> list[int]:
    """Return the freedoms of a joint that are prescribed throughout or once they latch, in the model's order."""
    return [*joint.prescribed, *(latch.freedom for latch in joint.locking)]


def prescribed_places(system: System) -> list[tuple[Joint, int, int, int]]:
    """Return (joint, its freedom, place in q, place in u) of every freedom that is or may become prescribed."""
    return [(joint, k, iq + k, iu + k) for joint, iq, iu in joint_places(system) for k in prescribed_freedoms(joint)]


def prescribed_states(model: Model, times: Array, states: Array) -> Array:
    """Return the states (n_t, n_x) with prescribed freedoms at their prescribed values."""
    places = [entry for entry in prescribed_places(model.system) if entry[1] in entry[0].prescribed]
    if not places:
        return states
    states = states.copy()
    for joint, k, q, u in places:
        states[:, q], states[:, model.n_q + u], _ = joint.prescribed[k](times)
    return states
