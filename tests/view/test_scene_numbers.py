"""What a window holds: points, matrices, colours and places of texts, by their numbers; shapes as they swing."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation
from support.made_runs import craft, panel_skin

import femflex.view.modes as modes
import femflex.view.overlay as overlay
from femflex.body import Skin
from femflex.view.actors import BodyActor, SightActor, TraceActor, matt_shading
from femflex.view.drawing import Drawing
from femflex.view.framing import View
from femflex.view.look import Look
from femflex.view.modes import craft_montage, craft_movie, mode_movie
from femflex.view.motion import motion
from femflex.view.movie import write_movie
from femflex.view.overlay import CornerTriad, add_colour_bar, add_length_scale, matrix, triad_actor
from femflex.view.plan import planned
from femflex.view.render import render_movie
from femflex.view.scene import Scene
from femflex.view.surface import Points, breadth, surface_of, twist_of
from femflex.view.theme import THEMES
from femflex.view.units import Bar
from femflex.view.window import grabbed, open_window

LIGHT = THEMES["light"]


@pytest.fixture
def plotter():
    window = open_window((160, 120), LIGHT)
    yield window
    window.close()


def skin(seed=1, n=2):
    """A sheet of two quads, a triangle beside it, a line and a dot; random shapes."""
    points = np.array(
        [[0, 0, 0], [1, 0, 0], [2, 0, 0.9], [0, 1, 0], [1, 1, 0], [2, 1, 0.9], [4, 0, 0], [5, 0, 1], [4, 2, 0.0]]
    )
    cells = {"quad": [[0, 1, 4, 3], [1, 2, 5, 4]], "line": [[6, 7]], "vertex": [[8]]}
    shapes = np.random.default_rng(seed).normal(size=(n, 9, 3)) * 0.1
    return Skin(points, {kind: np.array(rows) for kind, rows in cells.items()}, shapes)


def test_a_body_is_deformed_in_its_own_frame_and_coloured_by_its_true_displacement(plotter):
    own = skin()
    surface = surface_of(own)
    bar = Bar(100.0, "cm", 20.0, 4)
    body = BodyActor(plotter, surface, "#123456", LIGHT, bar, 1.0)
    r, C, delta = np.array([1.0, -2.0, 3.0]), Rotation.from_rotvec([0.3, 0.5, -0.2]).as_matrix(), np.array([0.7, -1.2])
    body.show(r, C, delta, 3.0)
    u = np.tensordot(delta, own.shapes, axes=1)
    seen = {}
    for kind, data in body._parts.items():
        numbers = (surface.skin if kind == "faces" else surface.wires).numbers
        assert np.asarray(data.points) == pytest.approx(own.points[numbers] + 3.0 * u[numbers], abs=1e-5)
        if kind != "edges":
            painted = np.asarray(data.point_data["painted"])
            assert painted == pytest.approx(100.0 * np.linalg.norm(u[numbers], axis=1), rel=1e-4)
        seen[kind] = len(numbers)
    assert set(seen) == {"faces", "edges", "lines", "dots"}
    for actor in body._actors:
        pose = actor.GetUserMatrix()
        found = np.array([[pose.GetElement(i, j) for j in range(4)] for i in range(4)])
        assert found == pytest.approx(np.block([[C, r[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]]))
    normals = np.asarray(body._parts["faces"].point_data["Normals"])
    assert normals == pytest.approx(surface.normals(np.asarray(body._parts["faces"].points)), abs=1e-6)
    body.rescale(0.05)
    assert {tuple(actor.mapper.scalar_range) for actor in body._actors if actor.mapper.scalar_visibility} == {
        (0.0, 5.0)
    }
    plain = BodyActor(plotter, surface, "#123456", LIGHT, None, 1.0)
    plain.show(r, C, delta, 1.0)
    assert "painted" not in plain._parts["faces"].point_data


def test_a_paint_takes_the_amplitudes_of_the_bodys_own_shapes(plotter):
    asked = []
    paint = SimpleNamespace(values=lambda y: asked.append(np.array(y)) or np.arange(9, dtype=np.float32))
    surface = surface_of(skin())
    body = BodyActor(plotter, surface, "#123456", LIGHT, Bar(2.0, "x", 20.0, 4, True), 1.0, paint)
    body.show(np.zeros(3), np.eye(3), np.array([1.0, 2.0]), 1.0, np.array([5.0]))
    body.show(np.ones(3), np.eye(3), np.array([1.0, 2.0]), 1.0, np.array([5.0]))  # moved as a whole: not painted again
    body.show(np.ones(3), np.eye(3), np.array([1.0, 2.5]), 1.0)
    assert [y.tolist() for y in asked] == [[5.0], [1.0, 2.5]]
    for kind in ("faces", "lines", "dots"):
        numbers = (surface.skin if kind == "faces" else surface.wires).numbers
        assert np.asarray(body._parts[kind].point_data["painted"]).tolist() == (2.0 * numbers).tolist()


def test_growth_moves_points_and_is_no_displacement():
    own = skin(n=3)
    growing = Skin(own.points, own.cells, own.shapes, own.shapes[2])
    delta = np.array([0.5, -1.0, 2.0], np.float32)
    moved, length = Points.of(growing, np.array([4, 2])).moved(delta, 2.0)
    u = np.tensordot(delta, own.shapes, axes=1)[[4, 2]]
    bent = np.tensordot(delta[:2], own.shapes[:2], axes=1)[[4, 2]]
    assert moved == pytest.approx(own.points[[4, 2]] + 2.0 * u, abs=1e-5)
    assert length == pytest.approx(np.linalg.norm(bent, axis=1), rel=1e-4)
    assert Points.of(own, np.array([1])).moved(delta)[1] == pytest.approx(
        [np.linalg.norm(np.tensordot(delta, own.shapes, axes=1)[1])], rel=1e-4
    )


def test_a_trace_ends_where_the_marker_is_and_a_sight_goes_along_its_direction(plotter):
    path = np.arange(15.0).reshape(5, 3)
    trace = TraceActor(plotter, path, LIGHT, 1.0)
    now = np.array([9.0, 9.5, 8.0])
    for k in (0, 3, 5):
        trace.show(k, now)
        assert np.asarray(trace._data.points).tolist() == [*path[:k].tolist(), *[now.tolist()] * (5 - k)]
    sight = SightActor(plotter, 2.5, LIGHT, 1.0)
    sight.show(np.array([1.0, 2, 3]), np.array([0.0, 0.6, -0.8]))
    assert np.asarray(sight._data.points) == pytest.approx(np.array([[1, 2, 3], [1, 3.5, 1.0]]))


def test_three_arrows_have_their_lengths_and_colours():
    actor = triad_actor(LIGHT, np.array([1.0, 2.0, 3.0]), 0.05)
    assert np.reshape(actor.GetBounds(), (3, 2))[:, 1] == pytest.approx([1, 2, 3], abs=1e-6)
    assert np.reshape(actor.GetBounds(), (3, 2))[:, 0] == pytest.approx([-0.05] * 3, abs=2e-3)
    from vtkmodules.util.numpy_support import vtk_to_numpy

    data = actor.GetMapper().GetInput()
    colours = vtk_to_numpy(data.GetCellData().GetArray("colour"))
    tips = [
        data.GetCell(int(np.flatnonzero((colours == c).all(axis=1))[0])).GetBounds() for c in np.unique(colours, axis=0)
    ]
    assert len(tips) == 3
    rgb = [tuple(int(name[k : k + 2], 16) for k in (1, 3, 5)) for name in LIGHT.axes]
    for axis in range(3):
        own = np.flatnonzero((colours == rgb[axis]).all(axis=1))
        reach = np.max([np.reshape(data.GetCell(int(k)).GetBounds(), (3, 2))[:, 1] for k in own], axis=0)
        assert int(np.argmax(reach)) == axis and reach[axis] == pytest.approx(axis + 1)


def test_letters_of_the_corner_triad_stand_beyond_the_tips_of_its_axes(plotter):
    view = View(np.array([4.0, -3.0, 2.0]), np.zeros(3), np.array([0.0, 0, 1]), 0.4, 0.1, 9.0)
    triad = CornerTriad(plotter, view, ("normal", "up", "Z"), LIGHT, (160, 120))
    C = Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix()
    triad.show(C)
    aspect = 160 / 120
    for k, (actor, letters) in enumerate(triad._labels):
        place = np.array(actor.GetPosition()) * [aspect, 1.0]
        tip = view.axes[:2] @ C[:, k]
        length = np.linalg.norm(tip)
        beyond = 0.02 + 0.3 * 0.023 * letters * abs(tip[0])
        expected = np.array([0.19, 0.175]) + 0.075 * tip + beyond * tip / length
        assert place == pytest.approx(expected, abs=1e-6) and actor.GetInput() == ("normal", "up", "Z")[k]
    towards = np.stack([view.axes[0], view.axes[1], -view.axes[2]], axis=1)  # its third axis points at the camera
    triad.show(towards)
    end_on = np.array(triad._labels[2][0].GetPosition()) * [aspect, 1.0]
    assert end_on == pytest.approx([0.19 - 0.02, 0.175 - 0.02], abs=1e-6)


@pytest.fixture
def written(monkeypatch):
    """Texts laid over a scene: text -> place, size in pixels, colour, alignment."""
    import femflex.view.scene

    seen = {}
    real = overlay.add_text

    def spy(renderer, text, where, pixels, colour, align="left top", bold=False):
        actor = real(renderer, text, where, pixels, colour, align, bold)
        seen[text] = SimpleNamespace(where=where, pixels=pixels, colour=colour, align=align, bold=bold, actor=actor)
        return actor

    monkeypatch.setattr(overlay, "add_text", spy)
    monkeypatch.setattr(femflex.view.scene, "add_text", spy)
    return seen


def test_labels_of_the_bar_stand_at_their_heights_and_the_scale_is_as_long_as_it_says(plotter, written):
    add_colour_bar(plotter.renderer, Bar(1.0, "cm", 4.0, 2, True, "some\nthing"), LIGHT, (160, 120))
    heights = {text: one.where[1] for text, one in written.items() if "\n" not in text}
    assert heights == pytest.approx({"-4": 0.22, "-2": 0.35, "0": 0.48, "2": 0.61, "4": 0.74})
    assert "some\nthing\n[cm]" in written and written["4"].where[0] == pytest.approx(1 - (0.128 - 0.014) * 120 / 160)
    written.clear()
    from vtkmodules.util.numpy_support import vtk_to_numpy

    for metre, text, length in ((0.02, "10 m", 10.0), (1.7, "10 cm", 0.1), (0.31, "50 cm", 0.5), (0.29, "1 m", 1.0)):
        add_length_scale(plotter.renderer, metre, LIGHT, (160, 120))
        assert text in written and written[text].where[0] == 0.345
        props = plotter.renderer.GetViewProps()
        lines = [props.GetItemAsObject(k) for k in range(props.GetNumberOfItems())]
        last = [prop for prop in lines if prop.IsA("vtkActor2D") and not prop.IsA("vtkTextActor")][-1]
        x = vtk_to_numpy(last.GetMapper().GetInput().GetPoints().GetData())[:, 0]
        assert np.ptp(x) == pytest.approx(length * metre * 120 / 160, rel=1e-5)
        assert np.mean(x) == pytest.approx(0.345, abs=1e-6)


def test_a_scene_shows_bodies_ghosts_triads_and_texts_where_the_motion_has_them(run, written):
    look = Look(size=(200, 120), scale=2.0, camera="body:hub", traces=("boom.tip",), title="Mine")
    plan = planned(run, look)
    with Scene(run, look, plan, 1, "a note") as scene:
        moving = motion(run, np.array([1.0, 7.3]), plan.camera, plan.body, look.traces, plan.scale)
        scene.show(moving, 1)
        pose = lambda actor: np.array([[actor.GetUserMatrix().GetElement(i, j) for j in range(4)] for i in range(4)])  # noqa: E731
        for name in ("hub", "boom", "panel"):
            expected = np.eye(4)
            expected[:3, :3], expected[:3, 3] = moving.attitude[name][1], moving.position[name][1]
            actors = [*scene._bodies[name]._actors, scene._triads[name], *scene._ghosts.get(name, [])]
            assert len(actors) > 2
            for actor in actors:
                assert pose(actor) == pytest.approx(expected, abs=1e-9)
        assert set(scene._ghosts) == {"boom", "panel"}
        trace = np.asarray(scene._traces["boom.tip"]._data.points)
        whole = motion(run, run.time, plan.camera, plan.body, look.traces, plan.scale).traces["boom.tip"]
        done = run.time < 7.3
        assert trace[done] == pytest.approx(whole[done], abs=1e-5)
        assert np.abs(trace[~done] - moving.traces["boom.tip"][1]).max() < 1e-5
        tip = scene._bodies["boom"]._parts["faces"]
        shapes = run.bodies()["boom"].skin
        u = np.tensordot(moving.delta["boom"][1], shapes.shapes, axes=1)
        assert np.linalg.norm(np.asarray(tip.points), axis=1).max() == pytest.approx(
            np.linalg.norm(shapes.points + 2.0 * u, axis=1).max(), rel=1e-5
        )
        assert scene._clock.GetInput() == "t = 7.30 s" and scene.image().shape == (120, 200, 3)
        corner = np.array([[scene._corner._actor.GetUserMatrix().GetElement(i, j) for j in range(3)] for i in range(3)])
        assert corner == pytest.approx(moving.reference[1], abs=1e-9)
    assert {"Mine", "a note", "deformation × 2", "scale of the whole run"} <= set(written)
    assert written["Mine"].bold and written["deformation × 2"].align == "right bottom"
    assert written["deformation × 2"].where == (0.98, 0.035) and written["Mine"].where == (0.02, 0.965)


def test_pictures_are_the_mean_of_their_samples(plotter):
    import pyvista as pv

    plotter.add_mesh(pv.Sphere(), color="red", reset_camera=True)
    fine = grabbed(plotter).astype(float)
    coarse = grabbed(plotter, 3)
    assert coarse.shape == (40, 53, 3)
    blocks = fine[:120, :159].reshape(40, 3, 53, 3, 3).mean(axis=(1, 3))
    assert np.abs(coarse - blocks).max() <= 1.0 and np.ptp(fine) > 50


def test_poses_and_shading_lines_are_as_written():
    found = matrix(np.array([1.0, 2, 3]), np.arange(9.0).reshape(3, 3))
    assert [found.GetElement(i, 3) for i in range(4)] == [1, 2, 3, 1] and found.GetElement(2, 0) == 6
    text = matt_shading()
    assert text.count("dot(normalVCVSOutput") == 2 and "vec3(0.2873, 0.0000, 0.9578)" in text
    assert f"{0.75 / 1.3:.4f} * max(0.0, dot" in text and f"{0.55 / 1.3:.4f} * max(0.0, dot" in text


@pytest.fixture
def swung(monkeypatch):
    """Coordinates that a body in a scene of shapes is shown at, and its colours' ends."""
    seen, tops = [], []

    class Watched(BodyActor):
        def show(self, position, attitude, delta, scale, own=None):
            seen.append(np.array(delta))
            super().show(position, attitude, delta, scale, own)

        def rescale(self, top):
            tops.append(top)
            super().rescale(top)

    monkeypatch.setattr(modes, "BodyActor", Watched)
    return seen, tops


