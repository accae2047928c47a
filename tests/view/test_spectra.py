"""Amplitude spectra and spectrograms of sines and chirps whose amplitude and frequency are known."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.view.spectra import amplitude_spectrum, spectrogram


@pytest.mark.parametrize("frequency", [0.83, 2.417, 7.9])
def test_peak_of_a_sine(frequency):
    time = np.linspace(0, 40, 2001)
    values = 3.0 + 0.2 * time + 1.7 * np.sin(2 * np.pi * frequency * time + 0.4)
    peaks = amplitude_spectrum(time, values).peaks()
    assert len(peaks) == 1
    assert peaks[0][0] == pytest.approx(frequency, rel=2e-4)
    assert peaks[0][1] == pytest.approx(1.7, rel=2e-3)


def test_small_peak_near_a_large_one():
    """80 dB down: a window with higher side lobes would hide it."""
    time = np.linspace(0, 100, 4001)
    values = np.sin(2 * np.pi * 1.003 * time) + 2e-4 * np.sin(2 * np.pi * 1.517 * time)
    peaks = amplitude_spectrum(time, values).peaks()
    assert [f for f, _ in peaks] == pytest.approx([1.003, 1.517], rel=1e-3)
    assert [a for _, a in peaks] == pytest.approx([1.0, 2e-4], rel=0.02)


@pytest.mark.parametrize("phase", [0.0, 1.2])
def test_peaks_of_few_cycles_are_left_out(phase):
    """Slow sines leave a hump at about two cycles, wherever they are; from 2.5 on it is where it says, to a tenth."""
    time = np.linspace(0, 20, 801)
    for cycles in np.arange(0.6, 3.4, 0.1):
        spectrum = amplitude_spectrum(time, np.sin(2 * np.pi * cycles / 20 * time + phase))
        peak_cycles = [20 * frequency for frequency, height in spectrum.peaks() if height > 1e-3]  # no side lobes
        assert all(peak >= 2.5 * 800 / 801 and abs(peak / cycles - 1) < 0.13 for peak in peak_cycles)
        assert len(peak_cycles) == 1 or cycles < 2.6


def test_uneven_times():
    rng = np.random.default_rng(3)
    time = np.sort(np.concatenate([[0.0, 40.0], rng.uniform(0, 40, 7998)]))
    peaks = amplitude_spectrum(time, np.sin(2 * np.pi * 1.25 * time)).peaks(1)
    assert peaks[0][0] == pytest.approx(1.25, rel=1e-3) and peaks[0][1] == pytest.approx(1.0, rel=0.02)


def test_constant_and_trend_have_no_peak():
    assert amplitude_spectrum(np.linspace(0, 1, 64), np.zeros(64)).peaks() == []
    assert amplitude_spectrum(np.linspace(0, 1, 64), np.linspace(2, 5, 64)).amplitude.max() < 1e-12  # a trend


def chirp(times):
    """2 cm at a frequency that falls from 4 to 1 Hz over 100 s."""
    return 0.02 * np.sin(2 * np.pi * (4 * times - 0.015 * times**2))


def test_spectrogram_of_a_chirp():
    times = np.linspace(0, 100, 2001)
    middle, frequency, amplitude = spectrogram(times, chirp(times))
    ridge = frequency[amplitude.argmax(axis=0)]
    assert np.abs(ridge - (4 - 0.03 * middle)).max() < 0.02
    assert 0.01 < amplitude.max() < 0.02  # spread over what the window sees of the change
    steady = spectrogram(times, 0.02 * np.sin(2 * np.pi * 3 * times))[2]
    assert steady.max(axis=0) == pytest.approx(0.02, rel=1e-3)
    assert middle[0] == pytest.approx(10, abs=0.1) and middle[-1] == pytest.approx(90, abs=0.1)
