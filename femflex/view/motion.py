"""Poses and elastic coordinates of a run's bodies at given instants, in the frame of the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.results import Run, RunBody
from femflex.rotations import dcm_from_quaternion
from femflex.view.segments import (
    amplitudes_with_growth,
    body_of_marker,
    deploying_bodies,
    extended_coordinates,
    segmented_body_of,
)
from femflex.view.surroundings import directions_of, sun_of

CAMERAS = ("auto", "fixed", "follow", "orbital", "body")
FAR = 1.0  # travel over size beyond which the automatic camera follows


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses and elastic coordinates of bodies, and positions of traces, at instants (n_t,), in frame V of the camera.

    position  body -> (n_t, 3) [m];  attitude  body -> C_VB (n_t, 3, 3);  delta  body -> (n_t, n)
    amplitudes  body -> (n_t, n)  delta; for a segment the amplitudes of its own shapes
    reference (n_t, 3, 3)  C_VR, R the orbital axes when orbiting, else the inertial ones
    traces    marker or contact -> (n_t, 3) [m], a marker's with its deflection magnified as the bodies are drawn
    sights    line of sight -> its start (n_t, 3) [m] and direction (n_t, 3)
    directions  word of a sun or a magnetic field -> its unit vector (n_t, 3)
    sun_share  (n_t,)  visible share of the sun's disc; 1 without a sun
    lengths   body that deploys -> its length (n_t,) [m]
    """

    times: Array
    position: dict[str, Array]
    attitude: dict[str, Array]
    delta: dict[str, Array]
    amplitudes: dict[str, Array]
    reference: Array
    traces: dict[str, Array]
    sights: dict[str, tuple[Array, Array]]
    lengths: dict[str, Array]
    directions: dict[str, Array]
    sun_share: Array


class Interpolated:
    """Channels of a run between its rows: linear, Euler parameters renormalised."""

    def __init__(self, run: Run, times: Array) -> None:
        self.run, self.times = run, np.asarray(times, float)
        last_row = len(run) - 1
        row_before = np.clip(np.searchsorted(run.time, self.times, side="right") - 1, 0, max(last_row - 1, 0))
        self._rows = np.stack([row_before, np.minimum(row_before + 1, last_row)])
        start, end = run.time[self._rows]
        self._weight = np.where(end > start, (self.times - start) / np.where(end > start, end - start, 1.0), 0.0)

    def __call__(self, path: str) -> Array:
        """Values of a channel at the instants, (n_t, *shape)."""
        a, b = self.run.finite(path)[self._rows]
        weight = self._weight.reshape(-1, *([1] * (a.ndim - 1)))
        return np.asarray(a + weight * (b - a))

    def dcm(self, path: str) -> Array:
        """C_PQ (n_t, 3, 3) of a channel of Euler parameters."""
        a, b = self.run.finite(path)[self._rows]
        b = b * np.where(np.einsum("ti,ti->t", a, b) < 0, -1.0, 1.0)[:, None]
        e = a + self._weight[:, None] * (b - a)
        return dcm_from_quaternion(e / np.linalg.norm(e, axis=1, keepdims=True))


