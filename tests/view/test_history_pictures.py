"""Histories, spectra, spectrograms and terms as drawn: lines, limits, names and marks by their numbers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view import plot_histories, plot_spectra, plot_spectrograms, plot_terms
from femflex.view.curves import Curve, by_range
from femflex.view.second_run import difference_text, fit_limits, mark_end, omission_text, title_of
from femflex.view.spectrogram import spectrogram
from femflex.view.spectrum import amplitude_spectrum
from femflex.view.terms import CoordinateTerms, contributions, drawn_as_lines, readable_name
from femflex.view.theme import THEMES

LIGHT = THEMES["light"]


def sine(t, frequency, amplitude):
    return amplitude * np.sin(2 * np.pi * frequency * t + 0.3)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    t = np.linspace(100.0, 140.0, 801)
    arrays = {
        "markers/boom.tip/deflection": np.column_stack([sine(t, 1.5, 0.4), sine(t, 3.2, 0.1), sine(t, 2.0, 0.05)]),
        "markers/mast.top/deflection": np.column_stack([sine(t, 0.6, 0.3), 1e-4 * t, 0 * t]),
        "many": np.cos(np.outer(t, np.arange(1, 11)) * 0.3),
        "attitude/angles": np.column_stack([sine(t, 0.1, 0.5), sine(t, 0.2, 0.4), sine(t, 0.3, 0.3)]),
    }
    names = {"attitude/angles": ("roll", "pitch", "yaw"), "many": ()}
    channels = {
        path: Channel("rad" if path == "attitude/angles" else "m" if "markers" in path else "N m^2", path, v.shape[1:],
                      names.get(path, ("x", "y", "z")))
        for path, v in arrays.items()
    }  # fmt: skip
    path = tmp_path_factory.mktemp("runs") / "run.h5"
    with RunWriter(path, channels, {}, {"title": "made"}) as writer:
        writer.write_block(t, arrays)
    with open_run(path) as opened:
        yield opened


def test_histories_have_a_line_a_curve_and_a_legend_in_columns(tmp_path, run, drawn_figure):
    plot_histories(run, tmp_path / "a.svg", ["many", "attitude/angles:2", "markers/mast.top/deflection"], dpi=31)
    figure = drawn_figure()
    many, angle, deflection = figure.axes
    assert figure.get_size_inches() == pytest.approx([9.0, 3 * 2.5 + 0.5]) and figure.keywords["dpi"] == 31
    assert [line.get_label() for line in many.lines] == [str(k + 1) for k in range(10)]
    for k, line in enumerate(many.lines):
        np.testing.assert_allclose(line.get_data(), [run.time, run["many"][:, k]])
        assert line.get_color() == LIGHT.lines[k % 8]
    assert many.get_legend()._ncols == 2 and deflection.get_legend()._ncols == 1
    assert (many.get_ylabel(), angle.get_ylabel(), deflection.get_ylabel()) == (
        "many [N m$^{2}$]",
        "attitude [deg]",
        "deflection [cm]",
    )
    assert angle.lines[0].get_ydata() == pytest.approx(np.rad2deg(run["attitude/angles"][:, 1]))
    assert [line.get_label() for line in deflection.lines] == ["mast.top x", "mast.top y"]
    assert figure.get_suptitle() == "made" and figure.axes[-1].get_xlabel() == "time [s]"
    assert many.get_xlim() == pytest.approx((100, 140)) and many.get_title() == ""


def test_spectra_show_every_curve_up_to_a_little_beyond_the_last_peak(tmp_path, run, drawn_figure):
    plot_spectra(
        run, tmp_path / "a.png", ["markers/boom.tip/deflection", "markers/mast.top/deflection:x"], title="Mine"
    )
    figure = drawn_figure()
    (ax,) = figure.axes
    assert figure.get_suptitle() == "Mine"
    values = {"boom.tip x": (1.5, 40.0), "boom.tip y": (3.2, 10.0), "boom.tip z": (2.0, 5.0), "mast.top x": (0.6, 30.0)}
    for line in ax.lines:
        if line.get_label() in values:
            place, height = values[line.get_label()]
            x, y = line.get_data()
            assert x[np.argmax(y)] == pytest.approx(place, abs=0.01) and y.max() == pytest.approx(height, rel=2e-2)
    assert set(values) <= {line.get_label() for line in ax.lines}
    assert ax.get_xlim() == pytest.approx((0.0, 1.3 * 3.2), rel=1e-3)
    top = max(line.get_ydata().max() for line in ax.lines)
    assert ax.get_ylim() == pytest.approx((3e-5 * top, 10 * top)) and ax.get_yscale() == "log"
    assert ax.get_ylabel() == "amplitude of\ndeflection [cm]"
    assert sorted(float(text.get_text()) for text in ax.texts) == pytest.approx([0.6, 1.5, 2.0, 3.2], rel=1e-3)
    plot_spectra(run, tmp_path / "b.png", ["markers/boom.tip/deflection"], highest=1.8)
    (ax,) = drawn_figure().axes
    assert ax.get_xlim() == pytest.approx((0.0, 1.8)) and [text.get_text() for text in ax.texts] == ["1.500"]
    with pytest.raises(ValueError, match="the last frequency shown is -1 Hz; give one above 0"):
        plot_spectra(run, tmp_path / "c.png", highest=-1.0)


def test_peaks_are_the_highest_in_order_of_frequency_without_slow_ones():
    t = np.linspace(0, 50, 4001)
    lines = {0.4: 0.2, 1.1: 0.9, 2.3: 0.5, 4.0: 0.7, 6.5: 1e-6}
    found = amplitude_spectrum(t, sum(sine(t, f, a) for f, a in lines.items()))
    assert [f for f, _ in found.peaks(3)] == pytest.approx([1.1, 2.3, 4.0], rel=1e-3)
    assert found.peaks()[0] == pytest.approx((0.4, 0.2), rel=2e-2) and len(found.peaks()) == 4
    slow = amplitude_spectrum(t, sine(t, 0.045, 1.0) + sine(t, 2.0, 0.5)).peaks()
    assert [f for f, _ in slow] == pytest.approx([2.0], rel=1e-3)  # fewer than 2.5 cycles have no place


def test_a_spectrogram_keeps_amplitude_time_and_frequency_of_uneven_rows(tmp_path, run, drawn_figure):
    rng = np.random.default_rng(2)
    t = 30.0 + np.sort(np.concatenate([[0.0, 60.0], rng.uniform(0, 60, 5998)]))
    places, frequencies, amplitude = spectrogram(t, 5.0 + 0.3 * t + sine(t, 2.0, 0.7))
    assert amplitude.shape == (len(frequencies), len(places)) and len(places) == 200
    assert (places[0], places[-1]) == pytest.approx((36.0, 84.0), abs=0.1) and np.diff(places).min() > 0
    at = frequencies[amplitude.argmax(axis=0)]
    assert at == pytest.approx(np.full(200, 2.0), abs=0.02) and amplitude.max(axis=0) == pytest.approx(0.7, rel=2e-2)
    assert amplitude[frequencies < 0.5].max() < 0.02  # the line is taken out
    plot_spectrograms(run, tmp_path / "a.svg", ["markers/boom.tip/deflection:x", "markers/boom.tip/deflection:y"])
    figure = drawn_figure()
    axes = [ax for ax in figure.axes if "frequency" in ax.get_ylabel()]
    assert [ax.get_ylabel() for ax in axes] == ["boom.tip x\nfrequency [Hz]", "boom.tip y\nfrequency [Hz]"]
    for ax, (frequency, height) in zip(axes, ((1.5, 40.0), (3.2, 10.0)), strict=True):
        (mesh,) = ax.collections
        values = np.asarray(mesh.get_array())
        assert values.max() == pytest.approx(height, rel=1e-2) and values.min() == pytest.approx(0.02 * values.max())
        assert (mesh.norm.vmin, mesh.norm.vmax) == pytest.approx((0.02 * values.max(), values.max()))
        low, high = ax.get_ylim()
        assert 1.6 * frequency < high < 1.6 * (frequency + 0.5)  # half a peak, of 4 over the 8 s of a window
        middle = low + (high - low) * (np.argmax(values[:, 50]) + 0.5) / len(values)
        assert middle == pytest.approx(frequency, rel=0.03)
    assert axes[-1].get_xlabel() == "time [s], middle of a window of 0.2 of the run"
    bars = [ax for ax in figure.axes if ax not in axes]
    assert [bar.get_ylabel() for bar in bars] == ["amplitude [cm]"] * 2
    plot_spectrograms(run, tmp_path / "b.svg", ["markers/boom.tip/deflection:x"], highest=0.4)
    (ax, _) = drawn_figure().axes
    assert "[mHz]" in ax.get_ylabel() and ax.get_ylim()[1] == pytest.approx(400, rel=0.05)


def of(title="T", without=(), integrator="", name="a.h5", complete=True):
    return SimpleNamespace(
        title=title,
        without=without,
        linearised=integrator == "linearised",
        path=SimpleNamespace(name=name),
        complete=complete,
    )


def test_a_second_run_is_named_by_what_tells_it_apart():
    assert title_of(of()) == "T" and title_of(of(integrator="linearised", without=("damping",))) == "T (linearised)"
    assert title_of(of(without=("nonlinear_strain", "loads/push"))) == "T (without nonlinear strain, push)"
    assert omission_text(of()) == "in full" and omission_text(of(integrator="linearised")) == "linearised"
    assert omission_text(of(without=("damping", "nonlinear_strain"))) == "without damping, linear strain"
    both = of(integrator="linearised", without=("loads/push", "nonlinear_strain"))
    assert omission_text(both) == "without push, linear strain, linearised"
    assert difference_text(both, of(integrator="linearised")) == omission_text(both) != difference_text(of(), both)
    assert difference_text(of("A"), of("B")) == "A"
    assert difference_text(of(name="b.h5"), of()) == "b.h5"
    assert (
        difference_text(of(without=("x",)), of()) == "without x"
        and difference_text(of(), of(without=("x",))) == "in full"
    )
    assert difference_text(of(integrator="linearised"), of()) == "linearised"


def curve(values, second=False, time=None, unit="rad", label="a", quantity="q"):
    values = np.asarray(values, float)
    return Curve(label, values, unit, quantity, np.arange(float(len(values))) if time is None else time, second)


@pytest.mark.parametrize(
    ("other", "limits"),
    [([0.0, 6.9], (-77, 77)), ([0.0, 7.1], (-3.0, 3.0)), ([-6.9, 0.0], (-77, 77)), ([0.0, -7.1], (-3.0, 3.0))],
)
def test_limits_leave_out_what_is_more_than_three_ranges_away(other, limits):
    """The first run goes from -1 to 1: three ranges beyond are 7, and one range is shown."""
    ax = Figure().subplots()
    ax.set_ylim(-77, 77)
    fit_limits(ax, [curve([-1.0, 0.5]), curve([0.0, 1.0]), curve(other, True)])
    assert ax.get_ylim() == pytest.approx(limits)


def test_the_end_of_a_run_that_stopped_is_marked_at_its_last_values_within_the_axes():
    ax = Figure().subplots()
    ax.set_ylim(-1.0, 2.0)
    second = [curve([0.0, 9.0], True, np.array([0.0, 90.0])), curve([0.0, 0.7], True, np.array([0.0, 90.0]))]
    mark_end(ax, [curve([0, 0]), *second], of(complete=False), (60.0, "min"), LIGHT)
    assert [(line.get_xdata()[0], line.get_ydata()[0]) for line in ax.lines] == [(1.5, 0.7), (1.5, 2.0)]
    assert ax.lines[0].get_label() == "stopped at 1.5 min" and ax.lines[1].get_label().startswith("_")
    assert ax.get_ylim() == (-1.0, 2.0)
    for group, complete in (([curve([0, 0])], False), (second, True)):
        empty = Figure().subplots()
        mark_end(empty, group, of(complete=complete), (60.0, "min"), LIGHT)
        assert not empty.lines


def test_angles_of_unlike_ranges_are_parted_and_a_second_runs_follow_their_namesakes():
    ranges = {"a": 10.0, "b": 0.6, "c": 0.4, "d": 0.01, "e": 0.0}
    group = [curve([0.0, size], label=name) for name, size in ranges.items()]
    group += [curve([0.0, 9.0], True, label="c")]
    parts = [[one.label for one in part] for part in by_range(group)]
    assert parts == [["a", "b", "e"], ["c", "c"], ["d"]]
    lengths = [curve([0.0, size], unit="m", label=name) for name, size in ranges.items()]
    assert by_range(lengths) == [lengths] and by_range(group[:1]) == [group[:1]]


def test_terms_of_several_coordinates_have_one_colour_each_and_their_units(tmp_path, drawn_figure):
    t = np.linspace(0, 10, 101)
    names = ("hub.angle", "boom.delta1", "hub.turn")
    q = np.column_stack([np.sin(t), 0.1 * t, 0 * t])
    channels = {
        "q": Channel("rad, kg^1/2 m, rad", "q", (3,), names),
        "u": Channel("rad/s, kg^1/2 m/s, rad/s", "u", (3,), ("hub.angle_rate", "boom.delta1_rate", "hub.spin")),
    }
    with RunWriter(tmp_path / "run.h5", channels, {}, {"title": "T"}) as writer:
        writer.write_block(t, {"q": q, "u": np.column_stack([np.cos(t), 0 * t + 0.1, 0.5 * np.cos(t)])})
    spring = np.column_stack([3 * np.cos(t), 0.2 * np.cos(t), 0 * t])
    push = np.column_stack([0 * t + 1.0, 2.0 * np.sin(t), 0.4 + 0 * t])
    parts = {"inertia": -spring - push, "joint_springs": spring, "loads/push": push}
    coordinates = [
        CoordinateTerms(0, "hub.angle_rate", "N m", "inertia"),
        CoordinateTerms(1, "boom.delta1_rate", "kg^1/2 m/s^2", "inertia"),
        CoordinateTerms(2, "hub.spin", "N", "inertia"),
    ]
    rows = slice(20, 81)
    with open_run(tmp_path / "run.h5") as run:
        plot_terms(run, t[rows], {k: v[rows] for k, v in parts.items()}, coordinates, tmp_path / "a.svg", title="Mine")
    figure = drawn_figure()
    assert figure.get_suptitle() == "Mine"
    strips, stacks = figure.axes[::2], figure.axes[1::2]
    assert [ax.get_title(loc="left") for ax in strips] == ["hub.angle", "boom.delta1", "hub.spin"]
    assert [ax.get_ylabel() for ax in strips] == ["[deg]", "[kg$^{1/2}$ m]", "[deg/s]"]
    expected = [np.rad2deg(np.sin(t)), 0.1 * t, np.rad2deg(0.5 * np.cos(t))]
    for ax, values in zip(strips, expected, strict=True):
        np.testing.assert_allclose(ax.lines[0].get_data(), [t[rows], values[rows]], atol=1e-12)
    assert [ax.get_ylabel() for ax in stacks] == [
        "moment [N m]",
        "generalised force [kg$^{1/2}$ m/s$^{2}$]",
        "force [N]",
    ]
    shares = []
    for ax, index in zip(stacks, range(3), strict=True):
        size = {name: np.mean(np.abs(parts[name][rows, index])) for name in ("joint_springs", "loads/push")}
        total = sum(size.values())
        ranked = sorted((name for name in size if size[name] > 2e-3 * total), key=lambda name: -size[name])
        texts = [text.get_text() for text in ax.get_legend().get_texts()]
        wanted = []
        for name in ranked:
            share = size[name] / total
            wanted.append(f"{readable_name(name)}  {100 * share:.{1 if share < 0.1 else 0}f} %")
        assert texts == [*wanted, "sum: inertia"]
        colours = {name: ax.collections[2 * k].get_facecolor()[0][:3] for k, name in enumerate(ranked)}
        shares.append(colours)
        np.testing.assert_allclose(ax.lines[-1].get_ydata(), parts["inertia"][rows, index], atol=1e-12)
        top = max(c.get_paths()[0].vertices[:, 1].max() for c in ax.collections)
        assert top == pytest.approx(sum(np.maximum(-parts[name][rows, index], 0) for name in ranked).max(), abs=1e-9)
    assert np.array_equal(shares[0]["loads/push"], shares[1]["loads/push"])
    assert not np.array_equal(shares[0]["loads/push"], shares[0]["joint_springs"])


def test_small_terms_go_together_and_inertia_is_one_where_most_of_it_cancels():
    one = CoordinateTerms(1, "u", "N", "inertia/hub")
    size = {"inertia/hub": 5.0, "inertia/boom": -4.0, "a": 2.0, "tiny": 1e-3, "b": -3.0}
    parts = {name: np.outer(np.ones(4), [0.0, value]) for name, value in size.items()}
    assert drawn_as_lines(parts, one) == ["inertia/hub", "inertia/boom"]  # 1 is less than half of 9
    line, found = contributions(parts, one)
    assert line.tolist() == [1.0] * 4 and {n: v[0] for n, v in found.items()} == {"b": 3.0, "a": -2.0}
    assert list(found) == ["b", "a"]
    parts["inertia/boom"] = np.outer(np.ones(4), [0.0, -1.5])
    assert drawn_as_lines(parts, one) == ["inertia/hub"]  # 3.5 of 6.5
    line, found = contributions(parts, one)
    assert line.tolist() == [5.0] * 4 and found["inertia/boom"][0] == 1.5 and list(found) == ["b", "a", "inertia/boom"]
    some = {f"p{k}": np.outer(np.ones(4), [0.0, 1.0 + 0.1 * k]) for k in range(9)} | {"inertia/hub": np.zeros((4, 2))}
    _, found = contributions(some, one)
    assert len(found) == 8 and found["others"].tolist() == pytest.approx([-2.1] * 4) and next(iter(found)) == "p8"


@pytest.mark.parametrize("name", ["light", "dark"])
def test_maps_of_a_theme_begin_at_its_zero_and_lines_differ_from_faces(name):
    import matplotlib

    theme = THEMES[name]
    faces, lines = np.asarray(theme.colour_map().colors), np.asarray(theme.mesh_line_map().colors)
    base = matplotlib.colormaps[theme.elastic[0]]
    assert (
        faces[0] == pytest.approx(base(theme.elastic[1]))
        and faces[-1] == pytest.approx(base(1.0))
        and len(faces) == 256
    )
    white = 0.25 + 0.45 * (faces[:, :3] @ [0.2126, 0.7152, 0.0722])
    assert lines == pytest.approx(faces[:, :3] + white[:, None] * (1 - faces[:, :3]))
    signed = np.asarray(theme.colour_map(True).colors)
    assert signed[0] == pytest.approx(matplotlib.colormaps["coolwarm"](0.0))
    assert np.asarray(theme.mesh_line_map(True).colors) == pytest.approx(0.55 * signed[:, :3])
