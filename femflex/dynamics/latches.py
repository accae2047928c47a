"""Latches at work: when a joint's coordinate reaches its latch, and what that does to the motion.

A rigid latch stops its freedom by an impulse J along it: M du = J e + A^T L with du = -u on the freedom and A du = 0 on
the constraints, whose impulses L keep loops closed. Nothing else acts, so momentum and angular momentum stay. The
energy lost is -J u / 2 (Carnot): what the constraints do not let move takes none. Latches that close at the same
instant are one impact, M du = sum J_i e_i + A^T L; each gets the work of its own impulse, -J_i u_i / 2, which add
up to the energy lost and are the same for two that are alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.law_report import latch_places
from femflex.dynamics.lowering.constraint_layout import R_LAMBDA
from femflex.dynamics.lowering.layout import HEADER, N_HEADER
from femflex.dynamics.reports.channel_reader import ChannelReader
from femflex.system import Latch, Threshold
from femflex.system.joint_coordinates import RELEASED

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


STEP = 1e-6  # s, over which the rate of a channel is taken along the motion


@dataclass(frozen=True)
class LatchEvent:
    """A latch, where its time and its coordinate stand in x and its freedom in u, and the sign of the way to it."""

    latch: Latch
    time: int
    q: int
    freedom: int
    side: float


@dataclass(frozen=True, eq=False)
class Latches:
    """The latches of a model as events (see femflex.integrate.events)."""

    model: Model

    @cached_property
    def latch_events(self) -> list[LatchEvent]:
        """Where each latch stands in the state, and from which side its coordinate comes."""
        entries, first = [], self.model.n_q + self.model.n_u
        for place in latch_places(self.model.system):
            side = 1.0 if place.joint.q0[place.latch.freedom] > place.latch.at else -1.0
            entries.append(LatchEvent(place.latch, first + place.time, place.q, place.u, side))
        return entries

    @cached_property
    def _reader(self) -> ChannelReader:
        return ChannelReader(self.model)

    def values(self, t: float, x: Array) -> Array:
        """How far each open latch's coordinate, or the channel at which it opens, has to go; 1 for a closed one."""
        out = np.array([_distance(p, t, x) for p in self.latch_events])
        waiting = {k: opens for k, p in enumerate(self.latch_events) if (opens := _threshold(p, x)) is not None}
        if waiting:
            channels = self._reader.values(t, x, sorted({opens.channel for opens in waiting.values()}))
            for k, opens in waiting.items():
                out[k] = opens.distance(float(channels[opens.channel]))
        return out

    def rates(self, t: float, x: Array) -> Array:
        """How fast that changes; 0 for a closed one."""
        n_q = self.model.n_q
        out = np.array([_approach(p, x, n_q) for p in self.latch_events])
        waiting = [k for k, p in enumerate(self.latch_events) if _threshold(p, x) is not None]
        if waiting:
            dx = self.model.state_rate(t, x)
            ahead, behind = (self.values(t + sign * STEP, x + sign * STEP * dx) for sign in (1.0, -1.0))
            out[waiting] = ((ahead - behind) / (2.0 * STEP))[waiting]
        return out

    def apply(self, simultaneous: Sequence[int], t: float, x: Array) -> None:
        """Close these latches at once."""
        for k in simultaneous:
            if self.latch_events[k].latch.opens is not None:
                x[self.latch_events[k].time] = RELEASED - t
        closing = [self.latch_events[k] for k in simultaneous if self.latch_events[k].latch.opens is None]
        for latch_event in closing:
            x[latch_event.time], x[latch_event.q] = t, latch_event.latch.at
        stopped = [latch_event for latch_event in closing if latch_event.latch.rigid]
        if not stopped:
            return
        moving = [x[self.model.n_q + latch_event.freedom] for latch_event in stopped]
        after, impulses = impact(self.model, t, x, [latch_event.freedom for latch_event in stopped])
        for latch_event, u, impulse in zip(stopped, moving, impulses, strict=True):
            x[latch_event.time + 1] = -0.5 * impulse * u
        x[self.model.n_q : self.model.n_q + self.model.n_u] = after


def _threshold(p: LatchEvent, x: Array) -> Threshold | None:
    """The threshold until which a latch is closed, None where it awaits none."""
    return p.latch.opens if isinstance(p.latch.opens, Threshold) and x[p.time] >= 0.0 else None


def _distance(p: LatchEvent, t: float, x: Array) -> float:
    """How far an open latch's coordinate has to go, or a time to the opening of one that opens; 1 when it is done."""
    if isinstance(p.latch.opens, Threshold):
        return 1.0
    if p.latch.opens is not None:
        return p.latch.opens - t if x[p.time] >= 0.0 else 1.0
    return 1.0 if x[p.time] >= 0.0 else p.side * (x[p.q] - p.latch.at)


def _approach(p: LatchEvent, x: Array, n_q: int) -> float:
    """Rate of `_to_go`."""
    if isinstance(p.latch.opens, Threshold):
        return 0.0
    if p.latch.opens is not None:
        return -1.0 if x[p.time] >= 0.0 else 0.0
    return 0.0 if x[p.time] >= 0.0 else p.side * x[n_q + p.freedom]


def impact(model: Model, t: float, x: Array, freedoms: list[int]) -> tuple[Array, list[float]]:
    """Quasi-velocities u (n_u,) after the freedoms are stopped, held in x already, and the impulses along them.

    Beside constraints in two steps, both the shortest by M: to rest of the freedoms, then onto the constraints with the
    freedoms at rest. Together they are the shortest way to both, for the second keeps what the first has reached.
    """
    q, before, z = (part.copy() for part in model.parts(x))
    rhs, change = np.concatenate([np.zeros(model.n_u), z]), np.empty(model.n_u)
    rhs[freedoms] = -before[freedoms]
    model.tree.solve(t, q, rhs, change, 1.0, 0.0, 0.0, model.table, model.pool, model.work)
    drives = int(model.table[:N_HEADER].view(HEADER)[0]["drives"])
    impulses = [float(model.work[drives + freedom]) for freedom in freedoms]
    after = before + change
    after[freedoms] = 0.0
    if model.constraints is None:
        return after, impulses
    closed = np.concatenate([q, after, z])
    model.project(t, closed, model.table, model.pool, model.work)
    multipliers = model.constraints.rows()[:, R_LAMBDA].copy()
    velocities = model.parts(closed)[1]
    change_by_constraints = velocities - after
    by_constraints = [
        constraint_impulse(model, t, x, change_by_constraints, multipliers, freedom) for freedom in freedoms
    ]
    return velocities, [first + second for first, second in zip(impulses, by_constraints, strict=True)]


def constraint_impulse(model: Model, t: float, x: Array, change: Array, multipliers: Array, freedom: int) -> float:
    """The impulse along a freedom that a change of u (n_u,) by multipliers (n_rows,) asks of what holds it at rest.

    That is the freedom's own row of M du = J e + A^T L, from the mass matrix with the freedom open.
    """
    assert model.constraints is not None
    A = model.constraints.matrix(t, x)
    return float(_free_row(model, t, x, freedom) @ change - A[:, freedom] @ multipliers)


def _free_row(model: Model, t: float, x: Array, freedom: int) -> Array:
    """Row of the mass matrix (n_u,) that belongs to a freedom which a latch holds in x, as if it were open."""
    opened, first = x.copy(), model.n_q + model.n_u
    for place in latch_places(model.system):
        if place.u == freedom and place.latch.rigid:
            opened[first + place.time] = -1.0
    return model.mass_matrix(t, opened)[freedom]
