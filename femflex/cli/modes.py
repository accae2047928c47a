"""`femflex modes`: natural modes of a craft, or frequencies and effective masses of its flexible bodies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.info import starts_as_hdf5
from femflex.cli.options import (
    MOVIE,
    PAGE_SUFFIXES,
    PICTURE,
    REPORT,
    At,
    Force,
    Json,
    Verbose,
    outputs,
    read_quantity,
    read_seconds,
)
from femflex.cli.progress import Patience
from femflex.cli.tables import (
    CellValue,
    print_folded,
    print_line,
    print_notes,
    print_table,
    print_title,
    printed,
    record,
    section,
)
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.body import FlexibleBody


DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")


@verb("femflex modes cases/orbiter_beam.toml -o modes.png")
def modes(
    file: Annotated[Path, typer.Argument(help="Case file (TOML) or body file (HDF5).", show_default=False)],
    body: Annotated[str | None, typer.Option("--body", help="Name of one body, for its modes alone.")] = None,
    all_bodies: Annotated[bool, typer.Option("--bodies", help="Every flexible body alone.")] = False,
    number: Annotated[
        int | None,
        typer.Option(
            "-n",
            "--number",
            min=1,
            help="Number of modes listed; with --body, of modes computed. Default: that of the case.",
        ),
    ] = None,
    at: At = None,
    mac: Annotated[
        Path | None, typer.Option("--mac", help="Body file whose shapes are compared (modal assurance).")
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="Montage of modes (.png), movie of one (.mp4) or page to turn them (.html); may be repeated.",
        ),
    ] = None,
    mode: Annotated[int | None, typer.Option("--mode", min=1, help="Number of the mode of the movie.")] = None,
    force: Force = False,
    backbone: Annotated[
        str | None,
        typer.Option("--backbone", help='Rising amplitudes, "1 mm, 5 mm": frequency of the lowest mode at each.'),
    ] = None,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Print the natural modes of a craft about its equilibrium, or those of single bodies.

    Of the craft: frequency, damping ratio, name, and the bodies that hold the kinetic energy. Loads that vary over time
    are left out without --at, and prescribed motions stay at their initial values. With --body, --bodies, --mac,
    --backbone or a body file: frequencies, participation and effective mass of each flexible body, per direction with
    the running sum.

    Effective masses are in per cent of the body's mass and of its inertia about the origin of its frame. With nonlinear
    or condensed strain --backbone tells how the lowest frequency changes with the amplitude, the frame held.
    """
    files = outputs(output, {PICTURE: (".png",), MOVIE: (".mp4",), REPORT: PAGE_SUFFIXES}, force)
    picture, movie, time = files.get(PICTURE), files.get(MOVIE), read_seconds(at, "--at")
    is_hdf5 = file.is_file() and starts_as_hdf5(file)
    if not (is_hdf5 or all_bodies or any(option is not None for option in (body, mac, backbone))):
        from femflex.cli.craft_modes import craft_modes

        return craft_modes(file, time, number, files, mode, force, verbose, as_json)
    if movie is not None or REPORT in files or mode is not None or at is not None:
        raise ValueError(
            "movies, pages, --mode and --at are for the modes of a craft; leave --body and its options out"
        )
    amplitudes = None
    if backbone is not None:
        amplitudes = [read_quantity(text, "m", "--backbone") for text in backbone.split(",")]
    with Patience("solving for the modes"):
        bodies, notes = (bodies_of_file if is_hdf5 else bodies_of_case)(file, body, number)
        compared_body = None if mac is None else bodies_of_file(mac)[0][mac.stem]
    if picture is not None and len(bodies) > 1:
        raise ValueError(f"-o draws one body; name one of {sorted(bodies)} with --body")
    if picture is not None:
        from femflex.view import mode_montage

        mode_montage(next(iter(bodies.values())), picture, title=f"modes of {next(iter(bodies))}", force=force)
    with printed(as_json):
        for k, (names, flexible_body) in enumerate(group_equal_bodies(bodies)):
            if k:
                print_folded("")
            with section(names):
                print_modes(names, flexible_body, verbose)
                if verbose:
                    print_notes({name: note for name, note in notes.items() if bodies.get(name) is flexible_body})
                if compared_body is not None:
                    print_mac(flexible_body, compared_body, str(mac))
                if amplitudes is not None:
                    print_backbone(flexible_body, amplitudes)
        if picture is not None:
            print_line("picture", picture)


