"""Initial values that loops and constraints corrected at the start of a run, and misfits that loops with play absorbed.

A loop with more rows than it needs closes only to the accuracy of its markers. Within its play the misfit that the best
configuration leaves is taken into the marker on the parent: moved and turned by it, the marker fits exactly, and so do
the equations, at the start always, and for good where axes are parallel. Where they are not quite, rows that follow
from others open and close within the play as the loop moves; all rows then share the misfit, least in squares.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.constraints.constrained import Constraints
from femflex.dynamics.layout.constraints import POSITION_TOLERANCE
from femflex.system.loop import COSINE, OFFSET, closure

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


RELATIVE_TOLERANCE = 1e-9  # of the largest value with the same unit
ABSOLUTE_TOLERANCE = 1e-12  # in SI: the rounding of a start in which all values of a unit are zero


@dataclass(frozen=True)
class CorrectedInitialValue:
    """An initial value: its name and unit, as given and as the run starts from it (SI)."""

    name: str
    unit: str
    given: float
    started: float

    def __str__(self) -> str:
        """Return the correction in words, with as many digits as show it, angles in degrees."""
        factor, unit = (math.degrees(1.0), "deg") if self.unit == "rad" else (1.0, self.unit)
        size = max(abs(self.given), abs(self.started))
        digits = max(4, 2 - math.floor(math.log10(abs(self.started - self.given) / size)))
        return f"{self.name} {factor * self.given:.{digits}g} -> {factor * self.started:.{digits}g} {unit}"


def initial_corrections(model: Model) -> list[CorrectedInitialValue]:
    """Return the initial values that were corrected to make the start consistent, largest corrections first.

    How far is reported relative to the largest value of the same unit; what is below NOTICED of it has not moved.
    """
    system = model.system
    if model.constraints is None:
        return []
    names = [*system.coordinate_names(), *system.velocity_names()]
    requested, started = system.initial_state(), model.x0
    size = np.maximum(np.abs(requested), np.abs(started))
    scale = np.array([max(size[k] for k, pair in enumerate(names) if pair[1] == unit) for _, unit in names])
    change = np.abs(started - requested)
    noticed = np.flatnonzero((change > RELATIVE_TOLERANCE * scale) & (change > ABSOLUTE_TOLERANCE))
    order = noticed[np.argsort(-change[noticed] / scale[noticed], kind="stable")]
    return [CorrectedInitialValue(names[k][0], names[k][1], float(requested[k]), float(started[k])) for k in order]


MAX_PLAY = 1e-3  # of the bodies' size: play beyond is a clearance in which parts would move


@dataclass(frozen=True)
class AbsorbedMisfit:
    """Displacement [m] and rotation [rad] of a loop's marker on the parent, and the loop's play [m]."""

    loop: str
    displacement: float
    rotation: float
    play: float

    def __str__(self) -> str:
        """Return the correction as a sentence."""
        return (
            f"loop {self.loop!r}: the smallest gap that its joints reach is {self.displacement:.3g} m and "
            f"{self.rotation:.3g} rad, within its `play` of {self.play:.3g} m; its marker on the parent "
            "was displaced and turned by the gap"
        )


def absorb_misfit(constraints: Constraints, x: Array) -> None:
    """Shift the markers of loops with play by the loops' misfit at the state x (n_x,)."""
    gaps, pool = constraints.residuals(0.0, x)[0], constraints.arrays[1]
    size = float(pool[int(constraints.closing["tolerance"]) + 1])
    for loop, record in zip(constraints.system.loops, constraints.records, strict=False):
        misfit = gaps[constraints.rows_of(loop.label)]
        if loop.play == 0.0 or np.abs(misfit).max(initial=0.0) <= POSITION_TOLERANCE * size:
            continue
        n = int(record["n_slides"])
        slides, pairs = _tables(constraints, record)
        slides[:, OFFSET] += misfit[:n]
        pairs[:, COSINE] += misfit[n:]


def absorbed_misfits(constraints: Constraints) -> list[AbsorbedMisfit]:
    """Return the misfit that the markers of each loop absorbed, of the loops that have any."""
    out = []
    for loop, record in zip(constraints.system.loops, constraints.records, strict=False):
        original, (slides, pairs) = closure(loop), _tables(constraints, record)
        displacement = float(np.linalg.norm(slides[:, OFFSET]))
        rotation = float(np.linalg.norm(pairs[:, COSINE] - original.pairs[:, COSINE]))
        if displacement or rotation:
            out.append(AbsorbedMisfit(loop.label, displacement, rotation, loop.play))
    return out


def refuse_clearance(constraints: Constraints, size: float) -> None:
    """Raise ValueError for play so large that it would be a motion of its own."""
    for loop in constraints.system.loops:
        if loop.play > MAX_PLAY * size:
            raise ValueError(
                f"play of loop {loop.label!r} is {loop.play:.3g} m, {loop.play / size:.2%} of the bodies' size of "
                f"{size:.3g} m; `play` allows for rounded lengths and axes (limit {MAX_PLAY:.1%}). Give lengths and "
                "axes to more digits, or a joint that lets the parts move"
            )


def _tables(constraints: Constraints, record: np.void) -> tuple[Array, Array]:
    """The slides (n_s, 4) and pairs (n_d, 7) of a loop, where the equations read them."""
    pool = constraints.arrays[1]
    n_s, n_d, s, d = (int(record[key]) for key in ("n_slides", "n_pairs", "slides", "pairs"))
    return pool[s : s + 4 * n_s].reshape(n_s, 4), pool[d : d + 7 * n_d].reshape(n_d, 7)
