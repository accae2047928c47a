"""Position, attitude and rate of every body, and the undeformed position of a body cut into segments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.reports.mobility import can_turn
from femflex.dynamics.reports.report import Observation, Report, RowReport
from femflex.dynamics.reports.row import BODY, EULER, XYZ, origin_text, worded
from femflex.rotations import dcm_from_quaternion, dcm_from_vector, quaternion_from_dcm
from femflex.system import Channel, System


class Bodies(RowReport):
    """Channels of the bodies in the row, in tree order."""

    place = 1

    def channels(self, system: System) -> dict[str, Channel]:
        words = {"where": origin_text(system)}
        return {
            f"bodies/{name}/{key}": worded(
                channel, {**words, "name": name}, reported=key != "rate" or can_turn(system, name)
            )
            for name in system.order
            for key, channel in BODY.items()
        }


class Segmented(Report):
    """Position and attitude of every cut body: it sits where it is held, at the marker by which its joint holds it."""

    def channels(self, system: System) -> dict[str, Channel]:
        out, where = {}, origin_text(system)
        for name in system.segments:
            text = f"origin of {name}, undeformed, {where}"
            out[f"bodies/{name}/position"] = Channel("m", text, (3,), XYZ, "inertial")
            text = f"Euler parameters of {name}, undeformed, C_NB"
            out[f"bodies/{name}/attitude"] = Channel("1", text, (4,), EULER)
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        for segments in seen.system.segments.values():
            origin, C = undeformed_place(seen, segments)
            yield from (origin, quaternion_from_dcm(C))


def undeformed_place(seen: Observation, segments: Sequence[str]) -> tuple[Array, Array]:
    """Origin (n_t, 3) and C_NB (n_t, 3, 3) of the undeformed body that was cut into these segments."""
    system = seen.system
    first = next(s for s in segments if system.joint_of(s).parent not in segments)
    marker, delta = system.bodies[first].marker(system.joint_of(first).child_marker), seen[f"bodies/{first}/delta"]
    C = dcm_from_quaternion(seen[f"bodies/{first}/attitude"])
    arm = np.einsum("tij,tj->ti", C, marker.position + delta @ marker.phi.T)
    C = C @ dcm_from_vector(marker.rotation_vector(delta))
    return seen[f"bodies/{first}/position"] + arm - C @ marker.position, C
