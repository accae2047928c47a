"""Position, velocity and deflection of markers.

Of markers of condensed bodies they include the static stretch, which is no coordinate: the body's inertia and weight
stretch it, u = -S (a - g, dC/dt^2) with S `Marker.stretch`, a the acceleration of the body's origin and
[alpha]x + omega omega^T - omega^2 that of its places. Equations of motion and energies know none of it, so that where
joints, loads or springs act the marker stays where they see it.

On a body cut into segments deflections are counted from the undeformed body, and may be as large as the body.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.layout.lower import reported_markers
from femflex.dynamics.layout.records import W_ACC, W_CIN, W_OMEGA, body_records
from femflex.dynamics.observe.bodies import can_move, undeformed_place
from femflex.dynamics.observe.row import IN_MARKER, MARKER, MARKER_WIDTH, origin_text, worded
from femflex.dynamics.report import Observation, RowReport
from femflex.rotations import dcm_from_quaternion, dcm_from_vector
from femflex.system import Channel, System
from femflex.system.connections import tie_markers
from femflex.system.segments import marker_label

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


POSITION, DEFLECTION = (slice(first, first + 3) for first in (IN_MARKER.position, IN_MARKER.deflection))


class Markers(RowReport):
    """Channels of the reported markers in the row, with static stretch and as parts of cut bodies."""

    place = 2

    def channels(self, system: System) -> dict[str, Channel]:
        out, stretching = {}, stretching_markers(system)
        for body, marker in reported_markers(system):
            label = marker_label(system.segments, body, marker)
            stretch = ", static stretch included," if (body, marker) in stretching else ""
            words = {"label": label, "where": origin_text(system), "stretch": stretch}
            deflects = is_deformable_marker(system, body, marker) or label != f"{body}.{marker}"
            reported = {"position": True, "velocity": deflects or can_move(system, body), "deflection": deflects}
            for key, channel in MARKER.items():
                out[f"markers/{label}/{key}"] = worded(channel, words, reported=reported[key])
        return out

    def observe(self, seen: Observation) -> Iterable[Array]:
        system, markers = seen.system, reported_markers(seen.system)
        motion = np.stack([seen.columns(path) for path in seen.paths_of(self)], axis=1)
        motion = motion.reshape(len(seen.times), len(markers), MARKER_WIDTH)
        add_static_stretch(seen, markers, motion)
        for segments in system.segments.values():
            origin, C = undeformed_place(seen, segments)
            for k, (body, marker) in enumerate(markers):
                if body in segments:
                    deflected = np.einsum("tij,ti->tj", C, motion[:, k, POSITION] - origin)
                    motion[:, k, DEFLECTION] = deflected - system.bodies[body].marker(marker).position
        return motion.reshape(len(motion), 3 * len(markers), 3).swapaxes(0, 1)


def is_deformable_marker(system: System, body: str, marker: str) -> bool:
    """Whether a marker moves or turns in the axes of its body."""
    flexible_body = system.bodies[body]
    m = flexible_body.marker(marker)
    return bool(m.phi.any() or m.psi.any() or m.stretch.any() or (body in system.varying and flexible_body.n_shapes))


def stretching_markers(system: System) -> list[tuple[str, str]]:
    """(body, marker) of the reported markers with static stretch where nothing acts."""
    loaded = {place for j in system.joints for place in ((j.child, j.child_marker), (j.parent, j.parent_marker))}
    loaded |= {(load.body, load.marker) for load in system.loads}
    loaded |= {(body, marker) for _, body, marker in tie_markers(system.loops, system.constraints, system.springs)}
    reported = reported_markers(system)
    return [(b, m) for b, m in reported if (b, m) not in loaded and system.bodies[b].marker(m).stretch.any()]


def add_static_stretch(seen: Observation, markers: list[tuple[str, str]], motion: Array) -> None:
    """Add the static stretch to positions and deflections of markers, (n_t, n_markers, MARKER_WIDTH), in place."""
    model, system, stretching = seen.model, seen.system, stretching_markers(seen.system)
    if not stretching or model.reduced:
        return
    names = sorted({body for body, _ in stretching})
    fields, turns = body_fields(model, seen.times, seen.states, [1 + system.order.index(name) for name in names])
    for body, marker in stretching:
        i, k = names.index(body), markers.index((body, marker))
        stretch = -np.einsum("cab,tab->tc", system.bodies[body].marker(marker).stretch, fields[:, i])
        motion[:, k, DEFLECTION] += stretch
        motion[:, k, POSITION] += np.einsum("tji,tj->ti", turns[:, i], stretch)


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


def marker_motion(
    system: System, times: Array, channels: Mapping[str, Array], body: str | None, marker: str
) -> tuple[Array, Array]:
    """Place r_M (n_t, 3) and C_NM (n_t, 3, 3) of a marker, inertial components, turned on its body as its shapes say.

    Without a body those of the base frame.
    """
    if body is None:
        return np.zeros((len(times), 3)), base_attitude(system, times, channels)
    m = system.bodies[body].marker(marker)
    C_NB = dcm_from_quaternion(channels[f"bodies/{body}/attitude"])
    delta = channels[f"bodies/{body}/delta"] if m.phi.size else np.zeros((len(times), 0))
    position = channels[f"bodies/{body}/position"] + np.einsum("tij,tj->ti", C_NB, m.position + delta @ m.phi.T)
    return position, C_NB @ dcm_from_vector(m.rotation_vector(delta)) @ m.orientation


def base_attitude(system: System, times: Array, channels: Mapping[str, Array]) -> Array:
    """C_NF (n_t, 3, 3) of the base frame."""
    if system.frame.kind == "orbital":
        return dcm_from_quaternion(channels["orbit/attitude"])
    rate = system.frame.rate if system.frame.kind == "spinning" else np.zeros(3)
    return dcm_from_vector(np.asarray(times)[:, None] * rate)
