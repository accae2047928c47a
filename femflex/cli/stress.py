"""`femflex stress`: section forces and stresses of a run, their peaks, and along time at points."""

from __future__ import annotations

import csv
import io
import json as json_format
from math import isfinite
from pathlib import Path
from typing import Annotated, Any

import typer

from femflex.cli.progress import Patience
from femflex.cli.verb import verb

HELP_AT = "Place on the body, x,y,z in metres: values along time at the strain points nearest to it; may be repeated."


@verb("femflex stress run.h5 --body wing --at 0.3,0,0 -o stress.csv")
def stress(
    file: Annotated[Path, typer.Argument(help="Result file of a run.", show_default=False)],
    body: Annotated[list[str] | None, typer.Option("--body", help="Body; may be repeated. Left out, all.")] = None,
    at: Annotated[list[str] | None, typer.Option("--at", help=HELP_AT)] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option("--quantity", help="Quantity such as von_mises or moment_y; may be repeated. Left out, all."),
    ] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="CSV file of what is printed.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Print the largest section forces and stresses of every flexible body over a run, or write them along time."""
    from femflex.results import open_run

    places = [_place(text) for text in at or []]
    if output is not None:
        from femflex.results.place import check_place

        check_place(output, force)
    with Patience(f"recovering stress of {file.name}"), open_run(file) as run:
        bodies = run.bodies()
        names = body or [name for name, found in bodies.items() if found.strain_field]
        unknown = [name for name in names if name not in bodies or not bodies[name].strain_field]
        if unknown or not names:
            having = [name for name, found in bodies.items() if found.strain_field]
            raise ValueError(f"{file.name} has no strain of {unknown or 'any body'}; it has that of {having}")
        rows = _along_time(run, bodies, names, places, quantity) if places else _peaks(run, bodies, names, quantity)
    if json:
        print(json_format.dumps([dict(zip(rows[0], row, strict=True)) for row in rows[1:]]))
    elif not places or output is None:
        print(_table(rows))
    if output is not None:
        text = io.StringIO()
        csv.writer(text).writerows(rows)
        output.write_text(text.getvalue(), encoding="utf-8")


def _peaks(run: Any, bodies: Any, names: list[str], wanted: list[str] | None) -> list[list[Any]]:
    from femflex.body.recovery import peaks

    rows: list[list[Any]] = [["body", "members", "quantity", "largest", "unit", "time_s", "x_m", "y_m", "z_m"]]
    for name in names:
        found = peaks(bodies[name].strain_field, run[f"bodies/{name}/delta"], run.time)
        known = [peak.name for peak in found]
        if wrong := [each for each in wanted or [] if each not in known]:
            raise ValueError(f"quantity {wrong[0]!r} is not known of body {name!r}; it has {', '.join(known)}")
        for peak in found:
            if not wanted or peak.name in wanted:
                rows.append([name, peak.kind, peak.name, peak.value, peak.unit, peak.time, *peak.place])
    return rows


def _along_time(
    run: Any, bodies: Any, names: list[str], places: list[list[float]], wanted: list[str] | None
) -> list[list[Any]]:
    import numpy as np

    from femflex.body.recovery import at_points, quantities

    head: list[Any] = ["time_s"]
    columns = [run.time]
    for name in names:
        parts, y = bodies[name].strain_field, run[f"bodies/{name}/delta"]
        for each in wanted or quantities(parts):
            values, where = at_points(parts, each, places, y)
            unit = quantities(parts)[each]
            head += [f"{name} {each} [{unit}] at ({', '.join(f'{c:.4g}' for c in x)}) m" for x in where]
            columns += list(values.T)
    return [head, *np.column_stack(columns).tolist()]


def _place(text: str) -> list[float]:
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != 3 or not all(map(isfinite, found)):
        raise ValueError(f"--at is {text!r}; give three numbers in metres, such as 0.3,0,0")
    return found


def _table(rows: list[list[Any]]) -> str:
    shown = [[f"{cell:.5g}" if isinstance(cell, float) else str(cell) for cell in row] for row in rows]
    width = [max(len(row[k]) for row in shown) for k in range(len(shown[0]))]
    return "\n".join("  ".join(cell.rjust(w) for cell, w in zip(row, width, strict=True)) for row in shown)
