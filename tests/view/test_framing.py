"""The camera: what is framed is within the margins, and bodies are where a pinhole camera sees them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from support.made_runs import box_skin, flexible

from femflex.body import Skin, rigid_body
from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view.framing import VIEW_ANGLE, Margins, best_direction, fit_camera
from femflex.view.look import Look
from femflex.view.motion import motion
from femflex.view.plan import plan_scene
from femflex.view.scene import Scene, render_movie, render_picture


def on_screen(points, view, aspect):
    """Positions (n, 2) of points in a pinhole camera's picture: parts of width and height from its lower left."""
    x, y, z = view.axes @ (points - view.position).T
    t = np.tan(VIEW_ANGLE / 2)
    return np.column_stack([0.5 + 0.5 * x / (z * t * aspect), 0.5 + 0.5 * y / (z * t)])


def test_a_displacement_along_the_line_of_sight_turns_the_camera():
    """A sheet across the line of sight of its best view, displaced along it."""
    u = np.linspace(-1.0, 1.0, 5)
    up = np.array([0.0, 0.0, 1.0])
    line = np.stack([np.zeros(25), np.repeat(u, 5), np.tile(u, 5)], axis=1)
    towards = best_direction(line, up)
    turned = best_direction(line, up, shift=towards)
    assert abs(turned @ towards) < 0.7 < abs(towards[0])
    assert best_direction(line, up, shift=np.cross(towards, up)) == pytest.approx(towards)


@pytest.mark.parametrize("seed", range(3))
def test_framed_points_fill_the_space_between_the_margins(seed):
    rng = np.random.default_rng(seed)
    cloud = rng.standard_normal((200, 3)) * rng.uniform(0.1, 30, 3) + rng.uniform(-100, 100, 3)
    margins, aspect = Margins(0.03, 0.14, 0.12, 0.1), 16 / 9
    view = fit_camera(cloud, rng.standard_normal(3), np.array([0.0, 0.0, 1.0]), aspect, margins)
    screen_points = on_screen(cloud, view, aspect)
    low, high = np.array([margins.left, margins.bottom]), 1 - np.array([margins.right, margins.top])
    assert np.all(screen_points > low - 1e-9) and np.all(screen_points < high + 1e-9)
    slack = np.array([screen_points.min(axis=0) - low, high - screen_points.max(axis=0)])
    used_direction = int(np.argmin(slack.sum(axis=0)))
    assert slack[:, used_direction] == pytest.approx(0, abs=1e-9)  # one direction is used to the full, from rim to rim
    free_direction = 1 - used_direction
    room = []
    for side, rim in ((1, low), (-1, high)):  # how far the camera could move across either way

        def gap(d, side=side, rim=rim):
            step = side * d * view.axes[free_direction]
            moved_points = on_screen(
                cloud, replace(view, position=view.position + step, focus=view.focus + step), aspect
            )
            return (side * moved_points[:, free_direction]).min() - side * rim[free_direction]

        room.append(brentq(gap, 0.0, 1e4))
    assert room[0] == pytest.approx(room[1], rel=1e-6, abs=1e-9)
    depth = (cloud - view.position) @ view.axes[2]
    assert view.near < depth.min() and depth.max() < view.far
    assert view.axes @ view.axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert view.pixels(1000) * np.linalg.norm(view.focus - view.position) * np.tan(VIEW_ANGLE / 2) == pytest.approx(500)


def test_body_is_drawn_where_a_pinhole_camera_sees_it(tmp_path):
    """A small cube beside a large frame of far points, found in the picture by its colour."""
    far_points = np.array([[x, y, z] for x in (-5.0, 5) for y in (-5.0, 5) for z in (-5.0, 5)])
    corners = Skin(far_points, {"vertex": np.arange(8)[:, None]}, np.zeros((0, 8, 3)))
    cube_position = np.array([2.0, -1.5, 3.0])
    bodies = {
        "corners": rigid_body(1.0, np.eye(3), skin=corners),
        "cube": rigid_body(1.0, np.eye(3), skin=box_skin(0.8, 0.8, 0.8)),
    }
    still = np.tile([1.0, 0, 0, 0], (2, 1))
    arrays = {
        "bodies/corners/position": np.zeros((2, 3)),
        "bodies/corners/attitude": still,
        "bodies/cube/position": np.tile(cube_position, (2, 1)),
        "bodies/cube/attitude": still,
    }
    channels = {path: Channel("m", path, value.shape[1:]) for path, value in arrays.items()}
    with RunWriter(tmp_path / "run.h5", channels, bodies) as writer:
        writer.write_block(np.array([0.0, 1.0]), arrays)
        writer.finish(complete=True)
    look = Look(size=(640, 400), triads=False, edges="none", view=(3.0, -4.0, 2.0), title="", camera="fixed")
    with open_run(tmp_path / "run.h5") as run:
        plan = plan_scene(run, look)
        with Scene(run, look, plan) as scene:
            scene.show(motion(run, np.array([0.5])), 0)
            image = scene.image().astype(int)
    # the first body by name, "corners", and the second, "cube", have neutral colours; corners are dots of 9 pixels
    is_drawn = np.abs(image - image[395, 5]).sum(axis=2) > 60
    expected = on_screen(cube_position[None], plan.view, 640 / 400)[0] * [640, 400]
    around = is_drawn[
        400 - int(expected[1]) - 25 : 400 - int(expected[1]) + 25, int(expected[0]) - 25 : int(expected[0]) + 25
    ]
    rows, columns = np.nonzero(around)
    assert len(rows) > 50
    centre = np.array([columns.mean() + int(expected[0]) - 24.5, int(expected[1]) + 24.5 - rows.mean()])
    assert np.linalg.norm(centre - expected) < 1.5  # pixels


