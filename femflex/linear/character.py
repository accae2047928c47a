"""Name and energies of a small motion: rigid motion of the craft, motion of a joint, or deformation of bodies.

Rigid motions of the craft are the wobble of a free spin (seen from inertial space: nutation) and librations in orbit.
Everything else is named by the bodies, looked at in slices along their longest direction (`body.slices`): flap is along
the spin axis, lag across it. Where nothing spins flap and lag are both bending, which has a direction. A slice may move
along the body though nothing is stretched, as a leg of a folded boom does: strain decides, where it is known, and the
word is lag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, BoolArray, ComplexArray
from femflex.body import FlexibleBody
from femflex.body.slices import DEFORMATIONS, direction_letters, points_of, slice_shares
from femflex.dynamics.model import Model
from femflex.dynamics.motion.freedoms import elastic_places, is_prescribed
from femflex.dynamics.motion.linear_stiffness import linear_stiffness
from femflex.linear.rigid_motions import LIBRATIONS, MOTIONS, TILT, WOBBLE, rigid_fields
from femflex.linear.small_motions import SmallMotions

LAG, STRETCH = DEFORMATIONS.index("lag"), DEFORMATIONS.index("stretch")
MEMBRANE = {"line": 1, "plate": 3}  # the first strains of a part, which stretch it
JOINT = "joint"
LEAST_SHARE = 1e-3  # share of a vibration's mass that must be seen to move; less is a turn about the line itself
DECISIVE_SHARE = 0.5  # share of the kinetic energy in rigid motions, or of the stiffness in strain, that decides


@dataclass(frozen=True, eq=False)
class MotionCharacter:
    """Words (n,) for n motions, their directions, and the share of the kinetic energy (n,) of each body by its name.

    directions (n,)  of bending where nothing spins, in axes of the root body ("z", "yz"); of a joint's motion its
                     coordinate ("hinge.angle"); else empty
    """

    words: tuple[str, ...]
    directions: tuple[str, ...]
    energy: dict[str, Array]


def motion_character(model: Model, motions: SmallMotions, axis: Array | None = None) -> MotionCharacter:
    """Return a description of each small motion; axis (3,) [1] is that of a spin, in base frame components."""
    kinetic = {
        name: motions.bodies[name].kinetic(model.system.bodies[name], motions.shapes) for name in model.system.order
    }
    total = np.maximum(np.sum(list(kinetic.values()), axis=0), 1e-300)
    elastic = np.zeros(model.n_u, bool)
    elastic[elastic_places(model)[1]] = True
    K = linear_stiffness(model)[0] * np.outer(elastic, elastic)
    strain = np.einsum("uk,uv,vk->k", motions.shapes.conj(), K, motions.shapes, optimize=True).real
    strained = strain >= DECISIVE_SHARE * np.abs(motions.eigenvalues) ** 2
    words, letters = _deformation_words(model, motions, axis, strained)
    free = np.flatnonzero(~is_prescribed(model) & ~elastic)
    _name_joints(motions, words, np.eye(model.n_u)[:, free], axis, strained)
    _name_rigid(model, motions, words)
    words = [state or word for state, word in zip(motions.owners, words, strict=True)]
    directions, names = [], model.system.velocity_names()
    for k, word in enumerate(words):
        if word == JOINT:
            effort = np.abs(motions.shapes[free, k]) ** 2 * np.diag(motions.M)[free]
            directions.append(names[free[int(np.argmax(effort))]][0].removesuffix("_rate"))
        else:
            directions.append(letters[k] if word == "bending" else "")
    energies = {name: energy / total for name, energy in kinetic.items()}
    return MotionCharacter(tuple(words), tuple(directions), energies)


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


def _deformation_words(
    model: Model, motions: SmallMotions, axis: Array | None, strained: BoolArray
) -> tuple[list[str], list[str]]:
    """Return the word for each motion by the motion of the bodies' slices, weighted by their mass, and its direction.

    Where strain is what resists (strained), the rigid bodies, which only go along, do not count.
    """
    total = np.zeros((motions.shapes.shape[1], len(DEFORMATIONS)))
    total_across = np.zeros((len(total), 3))
    C_FB = motions.bodies[model.system.root].attitude
    for name, body in model.system.bodies.items():
        points, moved = motions.bodies[name].points(*points_of(body), motions.shapes)
        shares, across = slice_shares(points @ C_FB, moved @ C_FB, axis if axis is None else C_FB.T @ axis)
        bends = ~_stretched(body, motions.bodies[name].shape @ motions.shapes)
        shares[bends, LAG] += shares[bends, STRETCH]
        shares[bends, STRETCH] = 0.0
        counted = body.moments.mass * (1.0 if body.n_modes else ~strained[:, None])
        total, total_across = total + counted * shares, total_across + counted * across
    total[total.sum(axis=1) < LEAST_SHARE, DEFORMATIONS.index("torsion")] += 1.0
    words = [DEFORMATIONS[k] for k in np.argmax(total, axis=1)]
    letters = [direction_letters(square) for square in total_across]
    if axis is not None:
        return words, letters
    bending = total[:, :2].sum(axis=1) >= total[:, 2:].max(axis=1)
    return ["bending" if flag else word for flag, word in zip(bending, words, strict=True)], letters


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