Bodies = tuple[dict[str, "FlexibleBody"], dict[str, str]]  # and notes on them, both by name


def bodies_of_case(file: Path, name: str | None, number: int | None) -> Bodies:
    """Return the flexible bodies of a case, or one of them, and notes. Raises ValueError if there are none."""
    from femflex.case import read_case
    from femflex.noun.problems import suggestion_text
    from femflex.pipeline.case_bodies import advised_bodies

    case = read_case(file)
    if name is not None and name not in case.bodies:
        raise ValueError(f"{file.name} has no body {name!r}; {suggestion_text(name, case.bodies)}")
    names = [name] if name is not None else [n for n, table in case.bodies.items() if table.kind != "rigid"]
    built, notes = advised_bodies(case, names, modes=number)
    bodies = {n: built_body for n, built_body in built.items() if built_body.n_modes}
    if not bodies:
        raise ValueError(f"{f'body {name!r}' if name else file.name} has no elastic modes; all of it is rigid")
    return bodies, notes


def bodies_of_file(file: Path, name: str | None = None, number: int | None = None) -> Bodies:
    """Return the body of a body file, with the first of its modes if a number is given."""
    from femflex.reduction import load_body

    body = load_body(file)
    if number is not None and number > body.n_modes:
        raise ValueError(f"{number} modes were requested; the body file holds {body.n_modes}")
    return {file.stem: body if number is None else body.truncated(number)}, {}


def group_equal_bodies(bodies: Mapping[str, FlexibleBody]) -> list[tuple[str, FlexibleBody]]:
    """Bodies with their names; those of the same mass and modes together, as "panel_a, panel_b"
    or "link1 to link8, 8 bodies"."""
    import numpy as np

    groups: list[tuple[list[str], FlexibleBody]] = []
    for name, body in bodies.items():
        for names, first_body in groups:
            a, b = body.moments, first_body.moments
            pairs = ((a.mass, b.mass), (a.first, b.first), (a.second, b.second), (body.omega, first_body.omega))
            if body.kinds == first_body.kinds and all(np.array_equal(x, y, equal_nan=True) for x, y in pairs):
                names.append(name)
                break
        else:
            groups.append(([name], body))
    return [(_joined(names), body) for names, body in groups]


