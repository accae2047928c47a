"""The look of scenes: texts with their places, sizes and colours, lights, lines and veils; and windows, movies and
files that fail."""

from __future__ import annotations

import errno
import stat
from types import SimpleNamespace

import numpy as np
import pytest
import pyvista as pv
from support.made_runs import box_skin, panel_skin

import femflex.view.modes as modes
import femflex.view.overlay as overlay
import femflex.view.scene
from femflex.body import Skin
from femflex.view.actors import BodyActor, SightActor, TraceActor, _style, add_ghost
from femflex.view.framing import Margins, framed
from femflex.view.look import Look
from femflex.view.motion import motion
from femflex.view.movie import write_movie
from femflex.view.output import placed
from femflex.view.plan import planned
from femflex.view.scene import Scene
from femflex.view.surface import surface_of
from femflex.view.theme import THEMES
from femflex.view.units import Bar, length_unit
from femflex.view.window import NoRenderer, open_window, place_camera

DARK = THEMES["dark"]


@pytest.fixture
def placed_texts(monkeypatch):
    """Place, size in pixels, colour, alignment and weight of every text, by its words."""
    seen = {}
    real = overlay.add_text

    def spy(renderer, text, where, pixels, colour, align="left top", bold=False):
        x, y = where
        seen[text] = ((round(x, 6), round(y, 6)), round(pixels, 6), colour, align, bold)
        return real(renderer, text, where, pixels, colour, align, bold)

    monkeypatch.setattr(overlay, "add_text", spy)
    monkeypatch.setattr(femflex.view.scene, "add_text", spy)
    return seen


def shown_texts(run, placed_texts, **look):
    """The texts of a scene of 600 by 360 pixels."""
    look = Look(size=(600, 360), theme="dark", **look)
    placed_texts.clear()
    plan = planned(run, look)
    with Scene(run, look, plan, 1, "a note") as scene:
        scene.show(motion(run, run.time[:1], plan.camera, plan.body, (), plan.scale), 0)
    return dict(placed_texts)


def test_texts_of_a_scene_have_their_places_sizes_and_colours(run, placed_texts):
    found = shown_texts(run, placed_texts, title="Mine", scale=2.0)
    assert found["Mine"] == ((0.02, 0.965), 12.0, DARK.text, "left top", True)
    assert found["deformation × 2"] == ((0.98, 0.035), 9.0, DARK.text, "right bottom", False)
    assert found["a note"] == ((0.55, 0.035), 9.0, DARK.faint, "center bottom", False)
    assert found["scale of the whole run"] == ((0.985, 0.165), 7.5, DARK.faint, "right bottom", False)
    assert found[""] == ((0.98, 0.965), 11.25, DARK.text, "right top", False)  # the clock
    axes = "inertial axes; arrows on bodies: x, y, z"
    assert found[axes] == ((0.02, 0.035), 7.5, DARK.faint, "left bottom", False)
    for name, colour in zip("XYZ", DARK.axes, strict=True):
        assert found[name][1:] == (8.28, colour, "center center", True)
    (length,) = [one for text, one in found.items() if text.endswith(" m")]
    assert length == ((0.345, 0.057), 8.28, DARK.text, "center bottom", False)
    (title,) = [one for text, one in found.items() if text.endswith("m]")]
    assert title == ((0.985, 0.775), 8.28, DARK.text, "right bottom", False)
    levels = [one for text, one in found.items() if text.replace(".", "").isdigit()]
    assert {(where[0], *rest) for where, *rest in levels} == {(0.9316, 8.28, DARK.text, "left center", False)}
    long = "a title of many words that would reach the clock on the other side of it"
    found = shown_texts(run, placed_texts, title=long, triads=False)
    assert found[long][1] == pytest.approx(0.78 * 600 / (0.66 * len(long)), abs=1e-6) and found[long][1] < 12
    assert not any("axes" in text for text in found) and found["deformation true to scale"][0] == (0.98, 0.035)


@pytest.mark.parametrize(("title", "shown"), [(None, True), ("", False)])
def test_an_empty_title_takes_the_place_of_that_of_the_run(run, placed_texts, title, shown):
    assert (run.title in shown_texts(run, placed_texts, title=title)) == shown


def test_lines_are_as_much_thicker_as_the_window_that_is_drawn_is_larger(run):
    look = Look(size=(300, 180), theme="dark")
    plan = planned(run, look)
    widths = []
    for samples in (1, 3):
        with Scene(run, look, plan, samples, "") as scene:
            scene.show(motion(run, run.time[:1], plan.camera, plan.body, (), plan.scale), 0)
            actors = [one for one in scene._plotter.actors.values() if hasattr(one, "prop")]
            widths.append(sorted(one.prop.line_width for one in actors))
    thick = [(a, b) for a, b in zip(*widths, strict=True) if b != 1.0]
    assert thick and all(b == pytest.approx(3 * a) for a, b in thick)


