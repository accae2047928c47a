"""Messages on constraints that cannot be satisfied: their names, and what competes with them."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.constraints.constrained import Constraints
from femflex.dynamics.joints.places import body_places
from femflex.dynamics.layout import constraint_records as layout
from femflex.rotations import SINGULAR
from femflex.system import System

ENTRY_TOLERANCE = 1e-9  # entry of A, relative to the largest of its row, from which a freedom moves a row


def prescribed_coordinates(system: System) -> dict[int, tuple[str, str]]:
    """Return place in u, name and body of every prescribed freedom, locked ones included."""
    return {p.u + k: (p.joint.freedom_names()[k], p.name) for p in body_places(system) for k in p.joint.prescribed}


def bodies_between(system: System, name: str) -> set[str]:
    """Bodies whose joints lie between the two ends of a constraint: those above both move it as a whole."""
    ties: dict[str, tuple[str | None, str | None]] = {loop.label: (loop.parent, loop.child) for loop in system.loops}
    ties |= {constraint.name: (constraint.parent, constraint.body) for constraint in system.constraints}
    parent_side, child_side = (set(ancestors(system, end)) for end in ties[name])
    return parent_side ^ child_side


def ancestors(system: System, body: str | None) -> list[str]:
    out = []
    while body is not None:
        out.append(body)
        body = system.joint_of(body).parent
    return out


def competing_motions_text(constraints: Constraints, t: float, x: Array, name: str) -> str:
    """Motions and constraints that act on the rows of a constraint: " together with ... and constraint ..." or "".

    t, x: an instant and a state at which the rows can be written.
    """
    A = np.abs(constraints.matrix(t, x))
    rows = A[constraints.rows_of(name)]
    touched = (rows > ENTRY_TOLERANCE * rows.max(axis=1, initial=0.0, keepdims=True)).any(axis=0)
    prescribed = prescribed_coordinates(constraints.system)
    inside = bodies_between(constraints.system, name)
    freedoms = [repr(freedom) for k, (freedom, body) in prescribed.items() if touched[k] and body in inside]
    free = [k for k in np.flatnonzero(touched) if k not in prescribed]
    others = [
        constraints.kind_of(constraint)
        for constraint in constraints.names
        if constraint != name and (A[constraints.rows_of(constraint)][:, free] > 0.0).any()
    ]
    motions = [f"the prescribed motion{'s' * (len(freedoms) > 1)} of {', '.join(freedoms)}"] if freedoms else []
    return f" together with {' and '.join(motions + others)}" if motions or others else ""


def violated_text(constraints: Constraints, t: float, x: Array, further: str = "") -> str:
    """Describe the worst row of the last projected state that no step reaches; x is the state before it."""
    note = int(constraints.closing["note"])
    row, remaining, limit, speed = constraints.arrays[2][note : note + layout.N_SPEED + 1]
    name = constraints.name_of_row(int(row))
    unit = "m/s (rad/s in rows of angles)" if speed else "m"
    what = "velocity" if speed else "gap"
    competing = competing_motions_text(constraints, t, x, name)
    return (
        f"{constraints.kind_of(name)} cannot be satisfied{further}{competing}: the nearest state leaves a {what} of "
        f"{remaining:.3g} {unit}, above the limit of {limit:.3g}. Change one of them, or remove it"
    )


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
