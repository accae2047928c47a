"""What a scene needs to know of the whole run before its first picture: camera, magnification, colours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.body import Skin
from femflex.results import Run
from femflex.view.extent import automatic_scale, cloud, displacement, skins_of, thinned
from femflex.view.framing import Margins, View, best_direction, framed, framed_clear_of_corner
from femflex.view.look import Look
from femflex.view.motion import chosen_camera, motion, traced_markers
from femflex.view.paint import Paint, painted
from femflex.view.segments import cut_bodies, whole_of, widened
from femflex.view.units import Bar, colour_bar

FRAMING_ROWS = 200
ARMS = 0.08  # length of the axes of a body, or by which they reach out of a rigid one, parts of the craft's size
SIGHT = 0.4  # length at which lines of sight are drawn, parts of the craft's size
TRIAD = (0.34, 0.31)  # width and height of the corner that the triad and its names take, parts of the height
VISIBLE = 0.01  # of the craft's size: a motion below it is not seen
PAUSE = 0.5  # of the time of motion, which a movie adds: vibrations die away, seen by their colours
SHORTER = 0.7  # of the run: a movie that would be longer shows all of it
TINY = 1e-12  # m; an elastic displacement below this is none


@dataclass(frozen=True, eq=False)
class Plan:
    """What is settled for all pictures of a scene.

    skins     body -> Skin;  arms  body -> lengths of its axes (3,) [m], none where they are not drawn
    undeformed  bodies whose undeformed shape means something: neither cut into segments nor growing
    camera, body  frame of the camera;  view  its place in it
    scale     magnification of the elastic displacement
    largest   elastic displacement of the whole run [m], reached at time peak [s]
    span      first and last time of the run [s]
    still     time [s] from which no point moves visibly, a pause included; the end of the run where that is near
    bar       the colour bar, None where nothing deforms
    paints    body -> what colours it, where that is not the displacement
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


def planned(run: Run, look: Look, time: float | None = None) -> Plan:
    """The plan of a run's pictures; with `fit` "picture" framed at that time alone (None: of largest displacement).

    Raises ValueError when there is nothing to draw, or the look asks for what the run has not.
    """
    if not len(run):
        raise ValueError(f"{run.path} holds no instants, so there is nothing to draw")
    _check_traces(run, look)
    bodies = run.bodies()
    skins = {
        name: widened(skin) if whole_of(name, cut_bodies(run)) else skin for name, skin in skins_of(bodies).items()
    }
    thin = thinned(skins)
    times, displaced = displacement(run, thin)
    largest = float(displaced.max())
    peak = float(times[np.argmax(displaced)]) if largest > TINY else float(times[-1])
    first = cloud(motion(run, times[:1]), thin, 1.0, {})[0]
    size = float(np.linalg.norm(np.ptp(first, axis=0)))
    scale = automatic_scale(largest, size) if isinstance(look.scale, str) else float(look.scale)
    camera, body = chosen_camera(run, bodies, look.camera, size)
    arms = {whole_of(name, cut_bodies(run)) or name: _arms(skin, size) for name, skin in thin.items()}
    arms = arms if look.triads else {}
    instants = np.union1d(_spread(times), [peak])
    if look.fit == "picture":
        instants = np.array([peak if time is None else time])
    moving = motion(run, instants, camera, body, look.traces, scale)
    points = cloud(moving, thin, scale, arms, SIGHT * size)
    view = _view(points.reshape(-1, 3), look, camera, largest > TINY or look.colour != "displacement")
    paints, bar = painted(run, bodies, look.colour)
    if look.colour == "displacement":
        bar = colour_bar(largest) if largest > TINY else None
    span = float(run.time[0]), float(run.time[-1])
    undeformed = frozenset(
        name for name, skin in skins.items() if skin.growth is None and not whole_of(name, cut_bodies(run))
    )
    still = _still_from(instants, points, span[1], size)
    return Plan(
        skins, undeformed, arms, camera, body, view, scale, largest, peak, span, still, bar, paints, SIGHT * size
    )


def _still_from(instants: Array, points: Array, end: float, size: float) -> float:
    """Time [s] after which points (n_t, n, 3) stay where they end, to VISIBLE of the craft's size [m]."""
    away = np.linalg.norm(points - points[-1], axis=2).max(axis=1)
    moving = np.flatnonzero(away > VISIBLE * size)
    if not len(moving):
        return end
    last = float(instants[min(moving[-1] + 1, len(instants) - 1)])
    shown = last + PAUSE * (last - float(instants[0]))
    return shown if shown - instants[0] < SHORTER * (end - instants[0]) else end


def _view(points: Array, look: Look, camera: str, bar: bool) -> View:
    up = np.array([0.0, 1.0, 0.0]) if camera == "orbital" else np.array([0.0, 0.0, 1.0])
    towards = best_direction(points, up) if look.view is None else np.asarray(look.view, float)
    aspect = look.size[0] / look.size[1]
    margins = Margins(right=0.25 / aspect if bar else 0.04)
    if not look.triads:
        return framed(points, towards, up, aspect, margins)
    return framed_clear_of_corner(points, towards, up, aspect, margins, TRIAD)


def _spread(times: Array) -> Array:
    return times[np.unique(np.linspace(0, len(times) - 1, min(len(times), FRAMING_ROWS)).round().astype(np.int64))]


def _arms(skin: Skin, size: float) -> Array:
    inside = np.zeros(3) if len(skin.shapes) else np.maximum(skin.points.max(axis=0), 0.0)
    return inside + ARMS * size


def _check_traces(run: Run, look: Look) -> None:
    contacts = [path.removesuffix("/place") for path in run if path.endswith("/place")]
    known = [*traced_markers(run), *contacts]
    unknown = [name for name in look.traces if name not in known]
    if unknown:
        raise ValueError(f"traces {unknown} are not markers of the run; its markers are {known}")
