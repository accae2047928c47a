"""Pictures and movies of a run, from its result file alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from femflex.arrays import Array
from femflex.results import Run
from femflex.view.look import Look, LookOptions
from femflex.view.motion import motion
from femflex.view.movie import Progress, write_movie, write_png
from femflex.view.plan import ScenePlan, plan_scene
from femflex.view.scene import Scene
from femflex.view.units import clock
from femflex.view.window import Drawing, Image
from femflex.writing import atomic_file

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
