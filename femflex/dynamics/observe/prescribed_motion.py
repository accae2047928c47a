"""Force or torque that the prescribed motion of joints needs, and the power that it gives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.places import FORCES, prescribed_freedoms, prescribed_places
from femflex.dynamics.layout.records import header_record
from femflex.dynamics.ledger.by_source import DRIVES, terms
from femflex.dynamics.report import Observation, Report
from femflex.system import Channel, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


class PrescribedMotion(Report):
    """Every joint with prescribed freedoms, and their power."""

    def channels(self, system: System) -> dict[str, Channel]:
        out = {}
        for joint in map(system.joint_of, system.order):
            if prescribed := prescribed_freedoms(joint):
                names = tuple(joint.freedom_names()[k].removeprefix(joint.label + ".") for k in prescribed)
                units = ", ".join(dict.fromkeys(FORCES[joint.velocity_names()[k][1]] for k in prescribed))
                text = f"force or torque required by the prescribed motion of {joint.label}"
                out[f"joints/{joint.label}/drive"] = Channel(units, text, (len(names),), names)
        if out:
            moves = any(motion.moves for joint in system.joints for motion in joint.prescribed.values())
            text = "power that prescribed joint motions give to the system"
            out["monitors/drive_power"] = Channel("W", text, reported=moves)
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        places = prescribed_places(seen.system)
        forces = prescribing_forces(seen.model, seen.times, seen.states)
        for joint in dict.fromkeys(joint for joint, *_ in places):
            yield forces[:, [u for owner, _, _, u in places if owner is joint]]
        yield np.sum(forces * seen.u, axis=1)


def prescribing_forces(model: Model, times: Array, states: Array) -> Array:
    """Return the generalised forces (n_t, n_u) of prescribed freedoms [N, N m]; zero for the others."""
    if model.constraints is not None:
        rows = [row for name, row in terms(model, times, states).items() if name.startswith(DRIVES)]
        return -sum(rows, np.zeros((len(times), model.n_u)))
    out, first = np.empty((len(times), model.n_u)), int(header_record(model.table)["drives"])
    for row, t, x in zip(out, times, states, strict=True):
        model.state_rate(float(t), x)
        row[:] = model.work[first : first + model.n_u]
    return out
