"""Frequencies in a sampled signal: by crossings of its mean, or by a least-squares fit of sinusoids."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array


def crossing_frequency(time: Array, signal: Array) -> float:
    """Frequency [Hz] of a signal (n_t,) from the upward crossings of its mean, each placed by a cubic through four
    samples.

    For one dominant oscillation of any shape. Raises ValueError when there are fewer than two crossings.
    """
    x = signal - signal.mean()
    up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    if len(up) < 2:
        raise ValueError(
            f"the signal crosses its mean upwards {len(up)} times; a frequency needs at least two crossings, so a "
            f"longer run"
        )
    instants = np.array([_crossing(time, x, k) for k in (up[0], up[-1])])
    return float((len(up) - 1) / (instants[1] - instants[0]))


def _crossing(time: Array, x: Array, k: int) -> float:
    """The zero of the cubic through the samples around k, between samples k and k + 1."""
    start = min(max(k - 1, 0), len(x) - 4)
    window = slice(start, start + 4)
    t = time[window] - time[k]
    c = np.polynomial.polynomial.polyfit(t, x[window], 3)
    roots = np.polynomial.polynomial.polyroots(c)
    real = roots[np.abs(roots.imag) < 1e-9 * (1 + np.abs(roots.real))].real
    inside = real[(real >= -1e-12) & (real <= (time[k + 1] - time[k]) * (1 + 1e-12))]
    linear = -x[k] * (time[k + 1] - time[k]) / (x[k + 1] - x[k])
    return float(time[k] + (inside[np.argmin(np.abs(inside - linear))] if len(inside) else linear))


def fitted_frequencies(time: Array, signal: Array, tones: int) -> Array:
    """Frequencies (n,) [Hz], ascending, of the best fit of the signal by this many sinusoids and a constant.

    Each sinusoid starts at the highest peak in the spectrum of the residual of the earlier ones; then all are fitted
    together by variable projection (amplitudes solved for linearly). Exact for such a signal; needs a few periods and
    no aliasing.
    """
    from scipy.optimize import least_squares

    time = time - time.mean()
    omegas, scale = np.zeros(0), 2 * np.pi / float(np.ptp(time))
    for _ in range(tones):
        omegas = np.append(omegas, _peak(time, _residual(omegas, time, signal)))
        fit = least_squares(
            _scaled_residual,
            omegas / scale,
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=200,
            args=(scale, time, signal),
        )
        omegas = fit.x * scale
    return np.asarray(np.sort(np.abs(omegas)) / (2 * np.pi))


def _residual(omega: Array, time: Array, signal: Array) -> Array:
    """Residual of the best fit by sinusoids of these frequencies and a constant, relative to the signal's range."""
    A = np.concatenate([np.ones((len(time), 1)), np.cos(np.outer(time, omega)), np.sin(np.outer(time, omega))], axis=1)
    size = np.ptp(signal)
    return np.asarray((signal - A @ np.linalg.lstsq(A, signal, rcond=None)[0]) / (size if size > 0 else 1.0))


def _scaled_residual(periods: Array, scale: float, time: Array, signal: Array) -> Array:
    """The residual over frequencies in periods per record, which makes them of order one."""
    return _residual(periods * scale, time, signal)


def _peak(time: Array, signal: Array) -> float:
    """Angular frequency of the highest peak of a padded, windowed spectrum of evenly spaced samples."""
    n = 8 * len(time)
    spectrum = np.abs(np.fft.rfft(signal * np.hanning(len(time)), n))
    spectrum[0] = 0.0
    return float(2 * np.pi * np.argmax(spectrum) / (n * (time[-1] - time[0]) / (len(time) - 1)))
