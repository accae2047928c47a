"""What kind of motion a vibration is: flap, lag, stretch, torsion or chordwise bending of the bodies that move.

A body is looked at in slices along its longest direction. The mean motion of a slice is flap along the spin axis, lag
across it and stretch along the body; turning about the body's line is torsion, and what is left bends the slice.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody
from femflex.dynamics.equilibria.linearised import advanced, held_freedoms, usual_sizes
from femflex.dynamics.equilibria.vibration import Vibrations
from femflex.dynamics.model import Model
from femflex.rotations import dcm_from_quaternion

Array = NDArray[np.float64]

WORDS = ("flap", "lag", "stretch", "torsion", "chordwise")
SLICES = 16
MOST = 400  # points of a body that are looked at
STEP = 1e-4  # of a coordinate's usual size
ALONG = 0.9  # cosine between spin axis and body from which on it spins about its own line
MOVES = 1e-3  # share of a vibration's mass that must be seen to move; less is a turn about the line itself


def shares(model: Model, x: Array, vibration: Vibrations, axis: Array, names: tuple[str, ...]) -> Array:
    """Share of each of WORDS in the vibrations about the state x (n_x,): (n, 5), each row adding up to 1."""
    free = np.flatnonzero(~held_freedoms(model))
    assert len(free) == len(names)
    total = np.zeros((len(vibration.eigenvalues), len(WORDS)))
    for points, moved, mass in _moved_points(model, x, free):
        motion = np.einsum("pau,uk->kpa", moved, vibration.shapes)
        total += mass * _slice_shares(points, motion, axis / np.linalg.norm(axis))
    total[total.sum(axis=1) < MOVES, WORDS.index("torsion")] += 1.0
    return np.asarray(total / total.sum(axis=1, keepdims=True))


def _moved_points(model: Model, x: Array, free: NDArray[np.int64]) -> list[tuple[Array, Array, float]]:
    """Of each body its points (p, 3), how they move with the free coordinates (p, 3, n_free), and its mass [kg]."""
    q, sizes = x[: model.n_q], usual_sizes(model) * STEP
    steps = np.eye(model.n_u)[free] * sizes[:, None][free]
    rows = [q, *(advanced(model, q, s) for s in steps), *(advanced(model, q, -s) for s in steps)]
    states = np.array([np.concatenate([row, np.zeros(model.n_u)]) for row in rows])
    seen = model.observe(np.zeros(len(states)), states)
    out, n = [], len(free)
    for name in model.system.order:
        body = model.system.bodies[name]
        rest, shapes = points_of(body)
        C = dcm_from_quaternion(seen[f"bodies/{name}/attitude"])
        own = rest + np.einsum("spa,ts->tpa", shapes, seen[f"bodies/{name}/delta"])
        places = seen[f"bodies/{name}/position"][:, None, :] + np.einsum("tab,tpb->tpa", C, own)
        slope = (places[1 : 1 + n] - places[1 + n :]) / (2 * sizes[free])[:, None, None]
        out.append((places[0], np.moveaxis(slope, 0, 2), body.moments.mass))
    return out


def points_of(body: FlexibleBody) -> tuple[Array, Array]:
    """Points (p, 3) of a body and how its shapes move them (n_shapes, p, 3).

    Six points of the same inertia for a rigid body; some of the skin of a flexible one, or its markers.
    """
    if not body.n_shapes:
        return _inertia_points(body), np.zeros((0, 6, 3))
    if body.skin is not None and len(body.skin.points):
        some = slice(None, None, max(1, len(body.skin.points) // MOST))
        return body.skin.points[some], body.skin.shapes[:, some]
    markers = list(body.markers.values())
    return np.stack([m.position for m in markers]), np.stack([m.phi.T for m in markers], axis=1)


def _inertia_points(body: FlexibleBody) -> Array:
    """Six points (6, 3) of a sixth of a rigid body's mass each that have its inertia."""
    centre = body.moments.center_of_mass()
    spread = body.moments.second[0, :, 0, :] / body.moments.mass - np.outer(centre, centre)
    square, axes = np.linalg.eigh(spread)
    arms = (np.sqrt(3.0 * np.maximum(square, 0.0)) * axes).T
    return np.concatenate([centre + arms, centre - arms])


def _slice_shares(points: Array, motion: NDArray[np.complex128], axis: Array) -> Array:
    """Mean square (n, 5) of the motion (n, p, 3) of a body's points in each of the ways."""
    centred = points - points.mean(axis=0)
    line = np.linalg.svd(centred, full_matrices=False)[2][0] if len(points) > 1 else np.eye(3)[0]
    if len(points) == 1 or not np.abs(centred).max() > 0:  # a point has no line: what is not flap is lag
        line = np.zeros(3)
    flap = axis - line * (line @ axis)
    flap = np.zeros(3) if np.linalg.norm(flap) < np.sqrt(1 - ALONG**2) else flap / np.linalg.norm(flap)
    place = centred @ line
    width = np.ptp(place) or 1.0
    index = np.minimum((SLICES * (place - place.min()) / width).astype(int), SLICES - 1)
    out = np.zeros((len(motion), len(WORDS)))
    for k in np.unique(index):
        here = index == k
        u, arm = motion[:, here], centred[here] - centred[here].mean(axis=0)
        arm = arm - np.outer(arm @ line, line)
        out += here.sum() * np.stack(_ways(u, arm, line, flap), axis=1)
    return out / len(points)


def _ways(u: NDArray[np.complex128], arm: Array, line: Array, flap: Array) -> list[Array]:
    """Mean square (n,) of the motion u (n, p, 3) of one slice: WORDS in turn."""
    mean = u.mean(axis=1)
    size = np.sum(np.abs(mean) ** 2, axis=1)
    up, along = np.abs(mean @ flap) ** 2, np.abs(mean @ line) ** 2
    turn = np.cross(line, arm)
    inertia = float(np.sum(turn**2))
    theta = np.einsum("npa,pa->n", u, turn) / inertia if inertia > 0 else np.zeros(len(u))
    left = u - mean[:, None] - theta[:, None, None] * turn
    left = left - np.einsum("npa,a->np", left, line)[:, :, None] * line  # turned slices of a bent body
    twisted = np.abs(theta) ** 2 * inertia / len(arm)
    return [up, size - up - along, along, twisted, np.sum(np.abs(left) ** 2, axis=(1, 2)) / len(arm)]
