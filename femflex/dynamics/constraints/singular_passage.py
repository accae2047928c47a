"""Singular configurations of loops along a run: where rows lose their rank for an instant, and branches meet.

What remains of the last independent row there goes to zero, and with it what is known of the motion across the branch:
a gap of rounding g moves the state by g over that row. So rows that have shrunk to a small part of what they were at
the start are left out: the motion goes straight on across the instant, and is brought back where the rows have grown
again.
"""

from __future__ import annotations

import numpy as np

from femflex.dynamics.constraints.constrained import Constraints
from femflex.dynamics.lowering import tie_layout as at
from femflex.dynamics.lowering.ties import characteristic_length

LOST = 3e-4  # part of the last pivot at the start below which a row is left out along a run
WIDER = 30.0  # the same of loops with play, over the root of the play by the bodies' size: a misfit e changes rates by
# e over the pivot's square, and so by a part in a thousand where the row is left out


def start_pivots(constraints: Constraints) -> None:
    """Set from the rows just solved at the start which pivots are lost along a run; begin to note the least."""
    _, pool, work = constraints.own
    small, m, rank = int(constraints.closing["small"]), constraints.n_rows, constraints.rank()
    pivots = np.array([work[small + k * m + k] for k in range(rank)])
    play = float((constraints.plays * constraints.lengths).max(initial=0.0)) / characteristic_length(constraints.system)
    part = float(pivots[-1] / pivots[0]) if rank else 1.0
    pool[int(constraints.closing["tolerance"]) + 2] = max(constraints.slack, part * max(LOST, WIDER * play**0.5))
    constraints.forget_passage()


def passage(constraints: Constraints) -> tuple[float, float, float] | None:
    """Where the rows came near to losing rank: time [s], least last pivot over the first, and that below which they do.

    None where they stayed a hundred times above.
    """
    note, pool = int(constraints.closing["note"]), constraints.own[1]
    lost = float(pool[int(constraints.closing["tolerance"]) + 2])
    least, t = (float(value) for value in constraints.own[2][note + at.N_LEAST : note + at.N_TIME + 1])
    if not constraints.own[2][note + at.N_RANK] or least > 100.0 * lost or lost <= constraints.slack:
        return None
    return t, least, lost
