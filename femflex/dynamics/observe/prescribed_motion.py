"""Force or torque that the prescribed motion of joints needs, and the power that it gives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, Table
from femflex.dynamics.joints.places import FORCES, prescribed_freedoms, prescribed_places
from femflex.dynamics.joints.prescribed_motion import prescribed_state
from femflex.dynamics.layout.records import header_of
from femflex.dynamics.ledger.by_source import DRIVES, terms
from femflex.dynamics.observe.observe import OBSERVE
from femflex.dynamics.rate.auxiliary_states import copy_auxiliary_states
from femflex.dynamics.rate.rate import write_accelerations
from femflex.dynamics.report import Observation, Report
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer
from femflex.system import Channel, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


@inner
def write_prescribing_forces(
    t: float, x: Array, out: Array, udot: Array, table: Table, pool: Array, work: Array
) -> None:
    """Write to out (n_u,) the generalised forces of prescribed freedoms at the state x, zero for the others."""
    head = header_of(table)
    copy_auxiliary_states(offset(x, head["n_q"]), table, work)
    q, u = prescribed_state(t, x, offset(x, head["n_q"]), table, pool, work)
    write_accelerations(t, q, u, pointer(udot), table, pool, work)
    for k in range(head["n_u"]):
        out[k] = work[head["drives"] + k]


@kernel(OBSERVE)
def observe_prescribing_forces(
    times: Array, states: Array, rows: Array, table: Table, pool: Array, work: Array
) -> None:
    """Write to rows (n_t, n_u) the forces of prescribed freedoms at times (n_t,) and states (n_t, n_x)."""
    udot = np.empty(rows.shape[1])
    for j in range(len(times)):
        write_prescribing_forces(
            times[j], pointer(states[j]), pointer(rows[j]), udot, pointer(table), pointer(pool), pointer(work)
        )


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
    out = np.empty((len(times), model.n_u))
    observe_prescribing_forces(times, states, out, model.table, model.pool, model.work)
    return out
