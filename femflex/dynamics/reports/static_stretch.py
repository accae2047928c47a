"""Static stretch of markers of condensed bodies, which is no coordinate: it is added to the channels of a run.

The body's own inertia and weight stretch it: u = -S (a - g, dC/dt^2) with S `Marker.stretch`, a the acceleration of the
body's origin and [alpha]x + omega omega^T - omega^2 that of its places. Equations of motion and energies know none of
it, so that where joints, loads or springs act the marker stays where they see it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.lowering.layout import W_ACC, W_CIN, W_OMEGA, body_records
from femflex.dynamics.lowering.lower import reported_markers
from femflex.system import System
from femflex.system.connections import tie_markers
from femflex.system.segments import marker_label

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


def stretching_markers(system: System) -> list[tuple[str, str]]:
    """(body, marker) of the reported markers with static stretch where nothing acts."""
    loaded = {place for j in system.joints for place in ((j.child, j.child_marker), (j.parent, j.parent_marker))}
    loaded |= {(load.body, load.marker) for load in system.loads}
    loaded |= {(body, marker) for _, body, marker in tie_markers(system.loops, system.constraints, system.springs)}
    reported = reported_markers(system)
    return [(b, m) for b, m in reported if (b, m) not in loaded and system.bodies[b].marker(m).stretch.any()]


def add_static_stretch(model: Model, times: Array, states: Array, out: dict[str, Array]) -> None:
    """Add the static stretch to the positions and deflections of markers at times (n_t,) and states (n_t, n_x)."""
    system = model.system
    markers = stretching_markers(system)
    if not markers or model.reduced:
        return
    names = sorted({body for body, _ in markers})
    fields, turns = body_fields(model, times, states, [1 + system.order.index(name) for name in names])
    for body, marker in markers:
        i, label = names.index(body), marker_label(system.segments, body, marker)
        stretch = -np.einsum("cab,tab->tc", system.bodies[body].marker(marker).stretch, fields[:, i])
        out[f"markers/{label}/deflection"] = out[f"markers/{label}/deflection"] + stretch
        stretch = np.einsum("tji,tj->ti", turns[:, i], stretch)
        out[f"markers/{label}/position"] = out[f"markers/{label}/position"] + stretch


def body_fields(model: Model, times: Array, states: Array, bodies: list[int]) -> tuple[Array, Array]:
    """Acceleration less uniform gravity over z_a e_b (n_t, n_b, 4, 3), z = (1, position), and C_iN of these bodies."""
    positions = [int(body_records(model.table)[i]["work"]) for i in bodies]
    gravity, e = model.system.environment.gravity, np.eye(3)
    fields, turns = np.empty((len(times), len(bodies), 4, 3)), np.empty((len(times), len(bodies), 3, 3))
    for j, (t, x) in enumerate(zip(times, states, strict=True)):
        model.gather(float(t), x, model.parts(model.state_rate(float(t), x))[1])
        for i, w in enumerate(positions):
            C = turns[j, i] = model.work[w + W_CIN : w + W_CIN + 9].reshape(3, 3)
            acceleration, omega = model.work[w + W_ACC : w + W_ACC + 8], model.work[w + W_OMEGA : w + W_OMEGA + 3]
            fields[j, i, 0] = acceleration[:3] - C @ gravity
            fields[j, i, 1:] = np.cross(acceleration[4:7], e) + np.outer(omega, omega) - omega @ omega * e
    return fields, turns
