"""Channels of a body cut into segments as a whole: its undeformed position, and the deflection of its markers."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.lowering.lower import reported_markers
from femflex.rotations import dcm_from_quaternion, dcm_from_vector, quaternion_from_dcm
from femflex.system import System
from femflex.system.segments import marker_label


def observe_segmented(system: System, out: dict[str, Array]) -> None:
    """Add position (n_t, 3) and attitude (n_t, 4) of every cut body, and write its markers' deflections (n_t, 3).

    The undeformed body sits where it is held: at the marker by which its joint holds it. Deflections are counted from
    there, in its axes, and may be as large as the body.
    """
    for name, segments in system.segments.items():
        first = next(s for s in segments if system.joint_of(s).parent not in segments)
        marker = system.bodies[first].marker(system.joint_of(first).child_marker)
        delta = out[f"bodies/{first}/delta"]
        C = dcm_from_quaternion(out[f"bodies/{first}/attitude"])
        position = out[f"bodies/{first}/position"] + np.einsum("tij,tj->ti", C, marker.position + delta @ marker.phi.T)
        C = C @ dcm_from_vector(marker.rotation_vector(delta))
        origin = position - C @ marker.position
        out[f"bodies/{name}/position"], out[f"bodies/{name}/attitude"] = origin, quaternion_from_dcm(C)
        for body, key in reported_markers(system):
            if body in segments:
                label = marker_label(system.segments, body, key)
                deflected = np.einsum("tij,ti->tj", C, out[f"markers/{label}/position"] - origin)
                out[f"markers/{label}/deflection"] = deflected - system.bodies[body].marker(key).position
