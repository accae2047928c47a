"""A run as a scene: one window, opened once, that shows any instant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from femflex.body import Skin
from femflex.results import Run
from femflex.view.actors import BodyActor, TraceActor
from femflex.view.extent import automatic_scale, cloud, displacement, skins_of, some_rows, thinned
from femflex.view.framing import Margins, View, best_direction, framed
from femflex.view.look import Look
from femflex.view.motion import Motion, chosen_camera, motion
from femflex.view.overlay import CornerTriad, add_colour_bar, add_text, matrix, triad_actor
from femflex.view.surface import surface_of
from femflex.view.units import Bar, clock, colour_bar
from femflex.view.window import Image, grabbed, open_window

Array = NDArray[np.float64]

FRAMING_ROWS = 200
ARMS = 0.11  # length of the bodies' axes, parts of the craft's size
TINY = 1e-12  # m; an elastic displacement below this is none


@dataclass(frozen=True, eq=False)
class Plan:
    """What a scene needs to know of the whole run before its first picture.

    skins   body -> Skin
    camera, body    frame of the camera
    view    place of the camera
    scale   magnification of the elastic displacement; largest [m] it reaches, at `peak` [s]
    arms    length of the triads [m]
    start, duration  of the run [s]
    """

    skins: dict[str, Skin]
    camera: str
    body: str
    view: View
    scale: float
    largest: float
    peak: float
    arms: float
    start: float
    duration: float

    @property
    def bar(self) -> Bar | None:
        """The colour bar, None where nothing deforms."""
        return colour_bar(self.largest) if self.largest > TINY else None


def planned(run: Run, look: Look) -> Plan:
    """The plan that frames the whole run."""
    if not len(run):
        raise ValueError(f"{run.path} holds no instants, so there is nothing to draw")
    bodies = run.bodies()
    skins = skins_of(bodies)
    thin = thinned(skins)
    times, largest = displacement(run, thin)
    rows = some_rows(run)
    rows = np.unique(rows[np.linspace(0, len(rows) - 1, min(len(rows), FRAMING_ROWS)).round().astype(int)])
    first = cloud(motion(run, run.time[:1]), thin, 1.0, 0.0)[0]
    size = float(np.linalg.norm(np.ptp(first, axis=0)))
    scale = automatic_scale(largest.max(), size) if isinstance(look.scale, str) else float(look.scale)
    camera, body = chosen_camera(run, bodies, look.camera, size)
    arms = ARMS * size if look.triads else 0.0
    instants = np.union1d(run.time[rows], times[[np.argmax(largest)]])
    points = cloud(motion(run, instants, camera, body, look.traces), thin, scale, arms).reshape(-1, 3)
    up = np.array([0.0, 1.0, 0.0]) if camera == "orbital" else np.array([0.0, 0.0, 1.0])
    towards = np.asarray(look.view, float) if look.view is not None else best_direction(points, up)
    deforms = largest.max() > TINY
    margins = Margins(right=0.14 if deforms else 0.04)
    view = framed(points, towards, up, look.size[0] / look.size[1], margins)
    peak = float(times[np.argmax(largest)]) if deforms else float(run.time[-1])
    return Plan(skins, camera, body, view, scale, float(largest.max()), peak, arms, float(run.time[0]), run.duration)


class Scene:
    """A window with every body of a run, shown at instants of a Motion; use it in a `with` statement.

    samples  each pixel of an image is the mean of samples x samples drawn ones;  note  a second line under the clock
    """

    def __init__(self, run: Run, look: Look, plan: Plan, samples: int = 1, note: str = "") -> None:
        self._run, self._plan, self._samples = run, plan, samples
        theme, (width, height) = look.colours, (look.size[0] * samples, look.size[1] * samples)
        self._plotter = open_window((width, height), theme)
        _place_camera(self._plotter, plan.view)
        pixel = height / 720
        self._bodies, self._triads = self._add_bodies(look, pixel), {}
        paths = motion(run, run.time[some_rows(run)], plan.camera, plan.body, look.traces).traces if look.traces else {}
        self._traces = {name: TraceActor(self._plotter, path, theme, pixel) for name, path in paths.items()}
        self._corner: CornerTriad | None = None
        if look.triads:
            self._add_triads(look, (width, height))
        self._clock = self._add_texts(look, height, note)

    def show(self, motion: Motion, k: int) -> None:
        """Show instant k of a motion in this scene's camera frame."""
        for name, actor in self._bodies.items():
            delta = motion.delta.get(name, np.zeros((len(motion.times), 0)))
            actor.show(motion.position[name][k], motion.attitude[name][k], delta[k], self._plan.scale)
        for name, triad in self._triads.items():
            triad.SetUserMatrix(matrix(motion.position[name][k], motion.attitude[name][k]))
        for name, trace in self._traces.items():
            trace.show(
                int(np.searchsorted(self._run.time[some_rows(self._run)], motion.times[k])), motion.traces[name][k]
            )
        if self._corner is not None:
            self._corner.show(motion.reference[k])
        self._clock.SetInput(f"t = {clock(float(motion.times[k]), self._plan.start + self._plan.duration)}")

    def image(self) -> Image:
        """The picture, (height, width, 3)."""
        return grabbed(self._plotter, self._samples)

    def close(self) -> None:
        """Close the window."""
        self._plotter.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _add_bodies(self, look: Look, pixel: float) -> dict[str, BodyActor]:
        theme, actors, rigid = look.colours, {}, 0
        for name, skin in self._plan.skins.items():
            surface = surface_of(skin, look.edges)
            deforms = self._plan.bar if len(skin.shapes) else None
            colour = theme.rigid[rigid % len(theme.rigid)]
            rigid += deforms is None
            actors[name] = BodyActor(self._plotter, surface, colour, theme, deforms, pixel)
        return actors

    def _add_triads(self, look: Look, size: tuple[int, int]) -> None:
        for name in self._plan.skins:
            self._triads[name] = triad_actor(look.colours, self._plan.arms)
            self._plotter.renderer.AddViewProp(self._triads[name])
        orbital = "orbit/attitude" in self._run
        names = ("normal", "up", "flight") if orbital else ("X", "Y", "Z")
        self._corner = CornerTriad(self._plotter, self._plan.view, names, look.colours, size)

    def _add_texts(self, look: Look, height: int, note: str) -> Any:
        theme, renderer, plan = look.colours, self._plotter.renderer, self._plan
        title = self._run.title if look.title is None else look.title
        add_text(renderer, title, (0.02, 0.965), height / 30, theme.text, bold=True)
        if plan.bar is not None:
            true = abs(plan.scale - 1) < 1e-12
            said = "deformation true to scale" if true else f"deformation × {plan.scale:g}"
            add_text(renderer, said, (0.98, 0.035), height / 40, theme.text, "right bottom")
            add_colour_bar(renderer, theme.colour_map, plan.bar, theme, height)
        if note:
            add_text(renderer, note, (0.5, 0.035), height / 40, theme.faint, "center bottom")
        return add_text(renderer, "", (0.98, 0.965), height / 32, theme.text, "right top")


def _place_camera(plotter: Any, view: View) -> None:
    plotter.camera.position = tuple(view.place)
    plotter.camera.focal_point = tuple(view.focus)
    plotter.camera.up = tuple(view.up)
    plotter.camera.view_angle = float(np.rad2deg(view.angle))
    plotter.camera.clipping_range = (view.near, view.far)
    plotter.camera_set = True
