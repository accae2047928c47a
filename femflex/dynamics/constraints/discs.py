"""Rolling discs that lie flat on their plane, where a sharp edge has no lowest point."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.constraints.constrained import Constraints
from femflex.dynamics.lowering import constraint_layout as layout
from femflex.rotations import SINGULAR


def tilts(constraints: Constraints, t: float, x: Array) -> dict[str, float]:
    """Angle between a disc's axis and its plane's normal at (t, x) [rad], by the name of the constraint."""
    constraints.residuals(t, x)
    pool, work = constraints.arrays[1], constraints.arrays[2]
    out = {}
    for name, record in zip(constraints.names, constraints.records, strict=True):
        if record["kind"] == layout.CONSTRAINT_DISC:
            C_P, C_Q = (
                work[int(record[key]) + layout.M_C : int(record[key]) + layout.M_C + 9].reshape(3, 3)
                for key in ("motion_P", "motion_Q")
            )
            axis, normal = pool[int(record["axis"]) : int(record["axis"]) + 6].reshape(2, 3)
            sine = float(np.linalg.norm(np.cross(C_P @ normal, C_Q @ axis)))
            out[name] = float(np.arcsin(min(sine, 1.0)))
    return out


def flat_disc_text(constraints: Constraints, t: float, x: Array, least: float = SINGULAR) -> str:
    """The sentence on a disc whose tilt is below `least` [rad], or ""."""
    for name, tilt in tilts(constraints, t, x).items():
        if tilt < least:
            return (
                f"disc {name!r} lies flat on its plane: its axis is within {tilt:.2g} rad of the plane's normal, and "
                "a sharp edge has no lowest point there. Check the axis and the normal, or start with the disc tilted"
            )
    return ""
