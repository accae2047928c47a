"""Pictures of several studies of one case side by side, and of the comparison of forms of strain."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.view.convergence import VARIED, check_kind, draw_study, finish_study_axes, plot_convergence
from femflex.view.drawing import Drawing
from femflex.view.theme import Theme, theme_of
from femflex.writing import atomic_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMN, HEIGHT = 5.2, 7.2  # inches
LETTERS = 76  # of a line of text under a column
STRAIN, FUNCTIONS = "strain", "functions"
LEAST = 1e-12  # relative difference below which it is rounding and is not drawn


def plot_studies(
    studies: Sequence[Any], path: str | Path, words: str, theme: str = "light", dpi: int = 150, force: bool = False
) -> Path:
    """Path of a picture (.png or .svg) with a column for each study: values above, errors or costs below.

    studies are of `femflex.studies` (Convergence, StrainStudy, FunctionStudy); words are set below all of them. One
    study over numbers is drawn as `plot_convergence` does.
    """
    check_kind(path)
    if len(studies) == 1 and studies[0].over not in (STRAIN, FUNCTIONS):
        return plot_convergence(studies[0], path, theme, dpi=dpi, force=force)
    colours = theme_of(theme)
    width = max(COLUMN * len(studies), 7.0)
    figure = colours.figure(width, HEIGHT, f"{studies[0].title[0].upper()}{studies[0].title[1:]}")
    axes = figure.subplots(2, len(studies), height_ratios=(2, 3), squeeze=False, sharex="col")
    for (above, below), study in zip(axes.T, studies, strict=True):
        if study.over == STRAIN:
            _draw_strain_forms(above, below, study, colours)
        elif study.over == FUNCTIONS:
            _draw_function_kinds(above, below, study, colours)
        else:
            draw_study(above, below, study, colours)
        above.set_title(f"over {VARIED.get(study.over, study.over)}", color=colours.text, fontsize=10)
        for ax in (above, below):
            finish_study_axes(ax, colours, inside=True)
        if study.over == STRAIN:
            below.tick_params(axis="x", labelsize=8)
    text = words if len(studies) > 1 else studies[0].verdict
    wrapped = "\n".join(textwrap.wrap(text, int(LETTERS * width / COLUMN)))
    figure.supxlabel(wrapped, color=colours.text, fontsize=8.5, ha="left", x=0.02, linespacing=1.4)
    with atomic_file(path, force) as draft:
        figure.savefig(draft, format=Path(path).suffix.lower().lstrip("."), dpi=dpi)
    return Drawing(path)


def _draw_strain_forms(above: Axes, below: Axes, study: Any, colours: Theme) -> None:
    """Values of the forms with their differences; under them the time of each run."""
    columns = np.arange(len(study.forms))
    values = np.array([form.value for form in study.forms])
    best = study.reference
    if best is not None:
        band = study.tolerance * abs(best.value)
        above.axhspan(best.value - band, best.value + band, color=colours.lines[2], alpha=0.25, linewidth=0)
        above.axhline(best.value, color=colours.lines[2], linewidth=1.2, label=f"{best.strain}, +- {study.tolerance:g}")
    above.plot(columns, values, "o", color=colours.lines[0], markersize=6, label="value")
    for k, form in enumerate(study.forms):
        _draw_column(above, k, form, study, colours)
    above.margins(x=0.2, y=0.3)
    above.set_ylabel(f"value [{study.unit}]" if study.unit not in ("", "1") else "value")
    below.bar(columns, [form.seconds for form in study.forms], width=0.5, color=colours.lines[0])
    for k, form in enumerate(study.forms):
        if np.isfinite(form.seconds):
            mark = below.annotate(f"{form.seconds:.3g} s", (k, form.seconds), (0, 3), textcoords="offset points")
            mark.set(ha="center", fontsize=8, color=colours.text)
    below.margins(x=0.2, y=0.15)
    below.set_ylabel("time of the run [s]")
    below.set_xticks(columns, [_label(form) for form in study.forms], fontsize=8)


def _draw_function_kinds(above: Axes, below: Axes, study: Any, colours: Theme) -> None:
    """Values of every type of functions over their number; under them the differences from the best."""
    from matplotlib.ticker import MaxNLocator

    below.set_yscale("log")
    best = study.reference
    for k, (kind, study_of_kind) in enumerate(study.with_values):
        colour = colours.lines[k % len(colours.lines)]
        above.plot(
            study_of_kind.counts, study_of_kind.values, "o-", color=colour, linewidth=1.2, markersize=4, label=kind
        )
        if best is not None:
            differences = study.differences(study_of_kind)
            visible = differences > LEAST
            below.plot(
                study_of_kind.counts[visible],
                differences[visible],
                "o-",
                color=colour,
                linewidth=1.2,
                markersize=4,
                label=kind,
            )
    below.axhline(
        study.tolerance, color=colours.text, linewidth=1.0, linestyle="--", label=f"tolerance {study.tolerance:g}"
    )
    above.set_ylabel(f"value [{study.unit}]" if study.unit not in ("", "1") else "value")
    below.set_ylabel("relative difference")
    below.set_xlabel("elastic coordinates")
    below.xaxis.set_major_locator(MaxNLocator(integer=True))


def _draw_column(ax: Axes, k: int, form: Any, study: Any, colours: Theme) -> None:
    """The difference of a form next to its value, or why it has none."""
    if not form.problem and form is study.reference:
        return
    text = textwrap.fill(form.problem, 22) if form.problem else f"{study.difference(form):.2g} off"
    height = form.value if np.isfinite(form.value) else ax.get_ylim()[0]
    mark = ax.annotate(text, (k, height), (0, 7), textcoords="offset points", ha="center", fontsize=8)
    mark.set_color(colours.text)


def _label(form: Any) -> str:
    counts = f"{form.coordinates} coordinates"
    counts += f",\n{form.derivatives} derivatives" if form.derivatives else ""
    counts += f",\n{form.followers} dependent derivatives" if form.followers else ""
    return f"{form.strain}\n{counts}"
