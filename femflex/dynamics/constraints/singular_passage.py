"""Singular configurations of loops along a run: where rows lose their rank for an instant, and branches meet.

What remains of the last independent row there goes to zero, and with it what is known of the motion across the branch:
a gap of rounding g moves the state by g over that row. So rows that have shrunk to a small part of what they were at
the start are left out: the motion goes straight on across the instant, and is brought back where the rows have grown
again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.dynamics.constraints.constrained import Constraints
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.constraints import characteristic_length

LOSS_RATIO = 3e-4  # part of the last pivot at the start below which a row is left out along a run
PLAY_FACTOR = (
    30.0  # the same of loops with play, over the root of the play by the bodies' size: a misfit e changes rates by
)
# e over the pivot's square, and so by a part in a thousand where the row is left out


def start_pivots(constraints: Constraints) -> None:
    """Set from the rows just solved at the start which pivots are lost along a run; begin to note the least."""
    _, pool, work = constraints.arrays
    small, m, rank = int(constraints.closing["small"]), constraints.n_rows, constraints.rank()
    pivots = np.array([work[small + k * m + k] for k in range(rank)])
    part = float(pivots[-1] / pivots[0]) if rank else 1.0
    pool[int(constraints.closing["tolerance"]) + 2] = max(constraints.dependence_limit, part * loss_ratio(constraints))
    constraints.reset_passage_notes()


def loss_ratio(constraints: Constraints) -> float:
    """Part of the last pivot at the start below which a row is left out, wider for loops with play."""
    play = float((constraints.row_plays * constraints.row_lengths).max(initial=0.0)) / characteristic_length(
        constraints.system
    )
    return float(max(LOSS_RATIO, PLAY_FACTOR * play**0.5))


@dataclass(frozen=True)
class Passage:
    """Configuration at which the rows came near to losing rank.

    t, least  time [s] where they came closest, and the last pivot over the first there;  lost  below which they do
    count     how many such configurations were passed at least: too long steps hide others;  first  about when
              the first of them were [s]
    """

    t: float
    least: float
    lost: float
    count: int
    first: tuple[float, ...]


def passage(constraints: Constraints) -> Passage | None:
    """Return the Passage of a run; None where the rows stayed a hundred times above LOST."""
    note, pool = int(constraints.closing["note"]), constraints.arrays[1]
    lost = float(pool[int(constraints.closing["tolerance"]) + 2])
    notes = constraints.arrays[2][note : note + layout.NOTE_SIZE]
    least, t, count = float(notes[layout.N_LEAST]), float(notes[layout.N_TIME]), int(notes[layout.N_COUNT])
    close = least <= lost * max(1.0, 100.0 * LOSS_RATIO / loss_ratio(constraints))
    if not notes[layout.N_RANK] or not (close or count) or lost <= constraints.dependence_limit:
        return None
    first = tuple(float(when) for when in notes[layout.N_FIRST : layout.N_FIRST + min(count, layout.MAX_NOTED)])
    return Passage(t, least, lost, max(count, 1), first or (t,))