def test_a_mode_of_a_craft_goes_round_its_real_and_imaginary_part(tmp_path, swung):
    seen, tops = swung
    own = panel_skin(n=(4, 2))
    two = Skin(own.points, own.cells, np.stack([2.0 * own.shapes[0], 0.5 * own.shapes[2]]))
    path = craft_movie(two, "mode", tmp_path / "m", seconds=1.0, cycles=2, fps=8, size=(80, 64))
    assert len(list(path.iterdir())) == 16 and len(seen) == 16
    size = np.linalg.norm(np.ptp(own.points, axis=0))
    top = 0.14 * size
    unit = top / np.linalg.norm(two.shapes[0], axis=1).max()
    angle = 2 * np.pi * np.arange(16) / 8
    assert np.array(seen) == pytest.approx(unit * np.stack([np.sin(angle), np.cos(angle)], axis=1), abs=1e-9)
    assert tops == pytest.approx([top])
    seen.clear()
    tops.clear()
    four = Skin(own.points, own.cells, np.concatenate([two.shapes, np.zeros_like(two.shapes)]))
    craft_montage(four, ["one", "two"], tmp_path / "a.png", tile=(64, 64))
    each = [0.14 * size / np.linalg.norm(shape, axis=1).max() for shape in two.shapes]
    assert np.array(seen) == pytest.approx(np.array([[each[0], 0, 0, 0], [0, each[1], 0, 0]]))
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == (128, 64)


