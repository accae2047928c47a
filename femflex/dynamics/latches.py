"""Latches at work: when a joint's coordinate reaches its latch, and what that does to the motion.

A rigid latch stops its freedom by an impulse J along it: M du = J e + A^T L with du = -u on the freedom and A du = 0 on
the constraints, whose impulses L keep loops closed. Nothing else acts, so momentum and angular momentum stay. The
energy lost is -J u / 2 (Carnot): what the constraints do not let move takes none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.constraint_layout import R_LAMBDA
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
            moving = x[u]
            after, impulse = impact(self.model, t, x, freedom)
            x[time + 1] = -0.5 * impulse * moving
            x[self.model.n_q :] = after


def impact(model: Model, t: float, x: Array, freedom: int) -> tuple[Array, float]:
    """Quasi-velocities u (n_u,) after the freedom is stopped, and the impulse along it; it is held in x already.

    Beside constraints in two steps, both the shortest by M: to rest of the freedom, then onto the constraints with the
    freedom at rest. Together they are the shortest way to both, for the second keeps what the first has reached.
    """
    before = x[model.n_q :].copy()
    rhs, change = np.zeros(model.n_u), np.empty(model.n_u)
    rhs[freedom] = -before[freedom]
    q = np.ascontiguousarray(x[: model.n_q])
    model.tree.solve(t, q, rhs, change, 1.0, 0.0, 0.0, model.table, model.pool, model.work)
    drives = int(model.table[:N_HEADER].view(HEADER)[0]["drives"])
    impulse = float(model.work[drives + freedom])
    after = before + change
    after[freedom] = 0.0
    if model.constraints is None:
        return after, impulse
    closed = np.concatenate([q, after])
    model.project(t, closed, model.table, model.pool, model.work)
    multipliers = model.constraints.rows()[:, R_LAMBDA].copy()
    more = closed[model.n_q :] - after
    return closed[model.n_q :], impulse + held_impulse(model, t, x, more, multipliers, freedom)


def held_impulse(model: Model, t: float, x: Array, change: Array, multipliers: Array, freedom: int) -> float:
    """The impulse along a freedom that a change of u (n_u,) by multipliers (n_rows,) asks of what holds it at rest.

    That is the freedom's own row of M du = J e + A^T L, from the mass matrix with the freedom open.
    """
    assert model.constraints is not None
    A = model.constraints.matrix(t, x)
    return float(_free_row(model, t, x, freedom) @ change - A[:, freedom] @ multipliers)


def _free_row(model: Model, t: float, x: Array, freedom: int) -> Array:
    """Row of the mass matrix (n_u,) that belongs to a freedom which a latch holds in x, as if it were open."""
    opened = x.copy()
    for _, latch, time, its in latch_places(model.system):
        if its == freedom and latch.rigid:
            opened[time] = -1.0
    return model.mass_matrix(t, opened)[freedom]
