"""Pictures and movies: size, content, texts, files."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import pairwise

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

import femflex.view.overlay
import femflex.view.scene
from femflex.results import open_run
from femflex.view import Look, render_movie, render_picture
from femflex.view.extent import automatic_scale
from femflex.view.motion import motion
from femflex.view.plan import planned

SMALL = {"size": (320, 180), "samples": 1}


def read(path):
    with Image.open(path) as image:
        return np.asarray(image)


@pytest.fixture
def texts(monkeypatch):
    """Every text laid over a scene."""
    seen = []
    real = femflex.view.overlay.add_text

    def spy(renderer, text, *args, **more):
        actor = real(renderer, text, *args, **more)
        seen.append(actor)
        return actor

    monkeypatch.setattr(femflex.view.overlay, "add_text", spy)
    monkeypatch.setattr(femflex.view.scene, "add_text", spy)
    return lambda: [actor.GetInput() for actor in seen]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_picture_has_its_size_and_shows_the_bodies(tmp_path, run, theme):
    image = read(render_picture(run, tmp_path / "a.png", time=3.0, theme=theme, size=(400, 240)))
    assert image.shape == (240, 400, 3)
    assert (image[0].mean() > 200) == (theme == "light")
    hue = np.ptp(image.astype(int), axis=2)  # greys have none
    assert np.count_nonzero(hue > 60) > 500 and len(np.unique(image.reshape(-1, 3), axis=0)) > 200


def test_the_picture_says_title_time_and_scale(tmp_path, run, texts):
    render_picture(run, tmp_path / "a.png", time=3.0, **SMALL)
    found = texts()
    assert {
        "A box with a boom and a panel",
        "t = 3.00 s",
        "deformation true to scale",
        "inertial axes; arrows on bodies: x, y, z",
    } <= set(found)
    assert {"X", "Y", "Z"} <= set(found) and "elastic\ndisplacement\n[cm]" in found


def test_a_magnified_picture_says_by_how_much(tmp_path, orbiting, texts):
    render_picture(orbiting, tmp_path / "a.png", time=754.2, scale=2.5, title="Mine", **SMALL)
    assert {
        "Mine",
        "t = 12 min 34.2 s",
        "deformation × 2.5",
        "orbital axes; arrows on bodies: x, y, z",
        "flight",
    } <= set(texts())


def test_the_colour_bar_ends_at_the_largest_displacement_of_the_run(run):
    """Boom: both bending planes together; amplitudes of the made-up motion times unit tip shapes."""
    plan = planned(run, Look())
    tip = run["markers/boom.tip/deflection"]
    assert plan.largest == pytest.approx(np.linalg.norm(tip, axis=1).max(), rel=2e-3)  # the rim turns a little too
    assert plan.bar.unit == "cm" and plan.bar.top >= 100 * plan.largest > 0.7 * plan.bar.top
    assert abs(run.time[np.argmax(np.linalg.norm(tip, axis=1))] - plan.peak) < 0.11


def test_a_small_deformation_is_magnified_by_a_round_factor(run):
    assert planned(run, Look(scale="auto")).scale == 1.0  # a metre on fourteen is large enough as it is
    assert [automatic_scale(u, 10.0) for u in (0.5, 0.05, 0.003, 0.0)] == [1.0, 10.0, 200.0, 1.0]


def test_magnification_moves_the_picture_of_flexible_bodies_alone(tmp_path, run):
    look = {**SMALL, "view": (0.0, -1.0, 0.3), "camera": "body:hub", "triads": False, "edges": "none"}
    true, more = (read(render_picture(run, tmp_path / f"{s}.png", time=8.55, scale=s, **look)) for s in (1.0, 4.0))
    assert np.count_nonzero(np.abs(true.astype(int) - more).sum(axis=2) > 60) > 100


def test_traces_show_the_path_up_to_now(tmp_path, run):
    look = {**SMALL, "traces": ("boom.tip",), "triads": False}
    early, late = (read(render_picture(run, tmp_path / f"{t}.png", time=t, **look)) for t in (1.0, 18.0))
    red = [np.count_nonzero(np.abs(i.astype(int) - [209, 73, 91]).sum(axis=2) < 60) for i in (early, late)]
    assert red[1] > 4 * red[0] > 0


@pytest.mark.parametrize("camera", ["fixed", "body"])
def test_a_trace_goes_where_the_magnified_body_is_drawn(run, camera):
    times, scale = run.time[[5, 40]], 7.0
    moving = motion(run, times, camera, "boom" if camera == "body" else "", ("boom.tip",), scale)
    skin = run.bodies()["boom"].skin
    for k in range(2):
        moved = skin.points + scale * np.einsum("n,npa->pa", moving.delta["boom"][k], skin.shapes)
        drawn = moving.position["boom"][k] + moved @ moving.attitude["boom"][k].T
        assert np.allclose(moving.traces["boom.tip"][k], drawn[-1], atol=1e-9)  # the tip is its last point


def movie_frames(path, width, height):
    """Frames of a movie (n, height, width, 3), and what the decoder says of the file."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3).astype(int), done.stderr.decode()