def motion(
    run: Run, times: Array, camera: str = "fixed", body: str = "", traces: tuple[str, ...] = (), scale: float = 1.0
) -> Motion:
    """Motion of all bodies that a run reports, at instants (n_t,) [s] inside it, in the camera's frame.

    camera  "fixed": inertial axes; "follow": moving with the centre of mass; "orbital": orbital axes at O;
            "body": axes of that body
    scale   magnification of the elastic displacement of the traced markers
    """
    channel = Interpolated(run, times)
    names = [path.split("/")[1] for path in run if path.startswith("bodies/") and path.endswith("/position")]
    position = {name: channel(f"bodies/{name}/position") for name in names}
    attitude = {name: channel.dcm(f"bodies/{name}/attitude") for name in names}
    paths = {name: f"bodies/{name}/delta" for name in names}
    delta = {name: channel(path) if path in run else np.zeros((len(times), 0)) for name, path in paths.items()}
    amplitudes = dict(delta)
    for name in names:  # a segment is drawn as a deformation of the whole body
        if (segmented := segmented_body_of(name, names)) is not None:
            pose = position[segmented], attitude[segmented]
            delta[name] = extended_coordinates(position[name], attitude[name], delta[name], pose)
            position[name], attitude[name] = pose
    lengths = {name: channel(f"bodies/{name}/length") for name in deploying_bodies(run, names)}
    for name, length in lengths.items():
        delta[name] = amplitudes_with_growth(run, name, length, delta[name], scale)
    origin, C_NV = camera_axes(run, times, camera, body)
    orbital = channel.dcm("orbit/attitude") if "orbit/attitude" in run else None
    relative = {name: np.einsum("tji,tj->ti", C_NV, r - origin) for name, r in position.items()}
    relative_attitude = {name: np.einsum("tji,tjk->tik", C_NV, C) for name, C in attitude.items()}
    reference = np.einsum("tji,tjk->tik", C_NV, orbital) if orbital is not None else np.swapaxes(C_NV, 1, 2)
    lines = {}
    for marker in traces:
        if marker not in traced_markers(run):
            lines[marker] = np.einsum("tji,tj->ti", C_NV, channel(f"{marker}/place") - origin)
            continue
        lines[marker] = np.einsum("tji,tj->ti", C_NV, channel(f"markers/{marker}/position") - origin)
        if (bend := f"markers/{marker}/deflection") in run:
            C_VB = relative_attitude[body_of_marker(marker, relative_attitude)]
            lines[marker] += (scale - 1.0) * np.einsum("tij,tj->ti", C_VB, channel(bend))
    sights = {}
    for path in (path for path in run if path.startswith("sights/") and path.endswith("/direction")):
        start = channel(path.replace("/direction", "/position")) - origin
        sights[path.split("/")[1]] = tuple(np.einsum("tji,tj->ti", C_NV, v) for v in (start, channel(path)))
    directions = {
        word: np.einsum("tji,tj->ti", C_NV, unit_vectors(np.stack([channel(f"{head}/{axis}") for axis in "xyz"], 1)))
        for head, word in directions_of(run).items()
    }
    sun_share = np.ones(len(times)) if (sun := sun_of(run)) is None else channel(f"{sun}/visible")
    return Motion(
        np.asarray(times, float), relative, relative_attitude, delta, amplitudes, reference, lines, sights, lengths,
        directions, sun_share,
    )  # fmt: skip


def camera_axes(run: Run, times: Array, camera: str, body: str = "") -> tuple[Array, Array]:
    """Origin (n_t, 3) [m] and axes C_NV (n_t, 3, 3) of the camera's frame at instants (n_t,); see `motion`."""
    channel = Interpolated(run, times)
    origin, C_NV = np.zeros((len(times), 3)), np.broadcast_to(np.eye(3), (len(times), 3, 3))
    if camera == "follow":
        first = next(path for path in run if path.startswith("bodies/") and path.endswith("/position"))
        origin = channel("monitors/center_of_mass" if "monitors/center_of_mass" in run else first)
    elif camera == "orbital" and "orbit/attitude" in run:
        C_NV = channel.dcm("orbit/attitude")
    elif camera == "body":
        origin, C_NV = channel(f"bodies/{body}/position"), channel.dcm(f"bodies/{body}/attitude")
    return origin, C_NV


def unit_vectors(v: Array) -> Array:
    """Unit vectors (n, 3) along v (n, 3); zero where v is."""
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), np.finfo(float).tiny))


def traced_markers(run: Run) -> list[str]:
    """Markers whose path can be drawn; contact points can be drawn too, such as "constraints/contact"."""
    return [path.split("/")[1] for path in run if path.startswith("markers/") and path.endswith("/position")]


def chosen_camera(run: Run, bodies: dict[str, RunBody], camera: str, size: float) -> tuple[str, str]:
    """The camera's frame and body, from "auto", "fixed", "follow", "orbital", "body" or "body:<name>".

    "auto" is orbital in an orbit; else fixed, unless the craft travels further than its size [m]: then it follows.
    Raises ValueError for a camera the run cannot have.
    """
    kind, _, name = camera.partition(":")
    if kind not in CAMERAS:
        raise ValueError(f"camera {camera!r} is not known; known are {[*CAMERAS, 'body:<name>']}")
    if kind == "body":
        if name and name not in bodies:
            raise ValueError(f"camera {camera!r} names no body of the run; its bodies are {sorted(bodies)}")
        return "body", name or max(bodies, key=lambda b: bodies[b].mass)
    if kind == "orbital" and "orbit/attitude" not in run:
        raise ValueError("camera 'orbital' needs a run in an orbit; this one has none, use 'fixed' or 'follow'")
    if kind == "auto":
        travel = [np.ptp(run.finite(f"bodies/{body}/position"), axis=0).max() for body in bodies]
        kind = "orbital" if "orbit/attitude" in run else "follow" if min(travel) > FAR * size else "fixed"
    return kind, ""
