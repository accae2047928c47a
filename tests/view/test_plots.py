"""Time histories and spectra: curves, units and files."""

from __future__ import annotations

import xml.etree.ElementTree

import numpy as np
import pytest
from PIL import Image

from femflex.results import RunWriter, open_run
from femflex.rotations import angles_from_dcm, dcm_from_angles, is_symmetric
from femflex.system import Channel
from femflex.view import plot_histories, plot_spectra, plot_spectrograms
from femflex.view.curves import continuous_angles
from femflex.view.spectra import spectrogram


def test_default_plot(tmp_path, run, drawn_figure):
    plot_histories(run, tmp_path / "a.png")
    attitude, small, deflection, drift = drawn_figure().axes
    assert attitude.get_ylabel() == "attitude [deg]" and deflection.get_ylabel() == "deflection [cm]"
    assert drift.get_ylabel() == "energy minus work [J]" and drift.get_xlabel() == "time [s]"
    assert [line.get_label() for line in attitude.lines] == ["pitch", "yaw"]
    assert [line.get_label() for line in small.lines] == ["roll"]  # 3 deg beside 290
    lines_by_label = {line.get_label(): line.get_ydata() for line in deflection.lines}
    assert set(lines_by_label) == {
        "boom.tip x",
        "boom.tip y",
        "boom.tip z",
        "panel.corner z",
    }  # in plane it does not move
    assert np.allclose(lines_by_label["boom.tip y"], 100 * run["markers/boom.tip/deflection"][:, 1])
    assert np.allclose(attitude.lines[0].get_ydata(), np.rad2deg(0.25 * run.time))
    E = run["monitors/energy"]
    assert np.allclose(drift.lines[0].get_ydata(), E - E[0], atol=1e-15)


def test_peaks_of_a_spectrum_have_the_natural_frequencies(tmp_path, run, drawn_figure):
    plot_spectra(run, tmp_path / "a.png", channels=["bodies/panel/delta"])
    (ax,) = drawn_figure().axes
    assert [float(text.get_text()) for text in sorted(ax.texts, key=lambda t: t.xy[0])] == pytest.approx(
        [0.8, 2.1, 5.0], rel=2e-3
    )
    heights = [text.xy[1] for text in sorted(ax.texts, key=lambda t: t.xy[0])]
    assert heights == pytest.approx([0.25, 0.15, 0.05], rel=0.02)  # amplitudes of the made-up motion


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


def test_attitude_angles_are_unwrapped(tmp_path, drawn_figure):
    t = np.linspace(0, 10, 201)
    wrapped = np.stack([0.2 * np.sin(t), 0 * t, (4 * t + np.pi) % (2 * np.pi) - np.pi], axis=1)
    with open_run(swinging(tmp_path / "run.h5", wrapped, 0 * wrapped)) as run:
        plot_histories(run, tmp_path / "a.png", channels=["attitude/angles"])
        yaw = next(line for ax in drawn_figure().axes for line in ax.lines if line.get_label() == "yaw")
        assert yaw.get_ydata() == pytest.approx(np.rad2deg(4 * t))
    sparse_rows = np.arange(0, 201, 15)  # 3 rad between two rows: which way cannot be told
    with open_run(swinging(tmp_path / "few.h5", wrapped[sparse_rows], 0 * wrapped[sparse_rows])) as run:
        plot_histories(run, tmp_path / "b.png", channels=["attitude/angles"])
        yaw = next(line for ax in drawn_figure().axes for line in ax.lines if line.get_label() == "yaw")
        assert yaw.get_ydata() == pytest.approx(np.rad2deg(wrapped[sparse_rows, 2]))


@pytest.mark.parametrize("sequence", ["xzy", "zxz", "extrinsic yxz"])
def test_angles_are_unwrapped_through_their_singularity(sequence):
    """The middle angle turns thrice and hits the singularity in a row; the angles carried on are the same attitude."""
    t = np.linspace(0, 1, 109)  # 10 deg between two rows
    exact_angles = np.stack([0.3 + 0.2 * t, 6 * np.pi * t, 0.1 - 0.1 * t], axis=1)
    C = dcm_from_angles(exact_angles, sequence)
    names = ("x1", "z2", "x3") if is_symmetric(sequence) else ("x", "z", "y")
    unwrapped = continuous_angles(angles_from_dcm(C, sequence), names)
    assert (
        np.abs(unwrapped - unwrapped[0] - (exact_angles - exact_angles[0])).max() < 0.01
    )  # rad: between neighbours at the singularity
    assert np.abs(dcm_from_angles(unwrapped, sequence) - C).max() < 0.01


def sine(t, frequency, amplitude):
    return amplitude * np.sin(2 * np.pi * frequency * t + 0.3)


@pytest.fixture(scope="module")
def sine_run(tmp_path_factory):
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


