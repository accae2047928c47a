"""The drawn bodies of a run with their whole motion, as glTF files and reports show them.

A body is a surface whose points move linearly with its amplitudes, on an axis system that moves and turns. That is the
displacement of the formulation itself: what bending shortens is among the shapes where the strain form has it. Between
two instants positions and amplitudes are linear, and rotations uniform about one axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body import Skin
from femflex.results import Run
from femflex.rotations import dcm_from_quaternion
from femflex.view.extent import automatic_scale, displacement, outer_skins, skins_of
from femflex.view.motion import camera_axes, chosen_camera
from femflex.view.segments import amplitudes_with_growth, extended_skin, segmented_bodies, segmented_body_of
from femflex.view.surface import Surface, surface_of

SAMPLED = 300  # points of a body at which the error between instants is measured
ROUNDING = 1e-7  # of the craft's size: shapes that never move a point further are left out


@dataclass(frozen=True, eq=False)
class MovingBody:
    """A body and its motion at n_t instants, in the axes of the camera.

    skin        its drawn points and cells, with its shapes

    position    (n_t, 3) of its origin [m]
    quaternion  (n_t, 4) scalar first, of the rotation from body axes; signs are continuous
    amplitudes  (n_t, n) of the shapes of its skin; of a body that grows the last one is that of its length
    kept        (k,) shapes that move a point by more than rounding, which are those of its surface
    """

    name: str
    skin: Skin
    position: Array
    quaternion: Array
    amplitudes: Array
    kept: IntArray

    @cached_property
    def surface(self) -> Surface:
        """Faces and edges, oriented, with the shapes that are kept."""
        return surface_of(self.skin).with_shapes(self.kept)

    @property
    def weights(self) -> Array:
        """Amplitudes (n_t, k) [kg^1/2 m] of the shapes that are kept."""
        return self.amplitudes[:, self.kept]

    def points(self, k: int) -> Array:
        """Points (n_p, 3) of the skin at instant k, axes of the camera [m]."""
        local = self.skin.points + np.tensordot(self.weights[k], self.skin.shapes[self.kept], 1)
        return self.position[k] + local @ dcm_from_quaternion(self.quaternion[k] / np.linalg.norm(self.quaternion[k])).T

    def error_between(self) -> float:
        """Estimate of the largest error of a point half way between two instants [m], from second differences."""
        if len(self.position) < 3 or not len(self.skin.points):
            return 0.0
        chosen = np.unique(np.linspace(0, len(self.skin.points) - 1, SAMPLED).round().astype(np.int64))
        x = np.tensordot(self.weights, self.skin.shapes[self.kept][:, chosen], 1) + self.skin.points[chosen]
        bend = np.linalg.norm(second_differences(x), axis=-1).max(initial=0.0)
        travel = np.linalg.norm(second_differences(self.position), axis=-1).max(initial=0.0)
        reach = np.linalg.norm(x, axis=-1).max(initial=0.0)
        turn = 2.0 * np.linalg.norm(second_differences(rotation_steps(self.quaternion)), axis=-1).max(initial=0.0)
        return float(bend + travel + reach * turn) / 8.0


@dataclass(frozen=True, eq=False)
class MovingCraft:
    """All bodies of a run that are drawn.

    times   (n_t,) [s]
    camera  kind of the axes in which the motion is given
    up      axis (0, 1 or 2) that points up in a picture
    size    of the craft at the first instant [m]
    scale   magnification that shows the elastic displacement
    """

    times: Array
    bodies: tuple[MovingBody, ...]
    camera: str
    up: int
    size: float
    scale: float

    def error_between(self) -> float:
        """The largest of the bodies' errors between instants [m]."""
        return max(body.error_between() for body in self.bodies)


def second_differences(values: Array) -> Array:
    """Of rows (n_t, ...): x0 - 2 x1 + x2, (n_t - 2, ...), which is h^2 times the second derivative."""
    return np.asarray(values[:-2] - 2.0 * values[1:-1] + values[2:])


