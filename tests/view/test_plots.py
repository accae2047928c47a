"""Time histories and spectra: which curves, in which units, and that the files are what their names say."""

from __future__ import annotations

import xml.etree.ElementTree

import numpy as np
import pytest
from PIL import Image

import femflex.view.plot
from femflex.results import RunWriter, open_run
from femflex.rotations import angles_from_dcm, dcm_from_angles, is_symmetric
from femflex.system import Channel
from femflex.view import plot_histories, plot_spectra
from femflex.view.curves import curves_of, unwrapped


@pytest.fixture
def figure(monkeypatch):
    """The figure that is saved."""
    kept = []
    real = femflex.view.plot.saved
    monkeypatch.setattr(femflex.view.plot, "saved", lambda fig, *args: kept.append(fig) or real(fig, *args))
    return lambda: kept[-1]


def test_what_is_plotted_by_default(tmp_path, run, figure):
    plot_histories(run, tmp_path / "a.png")
    attitude, small, deflection, drift = figure().axes
    assert attitude.get_ylabel() == "attitude [deg]" and deflection.get_ylabel() == "deflection [cm]"
    assert drift.get_ylabel() == "energy minus work [J]" and drift.get_xlabel() == "time [s]"
    assert [line.get_label() for line in attitude.lines] == ["pitch", "yaw"]
    assert [line.get_label() for line in small.lines] == ["roll"]  # 3 deg beside 290
    named = {line.get_label(): line.get_ydata() for line in deflection.lines}
    assert set(named) == {"boom.tip x", "boom.tip y", "boom.tip z", "panel.corner z"}  # in plane it does not move
    assert np.allclose(named["boom.tip y"], 100 * run["markers/boom.tip/deflection"][:, 1])
    assert np.allclose(attitude.lines[0].get_ydata(), np.rad2deg(0.25 * run.time))
    E = run["monitors/energy"]
    assert np.allclose(drift.lines[0].get_ydata(), E - E[0], atol=1e-15)


def test_channels_and_components_by_name(tmp_path, orbiting, figure):
    chosen = ["attitude/angles:yaw", "attitude/angles:1", "bodies/panel/delta:3", "markers/boom.tip/position"]
    plot_histories(orbiting, tmp_path / "a.png", channels=chosen, degrees=False)
    angles, delta, position = figure().axes
    assert [line.get_label() for line in angles.lines] == ["yaw", "pitch"]
    assert angles.get_ylabel() == "attitude [rad]" and delta.get_ylabel() == "delta [kg$^{1/2}$ m]"
    assert [line.get_label() for line in delta.lines] == ["panel 3"] and len(position.lines) == 3
    assert position.get_ylabel() == "position [m]" and position.get_xlabel() == "time [min]"
    assert np.allclose(angles.lines[1].get_xdata()[-1], 90.0)


def test_columns_of_several_units_go_to_several_axes(tmp_path):
    times, q = np.linspace(0, 1, 20), np.random.default_rng(0).standard_normal((20, 3))
    channels = {"q": Channel("rad, rad, kg^1/2 m", "coordinates", (3,), ("a.angle1", "a.angle2", "b.delta1"))}
    with RunWriter(tmp_path / "run.h5", channels, {}) as writer:
        writer.write_block(times, {"q": q})
    with open_run(tmp_path / "run.h5") as run:
        angles, deltas = curves_of(run, ["q"])
    assert [curve.label for curve in angles] == ["a.angle1", "a.angle2"] and angles[0].unit == "deg"
    assert np.allclose(angles[1].values, np.rad2deg(q[:, 1])) and deltas[0].unit == "kg^1/2 m"


def test_components_too_small_to_be_seen_leave_the_legend_unless_they_are_named(tmp_path):
    times = np.linspace(0, 1, 20)
    channels = {f"markers/a.{name}/deflection": Channel("m", "deflection", (3,), ("x", "y", "z")) for name in "pq"}
    rows = np.outer(np.sin(times), [1.0, 2e-3, 5e-4])
    with RunWriter(tmp_path / "run.h5", channels, {}) as writer:
        writer.write_block(times, {path: rows * size for path, size in zip(channels, (1.0, 1e-5), strict=True)})
    with open_run(tmp_path / "run.h5") as run:
        ((x, y, *other),) = curves_of(run, list(channels))
        assert [curve.label for curve in (x, y, *other)] == ["a.p x", "a.p y", "a.q x", "a.q y"]
        ((z,),) = curves_of(run, ["markers/a.p/deflection:z"])
    assert z.label == "a.p z"


