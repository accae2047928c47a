"""Contact points of rolling discs and knife edges."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.reports.marker_motion import marker_motion
from femflex.system import Channel, System

CONTACT_KINDS = ("rolling_disc", "knife_edge")


def contact_channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of the places of contact."""
    contacts = [c for c in system.constraints if c.kind in CONTACT_KINDS]
    text = "where {} touches, from the inertial origin (from O in an orbit)"
    return {
        f"constraints/{c.name}/place": Channel("m", text.format(c.body), (3,), ("x", "y", "z"), "inertial")
        for c in contacts
    }


def observe_contacts(system: System, times: Array, channels: Mapping[str, Array]) -> dict[str, Array]:
    """The channels of `contact_channels` at times (n_t,): the edge's marker, or the lowest point of a disc.

    A disc with axis a over a plane with normal n touches at its centre less R (n - a (a.n)) / |n - a (a.n)|.
    """
    out = {}
    for c in system.constraints:
        if c.kind not in CONTACT_KINDS:
            continue
        point, C_NQ = marker_motion(system, times, channels, c.body, c.marker)
        if c.kind == "rolling_disc":
            axis, normal = (
                C_NQ @ c.axis,
                marker_motion(system, times, channels, c.parent, c.parent_marker)[1] @ c.normal,
            )
            up = normal - axis * np.einsum("ti,ti->t", axis, normal)[:, None]
            point = point - c.radius * up / np.linalg.norm(up, axis=1, keepdims=True)
        out[f"constraints/{c.name}/place"] = point
    return out