def test_a_twisting_shape_is_drawn_with_at_most_half_a_radian_and_a_movie_swings_one_shape(tmp_path, swung):
    seen, _ = swung
    body = craft()["boom"]
    mode_movie(body, tmp_path / "m", mode=2, seconds=0.5, cycles=1, fps=8, size=(80, 64))
    found = np.array(seen)
    assert not found[:, [0, 2, 3]].any() and found[:, 1] == pytest.approx(
        found[:, 1].max() * np.sin(np.pi * np.arange(4) / 2), abs=1e-9
    )
    points = np.array(
        [[x, y, z] for x in np.linspace(0, 10, 21) for y, z in ((0.1, 0), (0, 0.1), (-0.1, 0), (0, -0.1))]
    )
    ring = np.arange(84).reshape(21, 4)
    around = np.roll(ring, -1, axis=1)
    quads = np.stack([ring[:-1], around[:-1], around[1:], ring[1:]], axis=-1).reshape(-1, 4)
    x, y, z = points.T
    shape = np.stack([0 * x, -0.3 * x * z, 0.3 * x * y], axis=1)  # 3 rad at the end, which moves 0.3 m
    tube = Skin(points, {"quad": quads}, np.stack([shape, shape]))
    assert twist_of(tube) == pytest.approx([3.0, 3.0])
    seen.clear()
    craft_montage(tube, ["twist"], tmp_path / "a.png", tile=(64, 64))
    assert seen[0][0] == pytest.approx(0.5 / 3.0) and 0.14 * 10 / 0.3 > 1  # and not 14 % of the size