def test_histories_have_the_data_of_their_channels(tmp_path, sine_run, drawn_figure):
    plot_histories(sine_run, tmp_path / "a.svg", ["many", "attitude/angles:2", "markers/mast.top/deflection"], dpi=31)
    figure = drawn_figure()
    ten_components, angle, deflection = figure.axes
    assert figure.get_size_inches() == pytest.approx([9.0, 3 * 2.5 + 0.5]) and figure.keywords["dpi"] == 31
    assert [line.get_label() for line in ten_components.lines] == [str(k + 1) for k in range(10)]
    assert len({(line.get_color(), line.get_linestyle()) for line in ten_components.lines}) == 10
    for k, line in enumerate(ten_components.lines):
        np.testing.assert_allclose(line.get_data(), [sine_run.time, sine_run["many"][:, k]])
    assert (ten_components.get_ylabel(), angle.get_ylabel(), deflection.get_ylabel()) == (
        "many [N m$^{2}$]",
        "attitude [deg]",
        "deflection [cm]",
    )
    assert angle.lines[0].get_ydata() == pytest.approx(np.rad2deg(sine_run["attitude/angles"][:, 1]))
    assert [line.get_label() for line in deflection.lines] == ["mast.top x", "mast.top y"]
    assert figure.get_suptitle() == "made" and figure.axes[-1].get_xlabel() == "time [s]"
    assert ten_components.get_xlim() == pytest.approx((100, 140)) and ten_components.get_title() == ""


def test_a_single_curve_is_named_at_its_ordinate(tmp_path, sine_run, drawn_figure):
    plot_histories(sine_run, tmp_path / "a.png", ["many:3"])
    (ax,) = drawn_figure().axes
    assert ax.get_ylabel() == "3\nmany [N m$^{2}$]" and ax.get_legend() is None


def test_spectra_have_the_peaks_of_their_sines(tmp_path, sine_run, drawn_figure):
    plot_spectra(
        sine_run, tmp_path / "a.png", ["markers/boom.tip/deflection", "markers/mast.top/deflection:x"], title="Mine"
    )
    figure = drawn_figure()
    (ax,) = figure.axes
    assert figure.get_suptitle() == "Mine"
    values = {"boom.tip x": (1.5, 40.0), "boom.tip y": (3.2, 10.0), "boom.tip z": (2.0, 5.0), "mast.top x": (0.6, 30.0)}
    for line in ax.lines:
        if line.get_label() in values:
            frequency, height = values[line.get_label()]
            x, y = line.get_data()
            assert x[np.argmax(y)] == pytest.approx(frequency, abs=0.01) and y.max() == pytest.approx(height, rel=2e-2)
    assert set(values) <= {line.get_label() for line in ax.lines}
    assert ax.get_xlim() == pytest.approx((0.0, 1.3 * 3.2), rel=1e-3)
    top = max(line.get_ydata().max() for line in ax.lines)
    assert ax.get_ylim() == pytest.approx((3e-5 * top, 10 * top)) and ax.get_yscale() == "log"
    assert ax.get_ylabel() == "amplitude of\ndeflection [cm]"
    assert sorted(float(text.get_text()) for text in ax.texts) == pytest.approx([0.6, 1.5, 2.0, 3.2], rel=1e-3)
    plot_spectra(sine_run, tmp_path / "b.png", ["markers/boom.tip/deflection"], highest=1.8)
    (ax,) = drawn_figure().axes
    assert ax.get_xlim() == pytest.approx((0.0, 1.8)) and [text.get_text() for text in ax.texts] == ["1.500"]


def test_spectrogram_has_amplitude_and_frequency_of_its_sine(tmp_path, sine_run, drawn_figure):
    rng = np.random.default_rng(2)
    t = 30.0 + np.sort(np.concatenate([[0.0, 60.0], rng.uniform(0, 60, 5998)]))
    window_times, frequencies, amplitude = spectrogram(t, 5.0 + 0.3 * t + sine(t, 2.0, 0.7))
    assert amplitude.shape == (len(frequencies), len(window_times)) and len(window_times) == 200
    assert (window_times[0], window_times[-1]) == pytest.approx((36.0, 84.0), abs=0.1) and np.diff(
        window_times
    ).min() > 0
    peak_frequencies = frequencies[amplitude.argmax(axis=0)]
    assert peak_frequencies == pytest.approx(np.full(200, 2.0), abs=0.02) and amplitude.max(axis=0) == pytest.approx(
        0.7, rel=2e-2
    )
    assert amplitude[frequencies < 0.5].max() < 0.02  # the line is taken out
    plot_spectrograms(sine_run, tmp_path / "a.svg", ["markers/boom.tip/deflection:x", "markers/boom.tip/deflection:y"])
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
    bars = [ax for ax in figure.axes if ax not in axes]
    assert [bar.get_ylabel() for bar in bars] == ["amplitude [cm]"] * 2
    plot_spectrograms(sine_run, tmp_path / "b.svg", ["markers/boom.tip/deflection:x"], highest=0.4)
    (ax, _) = drawn_figure().axes
    assert "[mHz]" in ax.get_ylabel() and ax.get_ylim()[1] == pytest.approx(400, rel=0.05)