def test_a_movie_has_its_frames_and_they_differ(tmp_path, run):
    seen, progress = [], lambda k, n: seen.append((k, n))
    path = render_movie(run, tmp_path / "a.mp4", fps=10, span=(2.0, 4.0), speed=1.0, size=(321, 181), progress=progress)
    images, said = movie_frames(path, 322, 182)  # even sizes
    assert len(images) == 21 and "h264" in said and "10 fps" in said and "yuv420p" in said
    assert seen == [(k, 21) for k in range(1, 22)]
    assert all(np.abs(a - b).max() > 50 for a, b in pairwise(images))
    assert os.listdir(tmp_path) == ["a.mp4"]


def test_a_long_run_is_shown_faster_and_says_so(tmp_path, orbiting, texts):
    path = render_movie(orbiting, tmp_path / "frames", fps=1, **SMALL)
    assert sorted(os.listdir(path)) == [f"frame_{k:05d}.png" for k in range(1, 14)]  # 12 s
    assert "450 × real time" in texts()
    assert read(path / "frame_00007.png").shape == (180, 320, 3)


def test_a_frame_is_the_picture_of_its_time(tmp_path, run):
    folder = render_movie(run, tmp_path / "frames", fps=1, span=(0.0, 5.0), speed=1.0, **SMALL)
    single = read(render_picture(run, tmp_path / "a.png", time=3.0, **SMALL))
    assert np.array_equal(read(folder / "frame_00004.png"), single)


def test_an_interrupted_movie_keeps_the_frames_drawn(tmp_path, run):
    def stop(done, count):
        if done == 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render_movie(run, tmp_path / "a.mp4", fps=10, progress=stop, **SMALL)
    assert len(movie_frames(tmp_path / "a.mp4", 320, 180)[0]) == 7
    assert os.listdir(tmp_path) == ["a.mp4"]


def test_a_failed_picture_leaves_nothing(tmp_path, run, monkeypatch):
    monkeypatch.setattr("femflex.view.render.write_png", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        render_picture(run, tmp_path / "a.png", **SMALL)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"time": 21.0}, r"time 21 s is outside the run, which goes from 0 s to 20 s"),
        ({"camera": "orbital"}, r"camera 'orbital' needs a run in an orbit; this one has none"),
        ({"camera": "body:wing"}, r"names no body of the run; its bodies are \['boom', 'hub', 'panel'\]"),
        ({"camera": "fly"}, r"camera 'fly' is not known; known are \['auto', 'fixed'"),
        ({"theme": "blue"}, r"theme 'blue' is not known; known are \['dark', 'light'\]"),
        ({"traces": ("boom.end",)}, r"traces \['boom.end'\] are not markers of the run; its markers are \['boom.tip'"),
        ({"scale": 0.0}, r"scale 0.0 of the deformation is neither a positive number nor 'auto'"),
        ({"scale": "big"}, r"scale 'big' of the deformation is neither"),
        ({"size": (10, 10)}, r"size 10 x 10 is not between 64 and 16384 pixels"),
        ({"edges": "all"}, r"edges 'all' are not known"),
        ({"fit": "all"}, r"fit 'all' is not known"),
        ({"view": (0, 0, 0)}, r"has no direction; give one from the scene to the camera"),
    ],
)
def test_what_cannot_be_drawn_is_told(tmp_path, run, options, told):
    with pytest.raises(ValueError, match=told):
        render_picture(run, tmp_path / "a.png", **options)
    assert os.listdir(tmp_path) == []


