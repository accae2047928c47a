"""Contact points of rolling discs and knife edges."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.reports.marker_motion import marker_motion
from femflex.dynamics.reports.report import Observation, Report
from femflex.dynamics.reports.row import XYZ
from femflex.system import Channel, Nonholonomic, System

KINDS = ("rolling_disc", "knife_edge")


class Contacts(Report):
    """Places of contact: the edge's marker, or the lowest point of a disc.

    A disc with axis a over a plane with normal n touches at its centre less R (n - a (a.n)) / |n - a (a.n)|.
    """

    def channels(self, system: System) -> dict[str, Channel]:
        text = "where {} touches, from the inertial origin (from O in an orbit)"
        return {
            f"constraints/{c.name}/place": Channel("m", text.format(c.body), (3,), XYZ, "inertial")
            for c in touching(system)
        }

    def observe(self, seen: Observation) -> Iterator[Array]:
        for c in touching(seen.system):
            point, C_NQ = marker_motion(seen.system, seen.times, seen, c.body, c.marker)
            if c.kind == "rolling_disc":
                C_NP = marker_motion(seen.system, seen.times, seen, c.parent, c.parent_marker)[1]
                axis, normal = C_NQ @ c.axis, C_NP @ c.normal
                up = normal - axis * np.einsum("ti,ti->t", axis, normal)[:, None]
                point = point - c.radius * up / np.linalg.norm(up, axis=1, keepdims=True)
            yield point


def touching(system: System) -> list[Nonholonomic]:
    """The constraints that have a place of contact."""
    return [c for c in system.constraints if c.kind in KINDS]
