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
from femflex.dynamics.linear.freedoms import is_prescribed, usual_sizes
from femflex.dynamics.linear.increments import displaced, increment_between
from femflex.dynamics.linear.states import effector_states
from femflex.dynamics.model import Model
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
    model = compile_system(system)
    x = model.x0 if state is None else np.asarray(state, float)
    positions = departures(model)
    names = tuple(name for _, name in positions)
    sizes = departure_sizes(model, [position for position, _ in positions], period)
    end = state_after_period(model, x, period)
    gap = float(np.abs(departure(model, x, end, positions) / sizes).max(initial=0.0))
    if gap > CLOSED:
        worst = names[int(np.argmax(np.abs(departure(model, x, end, positions) / sizes)))]
        raise ValueError(
            f"the motion is not periodic: after {period:.9g} s {worst} differs by {gap:.3g} of its usual size from its "
            "start. Check the period, or start on the periodic motion"
        )
    Phi = monodromy(model, x, period, positions, sizes)
    scaled = Phi / sizes[:, None] * sizes
    steps = returning_departures(scaled)
    R = np.hstack([np.zeros((len(sizes), 0)), *steps])
    S = np.linalg.qr(R, mode="complete")[0][:, R.shape[1] :]
    other_multipliers = np.asarray(np.linalg.eigvals(S.T @ scaled @ S), complex)
    values = np.concatenate([other_multipliers, np.ones(R.shape[1])])
    distances_from_one = np.abs(np.linalg.eigvals(scaled) - 1.0)
    split = float(np.sort(distances_from_one)[: R.shape[1]].max(initial=0.0))
    trivial = _trivial_names(model, x, steps, [position for position, _ in positions], sizes)
    order = np.argsort(-np.abs(values), kind="stable")
    return Floquet(values[order], Phi, names, period, x, gap, trivial, split)


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


def _trivial_names(model: Model, x: Array, steps: list[Array], positions: list[int], sizes: Array) -> tuple[str, ...]:
    """Names of the returning departures: of known symmetries, "neutral" for other unchanged ones, else "drift"."""
    if not steps:
        return ()
    unchanged, names, R = steps[0], list[str](), np.zeros((len(sizes), 0))
    for name, field in _symmetries(model, x, positions):
        scaled = field / sizes
        remainder = scaled - R @ (R.T @ scaled)
        size = float(np.linalg.norm(scaled))
        if (
            size > 0
            and np.linalg.norm(unchanged.T @ scaled) > ALIKE * size
            and np.linalg.norm(remainder) > (1 - ALIKE) * size
        ):
            names.append(name)
            R = np.column_stack([R, remainder / np.linalg.norm(remainder)])
    names += ["neutral"] * (unchanged.shape[1] - len(names))
    return tuple(names) + ("drift",) * sum(step.shape[1] for step in steps[1:])


def _symmetries(model: Model, x: Array, positions: list[int]) -> list[tuple[str, Array]]:
    """Departures (n,) [SI] that give the same motion later, or at another position or attitude of the base frame."""
    from femflex.dynamics.linear.rigid_motions import MOTIONS, body_motions, rigid_fields

    u = model.parts(x)[1]
    rate = model.state_rate(0.0, x)
    fields, is_free = rigid_fields(model, body_motions(model, x), np.eye(3))
    frame = model.system.frame
    spin = -frame.rate if frame.kind == "spinning" else np.zeros(3)
    turns = np.cross(spin, np.eye(3)).T  # a constant inertial vector moves in spinning axes
    rates = np.hstack([fields[:, :3] @ turns, fields[:, 3:] @ turns])
    symmetries = []
    for k, name in enumerate(MOTIONS):
        if is_free[k]:
            state = np.concatenate([fields[:, k], rates[:, k], np.zeros(model.n_z)])
            symmetries.append((name, state[positions]))
    symmetries.append(("phase", np.concatenate([u, rate[model.n_q :]])[positions]))
    return symmetries


