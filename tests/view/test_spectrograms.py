"""Spectrograms: a chirp lies where its frequency is and as high as its amplitude; quotients of two channels."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view import plot_spectrograms
from femflex.view.curves import curves_of
from femflex.view.spectrogram import spectrogram


def chirp(times):
    """2 cm at a frequency that falls from 4 to 1 Hz over 100 s."""
    return 0.02 * np.sin(2 * np.pi * (4 * times - 0.015 * times**2))


@pytest.fixture
def grown(tmp_path):
    times = np.linspace(0, 100, 2001)
    arrays = {
        "markers/boom.tip/deflection": np.column_stack([0 * times, chirp(times), np.full(2001, 1e-9)]),
        "bodies/boom/length": 1.0 + 0.02 * times,
        "bodies/boom/still": np.full(2001, 3.0),
    }
    channels = {
        "markers/boom.tip/deflection": Channel("m", "deflection", (3,), ("x", "y", "z")),
        "bodies/boom/length": Channel("m", "length"),
        "bodies/boom/still": Channel("m", "still"),
    }
    with RunWriter(tmp_path / "run.h5", channels, {}) as writer:
        writer.write_block(times, arrays)
    with open_run(tmp_path / "run.h5") as run:
        yield run


def test_a_chirp_lies_where_its_frequency_is():
    times = np.linspace(0, 100, 2001)
    middle, frequency, amplitude = spectrogram(times, chirp(times))
    ridge = frequency[amplitude.argmax(axis=0)]
    assert np.abs(ridge - (4 - 0.03 * middle)).max() < 0.02
    assert 0.01 < amplitude.max() < 0.02  # spread over what the window sees of the change
    steady = spectrogram(times, 0.02 * np.sin(2 * np.pi * 3 * times))[2]
    assert steady.max(axis=0) == pytest.approx(0.02, rel=1e-3)
    assert middle[0] == pytest.approx(10, abs=0.1) and middle[-1] == pytest.approx(90, abs=0.1)
    with pytest.raises(ValueError, match="at least 80 instants; the record has 50"):
        spectrogram(times[:50], times[:50])


def test_a_channel_over_another_is_their_quotient(grown):
    ((curve,),) = curves_of(grown, ["markers/boom.tip/deflection over bodies/boom/length"])
    assert curve.values == pytest.approx(chirp(grown.time) / (1 + 0.02 * grown.time), abs=1e-15)
    assert (curve.unit, curve.quantity, curve.label) == ("1", "deflection over length", "boom.tip y over boom")
    with pytest.raises(ValueError, match=r"has 3 components; name one to divide by"):
        curves_of(grown, ["bodies/boom/length over markers/boom.tip/deflection"])


def test_the_picture_has_one_pair_of_axes_for_what_moves(tmp_path, grown, monkeypatch):
    import femflex.view.spectrogram as module

    figures, real = [], module.saved
    monkeypatch.setattr(module, "saved", lambda figure, *rest: figures.append(figure) or real(figure, *rest))
    plot_spectrograms(grown, tmp_path / "a.png", ["markers/boom.tip/deflection"], dpi=30)
    axes = [ax for ax in figures[0].axes if ax.get_ylabel().startswith("boom")]
    assert len(axes) == 1 and axes[0].get_ylabel() == "boom.tip y\nfrequency [Hz]"
    assert 4.0 < axes[0].get_ylim()[1] < 8.0
    with pytest.raises(ValueError, match="nothing changes in these channels"):
        plot_spectrograms(grown, tmp_path / "b.png", ["bodies/boom/still"])
    with pytest.raises(ValueError, match="last frequency shown is 0 Hz; give one above 0"):
        plot_spectrograms(grown, tmp_path / "b.png", highest=0.0)


def test_the_command_line_draws_it_for_one_run_alone(grown, femflex, tmp_path):
    code, out, _ = femflex("plot", grown.path, "markers/boom.tip/deflection", "--spectrogram", "-o", "c.png")
    assert code == 0 and "c.png" in out and (tmp_path / "c.png").stat().st_size > 5000
    low = ("plot", grown.path, "markers/boom.tip/deflection", "--spectrogram", "--highest", "2", "-o", "low.png")
    assert femflex(*low)[0] == 0 and (tmp_path / "low.png").read_bytes() != (tmp_path / "c.png").read_bytes()
    for other in (("--spectrum",), ("--with", grown.path)):
        code, _, said = femflex("plot", grown.path, "--spectrogram", *other)
        assert code == 2 and "--spectrogram plots one run" in " ".join(said.split())
