"""Spectrograms: amplitudes over frequency and time along a run, as for a deploying member."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.signal.windows import blackmanharris

from femflex.arrays import Array
from femflex.extras import require
from femflex.results import Run
from femflex.view.curves import BALANCE, ROUNDED, Curve, curves_of
from femflex.view.plot import figure_of, finish, save_figure, with_superscripts
from femflex.view.second_run import title_of
from femflex.view.spectrum import check_finite
from femflex.view.theme import theme_of
from femflex.view.units import time_unit

SPAN = 0.2  # of the record: length of the window; its time is that of its middle
STEPS = 200  # positions of the window
PADDING = 8  # finer frequencies than the window's own
DEPTH = 0.02  # of the largest amplitude: the last colour


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
    amplitude = 2.0 * np.abs(np.fft.rfft(pieces * window, PADDING * size, axis=1)).T / window.sum()
    return even[starts] + step * (size - 1) / 2, np.fft.rfftfreq(PADDING * size, step), np.asarray(amplitude)


def plot_spectrograms(
    run: Run,
    path: str | Path,
    channels: Sequence[str] | None = None,
    degrees: bool = True,
    theme: str = "light",
    title: str | None = None,
    dpi: int = 150,
    highest: float | None = None,
    force: bool = False,
) -> Path:
    """Path of a picture (.png or .svg) of spectrograms of channels, one pair of axes for every component.

    highest is the last frequency shown [Hz]; by default a little above what reaches a tenth of the largest amplitude.
    Components below 1/1000 of the largest of their channel are left out.
    """
    require("view", "plots")
    from matplotlib.colors import LogNorm

    if highest is not None and not highest > 0:
        raise ValueError(f"the last frequency shown is {highest:g} Hz; give one above 0")
    colours, groups = theme_of(theme), curves_of(run, channels, degrees)
    curves: list[Curve] = [curve for group in groups for curve in group if curve.quantity != BALANCE or channels]
    curves = [curve for curve in curves if np.ptp(curve.values) > ROUNDED * np.abs(curve.values).max(initial=0.0)]
    if not curves:
        raise ValueError("nothing changes in these channels, so there is no spectrogram; name one that moves")
    seconds, unit = time_unit(run.duration)
    figure, axes = figure_of(len(curves), title_of(run) if title is None else title, colours, sharex=True)
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
            np.maximum(amplitude[is_shown], DEPTH * top),
            norm=LogNorm(DEPTH * top, top),
            cmap=colours.colour_map(),
            shading="nearest",
            rasterized=True,
        )
        bar = figure.colorbar(painted, ax=ax, pad=0.01)
        label = "amplitude" if curve.unit in ("1", "") else f"amplitude [{with_superscripts(curve.unit)}]"
        bar.set_label(label, color=colours.text)
        bar.ax.tick_params(colors=colours.text, labelsize=9)
        ax.set_ylabel(f"{curve.label}\nfrequency [{hertz}]")
        finish(ax, [], colours)
        ax.grid(False)
    axes[-1].set_xlabel(f"time [{unit}], middle of a window of {SPAN:g} of the run")
    return save_figure(figure, path, dpi, force)