def test_camera_is_fixed_between_pictures_of_a_run(run):
    look = Look(size=(320, 180))
    first_plan, second_plan = plan_scene(run, look, 1.0), plan_scene(run, look, 17.0)
    assert np.array_equal(first_plan.view.position, second_plan.view.position) and np.array_equal(
        first_plan.view.up, second_plan.view.up
    )
    close_plan = plan_scene(run, Look(size=(320, 180), fit="picture"), 1.0)
    assert np.linalg.norm(close_plan.view.position - close_plan.view.focus) < np.linalg.norm(
        first_plan.view.position - first_plan.view.focus
    )


def test_pictures_are_repeatable(tmp_path, run):
    images = [pixels_of(render_picture(run, tmp_path / f"{k}.png", time=4.2, size=(320, 180))) for k in (0, 1)]
    assert np.array_equal(*images)


def pixels_of(path):
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image)


def test_orbiting_run_is_seen_from_the_orbital_frame(orbiting):
    plan = plan_scene(orbiting, Look())
    assert plan.camera == "orbital" and plan.view.axes[0][1] == pytest.approx(0, abs=1e-12)  # y0 points up
    moving = motion(orbiting, orbiting.time, "orbital")
    assert np.allclose(moving.reference, np.eye(3), atol=1e-12)
    pitch, yaw, _ = orbiting["attitude/angles"].T  # turns about x, then z, then y
    assert np.allclose(moving.attitude["hub"][:, 1, 1], np.cos(pitch) * np.cos(yaw), atol=1e-12)
    fixed = motion(orbiting, orbiting.time, "fixed")
    assert np.ptp(fixed.attitude["hub"][:, 0, 1]) > 1.9  # while it turns over in inertial axes


def test_attitude_between_rows_takes_the_short_way(tmp_path):
    times = np.linspace(0, 2, 5)
    half = 0.2 * times
    turns = np.column_stack([np.cos(half), 0 * half, 0 * half, np.sin(half)])
    arrays = {"bodies/cube/position": np.zeros((5, 3)), "bodies/cube/attitude": turns * [[1], [-1], [1], [-1], [-1]]}
    channels = {path: Channel("m", path, value.shape[1:]) for path, value in arrays.items()}
    with RunWriter(tmp_path / "run.h5", channels, {"cube": rigid_body(1.0, np.eye(3))}) as writer:
        writer.write_block(times, arrays)
    with open_run(tmp_path / "run.h5") as run:
        between = np.linspace(0.05, 1.95, 20)
        attitude = motion(run, between).attitude["cube"]
    assert np.arctan2(attitude[:, 1, 0], attitude[:, 0, 0]) == pytest.approx(0.4 * between, abs=1e-4)


@pytest.mark.parametrize(("settles", "still"), [(20.0, 30.0)])
def test_movie_ends_with_the_motion(tmp_path, settles, still):
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
        assert plan_scene(run, Look()).still == pytest.approx(still, abs=1.5)  # 200 instants are looked at
        frames = render_movie(run, tmp_path / "frames", fps=0.5, size=(320, 180))
        assert len(list(frames.iterdir())) == 7  # 12 s of the movie
        later_frames = render_movie(run, tmp_path / "rest", fps=1, speed=2.0, span=(90.0, None), size=(320, 180))
        assert len(list(later_frames.iterdir())) == 6  # a later start is shown to the end of the run


TIMES = np.array([0.0, 1.0, 3.0, 4.0])


def attitudes(seed, n=4):
    return Rotation.random(n, random_state=seed)


def skin_of(seed, shapes, growth=False, points=9):
    rng = np.random.default_rng(seed)
    positions = rng.normal(size=(points, 3))
    return Skin(
        positions,
        {"vertex": np.arange(points)[:, None]},
        0.1 * rng.normal(size=(shapes, points, 3)),
        positions * [1.0, 0, 0] if growth else None,
    )


@pytest.fixture(scope="module")
def bodies():
    mast = flexible(skin_of(4, 2, growth=True), [1.0, 2.0], {"top": 3})
    return {
        "hub": rigid_body(50.0, np.eye(3), skin=box_skin(1.0, 2.0, 3.0)),
        "boom": flexible(skin_of(2, 2), [1.0, 2.0], {"tip": 8}),
        "boom.1": flexible(skin_of(3, 2), [1.0, 2.0], {"end": 5}),
        "mast": replace(mast, kinds=("vibration", "derivative")),
    }


