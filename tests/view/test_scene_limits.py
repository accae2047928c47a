"""Limits of a scene: clipping, the end of a motion, places of texts and of the corner, points that reach furthest."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body import Skin
from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view.curves import balance_of, curves_of
from femflex.view.extent import cloud, outer_points, thinned
from femflex.view.framing import Margins, best_direction, framed
from femflex.view.look import Look
from femflex.view.motion import motion
from femflex.view.overlay import CornerTriad, add_text
from femflex.view.plan import _still_from, planned
from femflex.view.theme import THEMES
from femflex.view.window import open_window

LIGHT = THEMES["light"]
UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("size", [0.03, 1.0, 40.0])
def test_clipping_leaves_a_fifth_of_the_size_before_and_behind_what_is_seen(size):
    points = size * np.array([[-0.5, -0.3, -0.2], [0.5, 0.1, 0.2], [0.3, 0.3, -0.1]])
    view = framed(points, np.array([0.0, -1.0, 0.0]), UP, 1.5, Margins())
    depth = points[:, 1] - view.place[1]
    whole = np.linalg.norm(np.ptp(points, axis=0))
    assert (view.near, view.far) == pytest.approx((depth.min() - 0.2 * whole, depth.max() + 0.2 * whole))
    assert view.focus == pytest.approx(view.place + np.array([0.0, (depth.min() + depth.max()) / 2, 0.0]))


@pytest.mark.parametrize("size", [0.03, 1.0, 40.0])
def test_a_line_seen_from_its_end_is_a_twentieth_of_its_length_away(size):
    points = size * np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    view = framed(points, np.array([0.0, -1.0, 0.0]), UP, 1.5, Margins())
    assert view.place[1] == pytest.approx(-0.05 * size)
    assert (view.near, view.far) == pytest.approx((0.02 * 0.05 * size, 1.25 * size))


@pytest.mark.parametrize("time", [None, 7.3])
def test_a_picture_is_framed_at_its_own_time_or_that_of_the_largest_displacement(run, time):
    look = Look(fit="picture", camera="fixed", triads=False, scale=2.0, size=(400, 300))
    plan = planned(run, look, time)
    moving = motion(run, np.array([plan.peak if time is None else time]), "fixed", scale=2.0)
    points = cloud(moving, thinned(plan.skins), 2.0, {}, plan.sight)[0]
    margins = Margins(right=0.25 * 300 / 400)  # room for the colour bar
    wanted = framed(points, best_direction(points, UP), UP, 4 / 3, margins)
    assert plan.view.place == pytest.approx(wanted.place) and plan.view.focus == pytest.approx(wanted.focus)
    assert 0.0 < plan.peak < 20.0 and plan.peak != pytest.approx(7.3, abs=0.5)


@pytest.mark.parametrize(
    ("away", "size", "still"),
    [
        ([1.0, 0.5, 0.05, 0.03, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 4.0, 14.5),  # moves to t = 13, less than 0.04
        ([1.0, 0.5, 0.05, 0.03, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 2.0, 16.0),  # to t = 14, less than 0.02
        ([1.0, 0.5, 0.05, 0.03, 0.02, 0.03, 0.0, 0.0, 0.0, 0.0, 0.0], 2.0, 20.0),  # to t = 16: near the end
        ([0.02, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 4.0, 20.0),  # nothing is seen to move
    ],
)
def test_a_motion_ends_half_its_length_after_nothing_is_seen_to_move(away, size, still):
    points = np.zeros((11, 2, 3))
    points[:, 1, 2] = 7.0 - np.array(away)
    assert _still_from(np.arange(10.0, 21.0), points, 20.0, size) == pytest.approx(still)


@pytest.mark.parametrize(
    ("align", "across", "upward"),
    [
        ("left top", 0, 2),
        ("center center", 1, 1),
        ("right bottom", 2, 0),
        ("left center", 0, 1),
        ("center bottom", 1, 0),
    ],
)
def test_texts_are_aligned_across_and_upward(align, across, upward):
    from vtkmodules.vtkRenderingCore import vtkRenderer

    renderer = vtkRenderer()
    actor = add_text(renderer, "words", (0.3, 0.8), 17.6, "#ff8000", align, bold=align == "left top")
    style = actor.GetTextProperty()
    assert (style.GetJustification(), style.GetVerticalJustification()) == (across, upward)
    assert (actor.GetInput(), actor.GetPosition(), style.GetFontSize()) == ("words", (0.3, 0.8), 18)
    assert style.GetColor() == pytest.approx((1.0, 128 / 255, 0.0))
    assert style.GetFontFile().endswith("DejaVuSans-Bold.ttf" if align == "left top" else "DejaVuSans.ttf")
    assert renderer.HasViewProp(actor)


def test_the_triad_has_a_square_window_in_the_lower_left_corner():
    points = np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]])
    view = framed(points, np.array([1.0, -2.0, 0.5]), UP, 2.0, Margins())
    window = open_window((160, 80), LIGHT)
    triad = CornerTriad(window, view, ("X", "Y", "Z"), LIGHT, (160, 80))
    assert triad._renderer.GetViewport() == pytest.approx((0.015 / 2, 0.0, 0.365 / 2, 0.35))
    camera = triad._renderer.GetActiveCamera()
    assert camera.GetParallelProjection() and camera.GetParallelScale() == pytest.approx(0.175 / 0.075)
    assert camera.GetPosition() == pytest.approx(tuple(-5 * view.axes[2]))
    assert camera.GetViewUp() == pytest.approx(tuple(view.axes[1]))
    window.close()


def test_outer_points_hold_those_furthest_in_64_directions_spread_over_a_sphere():
    """On a unit sphere the furthest point in a direction is that at it: all of these are far apart."""
    rng = np.random.default_rng(2)
    inside = rng.normal(size=(6400, 3))
    inside *= 0.8 / np.linalg.norm(inside, axis=1, keepdims=True)
    turn, height = np.pi * (3 - np.sqrt(5)) * np.arange(64), np.linspace(-1, 1, 64)
    level = np.sqrt(1 - height**2)
    rim = np.column_stack([level * np.cos(turn), level * np.sin(turn), height])
    found = outer_points(Skin(np.concatenate([inside, rim]), {}, np.zeros((0, 6464, 3))))
    assert set(found) == set(range(0, 6464, 64)) | set(range(6400, 6464))


def test_energies_that_hardly_change_are_counted_from_their_first_values_where_one_of_them_changes(tmp_path):
    t = np.linspace(0.0, 2.0, 21)
    arrays = {"monitors/a": 5.0 + 1e-5 * t, "monitors/b": 3.0 + 1e-14 * t, "monitors/c": 7.0 + 3e-14 * t}
    channels = {path: Channel("J", path) for path in arrays}
    with RunWriter(tmp_path / "run.h5", channels, {}) as writer:
        writer.write_block(t, arrays)
    with open_run(tmp_path / "run.h5") as run:
        ((a, b),) = curves_of(run, ["monitors/a", "monitors/b"])
        assert (a.label, a.quantity, b.label, b.quantity) == ("a\nfrom 5", "change of a", "b\nfrom 3", "change of b")
        assert a.values == pytest.approx(1e-5 * t, abs=1e-12) and np.abs(b.values).max() < 1e-13
        ((b, c),) = curves_of(run, ["monitors/b", "monitors/c"])
        assert b.label.startswith("b\nconstant within 2e-14 J") and c.label.startswith("c\nconstant within 6e-14 J")
        assert (b.quantity, c.quantity) == ("b", "c") and set(b.values) == {3.0} and set(c.values) == {7.0}


def test_energy_minus_work_of_two_rows_takes_the_mean_of_both_powers(tmp_path):
    """From 10 s to 14 s, 3 W and 5 W come in, 0.5 W and 1.5 W are dissipated, a latch loses 2 J."""
    arrays = {
        "monitors/energy": [100.0, 111.0],
        "monitors/supplied": [3.0, 5.0],
        "monitors/dissipation": [0.5, 1.5],
        "latches/door/loss": [0.0, 2.0],
    }
    rows = {path: np.array(values) for path, values in arrays.items()}
    with RunWriter(tmp_path / "run.h5", {path: Channel("J", path) for path in rows}, {}) as writer:
        writer.write_block(np.array([10.0, 14.0]), rows)
    with open_run(tmp_path / "run.h5") as run:
        found = balance_of(run)
    assert found.values == pytest.approx([0.0, 111.0 - 100.0 - (16.0 - 4.0) + 2.0]) and found.unit == "J"


def test_lengths_and_angles_of_other_quantities_have_axes_of_their_own_and_other_units_share_them(tmp_path):
    t = np.linspace(0.0, 1.0, 9)
    units = {"bodies/hub/position": "m", "markers/hub.tip/deflection": "m", "joints/pin/angle": "rad", "q": "rad",
             "bodies/hub/rate": "rad/s", "effectors/wheel/speed": "rad/s"}  # fmt: skip
    with RunWriter(tmp_path / "run.h5", {path: Channel(unit, path) for path, unit in units.items()}, {}) as writer:
        writer.write_block(t, {path: (k + 1) * t for k, path in enumerate(units)})
    with open_run(tmp_path / "run.h5") as run:
        groups = curves_of(run, list(units))
    assert [[(one.quantity, one.unit) for one in group] for group in groups] == [
        [("position", "cm")], [("deflection", "m")], [("angle", "deg")], [("coordinate", "deg")],
        [("rate", "deg/s"), ("speed", "deg/s")],
    ]  # fmt: skip
