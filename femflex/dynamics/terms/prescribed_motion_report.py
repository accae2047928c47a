"""Channels of joints with prescribed freedoms: their prescribed motion, and the force or torque that it needs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.prescribed_coordinates import prescribed_freedoms, prescribed_places, prescribed_states
from femflex.dynamics.reports.prescribing_forces import observe_prescribing_forces
from femflex.dynamics.terms.by_source import DRIVES, terms
from femflex.system import Channel, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


FORCES = {"m/s": "N", "rad/s": "N m"}


def prescribed_motion_channels(system: System) -> dict[str, Channel]:
    """Return path, unit and meaning of the channels of joints with prescribed freedoms, if there are any."""
    out = {}
    for joint in (system.joint_of(name) for name in system.order):
        prescribed = prescribed_freedoms(joint)
        if prescribed:
            names = [joint.freedom_names()[k] for k in prescribed]
            units = [FORCES[joint.velocity_names()[k][1]] for k in prescribed]
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


def prescribing_forces(model: Model, times: Array, states: Array) -> Array:
    """Return the generalised forces (n_t, n_u) of prescribed freedoms [N, N m]; zero for the others."""
    if model.reduced or model.constraints is not None:
        rows = [row for name, row in terms(model, times, states).items() if name.startswith(DRIVES)]
        return -sum(rows, np.zeros((len(times), model.n_u)))
    out = np.empty((len(times), model.n_u))
    observe_prescribing_forces(times, states, out, model.table, model.pool, model.work)
    return out


def observe_prescribed_motion(model: Model, times: Array, states: Array) -> dict[str, Array]:
    """Return the channels of `prescribed_motion_channels` at times (n_t,) and states (n_t, n_x)."""
    prescribed = prescribed_places(model.system)
    if not prescribed:
        return {}
    forces = prescribing_forces(model, times, states)
    out: dict[str, Array] = {}
    for joint in dict.fromkeys(joint for joint, *_ in prescribed):
        out[f"joints/{joint.label}/drive"] = forces[:, [u for owner, _, _, u in prescribed if owner is joint]]
    out["monitors/drive_power"] = np.sum(forces * model.parts(prescribed_states(model, times, states))[1], axis=1)
    return out
