"""Properties of the whole run that a scene needs before its first picture: camera, magnification, colours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.body import Skin
from femflex.results import Run
from femflex.view.extent import automatic_scale, cloud, displacement, largest_shift, outer_skins, skins_of
from femflex.view.framing import Margins, View, best_direction, fit_camera, fit_camera_clear_of_corner
from femflex.view.look import Look
from femflex.view.motion import chosen_camera, motion, traced_markers
from femflex.view.paint import Paint, paints_of
from femflex.view.segments import extended_skin, segmented_bodies, segmented_body_of
from femflex.view.sunlight import LIGHT, sunlight_bar
from femflex.view.units import Bar, colour_bar

FRAMING_ROWS = 200
ARMS = 0.08  # length of the axes of a body, or by which they reach out of a rigid one, parts of the craft's size
SIGHT = 0.4  # length at which lines of sight are drawn, parts of the craft's size
TRIAD = (0.34, 0.31)  # width and height of the corner that the triad and its names take, parts of the height
VISIBLE = 0.01  # of the craft's size: a smaller motion is not visible
PAUSE = 0.5  # of the time of motion, which a movie adds: vibrations die away, seen by their colours
SHORTER = 0.7  # of the run: a movie that would be longer shows the whole run
TINY = 1e-12  # m; a smaller elastic displacement counts as zero


@dataclass(frozen=True, eq=False)
class ScenePlan:
    """Settings that all pictures of a scene share.

    skins     body -> Skin;  arms  body -> lengths of its axes (3,) [m], none where they are not drawn
    undeformed  bodies with a meaningful undeformed shape: neither cut into segments nor deploying
    camera, body  frame of the camera;  view  its position in it
    scale     magnification of the elastic displacement
    largest   elastic displacement of the whole run [m], reached at time peak [s]
    span      first and last time of the run [s]
    still     time [s] after which no point moves visibly, including a pause; the end of the run if that is close
    bar       the colour bar, None where nothing deforms and displacement colours
    paints    body -> source of its colours, if that is not the displacement
    sight     length at which lines of sight are drawn [m]
    """

    skins: dict[str, Skin]
    undeformed: frozenset[str]
    arms: dict[str, Array]
    camera: str
    body: str
    view: View
    scale: float
    largest: float
    peak: float
    span: tuple[float, float]
    still: float
    bar: Bar | None
    paints: Mapping[str, Paint]
    sight: float


def plan_scene(run: Run, look: Look, time: float | None = None) -> ScenePlan:
    """The plan of a run's pictures; with `fit` "picture" framed at that time alone (None: of largest displacement).

    Raises ValueError when there is nothing to draw, or the look requires what the run does not have.
    """
    if not len(run):
        raise ValueError(f"{run.path} holds no instants, so there is nothing to draw")
    _check_traces(run, look)
    bodies = run.bodies()
    skins = {
        name: extended_skin(skin) if segmented_body_of(name, segmented_bodies(run)) else skin
        for name, skin in skins_of(bodies).items()
    }
    thin = outer_skins(skins)
    times, displaced = displacement(run, thin)
    largest = float(displaced.max())
    peak = float(times[np.argmax(displaced)]) if largest > TINY else float(times[-1])
    initial_cloud = cloud(motion(run, times[:1]), thin, 1.0, {})[0]
    size = float(np.linalg.norm(np.ptp(initial_cloud, axis=0)))
    scale = automatic_scale(largest, size) if isinstance(look.scale, str) else float(look.scale)
    camera, body = chosen_camera(run, bodies, look.camera, size)
    arms = {segmented_body_of(name, segmented_bodies(run)) or name: _arms(skin, size) for name, skin in thin.items()}
    arms = arms if look.triads else {}
    instants = np.union1d(
        times[np.unique(np.linspace(0, len(times) - 1, min(len(times), FRAMING_ROWS)).round().astype(np.int64))], [peak]
    )
    if look.fit == "picture":
        instants = np.array([peak if time is None else time])
    moving = motion(run, instants, camera, body, look.traces, scale)
    points = cloud(moving, thin, scale, arms, SIGHT * size)
    shift = largest_shift(moving, thin, int(np.argmin(np.abs(instants - peak)))) if largest > TINY else None
    view = _camera_view(points.reshape(-1, 3), look, camera, largest > TINY or look.colour != "displacement", shift)
    paints, bar = ({}, sunlight_bar(run)) if look.colour == LIGHT else paints_of(run, bodies, look.colour)
    if look.colour == "displacement":
        bar = colour_bar(largest) if largest > TINY else None
    span = float(run.time[0]), float(run.time[-1])
    undeformed = frozenset(
        name
        for name, skin in skins.items()
        if skin.growth is None and not segmented_body_of(name, segmented_bodies(run))
    )
    still = _end_of_visible_motion(instants, points, span[1], size)
    return ScenePlan(
        skins, undeformed, arms, camera, body, view, scale, largest, peak, span, still, bar, paints, SIGHT * size
    )


def _end_of_visible_motion(instants: Array, points: Array, end: float, size: float) -> float:
    """Time [s] after which points (n_t, n, 3) are at their final positions, within VISIBLE of the craft's size [m]."""
    distances = np.linalg.norm(points - points[-1], axis=2).max(axis=1)
    moving = np.flatnonzero(distances > VISIBLE * size)
    if not len(moving):
        return end
    last_motion = float(instants[min(moving[-1] + 1, len(instants) - 1)])
    end_of_movie = last_motion + PAUSE * (last_motion - float(instants[0]))
    return end_of_movie if end_of_movie - instants[0] < SHORTER * (end - instants[0]) else end


def _camera_view(points: Array, look: Look, camera: str, bar: bool, shift: Array | None) -> View:
    up = np.array([0.0, 1.0, 0.0]) if camera == "orbital" else np.array([0.0, 0.0, 1.0])
    towards = best_direction(points, up, shift) if look.view is None else np.asarray(look.view, float)
    aspect = look.size[0] / look.size[1]
    margins = Margins(right=0.25 / aspect if bar else 0.04)
    if not look.triads:
        return fit_camera(points, towards, up, aspect, margins)
    return fit_camera_clear_of_corner(points, towards, up, aspect, margins, TRIAD)


def _arms(skin: Skin, size: float) -> Array:
    inside = np.zeros(3) if len(skin.shapes) else np.maximum(skin.points.max(axis=0), 0.0)
    return inside + ARMS * size


def _check_traces(run: Run, look: Look) -> None:
    contacts = [path.removesuffix("/place") for path in run if path.endswith("/place")]
    traceable = [*traced_markers(run), *contacts]
    unknown = [name for name in look.traces if name not in traceable]
    if unknown:
        raise ValueError(f"traces {unknown} are not markers of the run; its markers are {traceable}")
