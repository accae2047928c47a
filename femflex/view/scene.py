"""A run as a scene: one window, opened once, that shows any instant; pictures and movies of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from femflex.arrays import Array
from femflex.results import Run
from femflex.view.actors import BodyActor, LineActor, add_ghost
from femflex.view.extent import some_rows
from femflex.view.look import Look, LookOptions
from femflex.view.motion import Motion, motion
from femflex.view.movie import Progress, write_movie, write_png
from femflex.view.overlay import (
    BAR_HEIGHT,
    BodyNames,
    CornerTriad,
    add_colour_bar,
    add_length_scale,
    add_text,
    arrows_actor,
    pose_matrix,
)
from femflex.view.plan import ScenePlan, plan_scene
from femflex.view.segments import cables, lengths_line, line_of_masses, segmented_bodies, segmented_body_of
from femflex.view.sunlight import LIGHT, Sunlight
from femflex.view.surface import MESH_LINE_GAP, VISIBLE, Surface, breadth, surface_of
from femflex.view.surroundings import directions_of
from femflex.view.units import clock
from femflex.view.window import Drawing, Image, Window
from femflex.writing import atomic_file

TIP = 0.055  # radius of the arrow heads of a body's axes, parts of the shortest
MOST_NAMES = 8  # names of bodies; more would cover the picture
GREY_NOTE = "grey: no such quantity"  # by members of another family, or bodies without it
BAR_NOTE = "scale of the whole run"  # text under the colour bar; a scale of one instant would flicker in a movie


class Scene(Window):
    """A window with every body of a run, shown at instants of a Motion.

    note: a second line under the clock
    """

    def __init__(self, run: Run, look: Look, plan: ScenePlan, samples: int = 1, note: str = "") -> None:
        super().__init__(look.size, look.colours, plan.view, samples)
        self._run, self._plan, theme, (width, height) = run, plan, look.colours, self._size
        pixel = height / 720
        self._ghosts: dict[str, list[Any]] = {}
        surfaces = self._surfaces(look)
        self._sunlight: Sunlight | None = None
        if look.colour == LIGHT:
            self._sunlight = Sunlight(self._plotter, surfaces, plan.view.pixels(1), theme)
            surfaces = {name: surface.without_faces() for name, surface in surfaces.items()}
        self._bodies = self._add_bodies(surfaces, look, pixel)
        self._triads: dict[str, Any] = {}
        self._path_times = run.time[some_rows(run)] if look.traces else np.zeros(0)
        self._paths = motion(run, self._path_times, plan.camera, plan.body, look.traces, plan.scale).traces
        self._traces = {name: LineActor(self._plotter, len(x), theme, 2.0 * pixel) for name, x in self._paths.items()}
        watched = motion(run, run.time[:1]).sights
        self._sights = {name: LineActor(self._plotter, 2, theme, 2.5 * pixel) for name in watched}
        self._cables = {
            masses: LineActor(self._plotter, len(masses) + 2, theme, 2.5 * pixel, theme.edge)
            for masses in map(tuple, cables(run).values())
        }
        self._corner: CornerTriad | None = None
        if look.triads:
            self._add_triads(look, (width, height))
        self._named = self._named_bodies() if look.names else {}
        self._names = BodyNames(self._plotter.renderer, list(self._named), look.colours, (width, height))
        self._clock = self._add_texts(look, (width, height), note)

    def show(self, moving: Motion, k: int) -> None:
        """Show instant k of a motion in this scene's camera frame."""
        t, plan = float(moving.times[k]), self._plan
        for name, actor in self._bodies.items():
            delta = moving.delta[name][k] if name in moving.delta else np.zeros(0)
            own_amplitudes = moving.amplitudes[name][k] if name in moving.amplitudes else delta
            actor.show(moving.position[name][k], moving.attitude[name][k], delta, plan.scale, own_amplitudes)
        self._names.show(plan.view, {name: self._bodies[body].centre for name, body in self._named.items()})
        if self._sunlight is not None:
            self._sunlight.show(moving, k, plan.scale)
        for name, ghosts in self._ghosts.items():
            pose = pose_matrix(moving.position[name][k], moving.attitude[name][k])
            for ghost in ghosts:
                ghost.SetUserMatrix(pose)
        for name, triad in self._triads.items():
            triad.SetUserMatrix(pose_matrix(moving.position[name][k], moving.attitude[name][k]))
        past = (self._path_times < t)[:, None]
        for name, trace in self._traces.items():
            trace.show(np.where(past, self._paths[name], moving.traces[name][k]))
        for name, sight in self._sights.items():
            start, direction = (values[k] for values in moving.sights[name])
            sight.show(np.stack([start, start + plan.sight * direction]))
        for masses, line in self._cables.items():
            others = [place[k] for name, place in moving.position.items() if name not in masses]
            points = np.array([moving.position[name][k] for name in masses])
            line.show(line_of_masses(points, np.array(others).reshape(-1, 3)))
        if self._corner is not None:
            self._corner.show(moving.reference[k], np.array([v[k] for v in moving.directions.values()]).reshape(-1, 3))
        lengths = lengths_line({name: float(length[k]) for name, length in moving.lengths.items()})
        self._clock.SetInput(f"t = {clock(t, plan.span[1] - plan.span[0])}{lengths}" if len(self._run) > 1 else lengths)

    def turning(self) -> Any:
        """The scene as a widget of a notebook, drawn by the kernel as it is turned; it keeps the window open."""
        self._plotter.notebook = True
        return self._plotter.show(jupyter_backend="server", return_viewer=True)

    def _named_bodies(self) -> dict[str, str]:
        """Name to write -> drawn body next to which it stands, of a body cut into segments the middle one."""
        segmented, parts = segmented_bodies(self._run), dict[str, list[str]]()
        for name, actor in self._bodies.items():
            if actor.is_drawn:
                parts.setdefault(segmented_body_of(name, segmented) or name, []).append(name)
        named = {name: bodies[len(bodies) // 2] for name, bodies in parts.items()}
        return named if 1 < len(named) <= MOST_NAMES else {}

    def _surfaces(self, look: Look) -> dict[str, Surface]:
        surfaces, metre = {}, self._plan.view.pixels(look.size[1])
        for name, skin in self._plan.skins.items():
            slender = breadth(skin) * metre < VISIBLE
            few = not len(skin.shapes) or look.colour == LIGHT
            edges = "sharp" if look.edges == "auto" and few else look.edges
            surfaces[name] = surface_of(skin, "thick" if slender else edges, MESH_LINE_GAP / metre)
        return surfaces

    def _add_bodies(self, surfaces: dict[str, Surface], look: Look, pixel: float) -> dict[str, BodyActor]:
        theme, actors, rigid = look.colours, {}, 0
        if look.colour == LIGHT:
            theme = replace(theme, edge=theme.faint)  # seen on lit and on dark faces
        for name, surface in surfaces.items():
            skin, paint = self._plan.skins[name], self._plan.paints.get(name)
            coloured = len(skin.shapes) and look.colour != LIGHT and (paint or not self._plan.paints)
            deforms = self._plan.bar if coloured else None
            colour = theme.rigid[rigid % len(theme.rigid)]
            rigid += deforms is None
            actors[name] = BodyActor(self._plotter, surface, colour, theme, deforms, pixel, paint)
            if len(skin.shapes) and self._plan.scale != 1.0 and name in self._plan.undeformed:
                self._ghosts[name] = add_ghost(self._plotter, surface, theme, pixel)
        return actors

    def _add_triads(self, look: Look, size: tuple[int, int]) -> None:
        for name, arm in self._plan.arms.items():
            self._triads[name] = arrows_actor(look.colours.axes, arm, TIP * arm.min())
            self._plotter.renderer.AddViewProp(self._triads[name])
        orbital = "orbit/attitude" in self._run
        axes = ("normal", "up", "flight") if orbital else ("X", "Y", "Z")
        names = (*axes, *dict.fromkeys(directions_of(self._run).values()))
        self._corner = CornerTriad(self._plotter, self._plan.view, names, look.colours, size)
        text = f"{'orbital' if orbital else 'inertial'} axes" + "; arrows on bodies: x, y, z" * bool(self._triads)
        add_text(self._plotter.renderer, text, (0.02, 0.035), size[1] / 48, look.colours.faint, "left bottom")

    def _has_grey(self) -> bool:
        """Whether a flexible body, or a part of it, lacks the quantity that colours the others."""
        paints = self._plan.paints
        for name, body in self._run.bodies().items():
            if paints and body.skin is not None and (count := len(body.skin.shapes)):
                if name not in paints or np.isnan(paints[name].values(np.zeros(count))).any():
                    return True
        return False

    def _add_texts(self, look: Look, size: tuple[int, int], note: str) -> Any:
        theme, renderer, plan, (width, height) = look.colours, self._plotter.renderer, self._plan, size
        add_length_scale(renderer, plan.view.pixels(1), theme, size)
        title = self._run.title if look.title is None else look.title
        fitting = 0.78 * width / (0.66 * max(1, len(title)))  # left of the clock
        add_text(renderer, title, (0.02, 0.965), min(height / 30, fitting), theme.text, bold=True)
        if plan.bar is not None:
            if any(len(skin.shapes) for skin in plan.skins.values()):
                scale_text = "deformation true to scale" if plan.scale == 1.0 else f"deformation × {plan.scale:g}"
                add_text(renderer, scale_text, (0.98, 0.035), height / 40, theme.text, "right bottom")
            colours = theme.light_map() if look.colour == LIGHT else theme.colour_map(plan.bar.signed)
            add_colour_bar(self._plotter, plan.bar, colours, theme, size)
            notes = [BAR_NOTE] * (len(self._run) > 1) + [GREY_NOTE] * self._has_grey()
            if notes and look.colour != LIGHT:
                position_below_bar = (1 - 0.025 * height / width, BAR_HEIGHT[0] - 0.025)
                add_text(renderer, "\n".join(notes), position_below_bar, height / 48, theme.faint, "right top")
        if note:
            add_text(renderer, note, (0.55, 0.035), height / 40, theme.faint, "center bottom")
        return add_text(renderer, "", (0.98, 0.965), height / 32, theme.text, "right top")


PICTURE_SAMPLES, MOVIE_SAMPLES = 2, 1
SLOW_MOTION, REAL_TIME = 4.0, 20.0  # s; a run of a length between these is shown as fast as it went
MOVIE_SECONDS = 12.0  # length of the movie of a longer or shorter one


def render_picture(
    run: Run, path: str | Path, time: float | None = None, force: bool = False, **look: Unpack[LookOptions]
) -> Path:
    """Path of a PNG picture of the run at a time [s]; without one, at the largest elastic displacement.

    `look` are the fields of `Look`. The camera is framed over the whole run. Raises ValueError for a time outside the
    run, NoRenderer where nothing can be drawn.
    """
    options, path = Look(**look), Path(path)
    if path.suffix.lower() != ".png":
        raise ValueError(f"a picture is written as .png; {path.name} is not one")
    if time is not None:
        _checked_time(run, time)
    plan = plan_scene(run, options, time)
    instant = plan.peak if time is None else time
    with atomic_file(path, force) as draft, Scene(run, options, plan, options.samples or PICTURE_SAMPLES) as scene:
        scene.show(motion(run, np.array([instant]), plan.camera, plan.body, options.traces, plan.scale), 0)
        write_png(draft, scene.image())
    return Drawing(path)


def turning_view(run: Run, time: float | None = None, **look: Unpack[LookOptions]) -> Any:
    """A view of the run at a time [s] that turns in a notebook, by pyvista and trame. Raises as `render_picture`."""
    options = Look(**look)
    if time is not None:
        _checked_time(run, time)
    plan = plan_scene(run, options, time)
    instant = plan.peak if time is None else time
    scene = Scene(run, options, plan)
    scene.show(motion(run, np.array([instant]), plan.camera, plan.body, options.traces, plan.scale), 0)
    return scene.turning()


def render_movie(
    run: Run,
    path: str | Path,
    fps: float = 25.0,
    speed: float | None = None,
    span: tuple[float | None, float | None] = (None, None),
    force: bool = False,
    progress: Progress | None = None,
    **look: Unpack[LookOptions],
) -> Path:
    """Path of a movie of the run: an .mp4 file, or a folder of PNG pictures when `path` has no suffix.

    speed     seconds of the run in one of the movie; by default 1 for runs of 4 to 20 s, else so that it lasts 12 s
    span      first and last time shown [s]; by default the start of the run and the time after which no point moves
              visibly (`ScenePlan.still`)
    progress  called with frames done and in all; what was drawn before an interrupt is kept
    """
    options = replace(Look(**look), fit="run")
    plan = plan_scene(run, options)
    default_span = (plan.span[0], plan.still if span[0] is None or span[0] < plan.still else plan.span[1])
    start, end = (_checked_time(run, default_span[k] if t is None else t) for k, t in enumerate(span))
    if not end > start:
        raise ValueError(f"a movie needs a span of time; from {start:g} s to {end:g} s there is none")
    if speed is None:
        speed = 1.0 if SLOW_MOTION <= end - start <= REAL_TIME else (end - start) / MOVIE_SECONDS
    if not speed > 0:
        raise ValueError(f"speed is {speed}; it is the number of seconds of the run in one of the movie, above 0")
    count = max(2, round((end - start) / speed * fps) + 1)
    times = np.linspace(start, end, count)
    notes = [] if abs(speed - 1) < 5e-3 else [f"{speed:.3g} × real time"]
    if span[1] is None and end < plan.span[1]:
        notes.append(f"still after {clock(end, plan.span[1] - plan.span[0])}")
    note = "; ".join(notes)
    with Scene(run, options, plan, options.samples or MOVIE_SAMPLES, note) as scene:
        frames = _frames(run, scene, plan, times, options.traces)
        return write_movie(path, frames, count, fps, force, progress)


def _frames(run: Run, scene: Scene, plan: ScenePlan, times: Array, traces: tuple[str, ...]) -> Iterator[Image]:
    moving = motion(run, times, plan.camera, plan.body, traces, plan.scale)
    for k in range(len(times)):
        scene.show(moving, k)
        yield scene.image()


def _checked_time(run: Run, time: float) -> float:
    start, end = float(run.time[0]), float(run.time[-1])
    if not start <= time <= end:
        raise ValueError(f"time {time:g} s is outside the run, which goes from {start:g} s to {end:g} s")
    return time