def test_a_scene_in_orbit_names_its_axes_and_the_run_its_title(orbiting, placed_texts):
    found = shown_texts(orbiting, placed_texts)
    assert {"orbital axes; arrows on bodies: x, y, z", "normal", "up", "flight", orbiting.title} <= found.keys()


def recorded_actor():
    calls = []
    note = lambda name: lambda *words: calls.append((name, *words))  # noqa: E731
    mapper = SimpleNamespace(SetRelativeCoincidentTopologyLineOffsetParameters=note("offset"))
    shader = SimpleNamespace(AddFragmentShaderReplacement=note("shader"))
    actor = SimpleNamespace(prop=SimpleNamespace(), mapper=mapper, GetShaderProperty=lambda: shader)
    return actor, calls


@pytest.mark.parametrize(
    ("kind", "width", "opacity", "round_dots"),
    [("edges", 1.1, 1.0, False), ("mesh", 0.8, 0.6, False), ("lines", 4.0, 1.0, False), ("dots", 4.0, 1.0, True)],
)
def test_lines_and_dots_are_unlit_and_lie_before_faces(kind, width, opacity, round_dots):
    actor, calls = recorded_actor()
    _style(actor, kind, 2.0, True)
    assert vars(actor.prop) == {
        "ambient": 0.36, "diffuse": 0.66, "lighting": False, "line_width": pytest.approx(2 * width),
        "opacity": opacity, "point_size": 18.0, "render_points_as_spheres": round_dots,
    }  # fmt: skip
    assert calls == [("offset", 0.0, -4.0)]


@pytest.mark.parametrize(("closed", "culling"), [(True, "back"), (False, "none")])
def test_faces_are_matt_and_the_inner_ones_of_a_closed_skin_are_left_out(closed, culling):
    actor, calls = recorded_actor()
    _style(actor, "faces", 2.0, closed)
    found = {"ambient": 0.36, "diffuse": 0.66, "interpolation": "Phong", "culling": culling}
    assert vars(actor.prop) == found and calls[0][1:3] == ("//VTK::Light::Impl", True)


def sheet():
    """Two quads with one shape, and a line."""
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.9], [0, 1, 0], [1, 1, 0], [2, 1, 0.9], [3, 0, 0], [4, 0, 0.0]])
    cells = {"quad": np.array([[0, 1, 4, 3], [1, 2, 5, 4]]), "line": np.array([[6, 7]])}
    return Skin(points, cells, np.random.default_rng(3).normal(size=(1, 8, 3)))


def hexes(actor):
    return pv.Color(actor.prop.color).hex_rgb


def test_bodies_ghosts_traces_and_sights_have_their_colours():
    plotter = pv.Plotter(off_screen=True, window_size=[80, 60])
    surface = surface_of(sheet(), "mesh")
    plain = BodyActor(plotter, surface, "#123456", DARK, None, 2.0)
    colours = dict(zip(plain._parts, map(hexes, plain._actors), strict=True))
    assert colours == {kind: DARK.edge if kind in ("edges", "mesh") else "#123456" for kind in plain._parts}
    bar = Bar(100.0, "cm", 20.0, 4, True)
    coloured = BodyActor(plotter, surface, "#123456", DARK, bar, 2.0)
    coloured.rescale(0.05)
    for kind, actor in zip(coloured._parts, coloured._actors, strict=True):
        if kind == "edges":
            assert hexes(actor) == DARK.edge
            continue
        assert actor.mapper.GetScalarRange() == pytest.approx((0.0, 5.0))
        low = actor.mapper.lookup_table.GetTableValue(0)[:3]
        assert low == pytest.approx(DARK.colour_map(True)(0.0)[:3], abs=0.01)
    assert not plotter.scalar_bars and not any(actor.prop.interpolation == "Gouraud" for actor in plain._actors[1:])
    for actor in add_ghost(plotter, surface, DARK, 2.0):
        faces = actor.mapper.dataset.faces.size > 0
        assert (hexes(actor), actor.prop.line_width) == (DARK.ghost, pytest.approx(2.2))
        assert actor.prop.opacity == pytest.approx(0.16 if faces else 0.9)
        assert faces or str(actor.prop.interpolation).endswith(("Flat", "FLAT"))
    before = set(plotter.actors)
    TraceActor(plotter, np.random.default_rng(1).normal(size=(5, 3)), DARK, 2.0)
    SightActor(plotter, 4.0, DARK, 2.0)
    lines = [actor for name, actor in plotter.actors.items() if name not in before]
    assert [hexes(actor) for actor in lines] == [DARK.trace] * 2 and not any(actor.prop.lighting for actor in lines)
    assert lines[1].prop.line_width == pytest.approx(5.0)
    plotter.close()


