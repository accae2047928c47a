"""Where rolling discs and knife edges touch."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.reports.marker_motion import marker_motion
from femflex.system import Channel, System

TOUCHING = ("rolling_disc", "knife_edge")


def contact_channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of the places of contact."""
    touching = [c for c in system.constraints if c.kind in TOUCHING]
    text = "where {} touches, from the inertial origin (from O in an orbit)"
    return {
        f"constraints/{c.name}/place": Channel("m", text.format(c.body), (3,), ("x", "y", "z"), "inertial")
        for c in touching
    }


def observe_contacts(system: System, times: Array, seen: Mapping[str, Array]) -> dict[str, Array]:
    """The channels of `contact_channels` at times (n_t,): the edge's marker, or the lowest point of a disc.

    A disc with axis a over a plane with normal n touches at its centre less R (n - a (a.n)) / |n - a (a.n)|.
    """
    out = {}
    for c in system.constraints:
        if c.kind not in TOUCHING:
            continue
        place, C_NQ = marker_motion(system, times, seen, c.body, c.marker)
        if c.kind == "rolling_disc":
            axis, normal = C_NQ @ c.axis, marker_motion(system, times, seen, c.parent, c.parent_marker)[1] @ c.normal
            up = normal - axis * np.einsum("ti,ti->t", axis, normal)[:, None]
            place = place - c.radius * up / np.linalg.norm(up, axis=1, keepdims=True)
        out[f"constraints/{c.name}/place"] = place
    return out