@pytest.fixture(scope="module")
def arrays():
    rng = np.random.default_rng(9)
    channels = {}
    for k, name in enumerate(("hub", "boom", "boom.1", "mast")):
        channels[f"bodies/{name}/position"] = rng.normal(size=(4, 3)) * 3
        channels[f"bodies/{name}/attitude"] = attitudes(k).as_quat(scalar_first=True)
        channels[f"bodies/{name}/delta"] = rng.normal(size=(4, 0 if name == "hub" else 2))
    channels["bodies/mast/length"] = np.array([2.0, 2.5, 4.0, 5.0])
    channels["orbit/attitude"] = attitudes(7).as_quat(scalar_first=True)
    channels["monitors/center_of_mass"] = rng.normal(size=(4, 3))
    for marker in ("boom.tip", "boom.1.end"):
        channels[f"markers/{marker}/position"] = rng.normal(size=(4, 3))
        channels[f"markers/{marker}/deflection"] = rng.normal(size=(4, 3))
    channels["constraints/contact/place"] = rng.normal(size=(4, 3))
    channels["sights/eye/position"] = rng.normal(size=(4, 3))
    channels["sights/eye/direction"] = rng.normal(size=(4, 3))
    return channels


def write(path, arrays, bodies, times=TIMES):
    channels = {name: Channel("m", name, values.shape[1:]) for name, values in arrays.items()}
    with RunWriter(path, channels, bodies, {"title": "made"}) as writer:
        writer.write_block(times, arrays)
    return path


@pytest.fixture(scope="module")
def made_run(tmp_path_factory, bodies, arrays):
    with open_run(write(tmp_path_factory.mktemp("runs") / "run.h5", arrays, bodies)) as opened:
        yield opened


TRACES = ("boom.tip", "constraints/contact", "boom.1.end")


@pytest.mark.parametrize("camera", ["fixed", "follow", "orbital", "body"])
def test_bodies_traces_and_sights_in_the_frame_of_the_camera(made_run, arrays, bodies, camera):
    scale = 3.0
    scene_motion = motion(made_run, TIMES, camera, "mast" if camera == "body" else "", TRACES, scale)
    zero, identity = np.zeros((4, 3)), np.broadcast_to(np.eye(3), (4, 3, 3))
    origin, C_NV = {
        "fixed": (zero, identity),
        "follow": (arrays["monitors/center_of_mass"], identity),
        "orbital": (zero, attitudes(7).as_matrix()),
        "body": (arrays["bodies/mast/position"], attitudes(3).as_matrix()),
    }[camera]

    def in_camera_frame(r, shift=True):
        return np.array([C.T @ (x - o * shift) for C, x, o in zip(C_NV, r, origin, strict=True)])

    for k, name in enumerate(("hub", "boom", "boom.1", "mast")):
        body_name = "boom" if name == "boom.1" else name
        position, turn = arrays[f"bodies/{body_name}/position"], attitudes(1 if name == "boom.1" else k).as_matrix()
        assert scene_motion.position[name] == pytest.approx(in_camera_frame(position), abs=1e-12)
        assert scene_motion.attitude[name] == pytest.approx(np.einsum("tji,tjk->tik", C_NV, turn), abs=1e-12)
        assert scene_motion.amplitudes[name] == pytest.approx(arrays[f"bodies/{name}/delta"])
    assert scene_motion.delta["boom"] == pytest.approx(arrays["bodies/boom/delta"]) and scene_motion.delta[
        "boom.1"
    ].shape == (4, 30)
    ratio = np.array([1.0, 1.25, 2.0, 2.5])
    grown = np.column_stack(
        [arrays["bodies/mast/delta"][:, 0], arrays["bodies/mast/delta"][:, 1] / ratio, (ratio - 1) / 3]
    )
    assert scene_motion.delta["mast"] == pytest.approx(grown) and scene_motion.lengths["mast"].tolist() == [
        2,
        2.5,
        4,
        5,
    ]
    assert scene_motion.reference == pytest.approx(np.einsum("tji,tjk->tik", C_NV, attitudes(7).as_matrix()), abs=1e-12)
    for marker, body in (("boom.tip", 1), ("boom.1.end", 1)):
        more = (scale - 1) * np.einsum(
            "tij,tj->ti", attitudes(body).as_matrix(), arrays[f"markers/{marker}/deflection"]
        )
        assert scene_motion.traces[marker] == pytest.approx(
            in_camera_frame(arrays[f"markers/{marker}/position"] + more), abs=1e-12
        )
    assert scene_motion.traces["constraints/contact"] == pytest.approx(
        in_camera_frame(arrays["constraints/contact/place"]), abs=1e-12
    )
    start, direction = scene_motion.sights["eye"]
    assert start == pytest.approx(in_camera_frame(arrays["sights/eye/position"]), abs=1e-12)
    assert direction == pytest.approx(in_camera_frame(arrays["sights/eye/direction"], False), abs=1e-12)
