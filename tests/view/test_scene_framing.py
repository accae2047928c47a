"""The camera: all it frames is inside its margins and fills them; bodies are where a pinhole camera sees them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from support.made_runs import box_skin, flexible

from femflex.body import Skin, rigid_body
from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view.extent import cloud, thinned
from femflex.view.framing import VIEW_ANGLE, Margins, best_direction, framed, framed_clear_of_corner
from femflex.view.look import Look
from femflex.view.motion import motion
from femflex.view.plan import planned
from femflex.view.render import render_movie, render_picture
from femflex.view.scene import Scene


def on_screen(points, view, aspect):
    """Where a pinhole camera sees points: parts of width and height from the lower left corner, (n, 2)."""
    x, y, z = view.axes @ (points - view.place).T
    t = np.tan(VIEW_ANGLE / 2)
    return np.column_stack([0.5 + 0.5 * x / (z * t * aspect), 0.5 + 0.5 * y / (z * t)])


@pytest.mark.parametrize("seed", range(8))
def test_the_corner_of_the_triad_is_kept_clear(seed):
    rng = np.random.default_rng(seed)
    cloud, towards = rng.standard_normal((400, 3)) * rng.uniform(0.1, 30, 3), rng.standard_normal(3)
    up, aspect, margins, corner = np.array([0.0, 0.0, 1.0]), 16 / 9, Margins(), (0.6, 0.5)
    x, y = on_screen(cloud, framed(cloud, towards, up, aspect, margins), aspect).T
    needed = bool(((x < corner[0] / aspect) & (y < corner[1])).any())
    view = framed_clear_of_corner(cloud, towards, up, aspect, margins, corner)
    x, y = on_screen(cloud, view, aspect).T
    assert not ((x < corner[0] / aspect - 1e-9) & (y < corner[1] - 1e-9)).any()
    assert min(x.min() - margins.left, y.min() - margins.bottom) > -1e-9
    least = framed(cloud, towards, up, aspect, margins).pixels(1000)
    assert view.pixels(1000) <= least if needed else view.pixels(1000) == least


@pytest.mark.parametrize("seed", range(8))
def test_everything_framed_lies_between_the_margins_touches_two_and_is_centred(seed):
    rng = np.random.default_rng(seed)
    cloud = rng.standard_normal((200, 3)) * rng.uniform(0.1, 30, 3) + rng.uniform(-100, 100, 3)
    margins, aspect = Margins(0.03, 0.14, 0.12, 0.1), 16 / 9
    view = framed(cloud, rng.standard_normal(3), np.array([0.0, 0.0, 1.0]), aspect, margins)
    seen = on_screen(cloud, view, aspect)
    low, high = np.array([margins.left, margins.bottom]), 1 - np.array([margins.right, margins.top])
    assert np.all(seen > low - 1e-9) and np.all(seen < high + 1e-9)
    slack = np.array([seen.min(axis=0) - low, high - seen.max(axis=0)])
    full = int(np.argmin(slack.sum(axis=0)))
    assert slack[:, full] == pytest.approx(0, abs=1e-9)  # one direction is used to the full, from rim to rim
    other = 1 - full
    room = []
    for side, rim in ((1, low), (-1, high)):  # how far the camera could move across either way

        def gap(d, side=side, rim=rim):
            step = side * d * view.axes[other]
            there = on_screen(cloud, replace(view, place=view.place + step, focus=view.focus + step), aspect)
            return (side * there[:, other]).min() - side * rim[other]

        room.append(brentq(gap, 0.0, 1e4))
    assert room[0] == pytest.approx(room[1], rel=1e-6, abs=1e-9)
    depth = (cloud - view.place) @ view.axes[2]
    assert view.near < depth.min() and depth.max() < view.far
    assert view.axes @ view.axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert view.pixels(1000) * np.linalg.norm(view.focus - view.place) * np.tan(VIEW_ANGLE / 2) == pytest.approx(500)


@pytest.mark.parametrize(("thin", "most"), [(0, np.cos(np.pi / 6)), (1, np.cos(np.pi / 6)), (2, None)])
def test_a_flat_cloud_is_seen_from_where_it_is_broadest(thin, most):
    """From 24 degrees above, and from that of eight directions around that is nearest to its normal: 30 degrees off."""
    cloud = np.random.default_rng(2).standard_normal((500, 3)) * np.where(np.arange(3) == thin, 0.01, 5.0)
    towards = best_direction(cloud, np.array([0.0, 0.0, 1.0]))
    assert np.linalg.norm(towards) == pytest.approx(1.0) and towards[2] == pytest.approx(np.sin(np.deg2rad(24)))
    if most is not None:
        assert abs(towards[thin]) == pytest.approx(np.cos(np.deg2rad(24)) * most)


def test_a_single_point_and_a_view_along_the_vertical_are_framed_too():
    view = framed(np.array([[3.0, 4, 5]]), np.array([0.0, 0, 1]), np.array([0.0, 0, 1]), 1.0, Margins())
    assert np.all(np.isfinite(view.place)) and view.near > 0
    assert np.linalg.norm(view.place - [3, 4, 5]) > 0


def test_a_body_is_drawn_where_a_pinhole_camera_sees_it(tmp_path):
    """A small cube beside a large frame of far points, found in the picture by its colour."""
    far = np.array([[x, y, z] for x in (-5.0, 5) for y in (-5.0, 5) for z in (-5.0, 5)])
    corners = Skin(far, {"vertex": np.arange(8)[:, None]}, np.zeros((0, 8, 3)))
    place = np.array([2.0, -1.5, 3.0])
    bodies = {
        "corners": rigid_body(1.0, np.eye(3), skin=corners),
        "cube": rigid_body(1.0, np.eye(3), skin=box_skin(0.8, 0.8, 0.8)),
    }
    still = np.tile([1.0, 0, 0, 0], (2, 1))
    arrays = {
        "bodies/corners/position": np.zeros((2, 3)),
        "bodies/corners/attitude": still,
        "bodies/cube/position": np.tile(place, (2, 1)),
        "bodies/cube/attitude": still,
    }
    channels = {path: Channel("m", path, value.shape[1:]) for path, value in arrays.items()}
    with RunWriter(tmp_path / "run.h5", channels, bodies) as writer:
        writer.write_block(np.array([0.0, 1.0]), arrays)
        writer.finish(complete=True)
    look = Look(size=(640, 400), triads=False, edges="none", view=(3.0, -4.0, 2.0), title="", camera="fixed")
    with open_run(tmp_path / "run.h5") as run:
        plan = planned(run, look)
        with Scene(run, look, plan) as scene:
            scene.show(motion(run, np.array([0.5])), 0)
            image = scene.image().astype(int)
    # the first body by name, "corners", and the second, "cube", have neutral colours; corners are dots of 9 pixels
    drawn = np.abs(image - image[395, 5]).sum(axis=2) > 60
    expected = on_screen(place[None], plan.view, 640 / 400)[0] * [640, 400]
    around = drawn[
        400 - int(expected[1]) - 25 : 400 - int(expected[1]) + 25, int(expected[0]) - 25 : int(expected[0]) + 25
    ]
    rows, columns = np.nonzero(around)
    assert len(rows) > 50
    centre = np.array([columns.mean() + int(expected[0]) - 24.5, int(expected[1]) + 24.5 - rows.mean()])
    assert np.linalg.norm(centre - expected) < 1.5  # pixels


@pytest.mark.slow
def test_nothing_drawn_reaches_the_margins_at_any_time_and_all_together_fills_what_is_between(
    tmp_path, run, monkeypatch
):
    monkeypatch.setattr("femflex.view.scene.add_length_scale", lambda *_: None)  # which stands in the margin
    look = {"size": (320, 180), "triads": False, "title": "", "scale": 2.0, "samples": 1}
    drawn = np.zeros((180, 320), bool)
    for k, t in enumerate(np.linspace(0, 20, 9)):
        image = read(render_picture(run, tmp_path / f"{k}.png", time=float(t), **look))
        drawn |= np.any(image[:, :, :3] != 255, axis=2)
    drawn[:, 250:] = False  # clock, colour bar and scale are there
    rows, columns = np.nonzero(drawn)
    top, bottom, left = 0.12 * 180, 180 - 0.12 * 180, 0.04 * 320
    assert top - 1 < rows.min() < top + 9 and bottom - 9 < rows.max() < bottom + 1  # nine of all times: nearly full
    assert columns.min() > left - 1


def test_a_camera_does_not_move_between_pictures_of_a_run(run):
    look = Look(size=(320, 180))
    first, second = planned(run, look, 1.0), planned(run, look, 17.0)
    assert np.array_equal(first.view.place, second.view.place) and np.array_equal(first.view.up, second.view.up)
    near = planned(run, Look(size=(320, 180), fit="picture"), 1.0)
    assert np.linalg.norm(near.view.place - near.view.focus) < np.linalg.norm(first.view.place - first.view.focus)


def test_a_picture_is_the_same_every_time(tmp_path, run):
    images = [read(render_picture(run, tmp_path / f"{k}.png", time=4.2, size=(320, 180))) for k in (0, 1)]
    assert np.array_equal(*images)


def test_slender_bodies_are_drawn_broad_enough_to_be_seen(tmp_path):
    times, s = np.linspace(0, 1, 5), np.linspace(0, 20, 41)
    ring = 0.004 * np.array([[0, 1, 0], [0, -0.5, 0.8], [0, -0.5, -0.8]])
    points = (s[:, None, None] * [1, 0, 0] + ring).reshape(-1, 3)
    number = np.arange(len(points)).reshape(-1, 3)
    around = np.roll(number, -1, axis=1)
    quads = np.stack([number[:-1], around[:-1], around[1:], number[1:]], axis=-1).reshape(-1, 4)
    wire = flexible(Skin(points, {"quad": quads}, np.zeros((1, len(points), 3))), [1.0], {"tip": 0})
    arrays = {
        "bodies/wire/position": np.zeros((5, 3)),
        "bodies/wire/attitude": np.tile([1.0, 0, 0, 0], (5, 1)),
        "bodies/wire/delta": np.zeros((5, 1)),
    }
    channels = {path: Channel("m", path, value.shape[1:]) for path, value in arrays.items()}
    with RunWriter(tmp_path / "run.h5", channels, {"wire": wire}) as writer:
        writer.write_block(times, arrays)
    look = {"size": (640, 360), "triads": False, "title": "", "samples": 1}
    with open_run(tmp_path / "run.h5") as run:
        image = read(render_picture(run, tmp_path / "a.png", **look))
    middle = image[60:-60, 300]
    assert 2 <= np.count_nonzero((255 - middle.astype(int)).sum(axis=1) > 60) <= 8


def read(path):
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image)


def test_an_orbiting_run_is_seen_from_the_orbital_frame(orbiting):
    plan = planned(orbiting, Look())
    assert plan.camera == "orbital" and plan.view.axes[0][1] == pytest.approx(0, abs=1e-12)  # y0 points up
    moving = motion(orbiting, orbiting.time, "orbital")
    assert np.allclose(moving.reference, np.eye(3), atol=1e-12)
    pitch, yaw, _ = orbiting["attitude/angles"].T  # turns about x, then z, then y
    assert np.allclose(moving.attitude["hub"][:, 1, 1], np.cos(pitch) * np.cos(yaw), atol=1e-12)
    fixed = motion(orbiting, orbiting.time, "fixed")
    assert np.ptp(fixed.attitude["hub"][:, 0, 1]) > 1.9  # while it turns over in inertial axes


def test_the_following_camera_holds_the_centre_and_the_bodys_its_axes(run):
    moving = motion(run, run.time[::40], "body", "hub")
    assert np.allclose(moving.attitude["hub"], np.eye(3), atol=1e-12) and np.allclose(moving.position["hub"], 0)
    assert np.allclose(moving.position["boom"], [0.8, 0, 0], atol=1e-12)  # welded
    fixed = motion(run, run.time[::40], "fixed")
    assert np.allclose(moving.reference, np.swapaxes(fixed.attitude["hub"], 1, 2), atol=1e-12)


def test_between_rows_positions_and_attitudes_are_interpolated(run):
    a, b = motion(run, run.time[100:102]).attitude["hub"]
    middle = motion(run, np.array([run.time[100:102].mean()]))
    turn = middle.attitude["hub"][0]
    assert np.allclose(turn @ turn.T, np.eye(3), atol=1e-14)
    assert np.allclose(a.T @ turn, turn.T @ b, atol=1e-12)  # half of the turn each
    expected = run["bodies/boom/position"][100:102].mean(axis=0)
    assert np.allclose(middle.position["boom"][0], expected, atol=1e-15)


def test_a_wandering_craft_is_followed(tmp_path):
    times = np.linspace(0, 10, 21)
    body = {"cube": rigid_body(1.0, np.eye(3), skin=box_skin(1, 1, 1))}
    arrays = {
        "bodies/cube/position": times[:, None] * [3.0, 0, 0],
        "bodies/cube/attitude": np.tile([1.0, 0, 0, 0], (21, 1)),
    }
    channels = {path: Channel("m", path, value.shape[1:]) for path, value in arrays.items()}
    with RunWriter(tmp_path / "run.h5", channels, body) as writer:
        writer.write_block(times, arrays)
    with open_run(tmp_path / "run.h5") as run:
        assert planned(run, Look()).camera == "follow"
        followed, fixed = motion(run, times, "follow"), motion(run, times, "fixed")
    assert np.allclose(followed.position["cube"], 0) and np.ptp(fixed.position["cube"]) == 30


def test_the_following_camera_moves_with_the_centre_of_mass_that_a_run_reports(tmp_path):
    times = np.linspace(0, 10, 21)
    centre = times[:, None] * [3.0, 0, 0]
    round_it = np.column_stack([np.cos(times), np.sin(times), 0 * times])
    arrays = {
        "bodies/cube/position": centre + round_it,
        "bodies/cube/attitude": np.tile([1.0, 0, 0, 0], (21, 1)),
        "monitors/center_of_mass": centre,
    }
    channels = {path: Channel("m", path, value.shape[1:]) for path, value in arrays.items()}
    with RunWriter(tmp_path / "run.h5", channels, {"cube": rigid_body(1.0, np.eye(3))}) as writer:
        writer.write_block(times, arrays)
    with open_run(tmp_path / "run.h5") as run:
        assert np.allclose(motion(run, times, "follow").position["cube"], round_it, atol=1e-12)


def test_between_rows_a_turn_goes_the_short_way_whatever_the_sign_of_its_euler_parameters(tmp_path):
    times = np.linspace(0, 2, 5)
    half = 0.2 * times
    turns = np.column_stack([np.cos(half), 0 * half, 0 * half, np.sin(half)])
    arrays = {"bodies/cube/position": np.zeros((5, 3)), "bodies/cube/attitude": turns * [[1], [-1], [1], [-1], [-1]]}
    channels = {path: Channel("m", path, value.shape[1:]) for path, value in arrays.items()}
    with RunWriter(tmp_path / "run.h5", channels, {"cube": rigid_body(1.0, np.eye(3))}) as writer:
        writer.write_block(times, arrays)
    with open_run(tmp_path / "run.h5") as run:
        between = np.linspace(0.05, 1.95, 20)
        found = motion(run, between).attitude["cube"]
    assert np.arctan2(found[:, 1, 0], found[:, 0, 0]) == pytest.approx(0.4 * between, abs=1e-4)


@pytest.mark.parametrize(("settles", "still"), [(20.0, 30.0), (80.0, 100.0)])
def test_a_movie_ends_where_the_motion_does(tmp_path, settles, still):
    """A box turns by 1 rad until an instant, of 100 s; half as long is added."""
    times = np.linspace(0, 100, 201)
    half = 0.5 * np.minimum(times / settles, 1.0)
    arrays = {
        "bodies/cube/position": np.zeros((201, 3)),
        "bodies/cube/attitude": np.column_stack([np.cos(half), 0 * half, np.sin(half), 0 * half]),
    }
    channels = {path: Channel("m", path, value.shape[1:]) for path, value in arrays.items()}
    body = replace(rigid_body(1.0, np.eye(3)), skin=box_skin(1.0, 2.0, 3.0))
    with RunWriter(tmp_path / "run.h5", channels, {"cube": body}) as writer:
        writer.write_block(times, arrays)
    with open_run(tmp_path / "run.h5") as run:
        assert planned(run, Look()).still == pytest.approx(still, abs=1.5)  # 200 instants are looked at
        frames = render_movie(run, tmp_path / "frames", fps=0.5, size=(320, 180))
        assert len(list(frames.iterdir())) == 7  # 12 s of the movie
        rest = render_movie(run, tmp_path / "rest", fps=1, speed=2.0, span=(90.0, None), size=(320, 180))
        assert len(list(rest.iterdir())) == 6  # a later start is shown to the end of the run


@pytest.mark.parametrize("size", [(900, 300), (300, 900), (500, 400)])
def test_a_colour_bar_takes_a_quarter_of_the_height_at_the_right_of_a_picture(size, run):
    """Of a broad picture and a tall one; the margin of the other rim stays 0.04 of the width."""
    look = Look(size=size, triads=False, view=(2.0, -3.0, 1.0), camera="fixed")
    plan = planned(run, look)
    width, height = size
    low = np.array([0.04, 0.12]) * size
    high = np.array([width - 0.25 * height, height - 0.12 * height])
    assert plan.bar is not None and plan.view.angle == VIEW_ANGLE
    times = np.union1d(run.time[np.linspace(0, len(run) - 1, 200).round().astype(int)], [plan.peak])
    moving = motion(run, times, plan.camera, plan.body, (), plan.scale)
    points = cloud(moving, thinned(plan.skins), plan.scale, {}, plan.sight)
    seen = on_screen(points.reshape(-1, 3), plan.view, width / height) * size
    assert np.all(seen > low - 1e-6 * height) and np.all(seen < high + 1e-6 * height)
    slack = (seen.min(axis=0) - low) + (high - seen.max(axis=0))
    assert slack.min() < 1e-6 * height  # one direction is used from rim to rim
