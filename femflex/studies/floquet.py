"""Stability of periodic motions: the monodromy matrix on the tangent space, and its Floquet multipliers.

A small departure (dxi, du, dz) from a motion of period T becomes Phi (dxi, du, dz) after a period; the motion is stable
if no eigenvalue of Phi is outside the unit circle. dxi are increments of the coordinates, so that quaternions keep
their length and either sign is the same attitude, and angles count modulo 2 pi. Phi is computed from central
differences of motions that start a small step apart, in both directions.

Multipliers at 1 of drift and of the motion's own phase are double, and those computed split by the root of the error.
Departures that return unchanged, and those that return with a multiple of these added (drift), are found first as null
spaces of Phi - 1. The other multipliers are those of Phi over the orthogonal complement, and keep their accuracy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.dynamics import compile_system
from femflex.dynamics.model import Model
from femflex.dynamics.motion.freedoms import is_prescribed, usual_sizes
from femflex.dynamics.motion.increments import displaced, increment_between
from femflex.linear.states import effector_states
from femflex.system import System

STEP = 1e-4  # of a usual size: errors of differences 1e-8, of the integration RTOL / STEP
RTOL = 1e-11  # of the integration
CLOSED = 1e-6  # largest gap of a motion that counts as periodic, in usual sizes
TRIES, SHOT = 12, 1e-9  # steps of Newton's method, and the gap in usual sizes at which it ends
FREE = 1e-7  # of the largest singular value of 1 - Phi: directions along which the initial state is arbitrary
UNCHANGED = 1e-6  # singular value of Phi - 1 in usual sizes up to which a departure returns unchanged
ALIKE = 0.999  # cosine between a departure and the space of unchanged ones from which on it is one of them
OUTSIDE = 1e-6  # beyond the unit circle from which on a multiplier grows


@dataclass(frozen=True, eq=False)
class Floquet:
    """Multipliers (n,) by falling size of the motion of a period [s] that begins at x (n_x,), trivial ones exactly 1.

    monodromy  (n, n);  names (n,) of the departures;  gap  largest departure of the motion from itself after a period
    trivial    names of the trivial multipliers, one for each: "phase", "rotation x", "drift" of one of them, "neutral"
    split      largest distance from 1 of the trivial ones among the eigenvalues of the whole matrix: the root of its
               error where they are double
    """

    multipliers: ComplexArray
    monodromy: Array
    names: tuple[str, ...]
    period: float
    x: Array
    gap: float
    trivial: tuple[str, ...] = ()
    split: float = 0.0

    @property
    def stable(self) -> bool:
        """Whether no multiplier lies outside of the unit circle."""
        return bool(np.abs(self.multipliers).max(initial=0.0) <= 1.0 + OUTSIDE)


def floquet(system: System, period: float, state: Array | None = None) -> Floquet:
    """The Floquet multipliers of the motion of a system that begins at a state (n_x,) [SI], its initial one when left
    out.

    Raises ValueError for a motion that is not periodic, for loops, and for sampled controllers.
    """
    if not period > 0:
        raise ValueError(f"the period is {period} s; it must be above 0")
    if system.loops or system.constraints or system.controllers:
        raise ValueError(
            "Floquet multipliers are those of systems without loops, rolling and sampled controllers; open the loops, "
            "or leave the controllers out"
        )
    motions = _NearbyMotions(compile_system(system), period)
    x = motions.model.x0 if state is None else np.asarray(state, float)
    departures = np.abs(motions.departure(x, motions.state_after_period(x)))
    gap = float(departures.max(initial=0.0))
    if gap > CLOSED:
        raise ValueError(
            f"the motion is not periodic: after {period:.9g} s {motions.names[int(np.argmax(departures))]} differs by "
            f"{gap:.3g} of its usual size from its start. Check the period, or start on the periodic motion"
        )
    Phi = motions.monodromy(x)
    steps = returning_departures(Phi)
    R = np.hstack([np.zeros((len(Phi), 0)), *steps])
    S = np.linalg.qr(R, mode="complete")[0][:, R.shape[1] :]
    values = np.concatenate([np.asarray(np.linalg.eigvals(S.T @ Phi @ S), complex), np.ones(R.shape[1])])
    distances_from_one = np.abs(np.linalg.eigvals(Phi) - 1.0)
    split = float(np.sort(distances_from_one)[: R.shape[1]].max(initial=0.0))
    trivial = _trivial_names(motions, x, steps)
    order = np.argsort(-np.abs(values), kind="stable")
    sizes = motions.sizes
    return Floquet(values[order], Phi * sizes[:, None] / sizes, motions.names, period, x, gap, trivial, split)


def periodic_state(system: System, period: float, state: Array | None = None) -> Array:
    """The state (n_x,) near a given one, by default the initial one, whose motion has a period [s], found by shooting.

    Newton's method on the gap, in the least step where the motion may begin anywhere. Raises ValueError where it finds
    none.
    """
    motions = _NearbyMotions(compile_system(system), period)
    x = motions.model.x0 if state is None else np.asarray(state, float)
    for _ in range(TRIES):
        gap = motions.departure(x, motions.state_after_period(x))
        if np.abs(gap).max(initial=0.0) <= SHOT:
            return x
        Phi = motions.monodromy(x)
        x = motions.displaced(x, np.asarray(np.linalg.lstsq(np.eye(len(Phi)) - Phi, gap, rcond=FREE)[0]))
    raise ValueError(
        f"no motion of the period {period:.9g} s was found near the start; after {TRIES} steps of Newton's method "
        f"{np.abs(gap).max():.3g} of the usual sizes is left. Begin nearer to it, or check the period"
    )


class _NearbyMotions:
    """Motions over a period [s] that start near each other; departures (n,) are in usual sizes.

    A departure is that of a free coordinate, of its rate or of a state of an effector. places: their positions among
    all coordinates, rates and states;  names  and usual sizes (n,) [SI] of them: a rate moves its coordinate by its
    usual size in a period.
    """

    def __init__(self, model: Model, period: float) -> None:
        self.model, self.period = model, period
        free, n = np.flatnonzero(~is_prescribed(model)), model.n_u
        rates = np.array([name for name, _ in model.system.velocity_names()], object)[free]
        states = effector_states(model)[0] - model.n_q - n
        self.places = np.concatenate([free, n + free, 2 * n + states]).astype(np.int64)
        coordinates = [name.removesuffix("_rate").replace(".omega_", ".turn_") for name in rates]
        state_names = [name for name, _ in model.system.state_names()]
        self.names = (*coordinates, *rates, *(state_names[k] for k in states))
        sizes = usual_sizes(model)
        self.sizes = np.concatenate([sizes, sizes / period, model.system.state_sizes()])[self.places]

    def displaced(self, x: Array, by: Array) -> Array:
        """The state (n_x,) [SI] with departures from x."""
        full = np.zeros(2 * self.model.n_u + self.model.n_z)
        full[self.places] = by * self.sizes
        return displaced(self.model, x, *np.split(full, [self.model.n_u, 2 * self.model.n_u]))

    def departure(self, x: Array, y: Array) -> Array:
        """Departures of the state y from x [SI]; angles modulo 2 pi, quaternions of either sign."""
        (q, u, z), (p, v, w) = self.model.parts(x), self.model.parts(y)
        return np.concatenate([increment_between(self.model, q, p), v - u, w - z])[self.places] / self.sizes

    def state_after_period(self, x: Array) -> Array:
        """The state (n_x,) [SI] after a period."""
        from femflex.integrate import Dop853

        return np.asarray(Dop853(rtol=RTOL).solve(self.model, np.array([0.0, self.period]), x).states[-1])

    def monodromy(self, x: Array) -> Array:
        """Phi (n, n): departures after a period by those at the start x (n_x,) [SI]."""
        columns = []
        for step in STEP * np.eye(len(self.sizes)):
            ends = (self.state_after_period(self.displaced(x, sign * step)) for sign in (1.0, -1.0))
            forward, backward = (self.departure(x, end) for end in ends)
            columns.append((forward - backward) / (2 * STEP))
        return np.column_stack([np.zeros((len(self.sizes), 0)), *columns])


def returning_departures(Phi: Array) -> list[Array]:
    """Departures (n, k) that return unchanged, then (n, m) those that return with a multiple of the ones before added.

    Phi (n, n): in usual sizes. Orthonormal columns, over all steps.
    """
    steps: list[Array] = []
    R = np.zeros((len(Phi), 0))
    while R.shape[1] < len(Phi):
        S = np.linalg.qr(R, mode="complete")[0][:, R.shape[1] :]
        _, sigma, Vt = np.linalg.svd(S.T @ Phi @ S - np.eye(S.shape[1]))
        next_step = S @ Vt[int((sigma > UNCHANGED).sum()) :].T
        if not next_step.shape[1]:
            break
        steps.append(next_step)
        R = np.hstack([R, next_step])
    return steps


def _trivial_names(motions: _NearbyMotions, x: Array, steps: list[Array]) -> tuple[str, ...]:
    """Names of the returning departures: of known symmetries, "neutral" for other unchanged ones, else "drift"."""
    if not steps:
        return ()
    unchanged, names, R = steps[0], list[str](), np.zeros((len(motions.sizes), 0))
    for name, departure in _symmetries(motions, x):
        remainder, size = departure - R @ (R.T @ departure), float(np.linalg.norm(departure))
        is_unchanged = size > 0 and np.linalg.norm(unchanged.T @ departure) > ALIKE * size
        if is_unchanged and np.linalg.norm(remainder) > (1 - ALIKE) * size:
            names.append(name)
            R = np.column_stack([R, remainder / np.linalg.norm(remainder)])
    names += ["neutral"] * (unchanged.shape[1] - len(names))
    return tuple(names) + ("drift",) * sum(step.shape[1] for step in steps[1:])


def _symmetries(motions: _NearbyMotions, x: Array) -> list[tuple[str, Array]]:
    """Departures (n,) that give the same motion later, or at another position or attitude of the base frame."""
    from femflex.linear.rigid_motions import MOTIONS, body_motions, rigid_fields

    model = motions.model
    fields, is_free = rigid_fields(model, body_motions(model, x), np.eye(3))
    frame = model.system.frame
    spin = -frame.rate if frame.kind == "spinning" else np.zeros(3)
    turns = np.cross(spin, np.eye(3)).T  # a constant inertial vector moves in spinning axes
    rates = np.hstack([fields[:, :3] @ turns, fields[:, 3:] @ turns])
    states: dict[str, tuple[Array, ...]] = {
        name: (fields[:, k], rates[:, k], np.zeros(model.n_z)) for k, name in enumerate(MOTIONS) if is_free[k]
    }
    states["phase"] = model.parts(x)[1], model.state_rate(0.0, x)[model.n_q :]
    return [(name, np.concatenate(parts)[motions.places] / motions.sizes) for name, parts in states.items()]
