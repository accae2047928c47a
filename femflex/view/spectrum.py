"""Amplitude spectrum of a time history, and its peaks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks
from scipy.signal.windows import blackmanharris

from femflex.arrays import Array

WINDOW = "Blackman–Harris window"  # side lobes 92 dB down, so visible peaks are signal; two lines merge below 4 / T
PADDING = 4  # finer frequencies than the record's own, so that peaks are smooth
PROMINENCE = 8.0  # a peak stands out of the valley next to it by this factor
LEAST_CYCLES = 2.5  # in the record; the frequency of a slower peak is too inaccurate
ROUNDING = 1e-13  # of the largest value: a smaller deviation from a straight line is no signal
FLOOR = 1e-4  # of the highest peak; smaller ones are not reported, and may be side lobes


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Amplitudes (n_f,) over frequencies (n_f,) [Hz]: a sine of amplitude a makes a peak of height a."""

    frequency: Array
    amplitude: Array

    def peaks(self, count: int = 6) -> list[tuple[float, float]]:
        """The highest peaks, (frequency [Hz], amplitude), in order of frequency; no slow ones.

        Frequencies and heights are those of a parabola through the logarithms around the top.
        """
        if not self.amplitude.any():
            return []
        level = np.log(np.maximum(self.amplitude, 1e-300))
        tops, _ = find_peaks(level, prominence=np.log(PROMINENCE), height=level.max() + np.log(FLOOR))
        a, b, c = level[tops - 1], level[tops], level[tops + 1]
        shift = 0.5 * (a - c) / (a - 2 * b + c)
        ranked = np.argsort(b)[::-1]
        selected = np.sort(ranked[(tops + shift)[ranked] >= LEAST_CYCLES * PADDING][:count])
        step = self.frequency[1] - self.frequency[0]
        frequencies, heights = self.frequency[tops] + shift * step, np.exp(b - 0.25 * (a - c) * shift)
        return list(zip(frequencies[selected].tolist(), heights[selected].tolist(), strict=True))


def check_finite(time: Array, values: Array) -> None:
    """Raise ValueError where a record (n_t,), of any unit, that is to be transformed is not finite."""
    if not np.isfinite(values).all():
        t = time[int(np.argmin(np.isfinite(values)))]
        raise ValueError(f"a spectrum needs finite values; the first that is not is at t = {t:g} s")


def amplitude_spectrum(time: Array, values: Array) -> Spectrum:
    """Amplitude spectrum of values (n_t,) at times (n_t,) [s]: line through the record removed, windowed, corrected.

    Uneven times are interpolated to the same number of even ones. Raises ValueError below 16 instants.
    """
    if len(time) < 16:
        raise ValueError(f"a spectrum needs at least 16 instants; the record has {len(time)}")
    check_finite(time, values)
    even = np.linspace(time[0], time[-1], len(time))
    values = np.interp(even, time, values)
    n = len(even)
    window = blackmanharris(n, sym=False)
    line = np.polynomial.Polynomial.fit(
        even, values, 1, w=np.sqrt(window)
    )  # as the window sees it: no remainder at 0 Hz
    residual = values - line(even)
    values = residual if np.abs(residual).max() > ROUNDING * np.abs(values).max() else np.zeros(n)
    amplitude = 2.0 * np.abs(np.fft.rfft(values * window, PADDING * n)) / window.sum()
    frequency = np.fft.rfftfreq(PADDING * n, (even[-1] - even[0]) / (n - 1))
    return Spectrum(frequency, np.asarray(amplitude))