def test_a_window_has_two_lights_the_themes_background_and_its_camera():
    plotter = open_window((80, 60), DARK)
    lights = plotter.renderer.lights
    assert [(light.position, light.intensity, light.is_camera_light) for light in lights] == [
        ((0.3, 0.0, 1.0), 0.75, True),
        ((-0.7, 0.8, 0.7), 0.55, True),
    ]
    assert pv.Color(plotter.background_color).hex_rgb == DARK.background
    assert plotter.render_window.GetMultiSamples() in (0, 1) and list(plotter.window_size) == [80, 60]
    view = SimpleNamespace(
        place=np.array([1.0, 2, 3]),
        focus=np.array([0.0, 1, 0]),
        up=np.array([0.0, 0, 1]),
        angle=0.5,
        near=0.25,
        far=9.0,
    )
    place_camera(plotter, view)
    camera = plotter.camera
    assert (camera.position, camera.focal_point, camera.up) == ((1, 2, 3), (0, 1, 0), (0, 0, 1))
    assert camera.view_angle == pytest.approx(np.degrees(0.5)) and camera.clipping_range == (0.25, 9.0)
    plotter.close()


def test_shapes_are_framed_at_both_ends_of_their_swing_with_room_for_the_caption(monkeypatch, placed_texts):
    monkeypatch.setattr(modes, "add_text", overlay.add_text)
    own = panel_skin(n=(4, 2))
    made = []
    real = modes.BodyActor
    monkeypatch.setattr(modes, "BodyActor", lambda *words: made.append(words) or real(*words))
    size = np.linalg.norm(np.ptp(own.points, axis=0))
    shapes = [0.14 * size * shape / np.linalg.norm(shape, axis=1).max() for shape in own.shapes]
    cloud = np.concatenate([own.points, *(own.points + sign * shape for shape in shapes for sign in (1, -1))])
    towards, up = np.array([1.0, -2.0, 0.5]), np.array([0.0, 0.0, 1.0])
    margins = Margins(left=0.05, right=0.05, top=0.06, bottom=0.16)
    view = framed(cloud, towards, up, 1.5, margins)
    with modes._ModeScene(own, DARK, (150, 100), tuple(towards), 2, None) as scene:
        camera = scene._plotter.camera
        assert camera.position == pytest.approx(view.place) and camera.focal_point == pytest.approx(view.focus)
        assert list(scene._plotter.window_size) == [300, 200]
        scene.choose(1, "mode 2")
        assert scene._caption.GetInput() == "mode 2"
    (_, surface, colour, theme, bar, pixel, paint) = made[0]
    assert (colour, theme, paint) == (DARK.rigid[0], DARK, None) and pixel == pytest.approx(200 / 720 + 0.7)
    assert bar == Bar(1.0, "", pytest.approx(0.14 * size), 4) and len(surface.quads)
    assert placed_texts[""] == ((0.5, 0.045), 0.03 * 200 + 18, DARK.text, "center bottom", False)
    band = modes._title_band("Modes", 120, 40, DARK)
    assert band.shape == (40, 120, 3) and placed_texts["Modes"] == ((0.5, 0.45), 20, DARK.text, "center center", True)


def test_a_machine_without_a_renderer_is_reported_what_to_install(monkeypatch):
    from vtkmodules.vtkCommonCore import vtkObject

    closed = []
    window = SimpleNamespace(SetMultiSamples=lambda n: None, Initialize=lambda: None, GetInitialized=lambda: 0)
    plotter = SimpleNamespace(render_window=window, close=lambda: closed.append(1))
    monkeypatch.setattr(pv, "Plotter", lambda **words: plotter)
    before = vtkObject.GetGlobalWarningDisplay()
    with pytest.raises(NoRenderer) as told:
        open_window((80, 60), DARK)
    assert str(told.value) == (
        "no picture can be drawn: no off-screen renderer starts here; install EGL or OSMesa (on Debian and Ubuntu: "
        "libegl1 or libosmesa6), or draw the pictures from the result file elsewhere"
    )
    assert closed == [1] and vtkObject.GetGlobalWarningDisplay() == before


