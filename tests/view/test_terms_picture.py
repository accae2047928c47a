"""The stacked picture of terms: what is stacked, what is named, and that stack and line balance."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from PIL import Image
from support.made_runs import write_run

import femflex.view.terms
from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view import plot_histories, plot_spectra, plot_terms
from femflex.view.curves import curves_of
from femflex.view.terms import CoordinateTerms, contributions

TIME = np.linspace(0, 10, 201)
SPRING, PUSH = 3.0 * np.cos(TIME), np.where(TIME < 5, -1.0, 0.0)
PARTS = {
    "inertia/base-hub": -(SPRING + PUSH + 1e-9),
    "joint_springs": SPRING,
    "loads/push": PUSH,
    "damping": np.full(len(TIME), 1e-9),
}
PARTS = {name: np.stack([rows, 0 * rows], axis=1) for name, rows in PARTS.items()}
HUB = CoordinateTerms(0, "base-hub.angle_rate", "N m", "inertia/base-hub")


@pytest.fixture
def run(tmp_path):
    """A run of two coordinates, of which the first swings."""
    q, u = np.stack([np.sin(TIME), TIME], axis=1), np.stack([np.cos(TIME), 0 * TIME + 1], axis=1)
    names = ("base-hub.angle", "boom.delta1")
    channels = {
        "q": Channel("rad, kg^1/2 m", "coordinates", (2,), names),
        "u": Channel("rad/s, kg^1/2 m/s", "quasi-velocities", (2,), tuple(f"{name}_rate" for name in names)),
    }
    with RunWriter(
        tmp_path / "run.h5", channels, {}, {"title": "swing", "without": "gravity_gradient, loads/pull"}
    ) as writer:
        writer.write_block(TIME, {"q": q, "u": u})
    with open_run(tmp_path / "run.h5") as opened:
        yield opened


@pytest.fixture
def figure(monkeypatch):
    """The figure that is saved."""
    kept = []
    real = femflex.view.terms.saved
    monkeypatch.setattr(femflex.view.terms, "saved", lambda fig, *args: kept.append(fig) or real(fig, *args))
    return lambda: kept[-1]


def test_contributions_stand_on_the_other_side_strongest_first():
    own, pushes = contributions(PARTS, HUB)
    assert list(pushes) == ["joint_springs", "loads/push"]  # what is far too small to be seen is not named
    assert pushes["loads/push"][0] == 1.0 and own == pytest.approx(sum(pushes.values()), abs=1e-8)


def test_many_small_contributions_go_together():
    parts = {f"loads/{k}": np.full((5, 1), 1.0 + k) for k in range(12)}
    parts["inertia/base-hub"] = -sum(parts.values())
    own, pushes = contributions(parts, HUB)
    assert len(pushes) == 8 and list(pushes)[-1] == "others"
    assert sum(pushes.values()) == pytest.approx(own)


def test_inertia_that_cancels_is_one():
    """Two bodies that share an acceleration: their shares are a hundred times what the spring does."""
    own = -100.0 * np.cos(TIME)
    parts = {"inertia/base-hub": own, "inertia/boom": -own - SPRING, "joint_springs": SPRING}
    line, pushes = contributions({name: rows[:, None] for name, rows in parts.items()}, HUB)
    assert list(pushes) == ["joint_springs"] and line == pytest.approx(-SPRING)
    small = {"inertia/base-hub": own, "inertia/boom": 0.2 * np.abs(own), "joint_springs": -own - 0.2 * np.abs(own)}
    line, pushes = contributions({name: rows[:, None] for name, rows in small.items()}, HUB)
    assert list(pushes) == ["joint_springs", "inertia/boom"] and line == pytest.approx(own)


def test_a_spike_is_cut_off_and_told(tmp_path, run, figure):
    spike = np.where(TIME == TIME[20], 1000.0, 0.0)
    parts = {"inertia/base-hub": -SPRING - spike, "joint_springs": SPRING, "loads/push": spike}
    plot_terms(run, TIME, {name: rows[:, None] for name, rows in parts.items()}, [HUB], tmp_path / "a.png", dpi=50)
    stack = figure().axes[1]
    assert max(np.abs(stack.get_ylim())) < 10
    (told,) = (text.get_text() for text in stack.texts)
    assert told == "cut off: up to 3, down to -1e+03 N m, the farthest at 1"


def test_what_is_wide_for_a_good_part_of_the_run_has_a_logarithmic_scale(tmp_path, run, figure):
    push = np.where(TIME > 7, 1000.0, 1.0) * np.cos(9 * TIME)
    parts = {"inertia/base-hub": -push, "loads/push": push}
    plot_terms(run, TIME, {name: rows[:, None] for name, rows in parts.items()}, [HUB], tmp_path / "a.png", dpi=50)
    stack = figure().axes[1]
    assert stack.get_yscale() == "symlog" and max(stack.get_ylim()) > 900
    (told,) = (text.get_text() for text in stack.texts)
    assert told == "scale linear to 1 N m, logarithmic beyond"  # as in the quiet 7 s


@pytest.mark.sampled(1)
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_motion_above_and_stack_below(tmp_path, run, figure, theme):
    rows = TIME <= 8
    parts = {name: part[rows] for name, part in PARTS.items()}
    plot_terms(run, TIME[rows], parts, [HUB], tmp_path / "a.png", theme=theme, dpi=50)
    motion, stack = figure().axes
    assert motion.get_title(loc="left") == "base-hub.angle" and motion.get_ylabel() == "[deg]"
    assert motion.lines[0].get_ydata() == pytest.approx(np.rad2deg(np.sin(TIME[rows])))
    assert stack.get_ylabel() == "moment [N m]" and stack.get_xlabel() == "time [s]"
    named = [text.get_text() for text in stack.get_legend().get_texts()]
    assert [name.split("  ")[0] for name in named] == ["joint springs", "load push", "sum: inertia of base-hub"]
    assert stack.lines[-1].get_ydata() == pytest.approx(parts["inertia/base-hub"][:, 0])
    areas = [area.get_paths()[0].vertices[:, 1] for area in stack.collections]
    assert max(a.max() for a in areas) == pytest.approx(max(-SPRING[rows] + 1.0 * (TIME[rows] < 5)), rel=1e-3)
    assert figure().get_suptitle() == "swing (without gravity gradient, pull)"
    with Image.open(tmp_path / "a.png") as image:
        pixels = np.asarray(image.convert("RGB"))
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100 and (pixels.mean() > 128) == (theme == "light")


def test_a_second_run_is_dashed_in_the_same_colours(tmp_path, monkeypatch):
    first, second = (write_run(tmp_path / f"{k}.h5", np.linspace(0, 20, n)) for k, n in ((1, 401), (2, 201)))
    kept = []
    monkeypatch.setattr("femflex.view.plot.saved", lambda fig, path, *_: kept.append(fig) or path)
    with open_run(first) as run, open_run(second) as other:
        plot_histories(run, tmp_path / "a.png", channels=["attitude/angles:pitch", "attitude/angles:yaw"], other=other)
        groups = curves_of(run, ["markers/boom.tip/deflection"], other=other)
        title = run.title
    lines = kept[0].axes[0].lines
    assert [line.get_label() for line in lines] == [
        "pitch",
        "yaw",
        *(label for label in (line.get_label() for line in lines[2:4]) if label.startswith("_")),
        "dashed: 2.h5",
    ]
    assert [line.get_color() for line in lines[:2]] == [line.get_color() for line in lines[2:4]]
    assert all(line.is_dashed() for line in lines[2:]) and not any(line.is_dashed() for line in lines[:2])
    assert len(lines[0].get_xdata()) == 401 and len(lines[2].get_xdata()) == 201
    assert kept[0].get_suptitle() == f"{title}\nin full; dashed: 2.h5"
    assert {curve.unit for curve in groups[0]} == {"cm"} and [curve.second for curve in groups[0]] == [False] * 3 + [
        True
    ] * 3


def cut_short(path, end, without):
    """The run as one that stopped at a time with something left out, and ran away in its last rows."""
    write_run(path, np.linspace(0, end, 201))
    with h5py.File(path, "r+") as file:
        file.attrs["complete"], file.attrs["without"] = False, without
        file["markers/boom.tip/deflection"][-3:, 1] *= 1e4
    return path


def test_every_plot_with_a_second_run_names_it_and_marks_where_it_stopped(tmp_path, monkeypatch):
    first, second = write_run(tmp_path / "1.h5", np.linspace(0, 20, 401)), tmp_path / "2.h5"
    cut_short(second, 12.5, "nonlinear_strain")
    kept = []
    monkeypatch.setattr("femflex.view.plot.saved", lambda fig, path, *_: kept.append(fig) or path)
    with open_run(first) as run, open_run(second) as other:
        for draw in (plot_histories, plot_spectra):
            draw(run, tmp_path / "a.png", channels=["attitude/angles", "markers/boom.tip/deflection"], other=other)
        angles = len(run.names("attitude/angles"))
    for k, figure in enumerate(kept):
        assert figure.get_suptitle().endswith("in full; dashed: linear strain")
        for ax in figure.axes:
            names = [text.get_text() for text in ax.get_legend().get_texts()]
            assert names.count("dashed: linear strain") == 1
            assert names.count("stopped at 12.5 s") == (k == 0)
    marked = 0
    for ax in kept[0].axes:
        crosses = [line for line in ax.lines if line.get_marker() == "x"]
        marked += len(crosses)
        assert crosses and all(line.get_xdata() == [12.5] for line in crosses)
        low, high = ax.get_ylim()
        assert all(low <= line.get_ydata()[0] <= high for line in crosses)
    assert marked == angles + 3
    assert any(line.get_ydata()[0] in kept[0].axes[-1].get_ylim() for line in kept[0].axes[-1].lines[-3:])  # at the rim


def test_a_second_run_that_reached_its_end_has_no_mark(tmp_path, monkeypatch):
    first, second = (write_run(tmp_path / f"{k}.h5", np.linspace(0, 20, 41)) for k in (1, 2))
    with h5py.File(second, "r+") as file:
        file.attrs["without"] = "damping, loads/push"
    kept = []
    monkeypatch.setattr("femflex.view.plot.saved", lambda fig, path, *_: kept.append(fig) or path)
    with open_run(first) as run, open_run(second) as other:
        plot_histories(run, tmp_path / "a.png", channels=["attitude/angles"], other=other)
    names = [text.get_text() for text in kept[0].axes[0].get_legend().get_texts()]
    assert names == ["pitch", "yaw", "dashed: without damping, without push"]
