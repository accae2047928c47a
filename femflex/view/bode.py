"""Frequency responses as pictures: gain and phase over frequency (Bode), and gain over phase (Nichols)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.view.convergence import check_kind
from femflex.view.plot import figure_of, finish, saved
from femflex.view.theme import Theme, theme_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


DEGREES = 180.0 / np.pi
MOST = 8  # curves of one picture
SEEN = 1e-9  # of the largest on the same axes: a smaller response is not drawn


def plot_bode(
    omega: Array,
    responses: Mapping[str, ComplexArray],
    path: str | Path,
    theme: str = "light",
    title: str = "Frequency response",
    dpi: int = 150,
    force: bool = False,
) -> Path:
    """Path of a picture (.png or .svg) of gain and phase of responses (n,), by their label, over omega (n,) [rad/s].

    The phase is followed on beyond half a turn. Raises ValueError when there is nothing to draw.
    """
    check_kind(path)
    colours, shown = theme_of(theme), drawn(responses)
    figure, axes = figure_of(2, title, colours, sharex=True)
    figure.set_size_inches(9.0, 6.5)
    for k, (label, response) in enumerate(shown.items()):
        style = _style(k, label, colours)
        axes[0].loglog(omega / (2 * np.pi), np.maximum(np.abs(response), 1e-300), **style)
        axes[1].semilogx(omega / (2 * np.pi), phase(response), **style)
    axes[0].set_ylabel("gain, outputs' units per inputs' units")
    _finished(axes[0], list(shown), colours, [])
    _finished(axes[1], [], colours, list(shown.values()))
    axes[1].set_ylabel("phase [deg]")
    axes[1].set_xlabel("frequency [Hz]")
    for ax in axes:
        ax.margins(x=0)
    return saved(figure, path, dpi, force)


def plot_nichols(
    responses: Mapping[str, ComplexArray],
    path: str | Path,
    theme: str = "light",
    title: str = "Nichols chart",
    dpi: int = 150,
    force: bool = False,
) -> Path:
    """Path of a picture (.png or .svg) of gain [dB] over phase [deg] of responses (n,), by their label.

    The point -180 deg, 0 dB is ringed: a loop that passes it on the left is unstable.
    """
    check_kind(path)
    colours, shown = theme_of(theme), drawn(responses)
    figure, (ax,) = figure_of(1, title, colours, sharex=False)
    figure.set_size_inches(8.0, 6.0)
    for k, (label, response) in enumerate(shown.items()):
        ax.plot(phase(response), 20 * np.log10(np.maximum(np.abs(response), 1e-300)), **_style(k, label, colours))
    ax.plot(-180.0, 0.0, "o", markerfacecolor="none", markeredgecolor=colours.trace, markersize=9)
    ax.set_xlabel("phase [deg]")
    ax.set_ylabel("gain [dB]")
    _finished(ax, list(shown), colours, [])
    return saved(figure, path, dpi, force)


def drawn(responses: Mapping[str, ComplexArray]) -> dict[str, ComplexArray]:
    """The responses that are not zero, no more than a picture takes."""
    largest = max((float(np.abs(one).max()) for one in responses.values()), default=0.0)
    seen = {label: one for label, one in responses.items() if np.abs(one).max() > SEEN * largest}
    if not seen:
        raise ValueError("no output answers to an input, so there is no frequency response to draw; choose others")
    return dict(list(seen.items())[:MOST])


def phase(response: ComplexArray) -> Array:
    """Phase (n,) [deg], followed on, begun between -270 and 90 deg."""
    angle = np.unwrap(np.angle(response)) * DEGREES
    return angle - 360.0 * np.ceil((angle[0] - 90.0) / 360.0)


def _style(k: int, label: str, colours: Theme) -> dict[str, Any]:
    return {"color": colours.lines[k % len(colours.lines)], "linewidth": 1.3, "label": label}


def _finished(ax: Axes, labels: list[str], colours: Theme, phases: list[ComplexArray]) -> None:
    if phases:
        from matplotlib.ticker import MultipleLocator

        spread = max(float(np.ptp(phase(one))) for one in phases)
        ax.yaxis.set_major_locator(MultipleLocator(90 if spread < 1000 else 360))
    finish(ax, labels, colours)
    if labels:
        ax.legend(loc="upper left", bbox_to_anchor=(0.0, -0.12 if phases else 1.12), frameon=False, fontsize=8, ncols=2)
        for text in ax.get_legend().get_texts():  # type: ignore[union-attr]
            text.set_color(colours.text)
