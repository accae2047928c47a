"""Freedoms of joints that are held: which they are, where they stand in the state, and what they are held at."""

from __future__ import annotations

from typing import TYPE_CHECKING

from femflex.arrays import Array
from femflex.system import Joint, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


def held_freedoms(joint: Joint) -> list[int]:
    """Freedoms of a joint that are held throughout or once they latch, in the model's order."""
    return [*joint.held, *(latch.freedom for latch in joint.locking)]


def held_places(system: System) -> list[tuple[Joint, int, int, int]]:
    """(joint, its freedom, place in q, place in u) of every freedom that is held, or may be."""
    found, iq, iu = [], 0, 0
    for name in system.order:
        joint, n = system.joint_of(name), system.bodies[name].n_modes
        found += [(joint, k, iq + k, iu + k) for k in held_freedoms(joint)]
        iq, iu = iq + joint.n_q + n, iu + joint.n_u + n
    return found


def specified_states(model: Model, times: Array, states: Array) -> Array:
    """The states (n_t, n_x) with held freedoms where they are held."""
    places = [place for place in held_places(model.system) if place[1] in place[0].held]
    if not places:
        return states
    states = states.copy()
    for joint, k, q, u in places:
        states[:, q], states[:, model.n_q + u], _ = joint.held[k](times)
    return states