def monodromy(model: Model, x: Array, period: float, positions: list[tuple[int, str]], sizes: Array) -> Array:
    """Phi (n, n) [SI]: departures after a period by those at the start x (n_x,)."""
    columns = []
    for k, size in enumerate(sizes):
        h = STEP * size * np.eye(len(sizes))[k]
        ends = [state_after_period(model, displaced_by(model, x, sign * h, positions), period) for sign in (1.0, -1.0)]
        end_departures = [departure(model, x, end, positions) for end in ends]
        columns.append((end_departures[0] - end_departures[1]) / (2 * STEP * size))
    return np.column_stack([np.zeros((len(sizes), 0)), *columns])


def periodic_state(system: System, period: float, state: Array | None = None) -> Array:
    """The state (n_x,) near a given one, by default the initial one, whose motion has a period [s], found by shooting.

    Newton's method on the gap, in the least step where the motion may begin anywhere. Raises ValueError where it finds
    none.
    """
    model = compile_system(system)
    x = model.x0 if state is None else np.asarray(state, float)
    positions = departures(model)
    sizes = departure_sizes(model, [position for position, _ in positions], period)
    for _ in range(TRIES):
        gap = departure(model, x, state_after_period(model, x, period), positions)
        if np.abs(gap / sizes).max(initial=0.0) <= SHOT:
            return x
        Phi = monodromy(model, x, period, positions, sizes) / sizes[:, None] * sizes
        step = np.linalg.lstsq(np.eye(len(sizes)) - Phi, gap / sizes, rcond=FREE)[0]
        x = displaced_by(model, x, step * sizes, positions)
    raise ValueError(
        f"no motion of the period {period:.9g} s was found near the start; after {TRIES} steps of Newton's method "
        f"{np.abs(gap / sizes).max():.3g} of the usual sizes is left. Begin nearer to it, or check the period"
    )


def departures(model: Model) -> list[tuple[int, str]]:
    """Position and name of every departure: free coordinates (from 0), their rates (from n_u), states (from 2 n_u)."""
    free, n = np.flatnonzero(~is_prescribed(model)), model.n_u
    rates = [name for name, _ in model.system.velocity_names()]
    states = [name for name, _ in model.system.state_names()]
    coordinates_and_rates = [(int(k), rates[k].removesuffix("_rate").replace(".omega_", ".turn_")) for k in free]
    coordinates_and_rates += [(n + int(k), rates[k]) for k in free]
    of_effectors = effector_states(model)[0] - model.n_q - n
    return coordinates_and_rates + [(2 * n + int(k), states[k]) for k in of_effectors]


def departure_sizes(model: Model, positions: list[int], period: float) -> Array:
    """Usual sizes of the departures (n,) [SI]: a rate moves its coordinate by its usual size in a period."""
    sizes = usual_sizes(model)
    return np.concatenate([sizes, sizes / period, model.system.state_sizes()])[positions]


def displaced_by(model: Model, x: Array, by: Array, positions: list[tuple[int, str]]) -> Array:
    """The state (n_x,) [SI] with departures (n,) from x."""
    full = np.zeros(2 * model.n_u + model.n_z)
    full[[position for position, _ in positions]] = by
    return displaced(model, x, *np.split(full, [model.n_u, 2 * model.n_u]))


def departure(model: Model, x: Array, y: Array, positions: list[tuple[int, str]]) -> Array:
    """Departures (n,) [SI] of the state y from x; angles modulo 2 pi, quaternions of either sign."""
    (q, u, z), (p, v, w) = model.parts(x), model.parts(y)
    increments = increment_between(model, q, p)
    return np.concatenate([increments, v - u, w - z])[[position for position, _ in positions]]


def state_after_period(model: Model, x: Array, period: float) -> Array:
    """The state (n_x,) [SI] after a period."""
    from femflex.integrate import Dop853

    solution = Dop853(rtol=RTOL).solve(model, np.array([0.0, period]), x)
    return np.asarray(solution.states[-1])
