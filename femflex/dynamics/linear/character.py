"""Name and energies of a small motion: rigid motion of the craft, motion of a joint, or deformation of bodies.

Rigid motions of the craft are the wobble of a free spin (seen from inertial space: nutation) and librations in orbit.
Everything else is named by the bodies, looked at in slices along their longest direction. The mean motion of a slice is
flap along the spin axis, lag across it and stretch along the body; turning about the body's line is torsion, and what
is left bends the slice (chordwise). Where nothing spins flap and lag are both bending. A slice may move along the body
though nothing is stretched, as a leg of a folded boom does: strain decides, where it is known, and the word is lag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, BoolArray, ComplexArray
from femflex.body import FlexibleBody
from femflex.dynamics.linear.equations import linear_stiffness
from femflex.dynamics.linear.freedoms import elastic_places, is_prescribed
from femflex.dynamics.linear.rigid_motions import LIBRATIONS, MOTIONS, TILT, WOBBLE, rigid_fields
from femflex.dynamics.linear.small_motions import SmallMotions
from femflex.dynamics.model import Model

DEFORMATIONS = ("flap", "lag", "stretch", "torsion", "chordwise")
LAG, STRETCH = DEFORMATIONS.index("lag"), DEFORMATIONS.index("stretch")
MEMBRANE = {"line": 1, "plate": 3}  # the first strains of a part, which stretch it
JOINT = "joint"
SLICES = 16
MAX_POINTS = 400  # points of a body that are looked at
PARALLEL = 0.9  # cosine between spin axis and body from which on it spins about its own line
LEAST_SHARE = 1e-3  # share of a vibration's mass that must be seen to move; less is a turn about the line itself
DECISIVE_SHARE = 0.5  # share of the kinetic energy in rigid motions, or of the stiffness in strain, that decides


@dataclass(frozen=True, eq=False)
class MotionCharacter:
    """Words (n,) for n motions, and the share of the kinetic energy (n,) of each body in each of them, by name."""

    words: tuple[str, ...]
    energy: dict[str, Array]


def motion_character(model: Model, motions: SmallMotions, axis: Array | None = None) -> MotionCharacter:
    """Return a description of each small motion; axis (3,) is that of a spin, in base frame components."""
    kinetic = {
        name: motions.bodies[name].kinetic(model.system.bodies[name], motions.shapes) for name in model.system.order
    }
    total = np.maximum(np.sum(list(kinetic.values()), axis=0), 1e-300)
    elastic = np.zeros(model.n_u, bool)
    elastic[elastic_places(model)[1]] = True
    K = linear_stiffness(model)[0] * np.outer(elastic, elastic)
    strain = np.einsum("uk,uv,vk->k", motions.shapes.conj(), K, motions.shapes, optimize=True).real
    strained = strain >= DECISIVE_SHARE * np.abs(motions.eigenvalues) ** 2
    words = _deformation_words(model, motions, axis, strained)
    _name_joints(motions, words, np.eye(model.n_u)[:, ~is_prescribed(model) & ~elastic], axis, strained)
    _name_rigid(model, motions, words)
    words = [state or word for state, word in zip(motions.owners, words, strict=True)]
    return MotionCharacter(tuple(words), {name: energy / total for name, energy in kinetic.items()})


def numbered_names(words: Sequence[str]) -> tuple[str, ...]:
    """Return names with their number among equal ones, "flap 1"; a single rigid motion has no number."""
    counts: dict[str, int] = {}
    out = []
    for word in words:
        counts[word] = counts.get(word, 0) + 1
        unnumbered = words.count(word) == 1 and (
            word in (WOBBLE, *LIBRATIONS, *MOTIONS) or "." in word
        )  # a state has a point
        out.append(word if unnumbered else f"{word} {counts[word]}")
    return tuple(out)


def _deformation_words(model: Model, motions: SmallMotions, axis: Array | None, strained: BoolArray) -> list[str]:
    """Return the word for each motion by the motion of the bodies' slices, weighted by their mass.

    Where strain is what resists (strained), the rigid bodies, which only go along, do not count.
    """
    total = np.zeros((motions.shapes.shape[1], len(DEFORMATIONS)))
    for name, body in model.system.bodies.items():
        shares = _slice_shares(*motions.bodies[name].points(*points_of(body), motions.shapes), axis)
        bends = ~_stretched(body, motions.bodies[name].shape @ motions.shapes)
        shares[bends, LAG] += shares[bends, STRETCH]
        shares[bends, STRETCH] = 0.0
        total += body.moments.mass * shares * (1.0 if body.n_modes else ~strained[:, None])
    total[total.sum(axis=1) < LEAST_SHARE, DEFORMATIONS.index("torsion")] += 1.0
    words = [DEFORMATIONS[k] for k in np.argmax(total, axis=1)]
    if axis is not None:
        return words
    bending = total[:, :2].sum(axis=1) >= total[:, 2:].max(axis=1)
    return ["bending" if flag else word for flag, word in zip(bending, words, strict=True)]


def _stretched(body: FlexibleBody, shapes: ComplexArray) -> BoolArray:
    """(n,) whether most of the linear strain energy of beams and plates stretches them, for amplitudes (n_shapes, n).

    True where a body has no strain at points, or other members.
    """
    parts, n = body.strain_field, shapes.shape[1]
    if not parts or any(part.kind not in MEMBRANE or part.rows.shape[2] != len(shapes) for part in parts):
        return np.ones(n, bool)
    stretch, total = np.zeros(n), np.zeros(n)
    for part in parts:
        eps = np.einsum("sg,pgm,mn->psn", part.linear, part.rows, shapes, optimize=True)
        stress = part.elastic @ eps * part.weight[:, None, None]
        work = (eps.conj() * stress).real
        stretch += work[:, : MEMBRANE[part.kind]].sum(axis=(0, 1))
        total += work.sum(axis=(0, 1))
    return np.asarray(stretch >= DECISIVE_SHARE * total)


def _name_joints(motions: SmallMotions, words: list[str], J: Array, axis: Array | None, strained: BoolArray) -> None:
    """Call motions of joints, of coordinates J (n_u, m), so where nothing spins; in a spin they flap and lag."""
    if axis is not None or not J.shape[1]:
        return
    for k in np.flatnonzero((_share_within(J, motions) >= DECISIVE_SHARE) & ~strained):
        words[k] = JOINT


def _name_rigid(model: Model, motions: SmallMotions, words: list[str]) -> None:
    """Name the motion that mostly turns the free spinning craft wobble, and those in orbit librations."""
    free = any(motion.name == TILT for motion in motions.known)
    in_orbit = model.system.frame.kind == "orbital" and model.system.orbit is not None
    fields, exist = rigid_fields(model, motions.bodies, np.eye(3))
    if words and not (free or in_orbit):
        _name_craft_motions(motions, words, fields, exist)
    if not words or not (free or in_orbit) or not exist[3:].all():
        return
    rigid = _share_within(fields[:, exist], motions)
    if free:
        wobble = int(np.argmax(rigid))
        words[wobble] = WOBBLE if rigid[wobble] >= DECISIVE_SHARE else words[wobble]
        return
    P = fields[:, 3:]
    inertia = P.T @ motions.M @ P
    turns = np.abs(np.linalg.solve(inertia, P.T @ motions.M @ motions.shapes)) ** 2 * np.diag(inertia)[:, None]
    for k in np.flatnonzero(rigid >= DECISIVE_SHARE):
        words[k] = LIBRATIONS[int(np.argmax(turns[:, k]))]


def _name_craft_motions(motions: SmallMotions, words: list[str], fields: Array, exist: BoolArray) -> None:
    """Call motions of the whole craft by the rigid motion that is most of them.

    Effectors with states resist them, or wheels turn them about (nutation of a craft that is free to turn).
    """
    if not (exist.all() or (motions.driven and exist.any())):
        return
    shares = np.array(
        [_share_within(fields[:, [k]], motions) if exist[k] else 0 * motions.eigenvalues.real for k in range(6)]
    )
    for k in np.flatnonzero(_share_within(fields[:, exist], motions) >= DECISIVE_SHARE):
        words[k] = MOTIONS[int(np.argmax(shares[:, k]))]


def _share_within(fields: Array, motions: SmallMotions) -> Array:
    """Share (n,) of the kinetic energy of each motion that lies within fields (n_u, m)."""
    projections = fields.T @ motions.M @ motions.shapes
    amplitudes = np.linalg.lstsq(fields.T @ motions.M @ fields, projections, rcond=None)[0]
    return np.asarray(np.einsum("mk,mk->k", projections.conj(), amplitudes).real)


def points_of(body: FlexibleBody) -> tuple[Array, Array]:
    """Return points (p, 3) of a body and their motion by its shapes (n_shapes, p, 3).

    Six points of the same inertia for a rigid body; some of the skin of a flexible one, or its markers.
    """
    if not body.n_shapes:
        return _inertia_points(body), np.zeros((0, 6, 3))
    if body.skin is not None and len(body.skin.points):
        chosen = slice(None, None, max(1, len(body.skin.points) // MAX_POINTS))
        return body.skin.points[chosen], body.skin.shapes[:, chosen]
    markers = list(body.markers.values())
    return np.stack([m.position for m in markers]), np.stack([m.phi.T for m in markers], axis=1)


def _inertia_points(body: FlexibleBody) -> Array:
    """Six points (6, 3) of a sixth of a rigid body's mass each that have its inertia."""
    centre = body.moments.center_of_mass()
    covariance = body.moments.second[0, :, 0, :] / body.moments.mass - np.outer(centre, centre)
    square, axes = np.linalg.eigh(covariance)
    arms = (np.sqrt(3.0 * np.maximum(square, 0.0)) * axes).T
    return np.concatenate([centre + arms, centre - arms])


