"""Stability of periodic motions: the monodromy matrix on the tangent space, and its Floquet multipliers.

A small departure (dxi, du, dz) from a motion of period T comes back as Phi (dxi, du, dz); the motion is stable where no
eigenvalue of Phi lies outside of the unit circle. dxi are increments of the coordinates, so that quaternions keep their
length and either sign is the same attitude, and angles count modulo 2 pi. Phi comes from central differences of motions
that begin a little apart, in both directions.

Multipliers at 1 of drift and of the motion's own phase are double, and those computed split by the root of the error.
Departures that come back as they are, and those that come back with more of these (drift), are found as null spaces of
Phi - 1 first; the other multipliers are those of Phi over what is orthogonal to them, and keep their digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.increments import advanced
from femflex.dynamics.equilibria.linearised import is_prescribed, usual_sizes
from femflex.dynamics.equilibria.states import effector_states
from femflex.dynamics.model import Model
from femflex.system import System

STEP = 1e-4  # of a usual size: errors of differences 1e-8, of the integration RTOL / STEP
RTOL = 1e-11  # of the integration
CLOSED = 1e-6  # largest gap of a motion that counts as periodic, in usual sizes
TRIES, SHOT = 12, 1e-9  # steps of Newton's method, and the gap in usual sizes at which it ends
FREE = 1e-7  # of the largest singular value of 1 - Phi: directions along which the motion may begin anywhere
BACK = 1e-6  # singular value of Phi - 1 in usual sizes up to which a departure comes back as it is
ALIKE = 0.999  # cosine between a departure and the space of those that come back, as one of them
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
    places = departures(model)
    names = tuple(name for _, name in places)
    sizes = departure_sizes(model, [place for place, _ in places], period)
    end = moved(model, x, period)
    gap = float(np.abs(departure(model, x, end, places) / sizes).max(initial=0.0))
    if gap > CLOSED:
        worst = names[int(np.argmax(np.abs(departure(model, x, end, places) / sizes)))]
        raise ValueError(
            f"the motion is not periodic: after {period:.9g} s {worst} differs by {gap:.3g} of its usual size from its "
            "start. Check the period, or start on the periodic motion"
        )
    Phi = monodromy(model, x, period, places, sizes)
    scaled = Phi / sizes[:, None] * sizes
    steps = coming_back(scaled)
    R = np.hstack([np.zeros((len(sizes), 0)), *steps])
    S = np.linalg.qr(R, mode="complete")[0][:, R.shape[1] :]
    others = np.asarray(np.linalg.eigvals(S.T @ scaled @ S), complex)
    values = np.concatenate([others, np.ones(R.shape[1])])
    whole = np.abs(np.linalg.eigvals(scaled) - 1.0)
    split = float(np.sort(whole)[: R.shape[1]].max(initial=0.0))
    trivial = _trivial(model, x, steps, [place for place, _ in places], sizes)
    order = np.argsort(-np.abs(values), kind="stable")
    return Floquet(values[order], Phi, names, period, x, gap, trivial, split)


def coming_back(Phi: Array) -> list[Array]:
    """Departures (n, k) that come back as they are, then (n, m) those that come back with more of the ones before.

    Phi (n, n): in usual sizes. Orthonormal columns, over all steps.
    """
    found: list[Array] = []
    R = np.zeros((len(Phi), 0))
    while R.shape[1] < len(Phi):
        S = np.linalg.qr(R, mode="complete")[0][:, R.shape[1] :]
        _, sigma, Vt = np.linalg.svd(S.T @ Phi @ S - np.eye(S.shape[1]))
        more = S @ Vt[int((sigma > BACK).sum()) :].T
        if not more.shape[1]:
            break
        found.append(more)
        R = np.hstack([R, more])
    return found


def _trivial(model: Model, x: Array, steps: list[Array], places: list[int], sizes: Array) -> tuple[str, ...]:
    """Names of the departures that come back: those that are known, as many more as there are, and their drift."""
    if not steps:
        return ()
    back, names, R = steps[0], list[str](), np.zeros((len(sizes), 0))
    for name, field in _symmetries(model, x, places):
        one = field / sizes
        left = one - R @ (R.T @ one)
        size = float(np.linalg.norm(one))
        if size > 0 and np.linalg.norm(back.T @ one) > ALIKE * size and np.linalg.norm(left) > (1 - ALIKE) * size:
            names.append(name)
            R = np.column_stack([R, left / np.linalg.norm(left)])
    names += ["neutral"] * (back.shape[1] - len(names))
    return tuple(names) + ("drift",) * sum(step.shape[1] for step in steps[1:])


def _symmetries(model: Model, x: Array, places: list[int]) -> list[tuple[str, Array]]:
    """Departures (n,) [SI] that make the same motion later, or at another place or attitude of the base frame."""
    from femflex.dynamics.equilibria.body_motions import body_motions
    from femflex.dynamics.equilibria.rigid_motions import rigid_fields

    u = model.parts(x)[1]
    rate = model.state_rate(0.0, x)
    fields, there = rigid_fields(model, body_motions(model, x), np.eye(3))
    frame = model.system.frame
    spin = -frame.rate if frame.kind == "spinning" else np.zeros(3)
    found = []
    for kind, first in (("translation", 0), ("rotation", 3)):
        own = fields[:, first : first + 3]
        turned = own @ np.cross(spin, np.eye(3)).T  # what stays in inertial axes moves in those that spin
        for k, axis in enumerate("xyz"):
            if there[first + k]:
                state = np.concatenate([own[:, k], turned[:, k], np.zeros(model.n_z)])
                found.append((f"{kind} {axis}", state[places]))
    found.append(("phase", np.concatenate([u, rate[model.n_q :]])[places]))
    return found


def monodromy(model: Model, x: Array, period: float, places: list[tuple[int, str]], sizes: Array) -> Array:
    """Phi (n, n) [SI]: departures after a period by those at the start x (n_x,)."""
    columns = []
    for k, size in enumerate(sizes):
        h = STEP * size * np.eye(len(sizes))[k]
        ends = [moved(model, displaced(model, x, sign * h, places), period) for sign in (1.0, -1.0)]
        there = [departure(model, x, one, places) for one in ends]
        columns.append((there[0] - there[1]) / (2 * STEP * size))
    return np.column_stack([np.zeros((len(sizes), 0)), *columns])


def periodic_state(system: System, period: float, state: Array | None = None) -> Array:
    """The state (n_x,) near one, the initial one when left out, whose motion has a period [s]: by shooting.

    Newton's method on the gap, in the least step where the motion may begin anywhere. Raises ValueError where it finds
    none.
    """
    model = compile_system(system)
    x = model.x0 if state is None else np.asarray(state, float)
    places = departures(model)
    sizes = departure_sizes(model, [place for place, _ in places], period)
    for _ in range(TRIES):
        gap = departure(model, x, moved(model, x, period), places)
        if np.abs(gap / sizes).max(initial=0.0) <= SHOT:
            return x
        Phi = monodromy(model, x, period, places, sizes) / sizes[:, None] * sizes
        step = np.linalg.lstsq(np.eye(len(sizes)) - Phi, gap / sizes, rcond=FREE)[0]
        x = displaced(model, x, step * sizes, places)
    raise ValueError(
        f"no motion of the period {period:.9g} s was found near the start; after {TRIES} steps of Newton's method "
        f"{np.abs(gap / sizes).max():.3g} of the usual sizes is left. Begin nearer to it, or check the period"
    )


def departures(model: Model) -> list[tuple[int, str]]:
    """Place and name of every departure: free coordinates (from 0), their rates (from n_u), states (from 2 n_u)."""
    free, n = np.flatnonzero(~is_prescribed(model)), model.n_u
    rates = [name for name, _ in model.system.velocity_names()]
    states = [name for name, _ in model.system.state_names()]
    own = [(int(k), rates[k].removesuffix("_rate").replace(".omega_", ".turn_")) for k in free]
    own += [(n + int(k), rates[k]) for k in free]
    return own + [(2 * n + k, states[k]) for k in effector_states(model.system)]


def departure_sizes(model: Model, places: list[int], period: float) -> Array:
    """Usual sizes of the departures (n,) [SI]: a rate moves its coordinate by its usual size in a period."""
    sizes = usual_sizes(model)
    return np.concatenate([sizes, sizes / period, model.system.state_sizes()])[places]


def displaced(model: Model, x: Array, by: Array, places: list[tuple[int, str]]) -> Array:
    """The state (n_x,) [SI] with departures (n,) from x."""
    n, full = model.n_u, np.zeros(2 * model.n_u + model.n_z)
    full[[place for place, _ in places]] = by
    q, u, z = model.parts(x)
    return np.concatenate([advanced(model, q, full[:n]), u + full[n : 2 * n], z + full[2 * n :]])


def departure(model: Model, x: Array, y: Array, places: list[tuple[int, str]]) -> Array:
    """Departures (n,) [SI] of the state y from x, to first order; angles modulo 2 pi, quaternions of either sign."""
    n = model.n_u
    (q, u, z), (p, v, w) = model.parts(x), model.parts(y)
    change = p - q
    for first in model.renormalise:
        four = slice(int(first), int(first) + 4)
        if p[four] @ q[four] < 0:
            change[four] = -p[four] - q[four]
    for k, (name, unit) in enumerate(model.system.coordinate_names()):
        if unit == "rad" and name:
            change[k] -= 2 * np.pi * np.round(change[k] / (2 * np.pi))
    h = 1e-6
    along = [(advanced(model, q, h * e) - advanced(model, q, -h * e)) / (2 * h) for e in np.eye(n)]
    increments = np.linalg.lstsq(np.column_stack(along), change, rcond=None)[0] if n else np.zeros(0)
    return np.concatenate([increments, v - u, w - z])[[place for place, _ in places]]


def moved(model: Model, x: Array, period: float) -> Array:
    """The state (n_x,) [SI] after a period."""
    from femflex.integrate import Dop853

    last = Dop853(rtol=RTOL).solve(model, np.array([0.0, period]), x)
    return np.asarray(last.states[-1])
