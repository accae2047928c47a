"""`femflex stress`: section forces and stresses of a run, their peaks as table and map, and along time at points."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.options import PICTURE, TABLE, Force, Json, RunFile, outputs
from femflex.cli.progress import Patience
from femflex.cli.tables import print_table, printed, write_csv
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.body.recovery import Peak
    from femflex.body.strain_field import StrainPart

ROUNDED = 1e-12  # of the largest of the same unit in members of the kind: zero to rounding
MOMENTS = {"N": "N m", "N/m": "N"}  # units of moments by those of the forces that make them
Fields = dict[str, "tuple[StrainPart, ...]"]  # of bodies, the parts of the requested groups
NOWHERE = [None] * 4  # time and point of a value that is zero
HELP_AT = (
    "Place on the body, x,y,z in metres, or one of its markers: values along time at the strain points nearest to it; "
    "may be repeated."
)


@verb("femflex stress run.h5 --body wing --at 0.3,0,0 -o stress.csv")
def stress(
    file: RunFile,
    body: Annotated[list[str] | None, typer.Option(help="Body; may be repeated. Default: all.")] = None,
    at: Annotated[list[str] | None, typer.Option(help=HELP_AT)] = None,
    quantity: Annotated[
        list[str] | None, typer.Option(help="Quantity such as von_mises or moment_y; may be repeated. Default: all.")
    ] = None,
    group: Annotated[list[str] | None, typer.Option(help="Group of members; may be repeated. Default: all.")] = None,
    points: Annotated[
        bool, typer.Option("--points", help="List every strain point with its largest values, in place of the peaks.")
    ] = False,
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", help="CSV file of what is printed; PNG picture of one quantity's peaks."),
    ] = None,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Print the largest section forces and stresses of every flexible body over a run, or write them along time."""
    from femflex.results import open_run

    if at and points:
        raise ValueError("--at and --points are two tables; give one of them")
    files = outputs(output, {TABLE: (".csv",), PICTURE: (".png",)}, force)
    with Patience(f"recovering stress of {file.name}"), open_run(file) as run:
        bodies = run.bodies()
        names = body or [name for name, found_body in bodies.items() if found_body.strain_field]
        unknown_names = [name for name in names if name not in bodies or not bodies[name].strain_field]
        if unknown_names or not names:
            names_with_strain = [name for name, found_body in bodies.items() if found_body.strain_field]
            raise ValueError(
                f"{file.name} has no strain of {unknown_names or 'any body'}; it has that of {names_with_strain}"
            )
        fields = _fields_of_groups(bodies, names, group)
        quantities = _requested_quantities(fields, quantity)
        if at:
            rows = _rows_over_time(run, fields, _read_points(at, bodies, list(fields)), quantities)
        else:
            rows = (_rows_of_points if points else _rows_of_peaks)(run, bodies, fields, quantities)
        if PICTURE in files:
            _draw_peaks(run, fields, files[PICTURE], quantity, force)
    if as_json or not (at or points) or TABLE not in files:
        keys = 1 if at else rows[0].index("quantity") + 1
        with printed(as_json):
            print_table([(head, ".5g") for head in rows[0]], rows[1:], keys=keys, name="rows")
    if TABLE in files:
        write_csv(files[TABLE], rows[0], rows[1:], force)


def _fields_of_groups(bodies: Any, names: list[str], groups: list[str] | None) -> Fields:
    """Return the parts of every body that belong to these groups, or all parts; ValueError for an unknown group."""
    known_groups = sorted({label(part) for name in names for part in bodies[name].strain_field})
    if unknown_groups := [group for group in groups or [] if group not in known_groups]:
        raise ValueError(
            f"no body of {names} has members of the group {unknown_groups[0]!r}; known are {', '.join(known_groups)}"
        )
    chosen_groups = set(groups or known_groups)
    fields = {name: tuple(part for part in bodies[name].strain_field if label(part) in chosen_groups) for name in names}
    return {name: field for name, field in fields.items() if field}


def label(part: StrainPart | Peak) -> str:
    """The group of its members; their kind where it is not known, as in files of earlier versions."""
    return part.group or part.kind


def _rows_of_peaks(run: Any, bodies: Any, fields: Fields, quantities: Mapping[str, list[str]]) -> list[list[Any]]:
    rows: list[list[Any]] = [["body", "members", "quantity", "largest", "unit", "time_s", "x_m", "y_m", "z_m"]]
    peaks_of_bodies = _peaks_of_bodies(run, bodies, fields)
    rounding = _rounding(bodies, peaks_of_bodies)
    for name, field in fields.items():
        chosen_groups = {label(part) for part in field}
        for peak in peaks_of_bodies[name]:
            if peak.name in quantities[name] and label(peak) in chosen_groups:
                cells = [peak.value, peak.unit, peak.time, *peak.place]
                if peak.value <= rounding[peak.kind, peak.unit]:
                    cells = [0.0, peak.unit, *NOWHERE]
                rows.append([name, label(peak), peak.name, *cells])
    return rows