def test_movies_that_cannot_be_are_told(tmp_path, run):
    with pytest.raises(ValueError, match=r"neither an \.mp4 file nor a folder of pictures"):
        render_movie(run, tmp_path / "a.avi", **SMALL)
    with pytest.raises(ValueError, match="a movie needs a span of time; from 3 s to 3 s there is none"):
        render_movie(run, tmp_path / "a.mp4", span=(3.0, 3.0), **SMALL)
    with pytest.raises(ValueError, match="speed is -1; it is the number of seconds of the run"):
        render_movie(run, tmp_path / "a.mp4", speed=-1, **SMALL)
    with pytest.raises(ValueError, match="fps is 0; a movie needs a positive number"):
        render_movie(run, tmp_path / "a.mp4", fps=0, speed=1.0, **SMALL)
    (tmp_path / "b.mp4").write_text("mine")
    with pytest.raises(FileExistsError, match=r"b\.mp4 exists"):
        render_movie(run, tmp_path / "b.mp4", **SMALL)
    with pytest.raises(ValueError, match=r"a picture is written as \.png; a\.jpg is not one"):
        render_picture(run, tmp_path / "a.jpg")
    assert (tmp_path / "b.mp4").read_text() == "mine"


def test_a_run_without_skins_says_so(tmp_path, run, monkeypatch):
    bare = {
        name: type(body)(body.mass, body.kinds, body.omega, body.markers, None) for name, body in run.bodies().items()
    }
    monkeypatch.setattr(type(run), "bodies", lambda self: bare)
    with pytest.raises(ValueError, match=r"no body of the run can be drawn: \['boom', 'hub', 'panel'\] have no skin"):
        render_picture(run, tmp_path / "a.png")


DRAW = """
import sys
from femflex.results import open_run
from femflex.view import NoRenderer, render_picture
with open_run(sys.argv[1]) as run:
    try:
        render_picture(run, sys.argv[2], size=(320, 180), samples=1)
    except NoRenderer as error:
        print(error)
    else:
        print("drawn")
"""


def drawn_elsewhere(tumbling, tmp_path, **environment):
    quiet = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-c", DRAW, str(tumbling), str(tmp_path / "a.png")]
    return subprocess.run(command, env={**quiet, **environment}, capture_output=True, text=True)


def test_without_a_display_pictures_are_drawn_quietly(tumbling, tmp_path):
    done = drawn_elsewhere(tumbling, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "drawn\n", "")


@pytest.mark.slow
def test_without_a_renderer_one_sentence_says_so(tumbling, tmp_path):
    """A window kind that needs a display, where there is none: VTK itself would crash."""
    done = drawn_elsewhere(tumbling, tmp_path, VTK_DEFAULT_OPENGL_WINDOW="vtkXOpenGLRenderWindow")
    assert done.returncode == 0 and done.stderr == ""
    if done.stdout != "drawn\n":  # it is, where OSMesa is installed
        assert done.stdout.startswith(
            "no picture can be drawn: no off-screen renderer starts here; install EGL or OSMesa"
        )
        assert os.listdir(tmp_path) == []


def test_importing_view_loads_no_renderer():
    code = "import femflex.view, sys; print([m for m in ('pyvista', 'vtkmodules', 'matplotlib') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_a_killed_run_can_be_drawn(tmp_path, tumbling):
    """Unfinished: trimmed rows, no `ended`."""
    import h5py

    copy = tmp_path / "run.h5"
    copy.write_bytes(tumbling.read_bytes())
    with h5py.File(copy, "r+") as file:
        file["progress"][...] = [150, -1]
        file.attrs["complete"] = False
    with open_run(copy) as run:
        assert planned(run, Look()).span == (0.0, pytest.approx(149 * 0.05))
        assert read(render_picture(run, tmp_path / "a.png", **SMALL)).shape == (180, 320, 3)


def test_two_processes_may_write_one_picture(tmp_path, monkeypatch):
    """Each writes beside it under a name of its own; the last one to end stands."""
    import os

    from femflex.view.output import placed

    path = tmp_path / "a.png"
    with placed(path) as first:
        first.write_text("first")
        monkeypatch.setattr(os, "getpid", lambda: 1)
        with placed(path) as second:
            assert second != first
            second.write_text("second")
        assert path.read_text() == "second" and first.read_text() == "first"
    assert path.read_text() == "first" and [one.name for one in tmp_path.iterdir()] == ["a.png"]
