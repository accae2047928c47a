"""Channels of joints whose freedoms are held: their motion as it is prescribed, and what it needs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.held_places import held_freedoms, held_places, specified_states
from femflex.dynamics.reports.drives import observe_drives
from femflex.dynamics.terms.by_source import DRIVES, terms
from femflex.system import Channel, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


FORCES = {"m/s": "N", "rad/s": "N m"}


def held_channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of what joints with held freedoms report; nothing for a system without any."""
    out = {}
    for joint in (system.joint_of(name) for name in system.order):
        held = held_freedoms(joint)
        if held:
            names = [joint.freedom_names()[k] for k in held]
            units = [FORCES[joint.velocity_names()[k][1]] for k in held]
            short = tuple(name.removeprefix(joint.label + ".") for name in names)
            out[f"joints/{joint.label}/drive"] = Channel(
                ", ".join(dict.fromkeys(units)),
                f"force or torque required by the prescribed motion of {joint.label}",
                (len(names),),
                short,
            )
    if out:
        out["monitors/drive_power"] = Channel("W", "power that prescribed joint motions give to the system")
    return out


def drives(model: Model, times: Array, states: Array) -> Array:
    """Generalised forces (n_t, n_u) that hold the held freedoms [N, N m]; zero on the others."""
    if model.reduced or model.constraints is not None:
        found = [row for name, row in terms(model, times, states).items() if name.startswith(DRIVES)]
        return -sum(found, np.zeros((len(times), model.n_u)))
    out = np.empty((len(times), model.n_u))
    observe_drives(times, states, out, model.table, model.pool, model.work)
    return out


def observe_held(model: Model, times: Array, states: Array) -> dict[str, Array]:
    """The channels of `held_channels` at times (n_t,) and states (n_t, n_x)."""
    places = held_places(model.system)
    if not places:
        return {}
    found = drives(model, times, states)
    out: dict[str, Array] = {}
    for joint in dict.fromkeys(joint for joint, *_ in places):
        out[f"joints/{joint.label}/drive"] = found[:, [u for other, _, _, u in places if other is joint]]
    out["monitors/drive_power"] = np.sum(found * model.parts(specified_states(model, times, states))[1], axis=1)
    return out
