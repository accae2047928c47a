"""`femflex stress`: section forces and stresses of a run, their peaks as table and map, and along time at points."""

from __future__ import annotations

import csv
import io
import json as json_format
import sys
from collections.abc import Iterable, Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.outputs import PICTURE, TABLE, outputs
from femflex.cli.progress import Patience
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.body.recovery import Peak
    from femflex.body.strain_field import StrainPart

ROUNDED = 1e-12  # of the largest of the same unit in members of the kind: zero to rounding
MOMENTS = {"N": "N m", "N/m": "N"}  # units of moments by those of the forces that make them
Fields = dict[str, "tuple[StrainPart, ...]"]  # of bodies, the parts of the groups that are asked for
NOWHERE = [None] * 4  # time and place of what is zero
HELP_AT = (
    "Place on the body, x,y,z in metres, or one of its markers: values along time at the strain points nearest to it; "
    "may be repeated."
)


@verb("femflex stress run.h5 --body wing --at 0.3,0,0 -o stress.csv")
def stress(
    file: Annotated[Path, typer.Argument(help="Result file of a run.", show_default=False)],
    body: Annotated[list[str] | None, typer.Option("--body", help="Body; may be repeated. Default: all.")] = None,
    at: Annotated[list[str] | None, typer.Option("--at", help=HELP_AT)] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option("--quantity", help="Quantity such as von_mises or moment_y; may be repeated. Default: all."),
    ] = None,
    group: Annotated[
        list[str] | None, typer.Option("--group", help="Group of members; may be repeated. Default: all.")
    ] = None,
    points: Annotated[
        bool, typer.Option("--points", help="List every strain point with its largest values, in place of the peaks.")
    ] = False,
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", help="CSV file of what is printed; PNG picture of one quantity's peaks."),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Print the largest section forces and stresses of every flexible body over a run, or write them along time."""
    from femflex.results import open_run
    from femflex.writing import check_destination, placed

    if at and points:
        raise ValueError("--at and --points are two tables; give one of them")
    files = outputs(output or (), {TABLE: (".csv",), PICTURE: (".png",)})
    for path in files.values():
        check_destination(path, force)
    with Patience(f"recovering stress of {file.name}"), open_run(file) as run:
        bodies = run.bodies()
        names = body or [name for name, found in bodies.items() if found.strain_field]
        unknown = [name for name in names if name not in bodies or not bodies[name].strain_field]
        if unknown or not names:
            having = [name for name, found in bodies.items() if found.strain_field]
            raise ValueError(f"{file.name} has no strain of {unknown or 'any body'}; it has that of {having}")
        fields = _fields(bodies, names, group)
        wanted = _wanted(fields, quantity)
        if at:
            rows = _along_time(run, fields, _places(at, bodies, list(fields)), wanted)
        else:
            rows = (_of_points if points else _peaks)(run, bodies, fields, wanted)
        if PICTURE in files:
            _draw(run, fields, files[PICTURE], quantity, force)
    if json:
        print(json_format.dumps([dict(zip(rows[0], row, strict=True)) for row in rows[1:]]))
    elif not (at or points) or TABLE not in files:
        print(_table(rows))
    if TABLE in files:
        text = io.StringIO()
        csv.writer(text).writerows(rows)
        with placed(files[TABLE], force) as part:
            part.write_text(text.getvalue(), encoding="utf-8")


def _fields(bodies: Any, names: list[str], groups: list[str] | None) -> Fields:
    """The parts of the members of these groups, or of all, of every body that has some; ValueError for one unknown."""
    known = sorted({label(part) for name in names for part in bodies[name].strain_field})
    if wrong := [each for each in groups or [] if each not in known]:
        raise ValueError(f"no body of {names} has members of the group {wrong[0]!r}; known are {', '.join(known)}")
    chosen = set(groups or known)
    fields = {name: tuple(part for part in bodies[name].strain_field if label(part) in chosen) for name in names}
    return {name: field for name, field in fields.items() if field}


def label(part: StrainPart | Peak) -> str:
    """The group of its members; their kind where it is not known, as in files of earlier versions."""
    return part.group or part.kind


def _peaks(run: Any, bodies: Any, fields: Fields, wanted: Mapping[str, list[str]]) -> list[list[Any]]:
    rows: list[list[Any]] = [["body", "members", "quantity", "largest", "unit", "time_s", "x_m", "y_m", "z_m"]]
    found = _peaks_of_bodies(run, bodies, fields)
    rounding = _rounding(bodies, found)
    for name, field in fields.items():
        chosen = {label(part) for part in field}
        for peak in found[name]:
            if peak.name in wanted[name] and label(peak) in chosen:
                what = [peak.value, peak.unit, peak.time, *peak.place]
                if peak.value <= rounding[peak.kind, peak.unit]:
                    what = [0.0, peak.unit, *NOWHERE]
                rows.append([name, label(peak), peak.name, *what])
    return rows