def test_breadth_is_that_of_a_rod_of_the_same_area_and_length():
    points = np.array([[0, 0, 0], [9, 0, 0], [7, 2, 0], [0, 2, 0], [0, 0, 12.0]])
    cells = {
        "quad8": np.array([[0, 1, 2, 3, 0, 0, 0, 0]]),
        "triangle": np.array([[0, 1, 4]]),
        "line": np.array([[2, 4]]),
    }
    area = 16 + 54  # of a trapezium and a triangle
    assert breadth(Skin(points, cells, np.zeros((0, 5, 3)))) == pytest.approx(area / np.pi / np.sqrt(81 + 4 + 144))


def test_edges_are_sharp_ones_or_all_and_thick_ones_are_lines():
    own = skin()  # two quads with 42 degrees between them, so a smooth edge
    bent = Skin(own.points * [1, 1, 2.0], own.cells, own.shapes)  # 61 degrees: sharp
    pairs = lambda s, table: sorted(tuple(sorted(s.wires.numbers[row])) for row in table)  # noqa: E731
    rim, inner = [(0, 1), (0, 3), (1, 2), (2, 5), (3, 4), (4, 5)], (1, 4)
    smooth, sharp, whole = surface_of(own), surface_of(bent), surface_of(own, "mesh")
    assert pairs(smooth, smooth.edges) == rim
    assert pairs(sharp, sharp.edges) == pairs(whole, whole.edges) == sorted([*rim, inner])
    assert not len(surface_of(own, "none").edges)
    found = surface_of(own, "auto", 0.5)
    assert pairs(found, found.edges) == rim and pairs(found, found.mesh) == [inner]
    assert not len(surface_of(own, "auto", 1.5).mesh)  # half of the sides are shorter
    s = surface_of(own, "thick")
    assert not len(s.edges) and pairs(s, s.lines) == sorted([*rim, inner, (6, 7)])
    assert s.wires.numbers[s.dots].tolist() == [8]
    strange = Skin(own.points, {"hexahedron": np.zeros((1, 8), int)}, own.shapes)
    with pytest.raises(
        ValueError, match=r"cells \['hexahedron'\] of a skin cannot be drawn; known are \['line', 'line3'"
    ):
        surface_of(strange)
    s = smooth
    normals = s.normals(s.skin.rest)
    first = np.cross([1, 0, 0], [0, 1, 0])
    second = np.cross([1, 0, 0.9], [0, 1, 0])
    both = first + second
    by = {int(n): normal for n, normal in zip(s.skin.numbers, normals, strict=True)}
    sign = np.sign(by[0] @ first)
    assert by[0] == pytest.approx(sign * first, abs=1e-6) and by[4] == pytest.approx(
        sign * both / np.linalg.norm(both), abs=1e-6
    )


