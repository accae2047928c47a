"""Pictures and movies: size, content, frames and files."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import pairwise

import av
import numpy as np
import pytest
from PIL import Image
from support.made_runs import craft

from femflex.results import open_run
from femflex.view import Look, mode_montage, mode_movie, render_movie, render_picture
from femflex.view.motion import motion
from femflex.view.plan import plan_scene

SMALL = {"size": (320, 180), "samples": 1}


def pixels_of(path):
    with Image.open(path) as image:
        return np.asarray(image).astype(int)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_picture_has_its_size_and_shows_the_bodies(tmp_path, run, theme):
    image = pixels_of(render_picture(run, tmp_path / "a.png", time=3.0, theme=theme, size=(400, 240)))
    assert image.shape == (240, 400, 3)
    assert (image[0].mean() > 200) == (theme == "light")
    hue = np.ptp(image.astype(int), axis=2)  # greys have none
    assert np.count_nonzero(hue > 60) > 500 and len(np.unique(image.reshape(-1, 3), axis=0)) > 200


def test_colour_bar_covers_the_largest_displacement_of_the_run(run):
    """Boom: both bending planes together; amplitudes of the made-up motion times unit tip shapes."""
    plan = plan_scene(run, Look())
    tip = run["markers/boom.tip/deflection"]
    assert plan.largest == pytest.approx(np.linalg.norm(tip, axis=1).max(), rel=2e-3)  # the rim turns a little too
    assert plan.bar.unit == "cm" and plan.bar.top >= 100 * plan.largest > 0.7 * plan.bar.top
    assert abs(run.time[np.argmax(np.linalg.norm(tip, axis=1))] - plan.peak) < 0.11


def test_magnification_changes_the_picture(tmp_path, run):
    look = {**SMALL, "view": (0.0, -1.0, 0.3), "camera": "body:hub", "triads": False, "edges": "none"}
    true_scale, magnified = (
        pixels_of(render_picture(run, tmp_path / f"{s}.png", time=8.55, scale=s, **look)) for s in (1.0, 4.0)
    )
    assert np.count_nonzero(np.abs(true_scale.astype(int) - magnified).sum(axis=2) > 60) > 100


def test_names_are_at_the_middle_of_bodies(tmp_path, run):
    look = {**SMALL, "view": (0.0, -1.0, 0.3), "camera": "body:hub", "fit": "picture"}
    bare, named = (
        pixels_of(render_picture(run, tmp_path / f"{k}.png", time=3.0, names=k, **look)) for k in (False, True)
    )
    rows, columns = np.nonzero(np.abs(bare - named).max(axis=2) > 30)
    plan, moving = plan_scene(run, Look(**look), 3.0), motion(run, np.array([3.0]), "body", "hub", (), 1.0)
    skin = run.bodies()["boom"].skin
    middle = moving.position["boom"][0] + moving.attitude["boom"][0] @ (skin.points.min(0) + skin.points.max(0)) / 2
    (place,) = plan.view.on_screen(np.stack([middle]), 320 / 180)
    near = np.hypot(columns - 320 * place[0], rows - 180 * (1 - place[1])) < 20
    assert np.count_nonzero(near) > 20 and np.count_nonzero(~near) > 10  # the other is that of the hub


def test_traces_grow_with_time(tmp_path, run):
    look = {**SMALL, "traces": ("boom.tip",), "triads": False}
    early, late = (pixels_of(render_picture(run, tmp_path / f"{t}.png", time=t, **look)) for t in (1.0, 18.0))
    red = [np.count_nonzero(np.abs(i.astype(int) - [209, 73, 91]).sum(axis=2) < 60) for i in (early, late)]
    assert red[1] > 4 * red[0] > 0


@pytest.mark.parametrize("camera", ["fixed", "body"])
def test_trace_follows_the_magnified_body(run, camera):
    times, scale = run.time[[5, 40]], 7.0
    moving = motion(run, times, camera, "boom" if camera == "body" else "", ("boom.tip",), scale)
    skin = run.bodies()["boom"].skin
    for k in range(2):
        deformed = skin.points + scale * np.einsum("n,npa->pa", moving.delta["boom"][k], skin.shapes)
        scene_points = moving.position["boom"][k] + deformed @ moving.attitude["boom"][k].T
        assert np.allclose(moving.traces["boom.tip"][k], scene_points[-1], atol=1e-9)  # the tip is its last point


def movie_frames(path, width, height):
    """Frames of a movie (n, height, width, 3); codec, format of pixels and frames a second."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        frames = np.array([frame.to_ndarray(format="rgb24") for frame in container.decode(stream)], int)
        assert frames.shape[1:] == (height, width, 3)
        return frames, (stream.codec_context.name, stream.pix_fmt, float(stream.average_rate))


