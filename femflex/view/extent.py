"""Extent of a run: the points that determine the framing, and the largest elastic displacement."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body import Skin
from femflex.results import Run, RunBody
from femflex.view.motion import Motion, motion
from femflex.view.segments import skin_with_growth
from femflex.view.units import round_below

DIRECTIONS = 64
MOST_ROWS = 2000  # rows of a run that are examined
VISIBLE = 0.08  # of the size: the displacement that an automatic scale aims at
MOST_MAGNIFIED = 1000.0  # smaller displacements are left to their colours


def outer_points(skin: Skin) -> IntArray:
    """Numbers (k,) of the points that reach furthest in many directions, undeformed and in every shape."""
    golden = np.pi * (3 - np.sqrt(5)) * np.arange(DIRECTIONS)
    height = np.linspace(-1, 1, DIRECTIONS)
    level = np.sqrt(1 - height**2)
    sphere = np.stack([level * np.cos(golden), level * np.sin(golden), height])
    indices = [np.argmax(skin.points @ sphere, axis=0)]
    indices += [np.argmax(np.abs(shape), axis=0) for shape in skin.shapes]
    stride = max(1, len(skin.points) // 100)
    return np.unique(np.concatenate([*indices, np.arange(0, len(skin.points), stride)]))


def outer_skins(skins: dict[str, Skin]) -> dict[str, Skin]:
    """The skins with only their outer points, and without cells."""
    numbers = {name: outer_points(skin) for name, skin in skins.items()}
    return {name: Skin(skin.points[numbers[name]], {}, skin.shapes[:, numbers[name]]) for name, skin in skins.items()}


def some_rows(run: Run) -> IntArray:
    """Numbers (k,) of rows spread over the run, all of them in a short one."""
    return np.unique(np.linspace(0, len(run) - 1, min(len(run), MOST_ROWS)).round().astype(np.int64))


def displacement(run: Run, skins: dict[str, Skin]) -> tuple[Array, Array]:
    """Instants (k,) spread over the run, and the largest elastic displacement of thinned skins at each [m]."""
    rows = some_rows(run)
    largest = np.zeros(len(rows))
    moving = motion(run, run.time[rows])
    deltas = moving.delta
    for name in moving.lengths:
        deltas[name][:, -1] = 0.0  # growth is no displacement
    for name, skin in skins.items():
        if name in deltas and len(skin.shapes):
            n = len(skin.shapes)
            displacements = (deltas[name] @ skin.shapes.reshape(n, -1)).reshape(len(rows), -1, 3)
            largest = np.maximum(largest, np.linalg.norm(displacements, axis=2).max(axis=1))
    return run.time[rows], largest


def cloud(motion: Motion, skins: dict[str, Skin], scale: float, arms: dict[str, Array], sight: float = 0.0) -> Array:
    """Points (n_t, n, 3) that thinned skins, axes and sights of such lengths, and traces reach at each instant [m]."""
    clouds = []
    for name, r in motion.position.items():
        C = motion.attitude[name]
        local = np.broadcast_to(
            np.concatenate([np.zeros((1, 3)), np.diag(arms.get(name, np.zeros(3)))]), (len(r), 4, 3)
        )
        if name in skins:
            skin, n = skins[name], len(skins[name].shapes)
            displacements = (
                (motion.delta[name] @ skin.shapes.reshape(n, -1)).reshape(len(r), -1, 3) if n else np.zeros((1, 1, 3))
            )
            local = np.concatenate([local, skin.points + scale * displacements + np.zeros((len(r), 1, 1))], axis=1)
        clouds.append(r[:, None] + np.einsum("tij,tpj->tpi", C, local))
    ends = [start + sight * direction for start, direction in motion.sights.values()]
    return np.concatenate([*clouds, *(line[:, None] for line in (*motion.traces.values(), *ends))], axis=1)


def largest_shift(motion: Motion, skins: dict[str, Skin], k: int) -> Array:
    """The largest elastic displacement (3,) [m] of a point at instant k, in the camera's frame."""
    largest = np.zeros(3)
    for name, skin in skins.items():
        delta = motion.delta.get(name)
        if delta is None or delta.shape[1] != len(skin.shapes) or not len(skin.shapes):
            continue
        shifts = np.einsum("s,spa->pa", delta[k], skin.shapes)
        shift = shifts[np.argmax(np.linalg.norm(shifts, axis=1))]
        if np.linalg.norm(shift) > np.linalg.norm(largest):
            largest = motion.attitude[name][k] @ shift
    return largest


def automatic_scale(largest: float, size: float) -> float:
    """A round magnification, 1 to 1000, that shows a displacement [m] on a craft of that size [m]."""
    if not largest > 0:
        return 1.0
    return min(max(1.0, round_below(VISIBLE * size / largest)), MOST_MAGNIFIED)


def skins_of(bodies: dict[str, RunBody]) -> dict[str, Skin]:
    """The skins of the bodies that have one.

    Raises ValueError when none has.
    """
    skins = {name: skin_with_growth(body.skin) for name, body in bodies.items() if body.skin is not None}
    if not skins:
        raise ValueError(f"no body of the run can be drawn: {sorted(bodies)} have no skin; give one of them a shape")
    return skins
