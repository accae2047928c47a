"""Freedoms of a system: which are free, how far they move, and how loops tie them together.

Loops are g(q) = 0 with dg = A dxi. Rows of A may depend on each other, as those of a flat linkage do in space; `slack`
is the part of the largest below which a row does (`slack_of_loops`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, BoolArray, IntArray
from femflex.body import FlexibleBody
from femflex.dynamics.joints.places import body_places, latch_places
from femflex.dynamics.layout.constraints import dependence_limit
from femflex.system import System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

DEPENDENT = 1e-9  # of the largest, below which a row of A follows from others
SINGULAR_MASS = 1e-13  # smallest eigenvalue of the mass matrix with unit diagonal
SAME_MOTION = 1e-10  # part of its own mass that is left to a coordinate once those before it are eliminated
SHARE = 1e-3  # of the largest part in a dependence, below which a coordinate is not named


def freedom_names(system: System) -> list[str]:
    """Names (n_u,) of the freedoms, those of their rates without the ending."""
    return [name.removesuffix("_rate") for name, _ in system.velocity_names()]


def is_prescribed(model: Model, x: Array | None = None) -> BoolArray:
    """Return (n_u,) whether each freedom is prescribed or locked, also by a rigid latch in the state x.

    x: (n_x,), the initial state when left out
    """
    prescribed = np.zeros(model.n_u, bool)
    prescribed[[place.u + k for place in body_places(model.system) for k in place.joint.prescribed]] = True
    z = model.parts(model.x0 if x is None else x)[2]
    prescribed[[latch.u for latch in latch_places(model.system) if latch.latch.rigid and z[latch.time] >= 0.0]] = True
    return prescribed


def elastic_places(model: Model) -> tuple[IntArray, IntArray]:
    """Places in q and in u of the elastic coordinates of all bodies."""
    places = list(body_places(model.system))
    return np.concatenate([p.shapes_q for p in places]), np.concatenate([p.shapes_u for p in places])


def usual_sizes(model: Model) -> Array:
    """Size (n_u,) of a large motion of each coordinate: a radian, the craft's length, or shapes that bend as far."""
    system = model.system
    spans = {name: span_of(system.bodies[name]) for name in system.order}
    longest = max(spans.values())
    sizes = np.ones(model.n_u)
    for place in body_places(system):
        name, body = place.name, place.body
        sizes[place.u : place.u + len(place.joint.translations)] = longest
        for k, at in enumerate(place.shapes_u):
            reach = max(float(np.linalg.norm(marker.phi[:, k])) for marker in body.markers.values()) / spans[name]
            turn = max(float(np.linalg.norm(marker.psi[:, k])) for marker in body.markers.values())
            if body.skin is not None and len(body.skin.points):
                reach = max(reach, float(body.skin.max_displacement[k]) / spans[name])
            # of a shape that moves no marker, of a body undrawn
            fallback = 1.0 / (spans[name] * np.sqrt(body.moments.mass))
            sizes[at] = 1.0 / (max(reach, turn) or fallback)
    return sizes


def span_of(body: FlexibleBody) -> float:
    """Extent of a body [m], 1 where it has none."""
    points = np.stack([marker.position for marker in body.markers.values()])
    if body.skin is not None and len(body.skin.points):
        points = np.concatenate([points, body.skin.points])
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0


def frame_rate(system: System) -> float:
    """Rate of the base frame [rad/s]: of its spin, or of the orbit."""
    frame, orbit = system.frame, system.orbit
    if frame.kind == "spinning":
        return float(np.linalg.norm(frame.rate))
    return orbit.mean_motion if orbit is not None and frame.kind == "orbital" else 0.0


def free_directions(model: Model, t: float, x: Array) -> tuple[IntArray, Array]:
    """Return the free freedoms (m,), neither prescribed nor following through loops, and the motion of all (n_u, m)."""
    free = np.flatnonzero(~is_prescribed(model, x))
    Z = np.eye(model.n_u)[:, free]
    if model.constraints is None:
        return free, Z
    independent, following = independent_coordinates(
        model.constraints.matrix(t, x)[:, free], usual_sizes(model)[free], slack_of_loops(model.system)
    )
    return free[independent], Z @ following