def _slice_shares(points: Array, motion: ComplexArray, axis: Array | None) -> Array:
    """Mean square (n, 5) of the motion (n, p, 3) of a body's points in each of the ways."""
    centred = points - points.mean(axis=0)
    line = np.linalg.svd(centred, full_matrices=False)[2][0] if len(points) > 1 else np.eye(3)[0]
    if len(points) == 1 or not np.abs(centred).max() > 0:  # a point has no line: what is not flap is lag
        line = np.zeros(3)
    axis = np.eye(3)[int(np.argmin(np.abs(line)))] if axis is None else axis / np.linalg.norm(axis)
    flap = axis - line * (line @ axis)
    flap = np.zeros(3) if np.linalg.norm(flap) < np.sqrt(1 - PARALLEL**2) else flap / np.linalg.norm(flap)
    coordinate = centred @ line
    width = np.ptp(coordinate) or 1.0
    index = np.minimum((SLICES * (coordinate - coordinate.min()) / width).astype(int), SLICES - 1)
    out = np.zeros((len(motion), len(DEFORMATIONS)))
    for k in np.unique(index):
        inside = index == k
        u, arm = motion[:, inside], centred[inside] - centred[inside].mean(axis=0)
        arm = arm - np.outer(arm @ line, line)
        out += inside.sum() * np.stack(_mean_squares(u, arm, line, flap), axis=1)
    return out / len(points)


def _mean_squares(u: ComplexArray, arm: Array, line: Array, flap: Array) -> list[Array]:
    """Mean square (n,) of the motion u (n, p, 3) of one slice: WAYS in turn."""
    mean = u.mean(axis=1)
    size = np.sum(np.abs(mean) ** 2, axis=1)
    along_flap, along_line = np.abs(mean @ flap) ** 2, np.abs(mean @ line) ** 2
    turn = np.cross(line, arm)
    inertia = float(np.sum(turn**2))
    theta = np.einsum("npa,pa->n", u, turn) / inertia if inertia > 0 else np.zeros(len(u))
    remaining = u - mean[:, None] - theta[:, None, None] * turn
    remaining = remaining - np.einsum("npa,a->np", remaining, line)[:, :, None] * line  # turned slices of a bent body
    twisted = np.abs(theta) ** 2 * inertia / len(arm)
    return [
        along_flap,
        size - along_flap - along_line,
        along_line,
        twisted,
        np.sum(np.abs(remaining) ** 2, axis=(1, 2)) / len(arm),
    ]
