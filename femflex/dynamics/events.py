"""Events of a model: latches, with the impact on the motion, and events of effectors (see femflex.integrate.events).

A latch closes at the instant at which a joint's coordinate reaches it. A rigid one stops its freedom by an impulse J
along it: M du = J e + A^T L with du = -u on the freedom and A du = 0 on the constraints, whose impulses L keep loops
closed. Nothing else acts, so momentum and angular momentum stay. The energy lost is -J u / 2 (Carnot): what the
constraints do not let move takes none. Latches that close at the same instant are one impact, M du = sum J_i e_i + A^T
L; each gets the work of its own impulse, -J_i u_i / 2, which add up to the energy lost and are the same for two that
are alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.places import latch_places
from femflex.dynamics.layout.constraint_records import R_LAMBDA
from femflex.dynamics.layout.records import header_record
from femflex.system import Effector, Latch, StateEvent, System, Threshold
from femflex.system.joint_coordinates import RELEASED

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


STEP = 1e-6  # s, over which the rate of a channel, or of an event's value, is taken along the motion


@dataclass(frozen=True)
class LatchEvent:
    """A latch, the places in x of its time, coordinate and freedom, and the sign of the way to it."""

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
        """Return for each latch its places in the state, and the side from which its coordinate approaches."""
        entries, first = [], self.model.n_q + self.model.n_u
        for latch_place in latch_places(self.model.system):
            side = 1.0 if latch_place.joint.q0[latch_place.latch.freedom] > latch_place.latch.at else -1.0
            entries.append(LatchEvent(latch_place.latch, first + latch_place.time, latch_place.q, latch_place.u, side))
        return entries

    def values(self, t: float, x: Array) -> Array:
        """Return the distance of each open latch's coordinate, or of the channel that opens it; 1 for a closed one."""
        out = np.array([_distance(p, t, x) for p in self.latch_events])
        waiting = {k: opens for k, p in enumerate(self.latch_events) if (opens := _threshold(p, x)) is not None}
        if waiting:
            channels = self.model.channel_values(t, x, sorted({opens.channel for opens in waiting.values()}))
            for k, opens in waiting.items():
                out[k] = opens.distance(float(channels[opens.channel]))
        return out

    def rates(self, t: float, x: Array) -> Array:
        """Return the rates of these distances; 0 for a closed latch."""
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


def _threshold(event: LatchEvent, x: Array) -> Threshold | None:
    """Return the threshold at which a closed latch opens, None if it has none."""
    return event.latch.opens if isinstance(event.latch.opens, Threshold) and x[event.time] >= 0.0 else None


def _distance(event: LatchEvent, t: float, x: Array) -> float:
    """Return the distance of an open latch's coordinate, or the time until a timed one opens; 1 when it is done."""
    if isinstance(event.latch.opens, Threshold):
        return 1.0
    if event.latch.opens is not None:
        return event.latch.opens - t if x[event.time] >= 0.0 else 1.0
    return 1.0 if x[event.time] >= 0.0 else event.side * (x[event.q] - event.latch.at)


def _approach(event: LatchEvent, x: Array, n_q: int) -> float:
    """Return the rate of `_distance`."""
    if isinstance(event.latch.opens, Threshold):
        return 0.0
    if event.latch.opens is not None:
        return -1.0 if x[event.time] >= 0.0 else 0.0
    return 0.0 if x[event.time] >= 0.0 else event.side * x[n_q + event.freedom]


def impact(model: Model, t: float, x: Array, freedoms: list[int]) -> tuple[Array, list[float]]:
    """Return quasi-velocities u (n_u,) after freedoms locked in x are stopped, and the impulses along them.

    Beside constraints in two steps, both the shortest by M: to rest of the freedoms, then onto the constraints with the
    freedoms at rest. Together they are the shortest way to both, for the second keeps what the first has reached.
    """
    q, before, z = (part.copy() for part in model.parts(x))
    rhs, change = np.concatenate([np.zeros(model.n_u), z]), np.empty(model.n_u)
    rhs[freedoms] = -before[freedoms]
    model.second_order.solve(t, q, rhs, change, 1.0, 0.0, 0.0, model.table, model.pool, model.work)
    drives = int(header_record(model.table)["drives"])
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
    """Return the impulse along a freedom for a change of u (n_u,) by multipliers (n_rows,), on what holds it at rest.

    That is the freedom's own row of M du = J e + A^T L, from the mass matrix with the freedom open.
    """
    assert model.constraints is not None
    A = model.constraints.matrix(t, x)
    return float(_free_row(model, t, x, freedom) @ change - A[:, freedom] @ multipliers)