def rotation_steps(e: Array) -> Array:
    """Sum (n_t, 3) of half the rotation vectors between instants, of quaternions (n_t, 4), scalar first."""
    a, b = e[:-1], e[1:]
    step = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
    sine = np.linalg.norm(step, axis=1)
    angle = np.arcsin(np.minimum(sine, 1.0))
    half = step * np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 1.0)[:, None]
    return np.concatenate([np.zeros((1, 3)), np.cumsum(half, axis=0)])


def moving_craft(run: Run, camera: str = "auto", most: int = 0) -> MovingCraft:
    """The drawn bodies of a run and their motion.

    camera  as of pictures: "auto", "fixed", "follow", "orbital", "body:NAME"
    most    number of instants, equally spaced among the rows; 0: all
    Raises ValueError where no body can be drawn, and for a camera that the run cannot have.
    """
    stored = run.bodies()
    whole = segmented_bodies(run)
    skins = {name: skin for name, skin in skins_of(stored).items() if name not in whole}
    rows = np.arange(len(run))
    if most and len(rows) > most:
        rows = np.unique(np.linspace(0, len(run) - 1, most).round().astype(np.int64))
    times = np.asarray(run.time)[rows]
    position = {name: run.finite(f"bodies/{name}/position")[rows] for name in skins}
    corners = np.concatenate([skin.points + position[name][0] for name, skin in skins.items()])
    size = float(np.linalg.norm(np.ptp(corners, axis=0))) or 1.0
    kind, body = chosen_camera(run, {name: stored[name] for name in skins}, camera, size)
    origin, axes = camera_axes(run, times, kind, body)
    bodies = []
    for name, skin in skins.items():
        e = run.finite(f"bodies/{name}/attitude")[rows]
        delta = run.finite(f"bodies/{name}/delta")[rows] if f"bodies/{name}/delta" in run else np.zeros((len(rows), 0))
        if skin.growth is not None:
            delta = amplitudes_with_growth(run, name, run.finite(f"bodies/{name}/length")[rows], delta, 1.0)
        moved = np.abs(delta).max(axis=0, initial=0.0) * skin.max_displacement
        kept = np.flatnonzero(moved > ROUNDING * size)
        relative = np.einsum("tji,tj->ti", axes, position[name] - origin)
        bodies.append(MovingBody(name, skin, relative, quaternions_of_camera(axes, e), delta, kept))
    drawn = {name: extended_skin(skin) if segmented_body_of(name, whole) else skin for name, skin in skins.items()}
    scale = automatic_scale(float(displacement(run, outer_skins(drawn))[1].max(initial=0.0)), size)
    return MovingCraft(times, tuple(bodies), kind, 1 if kind == "orbital" else 2, size, scale)


def quaternions_of_camera(axes: Array, e: Array) -> Array:
    """Rotations C_VB as quaternions (n_t, 4) with continuous signs, from those of C_NB and from C_NV (n_t, 3, 3)."""
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_matrix(axes).inv() * Rotation.from_quat(e[:, [1, 2, 3, 0]])
    q = rotation.as_quat()[:, [3, 0, 1, 2]]
    signs = np.where(np.einsum("ti,ti->t", q[:-1], q[1:]) < 0.0, -1.0, 1.0)
    return np.asarray(q * np.cumprod(np.concatenate([[1.0], signs]))[:, None])


def described(craft: MovingCraft) -> Mapping[str, object]:
    """Facts of a motion for people who open a file: axes, instants, and the error between them."""
    return {
        "axes": {"fixed": "inertial", "follow": "inertial, moving with the centre of mass"}.get(
            craft.camera, craft.camera
        ),
        "instants": len(craft.times),
        "first_s": float(craft.times[0]),
        "last_s": float(craft.times[-1]),
        "largest_error_between_instants_m": craft.error_between(),
    }
