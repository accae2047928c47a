"""Bodies cut into segments, drawn as one: every segment as a deformation of the undeformed complete body.

A point p of a segment at (r, C) with displacement S delta is, relative to the complete body, at d + C (p + S delta).
This is linear in d, C - 1 and C delta, which are used as amplitudes of extended shapes. A bent boom is thus coloured
and magnified by its displacement from the straight one, not by the deformation inside each segment.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable

import numpy as np

from femflex.arrays import Array
from femflex.body import Skin
from femflex.results import Run


def segmented_body_of(name: str, names: Collection[str]) -> str | None:
    """Name of the body of which `name` is a segment ("boom" of "boom.3"), None when it is none."""
    stem, dot, number = name.rpartition(".")
    return stem if dot and number.isdigit() and stem in names else None


def body_of_marker(marker: str, names: Iterable[str]) -> str:
    """Name of the body of a marker "body.marker", of these names; only its segments share that beginning."""
    return min((name for name in names if marker.startswith(f"{name}.")), key=len)


def body_names(run: Run) -> set[str]:
    """Names of the bodies of a run, and of their segments."""
    return {path.split("/")[1] for path in run if path.startswith("bodies/") and path.endswith("/position")}


def segmented_bodies(run: Run) -> set[str]:
    """Names of the bodies of a run that are cut into segments."""
    names = body_names(run)
    return {body for name in names if (body := segmented_body_of(name, names)) is not None}


def cables(run: Run) -> dict[str, list[str]]:
    """Cables with mass of a run, each with the names of its point masses in order."""
    names, found = body_names(run), {}
    for path in run:
        if path.startswith("effectors/") and path.endswith("/tension_end"):
            stem = path.split("/")[1]
            found[stem] = list(itertools.takewhile(names.__contains__, (f"{stem}_{k}" for k in itertools.count(1))))
    return {stem: masses for stem, masses in found.items() if len(masses) > 1}


def line_of_masses(points: Array, others: Array) -> Array:
    """Points (n + 2, 3) [m] of a cable whose masses (n, 3) are in the middles of equal parts, with its two ends.

    An end is at the nearest of other bodies (m, 3) within the distance of two masses, else half of it beyond the last.
    """
    ends = []
    for last, before in ((points[0], points[1]), (points[-1], points[-2])):
        apart = np.linalg.norm(others - last, axis=1)
        near = len(others) and apart.min() < np.linalg.norm(last - before)
        ends.append(others[np.argmin(apart)] if near else 1.5 * last - 0.5 * before)
    return np.concatenate([[ends[0]], points, [ends[1]]])


def extended_skin(skin: Skin) -> Skin:
    """The skin with shapes for d (3), C - 1 (3 x 3) and C delta (n x 3 x 3) in place of its own n."""
    n_points = len(skin.points)
    axes = np.broadcast_to(np.eye(3)[:, None], (3, n_points, 3))
    rotation_shapes = np.einsum("ac,pb->abpc", np.eye(3), skin.points).reshape(9, n_points, 3)
    deformation_shapes = np.einsum("ac,kpb->kabpc", np.eye(3), skin.shapes).reshape(-1, n_points, 3)
    return Skin(skin.points, skin.cells, np.concatenate([axes, rotation_shapes, deformation_shapes]))


def extended_coordinates(position: Array, attitude: Array, delta: Array, body_pose: tuple[Array, Array]) -> Array:
    """Coordinates [m, 1, kg^1/2 m] (n_t, 12 + 9 n) of the extended shapes of a segment, from its pose, delta and the
    pose of the complete body."""
    r, C = body_pose
    relative = np.einsum("tji,tjk->tik", C, attitude)
    d = np.einsum("tji,tj->ti", C, position - r)
    products = np.einsum("tab,tk->tkab", relative, delta)
    count = len(position)
    turn = (relative - np.eye(3)).reshape(count, 9)
    return np.concatenate([d, turn, products.reshape(count, 9 * delta.shape[1])], axis=1)


def skin_with_growth(skin: Skin) -> Skin:
    """The skin with its growth as the last shape; itself where it does not grow."""
    if skin.growth is None:
        return skin
    return Skin(skin.points, skin.cells, np.concatenate([skin.shapes, skin.growth[None]]), skin.growth)


def deploying_bodies(run: Run, names: list[str]) -> list[str]:
    """The bodies of a run that deploy."""
    return [name for name in names if f"bodies/{name}/length" in run]


def amplitudes_with_growth(run: Run, name: str, length: Array, delta: Array, scale: float) -> Array:
    """Amplitudes (n_t, n + 1) [kg^1/2 m] of the shapes of a skin with growth at lengths (n_t,), before
    magnification."""
    ratio = length / float(run[f"bodies/{name}/length"][0])
    follows = np.array([kind == "derivative" for kind in run.bodies()[name].kinds], np.bool_)
    delta = np.where(follows, delta / ratio[:, None], delta)
    return np.concatenate([delta, ((ratio - 1.0) / scale)[:, None]], axis=1)


def lengths_line(lengths: dict[str, float]) -> str:
    """The deployed lengths of bodies as a line below the clock; nothing where none deploys."""
    if not lengths:
        return ""
    shortest, longest = (f"{value:.4g}" for value in (min(lengths.values()), max(lengths.values())))
    members = ", ".join(lengths) if len(lengths) < 3 else f"{len(lengths)} members"
    return f"\n{members}: {shortest} m" if shortest == longest else f"\n{members}: {shortest} to {longest} m"