def _of_points(run: Any, bodies: Any, fields: Fields, wanted: Mapping[str, list[str]]) -> list[list[Any]]:
    """The largest magnitude of each quantity over the run at every strain point, and when."""
    from femflex.body.recovery import peaks_over_time, quantities

    rows: list[list[Any]] = [["body", "members", "x_m", "y_m", "z_m", "quantity", "largest", "unit", "time_s"]]
    rounding = _rounding(bodies, _peaks_of_bodies(run, bodies, fields))
    for name, field in fields.items():
        y = run.finite(f"bodies/{name}/delta")
        for part in field:
            units = {key: unit for key, unit in quantities([part]).items() if key in wanted[name]}
            for key, (largest, when) in peaks_over_time(part, y, list(units)).items():
                least = rounding[part.kind, units[key]]
                for place, value, t in zip(
                    part.places.tolist(), largest.tolist(), run.time[when].tolist(), strict=True
                ):
                    what = [value, units[key], t] if value > least else [0.0, units[key], None]
                    rows.append([name, label(part), *place, key, *what])
    return rows


def _peaks_of_bodies(run: Any, bodies: Any, names: Iterable[str]) -> dict[str, list[Peak]]:
    from femflex.body.recovery import peaks

    return {name: peaks(bodies[name].strain_field, run.finite(f"bodies/{name}/delta"), run.time) for name in names}


def _rounding(bodies: Any, found: Mapping[str, list[Peak]]) -> dict[tuple[str, str], float]:
    """Largest value that is zero to rounding, by kind of member and unit, from the peaks of all quantities of bodies.

    A force across the extent of its body is a moment that the moments may be what is left of.
    """
    import numpy as np

    sizes: dict[tuple[str, str], float] = {}
    for name, peaks in found.items():
        places = [part.places for part in bodies[name].strain_field]
        extent = max(float(np.ptp(x, axis=0).max()) for x in places)
        for peak in peaks:
            for unit, size in ((peak.unit, peak.value), (MOMENTS.get(peak.unit, ""), extent * peak.value)):
                sizes[peak.kind, unit] = max(size, sizes.get((peak.kind, unit), 0.0))
    return {key: ROUNDED * size for key, size in sizes.items()}


def _draw(run: Any, fields: Fields, path: Path, wanted: list[str] | None, force: bool) -> None:
    """Draw the largest values of one quantity over the run on the bodies."""
    from femflex.body.recovery import VON_MISES, quantities
    from femflex.cli.render import place_of_camera
    from femflex.view import render_picture

    known = quantities([part for field in fields.values() for part in field])
    if wanted and len(wanted) > 1:
        raise ValueError(f"-o {path} draws one quantity, and --quantity names {len(wanted)}; give one")
    name = wanted[0] if wanted else VON_MISES if VON_MISES in known else next(iter(known))
    render_picture(run, path, force=force, colour=f"peak:{name}", **place_of_camera(run, None, None))
    print(f"picture     {path} ({name})", file=sys.stderr)


def _wanted(fields: Fields, requested: list[str] | None) -> dict[str, list[str]]:
    """The requested quantities that each body has, all without a request; ValueError for one that no body has."""
    from femflex.body.recovery import quantities

    known = {name: list(quantities(field)) for name, field in fields.items()}
    every = list(dict.fromkeys(each for own in known.values() for each in own))
    if wrong := [each for each in requested or [] if each not in every]:
        raise ValueError(f"no body of {list(known)} has the quantity {wrong[0]!r}; known are {', '.join(every)}")
    return {name: [each for each in requested or own if each in own] for name, own in known.items()}


def _along_time(
    run: Any, fields: Fields, places: Mapping[str, list[list[float]]], wanted: Mapping[str, list[str]]
) -> list[list[Any]]:
    import numpy as np

    from femflex.body.recovery import at_points, quantities

    head: list[Any] = ["time_s"]
    columns = [run.time]
    for name, parts in fields.items():
        y = run.finite(f"bodies/{name}/delta")
        for each in wanted[name] if places[name] else []:
            values, where = at_points(parts, each, places[name], y)
            unit = quantities(parts)[each]
            head += [f"{name} {each} [{unit}] at ({', '.join(f'{c:.4g}' for c in x)}) m" for x in where]
            columns += list(values.T)
    return [head, *np.column_stack(columns).tolist()]


def _places(texts: list[str], bodies: Any, names: list[str]) -> dict[str, list[list[float]]]:
    """Places (3,) [m] on each body: three numbers count for all of them, a marker for the bodies that have it."""
    out: dict[str, list[list[float]]] = {name: [] for name in names}
    for text in texts:
        having = {name: bodies[name].markers[text].tolist() for name in names if text in bodies[name].markers}
        for name, place in (having or dict.fromkeys(names, _place(text, bodies, names))).items():
            out[name].append(place)
    return out


def _place(text: str, bodies: Any, names: list[str]) -> list[float]:
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != 3 or not all(map(isfinite, found)):
        markers = sorted({marker for name in names for marker in bodies[name].markers})
        raise ValueError(
            f"--at is {text!r}; give three numbers in metres, such as 0.3,0,0, or a marker: {', '.join(markers)}"
        )
    return found


def _table(rows: list[list[Any]]) -> str:
    shown = [
        [f"{cell:.5g}" if isinstance(cell, float) else "-" if cell is None else str(cell) for cell in row]
        for row in rows
    ]
    width = [max(len(row[k]) for row in shown) for k in range(len(shown[0]))]
    return "\n".join("  ".join(cell.rjust(w) for cell, w in zip(row, width, strict=True)) for row in shown)