def test_peaks_of_a_spectrum_carry_the_natural_frequencies(tmp_path, run, figure):
    plot_spectra(run, tmp_path / "a.png", channels=["bodies/panel/delta"])
    (ax,) = figure().axes
    assert [float(text.get_text()) for text in sorted(ax.texts, key=lambda t: t.xy[0])] == pytest.approx(
        [0.8, 2.1, 5.0], rel=2e-3
    )
    assert "Blackman–Harris window" in ax.get_xlabel() and ax.get_xlabel().startswith("frequency [Hz]")
    heights = [text.xy[1] for text in sorted(ax.texts, key=lambda t: t.xy[0])]
    assert heights == pytest.approx([0.25, 0.15, 0.05], rel=0.02)  # amplitudes of the made-up motion


def test_a_spectrum_names_only_the_curves_that_are_seen(tmp_path, run, figure):
    plot_spectra(run, tmp_path / "a.png", channels=["markers/panel.corner/deflection"])
    (ax,) = figure().axes
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["panel.corner z"]  # in plane it does not move


def test_slow_spectra_are_in_millihertz(tmp_path, orbiting, figure):
    plot_spectra(orbiting, tmp_path / "a.png", channels=["attitude/angles:pitch"], highest=0.01)
    (ax,) = figure().axes
    assert "[mHz]" in ax.get_xlabel() and ax.get_xlim()[1] == pytest.approx(10.0)
    assert float(ax.texts[0].get_text()) == pytest.approx(3e3 / 5400, rel=5e-3)  # three swings an orbit


@pytest.mark.sampled(1)
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_png_files_have_their_size_and_theme(tmp_path, run, theme):
    with Image.open(plot_histories(run, tmp_path / "a.png", theme=theme, dpi=50)) as image:
        assert image.size == (450, 525)
        pixels = np.asarray(image.convert("RGB"))
    assert (pixels[2, 2].mean() > 200) == (theme == "light") and len(np.unique(pixels.reshape(-1, 3), axis=0)) > 50


def test_svg_files_are_drawings(tmp_path, run):
    root = xml.etree.ElementTree.parse(plot_spectra(run, tmp_path / "a.svg")).getroot()
    assert root.tag.endswith("svg") and len(list(root.iter("{http://www.w3.org/2000/svg}path"))) > 20


def test_what_cannot_be_plotted_is_told(tmp_path, run):
    with pytest.raises(KeyError, match=r"near it are \['attitude/angles'\]"):
        plot_histories(run, tmp_path / "a.png", channels=["attitude/angle"])
    with pytest.raises(KeyError, match=r"'up' is not a component of 'attitude/angles'; its components are \['pitch'"):
        plot_histories(run, tmp_path / "a.png", channels=["attitude/angles:up"])
    with pytest.raises(ValueError, match="the list of channels to plot is empty"):
        plot_histories(run, tmp_path / "a.png", channels=[])
    with pytest.raises(ValueError, match=r"a plot is written as \.png or \.svg; a\.pdf is neither"):
        plot_histories(run, tmp_path / "a.pdf")
    assert not list(tmp_path.iterdir())
    plot_histories(run, tmp_path / "a.png", dpi=30)
    with pytest.raises(FileExistsError, match=r"a\.png exists; choose another name, or force"):
        plot_histories(run, tmp_path / "a.png")


def test_a_quantity_that_hardly_changes_is_shown_from_its_first_value(run):
    ((curve,),) = curves_of(run, ["monitors/energy"])
    E = run["monitors/energy"]
    assert np.allclose(curve.values, E - E[0], atol=1e-18) and curve.quantity == "change of energy"
    assert curve.label == "energy\nfrom 12.5" and curve.unit == "J"


def test_a_second_run_that_runs_away_does_not_hide_the_first(tmp_path, figure):
    channel = {"markers/tip/deflection": Channel("m", "deflection", (1,), ("y",))}
    t = np.linspace(0, 1, 11)
    made = []
    for name, values in (("first", np.sin(t)), ("away", np.exp(20 * t)), ("near", 1.5 * np.sin(t))):
        with RunWriter(tmp_path / f"{name}.h5", channel, {}) as writer:
            writer.write_block(t, {"markers/tip/deflection": values[:, None]})
        made.append(open_run(tmp_path / f"{name}.h5"))
    first, away, near = made
    plot_histories(first, tmp_path / "a.png", ["markers/tip/deflection"], other=away)
    low, high = figure().axes[0].get_ylim()
    assert low == pytest.approx(-84.1, abs=0.1) and high == pytest.approx(168.3, abs=0.1)  # cm
    plot_histories(first, tmp_path / "b.png", ["markers/tip/deflection"], other=near)
    assert figure().axes[0].get_ylim()[1] > 126
    for run in made:
        run.close()