def _joined(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 3 else f"{names[0]} to {names[-1]}, {len(names)} bodies"


def print_modes(name: str, body: FlexibleBody, verbose: bool) -> None:
    """Print the effective masses of a body's modes; verbose: with their running sums, and the participation."""
    from math import pi

    import numpy as np

    from femflex.body.slices import shape_names
    from femflex.reduction import effective_mass

    masses, form, n = effective_mass(body), body.strain_form, body.n_modes
    strain = "" if form == "linear" else f"; {form} strain"
    each_text = " each" if ", " in name else ""
    print_title(
        f"{name}: {body.moments.mass:.6g} kg{each_text}, {n} elastic coordinates"
        f"{kind_counts(body.kinds[:n])}{dependent_count(body)}{strain}"
    )
    several = len(set(masses.kinds)) > 1
    names = shape_names(body, masses.shapes)
    numbers = [(k, omega / (2 * pi), name) for k, (omega, name) in enumerate(zip(masses.omega, names, strict=True), 1)]
    kinds = [[kind] * several for kind in masses.kinds]
    shares = 100.0 * np.divide(masses.effective, masses.total, out=np.zeros((n, 6)), where=masses.total > 0)
    sums = 100.0 * masses.running

    def table(title: str, cells: Iterable[Iterable[Any]], form: str, last: list[Any], kinds: list[list[str]]) -> None:
        directions = ((direction, form) for direction in DIRECTIONS)
        heads = ["mode", "Hz", ("name", "<"), *directions, *["kind"] * bool(kinds[0])]
        rows = [[*a, *b, *c] for a, b, c in zip(numbers, cells, kinds, strict=True)]
        print_table(heads, rows + last, title, name=title.partition(" in ")[0])

    mass_title = "effective mass in % of the body's mass and inertia"
    if verbose:
        participation = np.round(masses.participation, 4) + 0.0
        table("participation in kg^1/2 and kg^1/2 m", participation, ".4f", [], kinds)
        cells = (
            [CellValue({"share": s, "sum": r}, f"{s:.2f} ({r:.2f})") for s, r in zip(*rows, strict=True)]
            for rows in zip(shares, sums, strict=True)
        )
        table(f"{mass_title} (running sum)", cells, "", [], [[]] * n)
        return
    table(mass_title, shares, ".2f", [["sum", None, None, *sums[-1]]], [[]] * n)


def kind_counts(kinds: tuple[str, ...]) -> str:
    """Count the shapes of each kind, for a heading; empty if all are of one kind."""
    names = dict.fromkeys(kinds)
    return f" ({', '.join(f'{kinds.count(name)} {name}' for name in names)})" if len(names) > 1 else ""


def dependent_count(body: FlexibleBody) -> str:
    """Count the dependent shapes of a condensed body, for a heading; empty if there are none."""
    dependent_kinds = body.kinds[body.n_modes :]
    return (
        f", {len(body.slaves)} dependent shapes ({', '.join(dict.fromkeys(dependent_kinds))})"
        if dependent_kinds
        else ""
    )


def print_mac(body: FlexibleBody, compared_body: FlexibleBody, title: str) -> None:
    """Print the modal assurance matrix of two bodies' shapes."""
    from femflex.reduction import mac_of_bodies

    table = mac_of_bodies(body, compared_body)
    heads = ["mode", *((str(k + 1), ".4f") for k in range(table.shape[1]))]
    rows = [[k, *row] for k, row in enumerate(table, 1)]
    print_table(heads, rows, f"modal assurance against {title}", name="modal assurance")


def print_backbone(body: FlexibleBody, amplitudes: list[float]) -> None:
    """Print the frequency of the lowest mode at these amplitudes [m].

    Raises BackboneError where they are not all reached, after those that are.
    """
    from math import pi

    from femflex.studies import BackboneError, backbone

    error = None
    try:
        curve = backbone(body, 1, amplitudes)
    except BackboneError as stopped:
        error = stopped
        if stopped.backbone is None:
            raise
        curve = stopped.backbone
    place = ", ".join(f"{x:.4g}" for x in curve.place)
    title = f"free vibration in mode 1 by its amplitude at ({place}) m, frame held"
    columns = curve.amplitudes, curve.omega / (2 * pi), curve.omega / curve.small
    heads = ["amplitude m", "Hz", ("over small motion", ".5f")]
    print_table(heads, zip(*columns, strict=True), title, name="backbone")
    record("path", [(vibration.amplitude, vibration.omega / (2 * pi)) for vibration in curve.path])
    for low, high in curve.gaps:
        print_line(
            "gap", f"between {low:.4g} and {high:.4g} m a higher harmonic is in internal resonance with another mode; "
            "the curve is not computed there", [[low, high]],
        )  # fmt: skip
    if text := amplitude_note(body):
        print_line("note", text)
    if error is not None:
        raise error


def amplitude_note(body: FlexibleBody) -> str:
    """Note on a frequency that cannot change with the amplitude; empty for one that can."""
    if body.strain_form != "linear":
        return ""
    return (
        "linear strain: its force is proportional to the amplitude, so that the frequency cannot change with it; "
        "give the body strain = 'condensed' or 'nonlinear' to see what a large amplitude does"
    )