def _free_row(model: Model, t: float, x: Array, freedom: int) -> Array:
    """Return the row of the mass matrix (n_u,) of a freedom that a latch locks in x, as if it were open."""
    opened, first = x.copy(), model.n_q + model.n_u
    for latch_place in latch_places(model.system):
        if latch_place.u == freedom and latch_place.latch.rigid:
            opened[first + latch_place.time] = -1.0
    return model.mass_matrix(t, opened)[freedom]


@dataclass(frozen=True, eq=False)
class AllEvents:
    """Events of several sources, one after another."""

    sources: tuple[Latches | StateEvents, ...]

    def values(self, t: float, x: Array) -> Array:
        """(n,) of all sources."""
        return np.concatenate([source.values(t, x) for source in self.sources])

    def rates(self, t: float, x: Array) -> Array:
        """(n,) of all sources."""
        return np.concatenate([source.rates(t, x) for source in self.sources])

    def apply(self, simultaneous: Sequence[int], t: float, x: Array) -> None:
        """Let each source's events happen, the first source's first."""
        first = 0
        for source in self.sources:
            n = len(source.values(t, x))
            indices = [k - first for k in simultaneous if first <= k < first + n]
            if indices:
                source.apply(indices, t, x)
            first += n


@dataclass(frozen=True, eq=False)
class StateEvents:
    """The events of a model's effectors."""

    model: Model

    @cached_property
    def states_of_events(self) -> list[tuple[Effector, StateEvent, slice]]:
        """Return every event, and the slice of x with the states of its effector."""
        names = [name for name, _ in self.model.system.all_state_names()]
        rows = []
        for effector in effectors_with_events(self.model.system):
            first = names.index(effector.state_names()[0][0])
            rows += [(effector, event, slice(first, first + len(effector.states))) for event in effector.events]
        return rows

    def values(self, t: float, x: Array) -> Array:
        """Their values."""
        return np.array(
            [
                float(_answer(effector, event, event.value, t, x[states]))
                for effector, event, states in self.states_of_events
            ]
        )

    def rates(self, t: float, x: Array) -> Array:
        """Rates of their values along the motion, by a difference."""
        dx = self.model.state_rate(t, x)
        ahead, behind = (self.values(t + sign * STEP, x + sign * STEP * dx) for sign in (1.0, -1.0))
        return np.asarray((ahead - behind) / (2.0 * STEP))

    def apply(self, simultaneous: Sequence[int], t: float, x: Array) -> None:
        """Let them happen one after another."""
        for k in simultaneous:
            effector, event, states = self.states_of_events[k]
            new = np.asarray(_answer(effector, event, event.apply, t, x[states]), float)
            if new.shape != (len(effector.states),):
                raise ValueError(
                    f"event {event.name!r} of effector {effector.name!r} gave states of shape {new.shape}; expected "
                    f"({len(effector.states)},)"
                )
            x[states] = new


def _answer(effector: Effector, event: StateEvent, function: Callable[..., Any], t: float, z: Array) -> Any:
    """The value of a function of an event. Raises ValueError that names the effector where the function raises."""
    try:
        return function(t, z.copy())
    except Exception as error:
        raise ValueError(
            f"event {event.name!r} of effector {effector.name!r} raised {type(error).__name__} at t = {t:.9g} s: "
            f"{error}"
        ) from error


def effectors_with_events(system: System) -> list[Effector]:
    """Effectors with events."""
    return [effector for effector in system.effectors if isinstance(effector, Effector) and effector.events]
