"""Bode and Nichols pictures: gains, phases and what is left out, by their numbers."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.view.bode import MOST, drawn, phase, plot_bode, plot_nichols
from femflex.view.theme import THEMES

LIGHT = THEMES["light"]


def oscillator(omega, natural, damping, delay=0.0):
    return np.exp(-1j * omega * delay) / (natural**2 - omega**2 + 2j * damping * natural * omega)


@pytest.fixture
def responses():
    omega = np.geomspace(0.1, 100, 400)
    shown = {"tip over force": oscillator(omega, 3.0, 0.05), "rate": 1j * omega * oscillator(omega, 9.0, 0.02)}
    return omega, {"none": 1e-12 * shown["rate"], **shown, "delayed": 0.1 * oscillator(omega, 5.0, 0.5, 0.3)}


def test_a_bode_picture_has_gain_and_phase_over_hertz(tmp_path, drawn_figure, responses):
    omega, every = responses
    plot_bode(omega, every, tmp_path / "a.svg", title="Mine", dpi=44)
    figure = drawn_figure()
    gain, angle = figure.axes
    assert figure.get_suptitle() == "Mine" and figure.keywords == {"format": "svg", "dpi": 44}
    labels = ["tip over force", "rate", "delayed"]
    assert [line.get_label() for line in gain.lines] == labels == [t.get_text() for t in gain.get_legend().get_texts()]
    for k, (name, upper, lower) in enumerate(zip(labels, gain.lines, angle.lines, strict=True)):
        np.testing.assert_allclose(upper.get_data(), [omega / (2 * np.pi), np.abs(every[name])])
        np.testing.assert_allclose(lower.get_xdata(), omega / (2 * np.pi))
        turned = np.exp(1j * np.radians(lower.get_ydata())) * np.abs(every[name])
        np.testing.assert_allclose(turned, every[name], atol=1e-12)
        assert np.abs(np.diff(lower.get_ydata())).max() < 180 and upper.get_color() == LIGHT.lines[k]
    assert angle.lines[0].get_ydata()[-1] == pytest.approx(-180, abs=5)
    delayed = 0.3 * np.degrees(omega[-1]) + 180  # far beyond half a turn
    assert angle.lines[2].get_ydata()[-1] == pytest.approx(-delayed, abs=10)
    assert np.diff(angle.yaxis.get_major_locator().tick_values(-900, 90))[0] == pytest.approx(360)
    assert gain.get_xscale() == gain.get_yscale() == angle.get_xscale() == "log" and angle.get_yscale() == "linear"
    assert (gain.get_ylabel(), angle.get_ylabel(), angle.get_xlabel()) == (
        "gain, outputs' units per inputs' units",
        "phase [deg]",
        "frequency [Hz]",
    )
    plot_bode(omega, {"rate": every["rate"]}, tmp_path / "b.svg")
    assert np.diff(drawn_figure().axes[1].yaxis.get_major_locator().tick_values(-200, 90))[0] == pytest.approx(90)


def test_a_nichols_picture_has_decibels_over_degrees_and_a_ring_at_the_critical_point(
    tmp_path, drawn_figure, responses
):
    _, every = responses
    plot_nichols(every, tmp_path / "a.png")
    (ax,) = drawn_figure().axes
    *lines, ring = ax.lines
    assert [line.get_label() for line in lines] == ["tip over force", "rate", "delayed"]
    for line in lines:
        response = every[line.get_label()]
        angle, decibels = line.get_data()
        np.testing.assert_allclose(10 ** (decibels / 20) * np.exp(1j * np.radians(angle)), response, atol=1e-12)
    assert np.ravel(ring.get_data()).tolist() == [-180.0, 0.0]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("phase [deg]", "gain [dB]")


@pytest.mark.parametrize(("start", "shown"), [(80, 80), (100, -260), (-170, -170), (180, -180), (0, 0)])
def test_a_phase_begins_between_minus_270_and_90_degrees(start, shown):
    found = phase(np.exp(1j * np.radians(start - np.arange(0.0, 900.0, 30.0))))
    assert found == pytest.approx(shown - np.arange(0.0, 900.0, 30.0))


def test_the_first_responses_that_are_not_zero_are_drawn():
    every = {f"r{k}": np.array([0.0, 1.0 + k]) * (1e-11 if k == 2 else 1) for k in range(12)}
    assert list(drawn(every)) == [f"r{k}" for k in (0, 1, *range(3, MOST + 1))]
    with pytest.raises(ValueError, match="no output answers to an input"):
        drawn({"a": np.zeros(3, complex)})