def _rows_of_points(
    run: Any, bodies: Any, fields: Fields, quantities_of_bodies: Mapping[str, list[str]]
) -> list[list[Any]]:
    """Rows with the largest magnitude of each quantity over the run at every strain point, and its time."""
    from femflex.body.recovery import peaks_over_time, quantities

    rows: list[list[Any]] = [["body", "members", "x_m", "y_m", "z_m", "quantity", "largest", "unit", "time_s"]]
    rounding = _rounding(bodies, _peaks_of_bodies(run, bodies, fields))
    for name, field in fields.items():
        y = run.finite(f"bodies/{name}/delta")
        for part in field:
            units = {key: unit for key, unit in quantities([part]).items() if key in quantities_of_bodies[name]}
            for key, (values, indices) in peaks_over_time(part, y, list(units)).items():
                zero_limit = rounding[part.kind, units[key]]
                for point, value, t in zip(
                    part.places.tolist(), values.tolist(), run.time[indices].tolist(), strict=True
                ):
                    cells = [value, units[key], t] if value > zero_limit else [0.0, units[key], None]
                    rows.append([name, label(part), *point, key, *cells])
    return rows


def _peaks_of_bodies(run: Any, bodies: Any, names: Iterable[str]) -> dict[str, list[Peak]]:
    from femflex.body.recovery import peaks

    return {name: peaks(bodies[name].strain_field, run.finite(f"bodies/{name}/delta"), run.time) for name in names}


def _rounding(bodies: Any, peaks_of_bodies: Mapping[str, list[Peak]]) -> dict[tuple[str, str], float]:
    """Largest value that is zero to rounding, by kind of member and unit, from the peaks of all quantities of bodies.

    A force across the extent of its body is a moment that the moments may be what is left of.
    """
    import numpy as np

    sizes: dict[tuple[str, str], float] = {}
    for name, peaks in peaks_of_bodies.items():
        points_of_parts = [part.places for part in bodies[name].strain_field]
        extent = max(float(np.ptp(x, axis=0).max()) for x in points_of_parts)
        for peak in peaks:
            for unit, size in ((peak.unit, peak.value), (MOMENTS.get(peak.unit, ""), extent * peak.value)):
                sizes[peak.kind, unit] = max(size, sizes.get((peak.kind, unit), 0.0))
    return {key: ROUNDED * size for key, size in sizes.items()}


def _draw_peaks(run: Any, fields: Fields, path: Path, requested: list[str] | None, force: bool) -> None:
    """Draw the largest values of one quantity over the run on the bodies."""
    from femflex.body.recovery import VON_MISES, quantities
    from femflex.cli.render import camera_options
    from femflex.view import render_picture

    available = quantities([part for field in fields.values() for part in field])
    if requested and len(requested) > 1:
        raise ValueError(f"-o {path} draws one quantity, and --quantity names {len(requested)}; give one")
    name = requested[0] if requested else VON_MISES if VON_MISES in available else next(iter(available))
    render_picture(run, path, force=force, colour=f"peak:{name}", **camera_options(run, None, None))
    print(f"picture     {path} ({name})", file=sys.stderr)


def _requested_quantities(fields: Fields, requested: list[str] | None) -> dict[str, list[str]]:
    """Return the requested quantities of each body, or all; ValueError for a quantity that no body has."""
    from femflex.body.recovery import quantities

    available = {name: list(quantities(field)) for name, field in fields.items()}
    all_quantities = list(
        dict.fromkeys(quantity for quantities_of_body in available.values() for quantity in quantities_of_body)
    )
    if unknown := [quantity for quantity in requested or [] if quantity not in all_quantities]:
        raise ValueError(
            f"no body of {list(available)} has the quantity {unknown[0]!r}; known are {', '.join(all_quantities)}"
        )
    return {
        name: [quantity for quantity in requested or quantities_of_body if quantity in quantities_of_body]
        for name, quantities_of_body in available.items()
    }


def _rows_over_time(
    run: Any, fields: Fields, points: Mapping[str, list[list[float]]], quantities_of_bodies: Mapping[str, list[str]]
) -> list[list[Any]]:
    import numpy as np

    from femflex.body.recovery import at_points, quantities

    head: list[Any] = ["time_s"]
    columns = [run.time]
    for name, parts in fields.items():
        y = run.finite(f"bodies/{name}/delta")
        for quantity in quantities_of_bodies[name] if points[name] else []:
            values, positions = at_points(parts, quantity, points[name], y)
            unit = quantities(parts)[quantity]
            head += [f"{name} {quantity} [{unit}] at ({', '.join(f'{c:.4g}' for c in x)}) m" for x in positions]
            columns += list(values.T)
    return [head, *np.column_stack(columns).tolist()]


def _read_points(texts: list[str], bodies: Any, names: list[str]) -> dict[str, list[list[float]]]:
    """Points (3,) [m] on each body: three numbers count for all of them, a marker for the bodies that have it."""
    points: dict[str, list[list[float]]] = {name: [] for name in names}
    for text in texts:
        marker_positions = {name: bodies[name].markers[text].tolist() for name in names if text in bodies[name].markers}
        for name, point in (marker_positions or dict.fromkeys(names, _read_point(text, bodies, names))).items():
            points[name].append(point)
    return points


def _read_point(text: str, bodies: Any, names: list[str]) -> list[float]:
    try:
        point = [float(number) for number in text.split(",")]
    except ValueError:
        point = []
    if len(point) != 3 or not all(map(isfinite, point)):
        markers = sorted({marker for name in names for marker in bodies[name].markers})
        raise ValueError(
            f"--at is {text!r}; give three numbers in metres, such as 0.3,0,0, or a marker: {', '.join(markers)}"
        )
    return point
