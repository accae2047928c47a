"""Whether the constraints' accelerations agree at the start: the first thing at which motions and branches can clash.

In a singular configuration the rows lose rank, and the velocities that they let pass have to lie along one of the
branches that meet there; n . (bdot - Adot u) = 0 for every n with n A = 0 is the condition, of second order in u.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.constraints.conflicts import competing_motions_text
from femflex.dynamics.constraints.constrained import Constraints
from femflex.dynamics.constraints.excess import SWAY
from femflex.dynamics.lowering import tie_layout as at

AGREED = 1e-6  # acceleration that may be missing, relative to the largest that a row asks for


def refuse_accelerations(constraints: Constraints, x: Array, size: float) -> None:
    """Raise ValueError for a constraint whose accelerations no multipliers can bring about at the start x (n_x,)."""
    udot, rows, rank, _ = constraints.solved(np.zeros(1), x[None])
    closing, m = constraints.closing, constraints.n_rows
    if rank[0] == m:
        return
    first, width = int(closing["white"]), int(closing["width"])
    white = constraints.own[2][first : first + m * width].reshape(m, width)
    asked = rows[0, :, at.R_TARGET]
    missing = np.abs(white @ (white.T @ rows[0, :, at.R_LAMBDA]) - asked)
    speed, rate = (
        np.abs(x[constraints.n_q : constraints.n_q + constraints.n_u]).max(initial=0.0),
        np.abs(udot).max(initial=0.0),
    )
    limits = AGREED * max(1.0, size, np.abs(asked).max()) + SWAY * constraints.plays * (speed**2 + rate)
    if np.all(missing <= limits):
        return
    worst = max(constraints.names, key=lambda name: (missing / limits)[constraints.rows_of(name)].max())
    text = competing_motions_text(constraints, 0.0, x, worst)
    raise ValueError(
        f"{constraints.kind_of(worst)} cannot be satisfied{text} at the start: the nearest accelerations violate it by "
        f"{missing[constraints.rows_of(worst)].max():.3g} (m/s^2 or rad/s^2). Another constraint contradicts it, or "
        "the loop starts in a singular configuration, where branches meet, with rates along none of them. Give "
        "the rates of all its joints, or start slightly off the singular configuration."
    )