def swinging(path, *angles):
    """A run of angles of joints beside its attitude, (n_t, 3) each [rad]."""
    names = ("a.angle", "b.angle", "c.angle")
    channels = {
        "attitude/angles": Channel("rad", "attitude", (3,), ("roll", "pitch", "yaw")),
        "q": Channel("rad, rad, rad", "coordinates", (3,), names),
    }
    with RunWriter(path, channels, {}) as writer:
        writer.write_block(np.linspace(0, 10, len(angles[0])), dict(zip(channels, angles, strict=True)))
    return path


def test_angles_that_move_far_less_than_others_get_axes_of_their_own(tmp_path, figure):
    t = np.linspace(0, 10, 201)
    q = np.stack([15 * t, 0.5 * np.sin(t), 0.3 + 0 * t], axis=1)
    with open_run(swinging(tmp_path / "run.h5", 0 * q, q)) as run:
        plot_histories(run, tmp_path / "a.png", channels=["q"])
        far, near = figure().axes
        assert [line.get_label() for line in far.lines] == ["a.angle", "c.angle"]
        assert [line.get_label() for line in near.lines] == ["b.angle"]
        assert np.ptp(near.get_ylim()) < 100 < np.ptp(far.get_ylim())  # deg
        plot_histories(run, tmp_path / "b.png", channels=["q:b.angle", "q:c.angle"])
        assert len(figure().axes) == 1


def test_attitude_angles_are_counted_on_beyond_half_a_turn(tmp_path, figure):
    t = np.linspace(0, 10, 201)
    wrapped = np.stack([0.2 * np.sin(t), 0 * t, (4 * t + np.pi) % (2 * np.pi) - np.pi], axis=1)
    with open_run(swinging(tmp_path / "run.h5", wrapped, 0 * wrapped)) as run:
        plot_histories(run, tmp_path / "a.png", channels=["attitude/angles"])
        yaw = next(line for ax in figure().axes for line in ax.lines if line.get_label() == "yaw")
        assert yaw.get_ydata() == pytest.approx(np.rad2deg(4 * t))
    few = np.arange(0, 201, 15)  # 3 rad between two rows: which way cannot be told
    with open_run(swinging(tmp_path / "few.h5", wrapped[few], 0 * wrapped[few])) as run:
        plot_histories(run, tmp_path / "b.png", channels=["attitude/angles"])
        yaw = next(line for ax in figure().axes for line in ax.lines if line.get_label() == "yaw")
        assert yaw.get_ydata() == pytest.approx(np.rad2deg(wrapped[few, 2]))


@pytest.mark.parametrize("sequence", ["xzy", "zxz", "extrinsic yxz"])
def test_angles_go_on_through_their_singularity(sequence):
    """The middle angle turns thrice and hits the singularity in a row; the angles carried on are the same attitude."""
    t = np.linspace(0, 1, 109)  # 10 deg between two rows
    whole = np.stack([0.3 + 0.2 * t, 6 * np.pi * t, 0.1 - 0.1 * t], axis=1)
    C = dcm_from_angles(whole, sequence)
    names = ("x1", "z2", "x3") if is_symmetric(sequence) else ("x", "z", "y")
    seen = unwrapped(angles_from_dcm(C, sequence), names)
    assert np.abs(seen - seen[0] - (whole - whole[0])).max() < 0.01  # rad: between neighbours at the singularity
    assert np.abs(dcm_from_angles(seen, sequence) - C).max() < 0.01


def test_of_peaks_that_are_close_the_higher_is_named():
    """Nearer than a twentieth of the axis."""
    from matplotlib.figure import Figure

    from femflex.view.plot import _name_peaks
    from femflex.view.theme import theme_of

    ax = Figure().add_subplot()
    ax.set_xlim(0.0, 10.0)
    _name_peaks(ax, [(5.2, 0.5), (5.0, 1.0), (8.0, 0.2), (8.6, 0.1)], theme_of("light"))
    assert [text.get_text() for text in ax.texts] == ["5.000", "8.000", "8.600"]


def test_rounding_of_an_energy_that_is_zero_is_shown_as_a_constant(tmp_path):
    """The parts of a pendulum's energy of zero are 40 J; what they leave is rounding. 1e-9 J is not."""
    times = np.linspace(0, 1, 20)
    left = 3e-14 + 2e-11 * np.sin(7 * times)
    for rest, label in ((left, "energy\nconstant within 4e-11 J"), (50 * left, "energy\nfrom 1.5e-12")):
        arrays = {"monitors/energy": rest, "monitors/kinetic": 40.0 * times}
        with RunWriter(tmp_path / "run.h5", {path: Channel("J", path) for path in arrays}, {}, force=True) as writer:
            writer.write_block(times, arrays)
        with open_run(tmp_path / "run.h5") as run:
            ((curve,),) = curves_of(run, ["monitors/energy"])
        assert curve.label == label
        assert (np.ptp(curve.values) == 0.0) == ("within" in label)
