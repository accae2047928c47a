"""`femflex modes`: natural modes of a craft, or frequencies and effective masses of its flexible bodies."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.advice_lines import Verbose, print_notes
from femflex.cli.backbone import backbone_data, print_backbone, read_lengths
from femflex.cli.outputs import MOVIE, PAGE_SUFFIXES, PICTURE, REPORT, outputs
from femflex.cli.progress import Patience
from femflex.cli.tables import print_json, print_table
from femflex.cli.times import read_seconds
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
    at: Annotated[
        str | None,
        typer.Option(
            "--at",
            help="Time at which loads and motions given as functions of time are evaluated: a number of seconds, or a "
            "text such as '2 min'. Without it, such loads are left out.",
        ),
    ] = None,
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
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    backbone: Annotated[
        str | None,
        typer.Option("--backbone", help='Rising amplitudes, "1 mm, 5 mm": frequency of the lowest mode at each.'),
    ] = None,
    verbose: Verbose = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print for programs.")] = False,
) -> None:
    """Print the natural modes of a craft about its equilibrium, or those of single bodies.

    Of the craft: frequency, damping ratio, name, and the bodies that hold the kinetic energy. Loads that vary over time
    are left out without --at, and prescribed motions stay at their initial values. With --body, --bodies, --mac,
    --backbone or a body file: frequencies, participation and effective mass of each flexible body, per direction with
    the running sum.

    Effective masses are in per cent of the body's mass and of its inertia about the origin of its frame. With nonlinear
    or condensed strain --backbone tells how the lowest frequency changes with the amplitude, the frame held.
    """
    files = outputs(output or (), {PICTURE: (".png",), MOVIE: (".mp4",), REPORT: PAGE_SUFFIXES})
    picture, movie, time = files.get(PICTURE), files.get(MOVIE), read_seconds(at, "--at")
    of_bodies = body is not None or all_bodies or mac is not None or backbone is not None or _is_hdf5(file)
    if not of_bodies:
        from femflex.cli.craft_modes import Drawing, craft_modes

        return craft_modes(
            file, time, number, Drawing(picture, movie, files.get(REPORT), mode, force), verbose, as_json
        )
    if movie is not None or REPORT in files or mode is not None or at is not None:
        raise ValueError(
            "movies, pages, --mode and --at are for the modes of a craft; leave --body and its options out"
        )
    amplitudes = None if backbone is None else read_lengths(backbone)
    with Patience("solving for the modes"):
        bodies, notes = flexible_bodies(file, body, number)
        compared_body = None if mac is None else _body_file(mac)
    if picture is not None and len(bodies) > 1:
        raise ValueError(f"-o draws one body; name one of {sorted(bodies)} with --body")
    if picture is not None:
        from femflex.view import mode_montage

        mode_montage(next(iter(bodies.values())), picture, title=f"modes of {next(iter(bodies))}", force=force)
    if as_json:
        data = {
            name: modes_data(flexible_body, compared_body) | {"note": notes.get(name, "")}
            for name, flexible_body in bodies.items()
        }
        first_error = None
        for name in bodies if amplitudes is not None else ():
            data[name]["backbone"], error = backbone_data(bodies[name], amplitudes or [])
            first_error = first_error or error
        print_json(data)
        if first_error is not None:
            raise first_error
        return
    for k, (names, flexible_body) in enumerate(group_equal_bodies(bodies)):
        print("\n" * (k > 0), end="")
        print_modes(names, flexible_body, verbose)
        if verbose:
            print_notes({name: notes[name] for name, b in bodies.items() if b is flexible_body and name in notes})
        if compared_body is not None:
            print_mac(flexible_body, compared_body, str(mac))
        if amplitudes is not None:
            print_backbone(flexible_body, amplitudes)
    if picture is not None:
        print(f"picture     {picture}")


def flexible_bodies(file: Path, name: str | None, number: int | None) -> tuple[dict[str, FlexibleBody], dict[str, str]]:
    """Return the flexible bodies of a case, or that of a body file, and notes. Raises ValueError if there are none."""
    from femflex.noun.problems import suggestion_text

    if _is_hdf5(file):
        return {file.stem: _with_number_of_modes(_body_file(file), number)}, {}
    from femflex.case import read_case
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

    from femflex.reduction import effective_mass

    masses, form, n = effective_mass(body), body.strain_form, body.n_modes
    strain = "" if form == "linear" else f"; {form} strain"
    each_text = " each" if ", " in name else ""
    print(
        f"{name}: {body.moments.mass:.6g} kg{each_text}, {n} elastic coordinates"
        f"{kind_counts(body.kinds[:n])}{dependent_count(body)}{strain}"
    )
    numbers = [[str(k + 1), f"{omega / (2 * pi):.6g}"] for k, omega in enumerate(masses.omega)]
    kinds = [[kind] if len(set(masses.kinds)) > 1 else [] for kind in masses.kinds]
    heads = ["mode", "Hz", *DIRECTIONS, *["kind"] * any(kinds)]
    shares = 100.0 * np.divide(masses.effective, masses.total, out=np.zeros((n, 6)), where=masses.total > 0)
    sums = 100.0 * masses.running
    if verbose:
        print("participation in kg^1/2 and kg^1/2 m")
        cells = [[f"{p + 0.0:.4f}" for p in np.round(row, 4)] for row in masses.participation]
        print_table(heads, [[*a, *b, *c] for a, b, c in zip(numbers, cells, kinds, strict=True)])
        cells = [[f"{s:.2f} ({r:.2f})" for s, r in zip(*rows, strict=True)] for rows in zip(shares, sums, strict=True)]
        print("effective mass in % of the body's mass and inertia (running sum)")
        print_table(heads[:8], [[*a, *b] for a, b in zip(numbers, cells, strict=True)])
        return
    print("effective mass in % of the body's mass and inertia")
    rows = [[*a, *(f"{s:.2f}" for s in row), *c] for a, row, c in zip(numbers, shares, kinds, strict=True)]
    rows.append(["sum", "", *(f"{r:.2f}" for r in sums[-1]), *[""] * any(kinds)])
    print_table(heads, rows)


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
    rows = [[str(k + 1), *(f"{value:.4f}" for value in row)] for k, row in enumerate(table)]
    print(f"modal assurance against {title}")
    print_table(["mode", *(str(k + 1) for k in range(table.shape[1]))], rows)


def modes_data(body: FlexibleBody, compared_body: FlexibleBody | None) -> dict[str, Any]:
    """Return the modes of a body for --json."""
    from math import pi

    from femflex.reduction import effective_mass, mac_of_bodies

    masses = effective_mass(body)
    data = {
        "mass_kg": body.moments.mass,
        "frequency_hz": masses.omega / (2 * pi),
        "kinds": list(body.kinds),
        "mode_kinds": list(masses.kinds),
        "strain": body.strain_form,
        "directions": list(DIRECTIONS),
        "participation": masses.participation,
        "effective_mass": masses.effective,
        "total": masses.total,
        "running_sum": masses.running,
    }
    return data | ({} if compared_body is None else {"mac": mac_of_bodies(body, compared_body)})


def _is_hdf5(file: Path) -> bool:
    if not file.is_file():
        return False
    with open(file, "rb") as opened:
        return opened.read(8) == b"\x89HDF\r\n\x1a\n"


def _body_file(file: Path) -> FlexibleBody:
    from femflex.reduction import load_body

    return load_body(file)


def _with_number_of_modes(body: FlexibleBody, number: int | None) -> FlexibleBody:

    if number is not None and number > body.n_modes:
        raise ValueError(f"{number} modes were requested; the body file holds {body.n_modes}")
    return body if number is None else body.truncated(number)