def test_movie_has_its_frames(tmp_path, run):
    reports, progress = [], lambda k, n: reports.append((k, n))
    path = render_movie(run, tmp_path / "a.mp4", fps=10, span=(2.0, 4.0), speed=1.0, size=(321, 181), progress=progress)
    images, facts = movie_frames(path, 322, 182)  # even sizes
    assert len(images) == 21 and facts == ("h264", "yuv420p", 10.0)
    assert reports == [(k, 21) for k in range(1, 22)]
    assert all(np.abs(a - b).max() > 50 for a, b in pairwise(images))
    assert os.listdir(tmp_path) == ["a.mp4"]


def test_frame_is_the_picture_of_its_time(tmp_path, run):
    folder = render_movie(run, tmp_path / "frames", fps=1, span=(0.0, 5.0), speed=1.0, **SMALL)
    single = pixels_of(render_picture(run, tmp_path / "a.png", time=3.0, **SMALL))
    assert np.array_equal(pixels_of(folder / "frame_00004.png"), single)


def test_run_shows_itself_as_view_renders_it(tmp_path, run):
    rendered = pixels_of(render_picture(run, tmp_path / "a.png", time=3.0, **SMALL))
    assert np.array_equal(pixels_of(run.view(3.0, **SMALL)), rendered)
    plotted = run.plot("bodies/boom/position")
    assert plotted.suffix == ".svg" and "position" in plotted.read_text(encoding="utf-8")
    assert "<h1>" in run.report(tmp_path / "a.html").read_text(encoding="utf-8")
    with pytest.raises(FileExistsError):
        run.report(tmp_path / "a.html")


def test_interrupted_movie_has_the_frames_drawn_before(tmp_path, run):
    def stop(done, count):
        if done == 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render_movie(run, tmp_path / "a.mp4", fps=10, progress=stop, **SMALL)
    assert len(movie_frames(tmp_path / "a.mp4", 320, 180)[0]) == 7
    assert os.listdir(tmp_path) == ["a.mp4"]


DRAW = """
import sys
from femflex.results import open_run
from femflex.view import render_picture
with open_run(sys.argv[1]) as run:
    render_picture(run, sys.argv[2], size=(320, 180), samples=1)
"""


@pytest.mark.slow
def test_picture_without_a_display(tumbling, tmp_path):
    quiet = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-c", DRAW, str(tumbling), str(tmp_path / "a.png")]
    done = subprocess.run(command, env=quiet, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "") and (tmp_path / "a.png").exists()


def test_importing_view_loads_no_renderer():
    code = "import femflex.view, sys; print([m for m in ('pyvista', 'vtkmodules', 'matplotlib') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_picture_of_a_killed_run(tmp_path, tumbling):
    """Unfinished: trimmed rows, no `ended`."""
    import h5py

    copy = tmp_path / "run.h5"
    copy.write_bytes(tumbling.read_bytes())
    with h5py.File(copy, "r+") as file:
        file["progress"][...] = [150, -1]
        file.attrs["complete"] = False
    with open_run(copy) as run:
        assert plan_scene(run, Look()).span == (0.0, pytest.approx(149 * 0.05))
        assert pixels_of(render_picture(run, tmp_path / "a.png", **SMALL)).shape == (180, 320, 3)


TILE = (200, 150)


@pytest.fixture
def boom():
    return craft()["boom"]


@pytest.fixture
def panel():
    return craft()["panel"]


@pytest.mark.parametrize("theme", ["dark"])
def test_montage_has_a_tile_for_every_shape(tmp_path, boom, theme):
    image = pixels_of(mode_montage(boom, tmp_path / "a.png", theme=theme, size=TILE))
    assert image.shape == (300, 400, 3)
    tiles = [image[r : r + 150, c : c + 200] for r in (0, 150) for c in (0, 200)]
    assert all(np.ptp(tile, axis=2).max() > 80 for tile in tiles)  # coloured by displacement
    drawings = [tile[:115] for tile in tiles]  # above the captions
    assert all(np.abs(a - b).max() > 100 for a, b in pairwise(drawings))
    rim = [np.concatenate([tile[0], tile[-1], tile[:, 0], tile[:, -1]]) for tile in tiles]
    assert all(np.ptp(edge, axis=0).max() == 0 for edge in rim)  # nothing clipped


def test_mode_movie_is_periodic(tmp_path, panel):
    folder = mode_movie(panel, tmp_path / "m", mode=1, seconds=1.0, cycles=2, fps=8, size=(240, 160))
    assert len(os.listdir(folder)) == 16
    frames = [pixels_of(folder / f"frame_{k:05d}.png") for k in range(1, 17)]
    assert all(np.array_equal(a, b) for a, b in zip(frames[:8], frames[8:], strict=True))
    assert np.array_equal(frames[0], frames[4])  # both ends of the swing pass through rest
    up, down = ((np.abs(f - f[0, 0]).sum(axis=2) > 100)[:120].nonzero()[0].mean() for f in (frames[2], frames[6]))
    assert up < down - 3  # pixels
