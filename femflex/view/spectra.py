"""Amplitude spectra with their peaks, spectrograms along a run, and frequency responses of linear models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from scipy.signal import find_peaks
from scipy.signal.windows import blackmanharris

from femflex.arrays import Array, ComplexArray
from femflex.results import Run
from femflex.view.curves import BALANCE, ROUNDED, Curve, curves_of
from femflex.view.plot import PlotOptions, Sheet, finish, labelled, name_points, name_second, ordinate, styled, title_of
from femflex.view.theme import Theme
from femflex.view.units import time_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    pass

WINDOW = "Blackman–Harris window"  # side lobes 92 dB down, so visible peaks are signal; two lines merge below 4 / T
PADDING = 4  # finer frequencies than the record's own, so that peaks are smooth
PROMINENCE = 8.0  # a peak stands out of the valley next to it by this factor
LEAST_CYCLES = 2.5  # in the record; the frequency of a slower peak is too inaccurate
ROUNDING = 1e-13  # of the largest value: a smaller deviation from a straight line is no signal
FLOOR = 1e-4  # of the highest peak; smaller ones are not reported, and may be side lobes
DEPTH = 3e-5  # a spectrum is shown down to this part of its highest peak
SMALLEST = 5e-3  # of the highest peak; smaller ones have no label
SPAN = 0.2  # of the record: length of the window; its time is that of its middle
STEPS = 200  # positions of the window
FINER = 8  # finer frequencies than the window's own
FAINTEST = 0.02  # of the largest amplitude: the last colour


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


def plot_spectra(
    run: Run,
    path: str | Path,
    channels: Sequence[str] | None = None,
    degrees: bool = True,
    highest: float | None = None,
    second_run: Run | None = None,
    **options: Unpack[PlotOptions],
) -> Path:
    """Path of a picture (.png or .svg) of amplitude spectra of channels, with their peaks named.

    A sine of amplitude a makes a peak of height a. highest is the last frequency shown [Hz]; by default every pair of
    axes goes a little beyond its last peak. second_run: a second run, drawn over the first in thin dashed lines.
    """
    if highest is not None and not highest > 0:
        raise ValueError(f"the last frequency shown is {highest:g} Hz; give one above 0")
    groups = curves_of(run, channels, degrees, second_run, least=ROUNDED)
    if channels is None:
        groups = [group for group in groups if group[0].quantity != BALANCE] or groups
    sheet = Sheet(path, title_of(run, second_run), **options)
    axes, colours = sheet.rows(len(groups), sharex=False), sheet.colours
    for ax, group in zip(axes, groups, strict=True):
        spectra = [amplitude_spectrum(curve.time, curve.values) for curve in group]
        peaks = [peak for spectrum in spectra for peak in spectrum.peaks() if highest is None or peak[0] <= highest]
        nyquist = float(spectra[0].frequency[-1])
        last_frequency = highest or min(nyquist, 1.3 * max((frequency for frequency, _ in peaks), default=nyquist))
        factor, unit = (1e3, "mHz") if last_frequency < 0.5 else (1.0, "Hz")
        top = max(float(spectrum.amplitude.max()) for spectrum in spectra)
        drawn_curves = []
        for (curve, style), spectrum in zip(styled(group, colours), spectra, strict=True):
            if (
                spectrum.amplitude[spectrum.frequency <= last_frequency].max(initial=0.0) < DEPTH * top
                and len(group) > 1
            ):
                continue  # below the axes, as a motion that is not excited
            ax.semilogy(spectrum.frequency * factor, np.maximum(spectrum.amplitude, 1e-300), **style)
            drawn_curves.append(curve)
        if second_run is not None:
            name_second(ax, drawn_curves, run, second_run, colours)
        ax.set_ylim(DEPTH * (top or 1.0), 10 * (top or 1.0))
        ax.set_xlim(0, last_frequency * factor)
        least = SMALLEST * max((amplitude for _, amplitude in peaks), default=0.0)
        ranked = sorted((peak for peak in peaks if peak[1] > least), key=lambda peak: -peak[1])
        name_points(ax, [(f"{f * factor:#.4g}", f * factor, a, colours.text) for f, a in ranked], colours)
        ax.set_ylabel("amplitude of\n" + ordinate(group))
        ax.set_xlabel(f"frequency [{unit}]")
        finish(ax, drawn_curves, colours)
    axes[-1].set_xlabel(f"{axes[-1].get_xlabel()}   ({WINDOW}, trend removed)")
    return sheet.save()


def spectrogram(time: Array, values: Array) -> tuple[Array, Array, Array]:
    """Times (n,) [s], frequencies (m,) [Hz] and amplitudes (m, n) of values (n_t,) at times (n_t,) [s].

    A sine of amplitude a has the amplitude a. A Blackman-Harris window of a fifth of the record, without its linear
    trend, moves along it; two spectral lines merge below 4 over its length. Uneven times are interpolated to even
    ones. Raises ValueError below 80 instants.
    """
    if len(time) < 80:
        raise ValueError(f"a spectrogram needs at least 80 instants; the record has {len(time)}")
    check_finite(time, values)
    even = np.linspace(time[0], time[-1], len(time))
    values, size = np.interp(even, time, values), int(SPAN * len(even))
    starts = np.unique(np.linspace(0, len(even) - size, STEPS).round().astype(int))
    pieces = np.lib.stride_tricks.sliding_window_view(values, size)[starts]
    window, x = blackmanharris(size, sym=False), np.linspace(-1.0, 1.0, size)
    line = np.polynomial.polynomial.polyfit(x, pieces.T, 1, w=np.sqrt(window))
    pieces = pieces - np.polynomial.polynomial.polyval(x, line)
    step = (even[-1] - even[0]) / (len(even) - 1)
    amplitude = 2.0 * np.abs(np.fft.rfft(pieces * window, FINER * size, axis=1)).T / window.sum()
    return even[starts] + step * (size - 1) / 2, np.fft.rfftfreq(FINER * size, step), np.asarray(amplitude)


def plot_spectrograms(
    run: Run,
    path: str | Path,
    channels: Sequence[str] | None = None,
    degrees: bool = True,
    highest: float | None = None,
    **options: Unpack[PlotOptions],
) -> Path:
    """Path of a picture (.png or .svg) of spectrograms of channels, one pair of axes for every component.

    highest is the last frequency shown [Hz]; by default a little above what reaches a tenth of the largest amplitude.
    Components below 1/1000 of the largest of their channel are left out.
    """
    from matplotlib.colors import LogNorm

    if highest is not None and not highest > 0:
        raise ValueError(f"the last frequency shown is {highest:g} Hz; give one above 0")
    groups = curves_of(run, channels, degrees)
    curves: list[Curve] = [curve for group in groups for curve in group if curve.quantity != BALANCE or channels]
    curves = [curve for curve in curves if np.ptp(curve.values) > ROUNDED * np.abs(curve.values).max(initial=0.0)]
    if not curves:
        raise ValueError("nothing changes in these channels, so there is no spectrogram; name one that moves")
    seconds, unit = time_unit(run.duration)
    sheet = Sheet(path, title_of(run), **options)
    axes, colours = sheet.rows(len(curves)), sheet.colours
    for ax, curve in zip(axes, curves, strict=True):
        time, frequency, amplitude = spectrogram(curve.time, curve.values)
        top = float(amplitude.max()) or 1.0
        strong = np.flatnonzero((amplitude > 0.1 * top).any(axis=1))
        last_frequency = highest or 1.6 * float(frequency[strong[-1]] if len(strong) else frequency[-1])
        factor, hertz = (1e3, "mHz") if last_frequency < 0.5 else (1.0, "Hz")
        is_shown = frequency <= last_frequency
        painted = ax.pcolormesh(
            time / seconds,
            frequency[is_shown] * factor,
            np.maximum(amplitude[is_shown], FAINTEST * top),
            norm=LogNorm(FAINTEST * top, top),
            cmap=colours.colour_map(),
            shading="nearest",
            rasterized=True,
        )
        bar = ax.figure.colorbar(painted, ax=ax, pad=0.01)
        bar.set_label(labelled("amplitude", curve.unit), color=colours.text)
        bar.ax.tick_params(colors=colours.text, labelsize=9)
        ax.set_ylabel(f"{curve.label}\nfrequency [{hertz}]")
        finish(ax, [], colours)
        ax.grid(False)
    axes[-1].set_xlabel(f"time [{unit}], middle of a window of {SPAN:g} of the run")
    return sheet.save()


DEGREES = 180.0 / np.pi
MOST = 8  # curves of one picture
VISIBLE = 1e-9  # of the largest on the same axes: a smaller response is not drawn


def plot_bode(
    omega: Array, responses: Mapping[str, ComplexArray], path: str | Path, **options: Unpack[PlotOptions]
) -> Path:
    """Path of a picture (.png or .svg) of gain and phase of responses (n,), by their label, over omega (n,) [rad/s].

    The phase is continued beyond half a turn. Raises ValueError when there is nothing to draw.
    """
    curves, sheet = nonzero_responses(responses), Sheet(path, "Frequency response", **options)
    axes, colours = sheet.rows(2, size=(9.0, 6.5)), sheet.colours
    for k, (label, response) in enumerate(curves.items()):
        style = _style(k, label, colours)
        axes[0].loglog(omega / (2 * np.pi), np.maximum(np.abs(response), 1e-300), **style)
        axes[1].semilogx(omega / (2 * np.pi), phase(response), **style)
    axes[0].set(ylabel="gain, outputs' units per inputs' units", xmargin=0)
    axes[1].set(ylabel="phase [deg]", xlabel="frequency [Hz]", xmargin=0)
    _finish_axes(axes[0], list(curves), colours, [])
    _finish_axes(axes[1], [], colours, list(curves.values()))
    return sheet.save()


def plot_nichols(responses: Mapping[str, ComplexArray], path: str | Path, **options: Unpack[PlotOptions]) -> Path:
    """Path of a picture (.png or .svg) of gain [dB] over phase [deg] of responses (n,), by their label.

    The point -180 deg, 0 dB is ringed: a loop that passes it on the left is unstable.
    """
    curves, sheet = nonzero_responses(responses), Sheet(path, "Nichols chart", **options)
    (ax,), colours = sheet.rows(1, size=(8.0, 6.0)), sheet.colours
    for k, (label, response) in enumerate(curves.items()):
        ax.plot(phase(response), 20 * np.log10(np.maximum(np.abs(response), 1e-300)), **_style(k, label, colours))
    ax.plot(-180.0, 0.0, "o", markerfacecolor="none", markeredgecolor=colours.trace, markersize=9)
    ax.set(xlabel="phase [deg]", ylabel="gain [dB]")
    _finish_axes(ax, list(curves), colours, [])
    return sheet.save()


def nonzero_responses(responses: Mapping[str, ComplexArray]) -> dict[str, ComplexArray]:
    """The responses (n,) that are not zero, at most as many as fit in a picture."""
    largest = max((float(np.abs(response).max()) for response in responses.values()), default=0.0)
    visible = {label: response for label, response in responses.items() if np.abs(response).max() > VISIBLE * largest}
    if not visible:
        raise ValueError("no output answers to an input, so there is no frequency response to draw; choose others")
    return dict(list(visible.items())[:MOST])


def phase(response: ComplexArray) -> Array:
    """Continuous phase (n,) [deg], which starts between -270 and 90 deg."""
    angle = np.unwrap(np.angle(response)) * DEGREES
    return angle - 360.0 * np.ceil((angle[0] - 90.0) / 360.0)


def _style(k: int, label: str, colours: Theme) -> dict[str, Any]:
    return {"color": colours.lines[k % len(colours.lines)], "linewidth": 1.3, "label": label}


def _finish_axes(ax: Axes, labels: list[str], colours: Theme, phases: list[ComplexArray]) -> None:
    if phases:
        from matplotlib.ticker import MultipleLocator

        range_of_phase = max(float(np.ptp(phase(response))) for response in phases)
        ax.yaxis.set_major_locator(MultipleLocator(90 if range_of_phase < 1000 else 360))
    finish(ax, labels, colours)
    if labels:
        place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (0.0, -0.12 if phases else 1.12)}
        ax.legend(frameon=False, fontsize=8, ncols=2, labelcolor=colours.text, **place)
