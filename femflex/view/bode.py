"""Frequency responses as pictures: gain and phase over frequency (Bode), and gain over phase (Nichols)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.view.plot import PlotOptions, Sheet, finish
from femflex.view.theme import Theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