def test_a_movie_of_a_short_span_lasts_twelve_seconds_unless_it_has_a_speed(tmp_path, run):
    look = {"size": (64, 64), "samples": 1, "camera": "fixed"}
    assert len(list(render_movie(run, tmp_path / "b", fps=0.25, span=(1.0, 4.0), **look).iterdir())) == 4  # slower
    assert len(list(render_movie(run, tmp_path / "c", fps=1.0, span=(1.0, 5.0), speed=2.0, **look).iterdir())) == 3


def test_frames_in_a_folder_replace_older_ones_and_progress_is_told(tmp_path):
    frames = [np.full((4, 6, 3), k, np.uint8) for k in range(3)]
    folder, told = tmp_path / "m", []
    folder.mkdir()
    (folder / "frame_00009.png").write_bytes(b"old")
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(
        FileExistsError, match="m exists and is not empty; choose another folder, or force to write into"
    ):
        write_movie(folder, frames, 3, 5.0)
    path = write_movie(folder, frames, 3, 5.0, force=True, progress=lambda *at: told.append(at))
    assert sorted(p.name for p in path.iterdir()) == [*(f"frame_0000{k}.png" for k in (1, 2, 3)), "notes.txt"]
    assert [np.asarray(Image.open(folder / f"frame_0000{k}.png"))[0, 0, 0] for k in (1, 2, 3)] == [0, 1, 2]
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_a_notebook_shows_pictures_drawings_and_movies_of_their_own_kind(tmp_path, monkeypatch):
    for name in ("a.PNG", "b.svg", "c.mp4"):
        (tmp_path / name).write_bytes(b"<svg>")
    png, svg, mp4 = (Drawing(tmp_path / name) for name in ("a.PNG", "b.svg", "c.mp4"))
    assert png._repr_png_() == b"<svg>" and svg._repr_svg_() == "<svg>"
    assert 'src="data:video/mp4;base64,PHN2Zz4="' in mp4._repr_html_()
    assert [d._repr_png_() for d in (svg, mp4)] == [d._repr_svg_() for d in (png, mp4)] == [None, None]
    assert [d._repr_html_() for d in (png, svg, Drawing(tmp_path / "none.mp4"))] == [None] * 3
    monkeypatch.setattr("femflex.view.drawing.LARGEST", 4)
    assert mp4._repr_html_() is None
    monkeypatch.setattr("femflex.view.drawing.LARGEST", 5)
    assert mp4._repr_html_() is not None
