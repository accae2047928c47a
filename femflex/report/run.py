"""The report of a run."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.export.moving_bodies import MovingCraft, described, moving_craft
from femflex.report.page import Page, history, lines, listed, paragraphs, table, write_page
from femflex.report.scene import Clip, ShownBody, packed
from femflex.results import Run
from femflex.view.curves import curves_of
from femflex.view.terms import VISIBLE, energy_account
from femflex.view.units import time_unit

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.linear.system_modes import SystemModes

INSTANTS = 1000  # of the scene, so that a page stays small
SHOWN_MODES = 20


def write_run_report(
    run: Run,
    path: str | Path,
    case_path: Path | None = None,
    camera: str = "auto",
    force: bool = False,
    say: Callable[[str], None] = lambda text: None,
) -> list[str]:
    """Write a run as one HTML file that needs nothing else. Returns what is worth saying, as lines.

    case_path  where the case file is now, if it has moved; meshes are searched beside it
    camera     axes of the scene, as of pictures
    say        called with the step that begins
    What cannot be shown, such as modes of a craft whose mesh is gone, is a sentence in its place. Raises MissingExtra
    without plotly, and OSError.
    """
    case, why = _case_of(run, case_path)
    page = Page(run.title or run.path.stem, _head_lines(run, case))
    say("drawing the bodies")
    craft: MovingCraft | None = None
    try:
        craft = moving_craft(run, camera, INSTANTS)
    except ValueError as error:
        page.add("Motion", paragraphs([f"No picture: {error}."]))
    if craft is not None:
        page.add_scene("Motion", _scene_of(craft), _scene_notes(craft, len(run)))
    page.add("Warnings", _warnings(run))
    if case is not None and case.expect.answers:
        page.add("Expected values", _verdicts(case, run))
    say("drawing plots")
    page.add_plots("Plots", _figures(run, case))
    try:
        page.add_plots("Energy", [_energy_figure(run)], ["Energy since the start by contributor; the sum is zero."])
    except ValueError as error:
        page.add("Energy", paragraphs([f"{error}."]))
    say("computing the modes of the craft")
    page.add("Modes", _modes(case, why))
    page.add("Bodies", _bodies(run))
    page.add("Provenance", _provenance(run))
    if run.case_text:
        page.add("Case", case_html(run.case_text))
    write_page(page, path, force)
    return [f"{Path(path).stat().st_size / 1e6:.2g} MB, needs a browser and nothing else"]


def _case_of(run: Run, case_path: Path | None) -> tuple[Case | None, str]:
    """The case of a run, or None and why."""
    from femflex.case.read import parse_case
    from femflex.noun.problems import CaseError

    if not run.case_text:
        return None, "the run was made from Python, without a case"
    path = case_path or Path(str(run.attributes.get("case_path", "case.toml")))
    if not path.parent.is_dir():
        return None, f"the folder of {path} is not here; say where the case file is now (--case)"
    try:
        return parse_case(run.case_text, path), ""
    except (CaseError, OSError, ValueError) as error:
        return None, f"the case cannot be read again: {error}"


def _head_lines(run: Run, case: Case | None) -> list[str]:
    """Description, source, and how the run ended."""
    seconds, unit = time_unit(run.duration)
    state = "complete" if run.complete else "not complete"
    end = f"{run.duration / seconds:.4g} {unit} in {len(run)} rows, {state}: {run.ended or 'still running'}"
    without = [f"without {', '.join(run.without)}"] if run.without else []
    texts = [] if case is None else [str(case.description or "").strip(), str(case.source or "").strip()]
    return [text for text in (*texts, end, *without) if text]


def _scene_of(craft: MovingCraft) -> str:
    bodies = [ShownBody(body.name, body.surface, body.surface.skin.grows) for body in craft.bodies]
    poses = {body.name: np.column_stack([body.position, body.quaternion]) for body in craft.bodies}
    weights = {body.name: body.weights for body in craft.bodies}
    return packed(bodies, [Clip("run", craft.times, poses, weights, craft.scale)], craft.up)


def _scene_notes(craft: MovingCraft, rows: int) -> list[str]:
    facts = described(craft)
    some = f"{len(craft.times)} of {rows} rows" if len(craft.times) < rows else f"all {rows} rows"
    error = craft.error_between()
    return [
        f"Drag to turn, wheel or two fingers to zoom, right or shift drag to shift. {facts['axes']} axes; {some}, "
        f"exact there, and at most {error:.2g} m off between them."
    ]


def _warnings(run: Run) -> str:
    said = [entry for key in ("advice", "watches") for entry in json.loads(str(run.attributes.get(key) or "[]"))]
    doubts = [entry for entry in said if entry["doubt"]]
    texts = [f"{entry['body'] or 'craft'}: {entry['reason']}" for entry in doubts]
    return listed(texts) if texts else paragraphs(["None."])


def _verdicts(case: Case, run: Run) -> str:
    from femflex.measures.verdicts import run_verdicts

    if run.without or run.linearised:
        return paragraphs(["Not checked: they are for the nonlinear run with all terms."])
    try:
        verdicts = run_verdicts(case, run)
    except (KeyError, ValueError) as error:
        return paragraphs([f"Not checked: {error}"])
    rows = [
        (each.name, each.measured, each.expected, each.unit, "holds" if each.holds else "does not hold")
        for each in verdicts
    ]
    return table(["value", "measured", "expected", "unit", ""], rows) if rows else paragraphs(["None about this run."])


def _figures(run: Run, case: Case | None) -> Iterator[dict[str, Any]]:
    """Histories of a selection, and of the plots that the case asks for besides."""
    drawn = set()
    named = [] if case is None or case.pictures is None else case.pictures.plots
    for channels in (None, *([channel] for channel in named)):
        for group in curves_of(run, channels):
            key = tuple((curve.channel, curve.label) for curve in group)
            if key not in drawn:
                drawn.add(key)
                yield history(group, run.duration)


def _energy_figure(run: Run) -> dict[str, Any]:
    """Contributors to the energy over time, each a line. Raises ValueError where the energy is no balance."""
    account = energy_account(run)
    seconds, unit = time_unit(run.duration)
    largest = max((float(np.abs(values).max()) for values in account.values()), default=0.0)
    curves = [
        (name, run.time / seconds, values)
        for name, values in account.items()
        if np.abs(values).max() >= VISIBLE * largest
    ]
    total = sum(account.values(), np.zeros(len(run)))
    return lines([*curves, ("sum", run.time / seconds, total)], f"time [{unit}]", "energy since the start [J]")


def _modes(case: Case | None, why: str) -> str:
    from femflex.pipeline.case_equilibrium import case_modes

    if case is None:
        return paragraphs([f"Not computed: {why}."])
    try:
        return modes_table(case_modes(case))
    except Exception as error:  # a craft without equilibrium, a mesh that is gone, ...: the report goes on
        return paragraphs([f"Not computed: {error}"])


def modes_table(modes: SystemModes, count: int = SHOWN_MODES) -> str:
    """The first modes of a craft as a table in HTML."""
    rows = [
        (
            k + 1,
            modes.label(k + 1),
            float(modes.frequencies[k]),
            float(modes.damping_ratios[k]),
            ", ".join(
                f"{name} {share[k]:.0%}"
                for name, share in sorted(modes.energy.items(), key=lambda item: -item[1][k])[:3]
                if share[k] > 0.005
            ),
        )
        for k in range(min(count, len(modes.names)))
    ]
    rest = len(modes.names) - len(rows)
    note = [f"And {rest} above.", modes.about.verdict] if rest > 0 else [modes.about.verdict]
    return table(["mode", "name", "Hz", "damping ratio", "kinetic energy"], rows) + paragraphs(note)


def _bodies(run: Run) -> str:
    bodies = run.bodies()
    rows: list[tuple[object, ...]] = []
    for name, body in bodies.items():
        omega = body.omega[np.isfinite(body.omega) & (body.omega > 0.0)]
        first = f"{omega.min() / (2 * np.pi):.5g}" if len(omega) else ""
        rows.append((name, body.mass, body.n_modes, first, ", ".join(body.markers)))
    rows.append(("sum", float(sum(body.mass for body in bodies.values())), "", "", ""))
    return table(["body", "mass, kg", "shapes", "first frequency, Hz", "markers"], rows)


def _provenance(run: Run) -> str:
    attributes = run.attributes
    rows: list[tuple[str, str]] = [("result file", run.path.name), ("case", str(attributes.get("case_path", "")))]
    rows += [("integrator", str(attributes.get("integrator", "")))]
    rows += [(name, str(value)) for name, value in run.statistics.items()]
    rows += list(run.versions.items())
    inputs = json.loads(str(attributes.get("inputs") or "{}")).get("files", {})
    rows += [(f"{key}: {entry['file']}", f"SHA-256 {entry['digest']}") for key, entry in inputs.items()]
    return table(["", ""], rows)


def case_html(text: str) -> str:
    """A case as text in HTML, whose keys show what they mean as the schema says."""
    from femflex.case.schema import json_schema

    meanings = _meanings(json_schema())
    lines_of_case = []
    heading = ""
    for line in text.splitlines():
        if match := re.match(r"\s*\[+\s*([\w.\"-]+?)\s*\]+", line):
            heading = match[1].split(".")[0].strip('"')
            shown = _explained(line, heading, meanings.get(heading, ""))
        elif match := re.match(r"\s*([\w-]+)(?:\.[\w\".-]+)?\s*=", line):
            meaning = meanings.get(f"{heading}.{match[1]}", "") or meanings.get(match[1] if not heading else "", "")
            shown = _explained(line, match[1], meaning)
        else:
            shown = escape(line)
        lines_of_case.append(shown)
    return "<pre>" + "\n".join(lines_of_case) + "</pre>" + paragraphs(["Point at an underlined key for its meaning."])


def _explained(line: str, word: str, meaning: str) -> str:
    if not meaning:
        return escape(line)
    before, _, after = line.partition(word)
    return f'{escape(before)}<abbr title="{escape(meaning)}">{escape(word)}</abbr>{escape(after)}'


def _meanings(schema: dict[str, Any]) -> dict[str, str]:
    """Descriptions of the tables of a case, and of their keys as "table.key"."""
    definitions = schema.get("$defs", {})
    out: dict[str, str] = {}

    def tables_of(entry: dict[str, Any]) -> Iterator[dict[str, Any]]:
        if "$ref" in entry:
            yield from tables_of(definitions[entry["$ref"].rsplit("/", 1)[1]])
            return
        if "properties" in entry:
            yield entry
        for branch in (*entry.get("anyOf", ()), *entry.get("oneOf", ())):
            yield from tables_of(branch)
        for inner in ("items", "additionalProperties"):
            if isinstance(entry.get(inner), dict):
                yield from tables_of(entry[inner])

    for heading, entry in schema.get("properties", {}).items():
        out[heading] = str(entry.get("description", ""))
        for each in tables_of(entry):
            out[heading] = out[heading] or str(each.get("description", ""))
            for key, value in each["properties"].items():
                out.setdefault(f"{heading}.{key}", str(value.get("description", "")))
    return out
