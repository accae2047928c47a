"""A second run laid over a first in the same plots: dashed, named by what tells it apart, a mark where it stopped."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from femflex.results import Run
from femflex.view.curves import Curve
from femflex.view.theme import Theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AWAY = 3.0  # times the range of the first run that a second may go beyond it and still be shown whole
SHOWN = 1.0  # of that range, shown beyond it where the second goes further
INSTEAD = {"nonlinear strain": "linear strain"}  # what is left where something is switched off


def title_of(run: Run) -> str:
    """Title of a run, with what was switched off in it."""
    left_out = _left_out(run)
    if run.linearised:
        return f"{run.title} (linearised)"
    return f"{run.title} (without {', '.join(left_out)})" if left_out else run.title


def difference_text(run: Run, other: Run) -> str:
    """What a run is compared with another, in words: its title, what it leaves out, or the name of its file."""
    if run.title != other.title:
        return title_of(run)
    same = _left_out(run) == _left_out(other) and run.linearised == other.linearised
    return run.path.name if same else omission_text(run)


def omission_text(run: Run) -> str:
    """What a run leaves out, in words, or what is left instead."""
    said = [INSTEAD.get(name, f"without {name}") for name in _left_out(run)]
    said += ["linearised"] * run.linearised
    return ", ".join(said) or "in full"


def dashed_style() -> dict[str, Any]:
    """Style of a second run's curves; the legend names them all together."""
    return {"linewidth": 1.0, "linestyle": (0, (4, 1.6)), "alpha": 0.85}


def name_second(ax: Axes, group: Sequence[Curve], run: Run, other: Run, colours: Theme) -> None:
    """Name the dashed curves of a group in the legend, where there are any."""
    if any(curve.second for curve in group):
        ax.plot([], [], color=colours.text, label=f"dashed: {difference_text(other, run)}", **dashed_style())


def mark_end(ax: Axes, group: Sequence[Curve], other: Run, unit: tuple[float, str], colours: Theme) -> None:
    """A cross where the curves of an unfinished run end, at the rim where they have left the axes, and its time."""
    second = [curve for curve in group if curve.second and len(curve.time)]
    if other.complete or not second:
        return
    end, (low, high) = float(second[0].time[-1]) / unit[0], ax.get_ylim()
    label: str | None = f"stopped at {end:.4g} {unit[1]}"
    for place in sorted({min(max(float(curve.values[-1]), low), high) for curve in second}):
        style = {"marker": "x", "markersize": 8, "markeredgewidth": 2, "linestyle": "none", "clip_on": False}
        ax.plot([end], [place], color=colours.text, label=label, zorder=5, **style)  # type: ignore[arg-type]
        label = None
    ax.set_ylim(low, high)


def fit_limits(ax: Axes, group: Sequence[Curve]) -> None:
    """Limits that show the first run where a second leaves it far behind, as one does that runs away."""
    first, second = ([c.values for c in group if c.second == which] for which in (False, True))
    if not first or not second:
        return
    low, high = min(v.min() for v in first), max(v.max() for v in first)
    span = (high - low) or 1.0
    if max(v.max() for v in second) > high + AWAY * span or min(v.min() for v in second) < low - AWAY * span:
        ax.set_ylim(low - SHOWN * span, high + SHOWN * span)


def _left_out(run: Run) -> list[str]:
    return [name.replace("_", " ").removeprefix("loads/") for name in run.without]