FRAMES = [np.full((4, 6, 3), k, np.uint8) for k in range(3)]


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("cat > /dev/null; echo ' it is bad ' >&2; exit 3", "it is bad"),
        ("cat > /dev/null; exit 3", "ffmpeg ended with 3"),
    ],
)
def test_an_encoder_that_fails_is_reported_and_leaves_nothing(script, said, tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr("imageio_ffmpeg.get_ffmpeg_exe", lambda: str(program))
    path = tmp_path / "m.mp4"
    with pytest.raises(OSError, match=f"m.mp4 cannot be written: {said}$"):
        write_movie(path, FRAMES, 3, 5.0)
    assert [entry.name for entry in tmp_path.iterdir()] == ["ffmpeg"]


def test_an_encoder_that_ends_early_is_reported(tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho 'no such codec' >&2; exit 1\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr("imageio_ffmpeg.get_ffmpeg_exe", lambda: str(program))
    frames = (np.zeros((400, 600, 3), np.uint8) for _ in range(50))  # more than a pipe holds
    with pytest.raises(OSError, match=r"m\.mp4 cannot be written: no such codec$"):
        write_movie(tmp_path / "m.mp4", frames, 50, 5.0)
    assert not (tmp_path / "m.mp4").exists()


def test_the_encoder_gets_size_and_rate_and_pads_to_even_sides(tmp_path, monkeypatch):
    program, kept = tmp_path / "ffmpeg", tmp_path / "words"
    program.write_text(f'#!/bin/sh\nfor last; do :; done\ncat > "$last"\necho "$@" > {kept}\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr("imageio_ffmpeg.get_ffmpeg_exe", lambda: str(program))
    path = write_movie(tmp_path / "m.mp4", FRAMES, 3, 12.5)
    assert path.read_bytes() == b"".join(frame.tobytes() for frame in FRAMES)
    words = kept.read_text()
    for pair in ("-s 6x4", "-r 12.5", "-pix_fmt rgb24", "-vf pad=ceil(iw/2)*2:ceil(ih/2)*2", "-crf 18", "-y"):
        assert pair in words
    with pytest.raises(FileExistsError):
        write_movie(tmp_path / "m.mp4", FRAMES, 3, 12.5)


def test_movies_without_frames_and_of_wrong_kinds(tmp_path):
    path = write_movie(tmp_path / "none", [], 3, 5.0)
    assert path.is_dir() and not list(path.iterdir())
    (tmp_path / "file").touch()
    with pytest.raises(FileExistsError, match="file exists and is not empty"):
        write_movie(tmp_path / "file", FRAMES, 3, 5.0, force=True)
    for fps in (0.0, -1.0):
        with pytest.raises(ValueError, match=f"fps is {fps}; a movie needs a positive number of frames a second"):
            write_movie(tmp_path / "m", FRAMES, 3, fps)
    told = []
    write_movie(tmp_path / "two", iter(FRAMES[:2]), 5, 5.0, progress=lambda *at: told.append(at))
    assert told == [(1, 5), (2, 5)] and len(list((tmp_path / "two").iterdir())) == 2


def test_a_full_disk_names_the_file_that_was_to_be_written(tmp_path):
    path = tmp_path / "a.png"
    for named, other in ((None, str(path)), ("part", str(path)), ("/elsewhere", "/elsewhere")):
        with pytest.raises(OSError, match="full") as told, placed(path) as part:
            part.write_bytes(b"half")
            error = OSError(errno.ENOSPC, "full")
            error.filename = str(part) if named == "part" else named
            raise error
        assert told.value.filename == other and not list(tmp_path.iterdir())
    with pytest.raises(OSError, match="odd") as told, placed(path):
        raise OSError("odd")
    assert told.value.filename is None


def test_an_interrupt_keeps_what_was_written_so_far(tmp_path):
    for content, kept in ((b"half", True), (b"", False)):
        path = tmp_path / f"{kept}.mp4"
        with pytest.raises(KeyboardInterrupt), placed(path) as part:
            assert part.suffix == ".mp4" and part.parent == tmp_path
            part.write_bytes(content)
            raise KeyboardInterrupt
        assert path.exists() is kept and (not kept or path.read_bytes() == content)


def test_a_run_without_rows_has_nothing_to_draw():
    class Empty(list):
        path = "run.h5"

    with pytest.raises(ValueError, match=r"run\.h5 holds no instants, so there is nothing to draw"):
        planned(Empty(), Look())  # type: ignore[arg-type]


def test_lengths_below_a_nanometre_are_in_nanometres():
    assert length_unit(1e-12) == (1e9, "nm") and length_unit(2e-6)[1] == "µm" and length_unit(1.9e-2)[1] == "mm"


def test_a_box_that_is_seen_small_is_drawn_with_thick_edges():
    """A body of a thousandth of the craft's size; its edges are drawn as lines of the body's own colour."""
    surface, thick = (surface_of(box_skin(1, 1, 1), kind) for kind in ("sharp", "thick"))
    assert len(surface.edges) == 12 and not len(surface.lines)
    assert len(thick.lines) == 12 and not len(thick.edges)
