"""A second run drawn over a first in the same plots: dashed, named by their difference, with a mark at its end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from femflex.results import Run
from femflex.view.curves import Curve
from femflex.view.theme import Theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AWAY = 3.0  # times the range of the first run by which a second may exceed it and still be shown completely
SHOWN = 1.0  # of that range, shown beyond it if the second run exceeds that limit
INSTEAD = {"nonlinear strain": "linear strain"}  # the model that remains when a term is omitted


def title_of(run: Run) -> str:
    """Title of a run, with what was switched off in it."""
    left_out = _omitted_terms(run)
    if run.linearised:
        return f"{run.title} (linearised)"
    return f"{run.title} (without {', '.join(left_out)})" if left_out else run.title


def difference_text(run: Run, reference: Run) -> str:
    """Difference of a run from another, in words: its title, the omitted terms, or the name of its file."""
    if run.title != reference.title:
        return title_of(run)
    has_same_terms = _omitted_terms(run) == _omitted_terms(reference) and run.linearised == reference.linearised
    return run.path.name if has_same_terms else omission_text(run)


def omission_text(run: Run) -> str:
    """Omitted terms of a run in words, or the model that replaces them."""
    texts = [INSTEAD.get(name, f"without {name}") for name in _omitted_terms(run)]
    texts += ["linearised"] * run.linearised
    return ", ".join(texts) or "in full"


def dashed_style() -> dict[str, Any]:
    """Style of a second run's curves; the legend names them all together."""
    return {"linewidth": 1.0, "linestyle": (0, (4, 1.6)), "alpha": 0.85}


def name_second(ax: Axes, group: Sequence[Curve], run: Run, second_run: Run, colours: Theme) -> None:
    """Name the dashed curves of a group in the legend, where there are any."""
    if any(curve.second for curve in group):
        ax.plot([], [], color=colours.text, label=f"dashed: {difference_text(second_run, run)}", **dashed_style())


def mark_end(ax: Axes, group: Sequence[Curve], second_run: Run, unit: tuple[float, str], colours: Theme) -> None:
    """Mark the end of the curves of an unfinished run by a cross, at the border if they left the axes, and its time."""
    second = [curve for curve in group if curve.second and len(curve.time)]
    if second_run.complete or not second:
        return
    end, (low, high) = float(second[0].time[-1]) / unit[0], ax.get_ylim()
    label: str | None = f"stopped at {end:.4g} {unit[1]}"
    for height in sorted({min(max(float(curve.values[-1]), low), high) for curve in second}):
        style = {"marker": "x", "markersize": 8, "markeredgewidth": 2, "linestyle": "none", "clip_on": False}
        ax.plot([end], [height], color=colours.text, label=label, zorder=5, **style)  # type: ignore[arg-type]
        label = None
    ax.set_ylim(low, high)


def fit_limits(ax: Axes, group: Sequence[Curve]) -> None:
    """Set limits that show the first run, if a second one exceeds its range by far, as when it diverges."""
    first_values, second_values = ([c.values for c in group if c.second == which] for which in (False, True))
    if not first_values or not second_values:
        return
    low, high = min(v.min() for v in first_values), max(v.max() for v in first_values)
    span = (high - low) or 1.0
    if (
        max(v.max() for v in second_values) > high + AWAY * span
        or min(v.min() for v in second_values) < low - AWAY * span
    ):
        ax.set_ylim(low - SHOWN * span, high + SHOWN * span)


def _omitted_terms(run: Run) -> list[str]:
    return [name.replace("_", " ").removeprefix("loads/") for name in run.without]
