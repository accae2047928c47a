"""Where a run is drawn: every body, trace and sight in every frame of the camera, and how far all of it reaches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.made_runs import box_skin, flexible

from femflex.body import Skin, rigid_body
from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view.extent import automatic_scale, cloud, displacement, outer_points, skins_of, some_rows, thinned
from femflex.view.framing import Margins, View, best_direction, framed, framed_clear_of_corner, screen_axes
from femflex.view.growing import lengths_line
from femflex.view.look import Look
from femflex.view.motion import Interpolated, chosen_camera, dcms, motion
from femflex.view.plan import ARMS, SIGHT, planned
from femflex.view.segments import cut_bodies

TIMES = np.array([0.0, 1.0, 3.0, 4.0])


def attitudes(seed, n=4):
    return Rotation.random(n, random_state=seed)


def skin_of(seed, shapes, growth=False, points=9):
    rng = np.random.default_rng(seed)
    own = rng.normal(size=(points, 3))
    return Skin(
        own,
        {"vertex": np.arange(points)[:, None]},
        0.1 * rng.normal(size=(shapes, points, 3)),
        own * [1.0, 0, 0] if growth else None,
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
    found = {}
    for k, name in enumerate(("hub", "boom", "boom.1", "mast")):
        found[f"bodies/{name}/position"] = rng.normal(size=(4, 3)) * 3
        found[f"bodies/{name}/attitude"] = attitudes(k).as_quat(scalar_first=True)
        found[f"bodies/{name}/delta"] = rng.normal(size=(4, 0 if name == "hub" else 2))
    found["bodies/mast/length"] = np.array([2.0, 2.5, 4.0, 5.0])
    found["orbit/attitude"] = attitudes(7).as_quat(scalar_first=True)
    found["monitors/center_of_mass"] = rng.normal(size=(4, 3))
    for marker in ("boom.tip", "boom.1.end"):
        found[f"markers/{marker}/position"] = rng.normal(size=(4, 3))
        found[f"markers/{marker}/deflection"] = rng.normal(size=(4, 3))
    found["constraints/contact/place"] = rng.normal(size=(4, 3))
    found["sights/eye/position"] = rng.normal(size=(4, 3))
    found["sights/eye/direction"] = rng.normal(size=(4, 3))
    return found


def write(path, arrays, bodies, times=TIMES):
    channels = {name: Channel("m", name, values.shape[1:]) for name, values in arrays.items()}
    with RunWriter(path, channels, bodies, {"title": "made"}) as writer:
        writer.write_block(times, arrays)
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory, bodies, arrays):
    with open_run(write(tmp_path_factory.mktemp("runs") / "run.h5", arrays, bodies)) as opened:
        yield opened


TRACES = ("boom.tip", "constraints/contact", "boom.1.end")


@pytest.mark.parametrize("camera", ["fixed", "follow", "orbital", "body"])
def test_every_body_trace_and_sight_is_seen_from_the_frame_of_the_camera(run, arrays, bodies, camera):
    scale = 3.0
    found = motion(run, TIMES, camera, "mast" if camera == "body" else "", TRACES, scale)
    zero, one = np.zeros((4, 3)), np.broadcast_to(np.eye(3), (4, 3, 3))
    origin, C_NV = {
        "fixed": (zero, one),
        "follow": (arrays["monitors/center_of_mass"], one),
        "orbital": (zero, attitudes(7).as_matrix()),
        "body": (arrays["bodies/mast/position"], attitudes(3).as_matrix()),
    }[camera]
    seen = lambda r, shift=True: np.array([C.T @ (x - o * shift) for C, x, o in zip(C_NV, r, origin, strict=True)])  # noqa: E731
    for k, name in enumerate(("hub", "boom", "boom.1", "mast")):
        whole = "boom" if name == "boom.1" else name
        place, turn = arrays[f"bodies/{whole}/position"], attitudes(1 if name == "boom.1" else k).as_matrix()
        assert found.position[name] == pytest.approx(seen(place), abs=1e-12)
        assert found.attitude[name] == pytest.approx(np.einsum("tji,tjk->tik", C_NV, turn), abs=1e-12)
        assert found.amplitudes[name] == pytest.approx(arrays[f"bodies/{name}/delta"])
    assert found.delta["boom"] == pytest.approx(arrays["bodies/boom/delta"]) and found.delta["boom.1"].shape == (4, 30)
    ratio = np.array([1.0, 1.25, 2.0, 2.5])
    grown = np.column_stack(
        [arrays["bodies/mast/delta"][:, 0], arrays["bodies/mast/delta"][:, 1] / ratio, (ratio - 1) / 3]
    )
    assert found.delta["mast"] == pytest.approx(grown) and found.lengths["mast"].tolist() == [2, 2.5, 4, 5]
    assert found.reference == pytest.approx(np.einsum("tji,tjk->tik", C_NV, attitudes(7).as_matrix()), abs=1e-12)
    for marker, body in (("boom.tip", 1), ("boom.1.end", 1)):
        more = (scale - 1) * np.einsum(
            "tij,tj->ti", attitudes(body).as_matrix(), arrays[f"markers/{marker}/deflection"]
        )
        assert found.traces[marker] == pytest.approx(seen(arrays[f"markers/{marker}/position"] + more), abs=1e-12)
    assert found.traces["constraints/contact"] == pytest.approx(seen(arrays["constraints/contact/place"]), abs=1e-12)
    start, direction = found.sights["eye"]
    assert start == pytest.approx(seen(arrays["sights/eye/position"]), abs=1e-12)
    assert direction == pytest.approx(seen(arrays["sights/eye/direction"], False), abs=1e-12)


def test_channels_are_linear_between_uneven_rows(run, arrays):
    at = np.array([0.0, 0.25, 1.0, 2.5, 3.75, 4.0])
    between = Interpolated(run, at)
    given = arrays["bodies/hub/position"]
    expected = np.column_stack([np.interp(at, TIMES, column) for column in given.T])
    assert between("bodies/hub/position") == pytest.approx(expected, abs=1e-12)
    e = np.random.default_rng(1).normal(size=(5, 4))
    assert dcms(e) == pytest.approx(Rotation.from_quat(e, scalar_first=True).as_matrix(), abs=1e-12)


def test_a_run_of_one_row_stands_still(tmp_path, bodies, arrays):
    one = {name: values[:1] for name, values in arrays.items()}
    with open_run(write(tmp_path / "one.h5", one, bodies, TIMES[:1])) as run:
        assert motion(run, np.array([0.0])).position["hub"] == pytest.approx(one["bodies/hub/position"])
        assert some_rows(run).tolist() == [0]


def test_the_cloud_holds_every_point_arm_sight_and_trace(run, bodies):
    skins = {name: body.skin for name, body in bodies.items() if name in ("hub", "boom")}
    moving = motion(run, TIMES, "body", "mast", TRACES, 2.0)
    arms = {"hub": np.array([1.0, 2.0, 3.0]), "boom": np.array([0.5, 0.5, 0.5])}
    found = cloud(moving, skins, 2.0, arms, 4.0)
    for k in range(4):
        expected = []
        for name in moving.position:
            local = [np.zeros(3), *np.diag(arms.get(name, np.zeros(3)))]
            if name in skins:
                u = np.tensordot(moving.delta[name][k], skins[name].shapes, axes=1)
                local += list(skins[name].points + 2.0 * u)
            expected += [moving.position[name][k] + moving.attitude[name][k] @ x for x in local]
        start, direction = (part[k] for part in moving.sights["eye"])
        expected += [trace[k] for trace in moving.traces.values()] + [start + 4.0 * direction]
        key = lambda table: np.array(sorted(map(tuple, np.round(table, 9))))  # noqa: E731
        np.testing.assert_allclose(key(found[k]), key(expected), atol=1e-8)


def test_the_largest_displacement_is_that_of_any_body_without_its_growth(run, bodies, arrays):
    skins = skins_of(run.bodies())
    assert len(skins["mast"].shapes) == 3 and len(skins["boom"].shapes) == 2
    times, found = displacement(run, {name: skins[name] for name in ("hub", "boom", "mast")})
    ratio = np.array([1.0, 1.25, 2.0, 2.5])
    expected = np.zeros(4)
    for name in ("boom", "mast"):
        delta = arrays[f"bodies/{name}/delta"].copy()
        if name == "mast":
            delta[:, 1] /= ratio
        for k in range(4):
            u = np.tensordot(delta[k], bodies[name].skin.shapes, axes=1)
            expected[k] = max(expected[k], np.linalg.norm(u, axis=1).max())
    assert found == pytest.approx(expected) and times.tolist() == TIMES.tolist()


def test_rows_of_a_long_run_are_spread_over_it(tmp_path):
    times = np.arange(4001.0)
    body = {"cube": rigid_body(1.0, np.eye(3))}
    arrays = {"bodies/cube/position": np.zeros((4001, 3))}
    with open_run(write(tmp_path / "long.h5", arrays, body, times)) as run:
        rows = some_rows(run)
        assert len(rows) == 2000 and rows[0] == 0 and rows[-1] == 4000 and set(np.diff(rows)) <= {1, 2, 3}
        with pytest.raises(ValueError, match=r"no body of the run can be drawn: \['cube'\] have no skin"):
            skins_of(run.bodies())


def test_outer_points_hold_the_corners_of_a_body_and_of_its_shapes():
    rng = np.random.default_rng(3)
    inner = rng.uniform(-0.5, 0.5, (3000, 3))
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)], float)
    points = np.concatenate([inner, corners])
    shapes = np.zeros((2, len(points), 3))
    shapes[0, 1234, 1], shapes[1, 777, 0], shapes[1, 13, 2] = -5.0, 2.0, -1.0
    skin = Skin(points, {"vertex": np.arange(3008)[:, None]}, shapes)
    found = outer_points(skin)
    assert set(range(3000, 3008)) | {1234, 777, 13} <= set(found.tolist()) and len(found) < 300
    thin = thinned({"a": skin})["a"]
    assert np.array_equal(thin.points, points[found]) and np.array_equal(thin.shapes, shapes[:, found])


@pytest.mark.parametrize(
    ("largest", "size", "scale"),
    [(0.1, 50.0, 20.0), (1e-3, 1.0, 50.0), (3.0, 1.0, 1.0), (0.0, 1.0, 1.0), (0.01, 2.5, 20.0), (0.07, 1.0, 1.0)],
)
def test_an_automatic_scale_shows_eight_percent_of_the_size_rounded_down(largest, size, scale):
    assert automatic_scale(largest, size) == pytest.approx(scale)


def test_cameras_are_chosen_by_what_a_run_has(run, tmp_path, bodies, arrays):
    assert chosen_camera(run, run.bodies(), "auto", 1.0) == ("orbital", "")
    assert chosen_camera(run, run.bodies(), "body", 1.0) == ("body", "hub")  # the heaviest
    assert chosen_camera(run, run.bodies(), "body:mast", 1.0) == ("body", "mast")
    with pytest.raises(
        ValueError, match=r"camera 'body:x' names no body of the run; its bodies are \['boom', 'boom.1', "
    ):
        chosen_camera(run, run.bodies(), "body:x", 1.0)
    with pytest.raises(
        ValueError, match=r"camera 'far' is not known; known are \['auto', 'fixed', 'follow', 'orbital'"
    ):
        chosen_camera(run, run.bodies(), "far", 1.0)
    free = {k: v for k, v in arrays.items() if not k.startswith(("orbit", "monitors"))}
    with open_run(write(tmp_path / "free.h5", free, bodies)) as other:
        travel = min(np.ptp(arrays[f"bodies/{name}/position"], axis=0).max() for name in bodies)
        assert chosen_camera(other, other.bodies(), "auto", 1.01 * travel) == ("fixed", "")
        assert chosen_camera(other, other.bodies(), "auto", 0.99 * travel) == ("follow", "")
        with pytest.raises(ValueError, match="camera 'orbital' needs a run in an orbit; this one has none"):
            chosen_camera(other, other.bodies(), "orbital", 1.0)
        followed = motion(other, TIMES, "follow")
        assert followed.position["boom"] == pytest.approx(np.zeros((4, 3)))  # the first of its bodies by name
        fixed = motion(other, TIMES, "body", "hub")
        assert fixed.reference == pytest.approx(np.swapaxes(attitudes(0).as_matrix(), 1, 2), abs=1e-12)


def test_a_plan_has_arms_scale_span_and_what_is_undeformed(run, bodies):
    assert cut_bodies(run) == {"boom"}
    plan = planned(run, Look(scale=2.0, camera="fixed", size=(640, 360)))
    assert plan.undeformed == {"hub", "boom"} and plan.span == (0.0, 4.0) and plan.scale == 2.0
    assert len(plan.skins["boom.1"].shapes) == 12 + 9 * 2 and len(plan.skins["mast"].shapes) == 3
    size = plan.sight / SIGHT
    assert plan.arms["hub"] == pytest.approx(np.array([0.5, 1.0, 1.5]) + ARMS * size)  # a rigid box of 1, 2, 3 m
    assert plan.arms["mast"] == pytest.approx(np.full(3, ARMS * size)) and set(plan.arms) == {"hub", "boom", "mast"}
    assert planned(run, Look(triads=False, camera="fixed")).arms == {}
    assert plan.peak in TIMES and plan.bar is not None and plan.bar.top >= plan.largest * plan.bar.factor
    with pytest.raises(
        ValueError, match=r"traces \['x'\] are not markers of the run; its markers are \['boom.1.end', 'boom"
    ):
        planned(run, Look(traces=("x", "boom.tip")))
    one = planned(run, Look(fit="picture", camera="fixed", scale=2.0), 1.0)
    thin = thinned({name: skin for name, skin in plan.skins.items()})
    moving = motion(run, np.array([1.0]), "fixed", "", (), 2.0)
    points = cloud(moving, thin, 2.0, one.arms, one.sight)[0]
    seen = one.view.on_screen(points, 1280 / 720)
    assert (seen > 0).all() and (seen < 1).all() and seen.max(axis=0).max() > 0.7


def test_lengths_of_what_deploys_stand_below_the_clock():
    assert lengths_line({}) == ""
    assert lengths_line({"mast": 2.5}) == "\nmast: 2.5 m"
    assert lengths_line({"b": 3.0, "a": 2.5}) == "\nb, a: 2.5 to 3 m"
    assert lengths_line({"a": 2.00001, "b": 2.0, "c": 2.0}) == "\n3 members: 2 m"


def test_a_view_projects_points_as_a_pinhole_does():
    place, focus, up = np.array([4.0, -3.0, 2.0]), np.array([1.0, 1.0, 0.5]), np.array([0.1, 0.2, 1.0])
    view = View(place, focus, up, 0.4, 0.1, 99.0)
    forward = (focus - place) / np.linalg.norm(focus - place)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    assert view.axes == pytest.approx(np.array([right, np.cross(right, forward), forward]))
    half = np.tan(0.2) * np.linalg.norm(focus - place)
    rims = focus + half * np.array([view.axes[1], -view.axes[1], 1.6 * right, -1.6 * right, 0 * right])
    assert view.on_screen(rims, 1.6) == pytest.approx(np.array([[0.5, 1], [0.5, 0], [1, 0.5], [0, 0.5], [0.5, 0.5]]))
    assert view.pixels(300) == pytest.approx(150 / half)
    down = screen_axes(np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, 1.0]))
    assert down @ down.T == pytest.approx(np.eye(3)) and down[2] == pytest.approx([0, 0, -1])


def test_the_corner_is_cleared_by_the_margin_that_leaves_the_picture_larger():
    """A cloud nearly as high as the picture makes way to the right, a broad one upwards."""
    up, towards, corner = np.array([0.0, 0, 1]), np.array([0.0, -1, 0]), (0.5, 0.4)
    chosen = []
    for size in ((2.0, 0.1, 1.7), (3.0, 0.1, 1.5)):
        cloud = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size
        margins = Margins(0.03, 0.05, 0.07, 0.09)
        found = framed_clear_of_corner(cloud, towards, up, 1.5, margins, corner)
        seen = framed(cloud, towards, up, 1.5, margins).on_screen(cloud, 1.5)
        assert ((seen[:, 0] < 0.5 / 1.5) & (seen[:, 1] < 0.4)).any()
        each = [
            framed(cloud, towards, up, 1.5, replace(margins, **{side: value}))
            for side, value in (("left", 0.5 / 1.5), ("bottom", 0.4))
        ]
        sizes = [one.pixels(1) for one in each]
        chosen.append(int(np.argmax(sizes)))
        assert max(sizes) > 1.02 * min(sizes) and found.place == pytest.approx(each[chosen[-1]].place)
    assert chosen == [0, 1]
    assert best_direction(cloud, np.array([0.0, 1.0, 0.0])) @ [0, 1, 0] == pytest.approx(np.sin(np.radians(24)))
    assert best_direction(cloud, np.array([1.0, 0.0, 0.0])) @ [1, 0, 0] == pytest.approx(np.sin(np.radians(24)))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"edges": "thick"}, r"edges 'thick' are not known; known are \['auto', 'sharp', 'mesh', 'none'\]"),
        ({"size": (63, 720)}, "size 63 x 720 is not between 64 and 16384 pixels each way"),
        ({"size": (720, 16385)}, "size 720 x 16385 is not between"),
        ({"fit": "all"}, r"fit 'all' is not known; known are \['run', 'picture'\]"),
        ({"scale": 0.0}, "scale 0.0 of the deformation is neither a positive number nor 'auto'"),
        ({"scale": "big"}, "scale 'big' of the deformation is neither"),
        ({"view": (1.0, np.nan, 0.0)}, "is not finite; give three numbers"),
        ({"view": (0.0, 0.0, 0.0)}, r"the view direction \(0, 0, 0\) has no direction"),
        ({"theme": "red"}, r"theme 'red' is not known; known are \['dark', 'light'\]"),
    ],
)
def test_looks_that_cannot_be_are_reported(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        Look(**options)
    assert Look(size=(64, 16384), scale="auto", view=(0.0, 0.0, 1.0)).colours.background == "#ffffff"