def independent_coordinates(A: Array, sizes: Array, slack: float) -> tuple[IntArray, Array]:
    """Freedoms that the others follow, and Z (n, m) of dxi = Z dxi_independent with A Z = 0.

    Those that A (n_rows, n) moves most, measured in usual sizes (n,), are made to follow.
    """
    from scipy.linalg import qr

    scaled = A * sizes
    R, order = qr(scaled, mode="r", pivoting=True)
    pivots = np.abs(np.diag(R))
    rank = int((pivots > slack * pivots.max(initial=0.0)).sum())
    dependent, independent = order[:rank], np.sort(order[rank:]).astype(np.int64)
    Z = np.zeros((len(sizes), len(independent)))
    Z[independent, np.arange(len(independent))] = 1.0
    Z[dependent] = -np.linalg.lstsq(scaled[:, dependent], scaled[:, independent], rcond=None)[0]
    return independent, sizes[:, None] * Z / sizes[independent]


def closing_directions(A: Array, slack: float) -> Array:
    """Orthonormal directions (n, m) along which A (n_rows, n) keeps every loop closed."""
    _, sigma, Vt = np.linalg.svd(A)
    rank = int((sigma > slack * sigma.max(initial=0.0)).sum())
    return np.ascontiguousarray(Vt[rank:].T)


def least_multipliers(A: Array, force: Array, slack: float) -> Array:
    """Return the smallest multipliers (n_rows,) with A^T lambda nearest to a generalised force (n,)."""
    return np.asarray(np.linalg.lstsq(A.T, force, rcond=slack)[0], float)


def slack_of_loops(system: System) -> float:
    """The part of the largest below which a row of A follows from others."""
    return dependence_limit(system, DEPENDENT)


def refuse_rolling(system: System, what: str) -> None:
    """Raise ValueError when nonholonomic constraints act on the system: they leave no set of positions to search."""
    if system.constraints:
        raise ValueError(
            f"{', '.join(repr(c.name) for c in system.constraints)}: nonholonomic constraints restrict velocities and "
            f"not positions, so {what} cannot be found with them; leave them out, or let a damped run "
            "come to rest"
        )


def refuse_singular_mass(model: Model, M: Array | None = None) -> None:
    """Raise ValueError where coordinates of a model describe the same motion at the start, with names and remedy.

    M: its mass matrix (n_u, n_u) there, where it is known
    """
    free = np.flatnonzero(~is_prescribed(model))
    if not free.size:
        return
    M = (model.mass_matrix(0.0, model.x0) if M is None else M)[np.ix_(free, free)]
    diagonal = np.diag(M)
    if not (np.isfinite(M).all() and (diagonal > 0.0).all()):
        return  # the run itself says what is wrong
    size = 1.0 / np.sqrt(diagonal)
    scaled = size[:, None] * (M + M.T) / 2.0 * size
    if np.linalg.eigvalsh(scaled)[0] > SINGULAR_MASS:
        return
    for k in range(1, len(free)):
        parts = np.linalg.lstsq(scaled[:k, :k], scaled[:k, k], rcond=None)[0]
        if 1.0 - scaled[k, :k] @ parts < SAME_MOTION:
            raise ValueError(
                _sentence(model, int(free[k]), free[:k][np.abs(parts) > SHARE * np.abs(parts).max()].tolist())
            )


def _sentence(model: Model, k: int, related: list[int]) -> str:
    """The sentence on coordinate k, which only moves as these others together do."""
    names = freedom_names(model.system)
    bodies = [p.name for p in body_places(model.system) for _ in range(p.joint.n_u + p.body.n_modes)]
    listed = ", ".join(names[i] for i in related)
    body_names = " and ".join(dict.fromkeys(repr(bodies[i]) for i in (*related, k)))
    return (
        f"the mass matrix is singular at the start: coordinate {names[k]} describes the same motion as {listed} (of "
        f"{body_names}), so its acceleration is not determined. Leave one of them out: lock that motion of the joint, "
        "choose a joint with fewer free motions, or take fewer shapes (of a deploying tether, functions.straight = "
        "false)"
    )
