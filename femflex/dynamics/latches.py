"""Latches at work: when a joint's coordinate reaches its latch, and what that does to the motion.

A rigid latch stops its freedom by an impulse J along it: M du = J e with du = -u on the freedom, and nothing else acts,
so momentum and angular momentum stay. The energy lost is -J u / 2 (Carnot).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.law_report import latch_places
from femflex.dynamics.layout import HEADER, N_HEADER

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Latches:
    """The latches of a model as events (see femflex.integrate.events)."""

    model: Model

    def values(self, t: float, x: Array) -> Array:
        """How far each open latch's coordinate has to go; 1 for a closed one."""
        out = []
        for joint, latch, time, _ in latch_places(self.model.system):
            first = time - joint.latch_places()[joint.latches.index(latch)]
            side = 1.0 if joint.q0[latch.freedom] > latch.at else -1.0
            out.append(1.0 if x[time] >= 0.0 else side * (x[first + latch.freedom] - latch.at))
        return np.array(out)

    def happen(self, k: int, t: float, x: Array) -> None:
        """Close latch k."""
        joint, latch, time, freedom = latch_places(self.model.system)[k]
        first = time - joint.latch_places()[joint.latches.index(latch)]
        x[time], x[first + latch.freedom] = t, latch.at
        if latch.rigid:
            u = self.model.n_q + freedom
            change, impulse = impact(self.model, t, x, freedom)
            x[time + 1] = -0.5 * impulse * x[u]
            x[self.model.n_q :] += change
            x[u] = 0.0


def impact(model: Model, t: float, x: Array, freedom: int) -> tuple[Array, float]:
    """Jump of u (n_u,) and impulse along the freedom when it is stopped; it is held in x already."""
    rhs, change = np.zeros(model.n_u), np.empty(model.n_u)
    rhs[freedom] = -x[model.n_q + freedom]
    q = np.ascontiguousarray(x[: model.n_q])
    model.tree.solve(t, q, rhs, change, 1.0, 0.0, 0.0, model.table, model.pool, model.work)
    drives = int(model.table[:N_HEADER].view(HEADER)[0]["drives"])
    return change, float(model.work[drives + freedom])
