"""The reports of studies: plots that one can zoom, tables, and verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.report.page import Page, layout, lines, paragraphs, plain, table, write_page
from femflex.report.run import modes_table
from femflex.report.scene import Clip, ShownBody, packed
from femflex.view.stability import REGIONS
from femflex.view.surface import surface_of
from femflex.view.theme import THEMES

if TYPE_CHECKING:
    from femflex.linear.system_modes import SystemModes
    from femflex.studies import Finding
    from femflex.studies.campbell import Campbell
    from femflex.studies.stability import Chart
    from femflex.studies.stability.of_case import CaseStability
    from femflex.studies.sweep.sweep import Sweep

COLOURS = {-1: "#c9d0d8", 0: "#f0b9b2", 1: "#f4d9a8", 2: "#b5dcc3"}  # of the regions of a chart, by their kinds
MOST_OUTPUTS = 6  # of a sweep that are plotted over its inputs


def write_convergence_report(findings: Sequence[Finding], verdict: str, path: str | Path, force: bool = False) -> None:
    """Write studies of `femflex converge`: for each its table, errors over coordinates, and verdict."""
    from femflex.studies import Convergence

    page = Page(f"Convergence of {findings[0].title}", [verdict] if len(findings) > 1 else [])
    for finding in findings:
        unit = "" if finding.unit in ("", "1") else f", {finding.unit}"
        heading = f"Over {finding.over}"
        heads = [finding.over, "level", "coordinates", f"value{unit}", "difference"]
        if isinstance(finding, Convergence):
            errors = finding.errors > 0.0
            curves = [("estimated error", finding.counts[errors].astype(float), finding.errors[errors])]
            heads = [finding.over, "coordinates", f"value{unit}", "change", "error"]
            columns = finding.levels, finding.counts, finding.values, finding.changes, finding.errors
            rows = list(zip(*columns, strict=True))
        else:
            curves, rows = [], []
            for option in finding.with_values:
                off = finding.differences(option)
                curves.append((option.name, option.counts[off > 0].astype(float), off[off > 0]))
                levels = [point.level for point in option.points]
                rows += zip([option.name] * len(off), levels, option.counts, option.values, off, strict=True)
        if any(len(curve[1]) > 1 for curve in curves):
            figure = lines(curves, "elastic coordinates", heads[-1], marks=True, type="log")
            figure["layout"]["xaxis"]["type"] = "log"
            page.add_plots(heading, [figure])
        page.add(heading, table(heads, rows))
        page.add("Verdict", paragraphs([finding.verdict]))
    write_page(page, path, force)


def write_campbell_report(diagram: Campbell, path: str | Path, scale: float, unit: str, force: bool = False) -> None:
    """Write a Campbell diagram: frequencies and damping of its branches over the speed, multiples, and crossings.

    scale, unit: of the speeds or values
    """
    x = diagram.speeds / scale
    over = f"{diagram.value or 'speed'}{f' [{unit}]' if unit else ''}"
    page = Page(diagram.title or "Campbell diagram")
    branches = [(branch.name, x, branch.frequencies) for branch in diagram.branches]
    figure = lines(branches, over, "frequency [Hz]", rangemode="tozero")
    for order in diagram.orders:
        end = order * float(np.abs(diagram.speeds[-1])) / (2.0 * np.pi)
        style = {"dash": "dot", "width": 1, "color": THEMES["light"].faint}
        line = {"x": [0.0, float(x[-1])], "y": [0.0, end], "mode": "lines", "line": style, "name": f"{order} x speed"}
        figure["data"].append({"type": "scatter", **line})
    damping = lines([(b.name, x, b.damping_ratios) for b in diagram.branches], over, "damping ratio")
    page.add_plots("Branches", [figure, damping])
    crossings = [(each.branch, each.order, each.speed / scale, each.frequency) for each in diagram.crossings]
    if crossings:
        page.add("Crossings", table(["branch", "multiple", over, "Hz"], crossings))
    growing = [branch.name for branch in diagram.branches if branch.growing.any()]
    said = f"Growing: {', '.join(growing)}." if growing else "No motion grows at any of these points."
    page.add("Stability", paragraphs([said]))
    write_page(page, path, force)


def write_stability_report(result: CaseStability, title: str, path: str | Path, force: bool = False) -> None:
    """Write a locus over one value, or a chart over two."""
    from femflex.studies.stability import KINDS
    from femflex.studies.stability.locus import Locus

    page = Page(title)
    for each, heading in ((result.result, "Stability"), (result.second, f"Without {', '.join(result.left_out)}")):
        if isinstance(each, Locus):
            over = f"{each.name}{f' [{each.unit}]' if each.unit else ''}"
            growth = lines([("growth", each.values, each.growth)], over, "growth of the fastest motion [1/s]")
            real = [(f"{k + 1}", each.values, branch.real) for k, branch in enumerate(each.branches.T)]
            page.add_plots(heading, [growth, lines(real, over, f"{each.quantity}, real part")])
            rows = [
                (float(v), float(g), KINDS[int(k)])
                for v, g, k in zip(each.values, each.growth, each.kinds, strict=True)
            ]
            page.add(f"{heading}: points", table([over, "growth, 1/s", ""], rows))
            critical = ", ".join(f"{value:.6g}" for value in each.critical) or "none"
            page.add(f"{heading}: changes", paragraphs([f"Stability changes at {critical}."]))
        elif each is not None:
            page.add_plots(heading, [_chart(each)])
    write_page(page, path, force)


def _chart(chart: Chart) -> dict[str, Any]:
    """Regions over two values, and their traced boundaries."""
    names = [f"{name}{f' [{unit}]' if unit else ''}" for name, unit in zip(chart.names, chart.units, strict=True)]
    steps = np.repeat(np.linspace(0.0, 1.0, len(COLOURS) + 1), 2)[1:-1]
    shades = [colour for colour in COLOURS.values() for _ in range(2)]
    heat = {
        "type": "heatmap",
        "x": plain(chart.first_values),
        "y": plain(chart.second_values),
        "z": chart.kinds.T.tolist(),
        "text": [[REGIONS[int(kind)] for kind in row] for row in chart.kinds.T],
        "hovertemplate": "%{x}, %{y}: %{text}<extra></extra>",
        "showscale": False,
        "zmin": min(COLOURS) - 0.5,
        "zmax": max(COLOURS) + 0.5,
        "colorscale": list(zip(steps.tolist(), shades, strict=True)),
    }
    edges = [
        {"x": plain(points[:, 0]), "y": plain(points[:, 1]), "mode": "lines", "line": {"color": "#1d2733", "width": 2}}
        for _, _, points in chart.boundaries
    ]
    keys = [
        {
            "x": [None],
            "y": [None],
            "mode": "markers",
            "marker": {"symbol": "square", "size": 13, "color": COLOURS[kind]},
        }
        | {"name": REGIONS[kind]}
        for kind in COLOURS
        if (chart.kinds == kind).any()
    ]
    traces: list[dict[str, Any]] = [*edges, *keys]
    scatter = [{"type": "scatter", "showlegend": "name" in each} | each for each in traces]
    settings = layout(names[0], names[1], True) | {"hovermode": "closest"}
    return {"data": [heat, *scatter], "layout": settings}


def write_sweep_report(results: Sweep, title: str, path: str | Path, force: bool = False) -> None:
    """Write a sweep: outputs over inputs, percentiles of histories and outputs, and the runs that failed."""
    page = Page(title, [f"{len(results.problems)} runs, of which {sum(map(bool, results.problems))} failed"])

    def head(name: str) -> str:
        unit = results.units.get(name, "")
        return name if unit in ("", "1") else f"{name} [{unit}]"

    figures = []
    for name in list(results.outputs)[:MOST_OUTPUTS]:
        for key, values in results.inputs.items():
            figure = lines([(name, values, results.outputs[name])], head(key), head(name), marks=True)
            figure["data"][0]["mode"] = "markers"
            figure["layout"]["hovermode"] = "closest"
            figures.append(figure)
    if figures:
        page.add_plots("Outputs over inputs", figures)
    bands = results.history_percentiles()
    histories = [
        lines(
            [(f"{p:g} %", results.time, row) for p, row in zip(results.percentiles, rows, strict=True)],
            "time [s]",
            head(name),
        )
        for name, rows in bands.items()
        if np.ndim(rows) == 2
    ]
    if histories:
        page.add_plots("Percentiles of histories", histories)
    rows = [
        (name, *(float(v) for v in results.statistics().get(name, ())[:2]), *(float(v) for v in row))
        for name, row in results.output_percentiles().items()
    ]
    page.add("Outputs", table(["output", "mean", "sigma", *(f"{p:g} %" for p in results.percentiles)], rows))
    failed = [(k, text) for k, text in enumerate(results.problems) if text]
    if failed:
        page.add("Failed runs", table(["run", "problem"], failed))
    write_page(page, path, force)


MOST = 30  # shapes, so that a page stays small
PHASES = 25  # instants of a period
SWING = 0.08  # of the craft's size: the largest displacement at a magnification of 1


def write_modes_report(modes: SystemModes, title: str, path: str | Path, force: bool = False) -> None:
    """Write the modes of a craft as one HTML file. Parts may move out of phase, as damping and spin make them.

    Raises ValueError where no body can be drawn, and OSError.
    """
    numbers = [k + 1 for k, rigid in enumerate(modes.known) if not rigid][:MOST]
    if not numbers:
        raise ValueError("the craft has only rigid-body modes, which are not drawn")
    skin = modes.skin(numbers)
    size = float(np.linalg.norm(np.ptp(skin.points, axis=0))) or 1.0
    phase = np.linspace(0.0, 2.0 * np.pi, PHASES)
    n, clips = len(numbers), []
    for i, number in enumerate(numbers):
        weights = np.zeros((PHASES, 2 * n))
        reach = float(np.hypot(skin.max_displacement[i], skin.max_displacement[n + i])) or 1.0
        weights[:, i], weights[:, n + i] = np.cos(phase), -np.sin(phase)
        poses = np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (PHASES, 1))
        name = f"{number} {modes.label(number)}, {modes.frequencies[number - 1]:.4g} Hz"
        amplitude = SWING * size / reach
        clips.append(Clip(name, phase, {"craft": poses}, {"craft": amplitude * weights}, 1.0, repeats=True))
    in_orbit = modes.about.model.system.orbit is not None
    page = Page(title, [modes.about.verdict])
    page.add_scene("Shapes", packed([ShownBody("craft", surface_of(skin))], clips, 1 if in_orbit else 2))
    page.add("Modes", modes_table(modes, len(modes.names)))
    write_page(page, path, force)
