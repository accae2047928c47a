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
from femflex.cli.progress import Bar, Patience
from femflex.cli.tables import (
    CellValue,
    print_folded,
    print_line,
    print_notes,
    print_reasons,
    print_table,
    print_title,
    printed,
    record,
    section,
)
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.body import FlexibleBody
    from femflex.case import Case
    from femflex.linear.system_modes import SystemModes

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")


@verb("femflex modes cases/orbiter_beam.toml -o modes.png")
def modes(
    file: Annotated[Path, typer.Argument(help="Case file (TOML) or body file (HDF5).", show_default=False)],
    body: Annotated[str | None, typer.Option(help="Name of one body, for its modes alone.")] = None,
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
    mac: Annotated[Path | None, typer.Option(help="Body file whose shapes are compared (modal assurance).")] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="Montage of modes (.png), movie of one (.mp4) or page to turn them (.html); may be repeated.",
        ),
    ] = None,
    mode: Annotated[int | None, typer.Option(min=1, help="Number of the mode of the movie.")] = None,
    force: Force = False,
    backbone: Annotated[
        str | None, typer.Option(help='Rising amplitudes, "1 mm, 5 mm": frequency of the lowest mode at each.')
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


SHOWN = 24  # modes printed
DRAWN = 12  # modes of the montage
CHANGED = 0.1  # of the damping ratio given, from which on a mode's own is remarked on
CARRIES = 0.05  # share of the kinetic energy from which a body is named


def caption(modes: SystemModes, mode: int) -> str:
    """Number, name and frequency of a mode."""
    frequency = float(modes.frequencies[mode - 1])
    growing = " · grows" if modes.growing[mode - 1] else ""
    return f"{mode} · {modes.label(mode)} · {frequency:.4g} Hz{growing}"


def craft_modes(
    file: Path,
    at: float | None,
    number: int | None,
    files: dict[str, Path],
    mode: int | None,
    force: bool,
    verbose: bool,
    as_json: bool,
) -> None:
    """Find, print and draw the modes of the craft of a case; mode: that of the movie."""
    if mode is not None and MOVIE not in files:
        raise ValueError("--mode names the mode of a movie; give -o mode.mp4 with it")
    with Patience("building bodies and solving for the modes"):
        from femflex.case import read_case
        from femflex.pipeline.case_equilibrium import case_modes, resolve_at_rest

        case = read_case(file)
        resolved = resolve_at_rest(case)
        modes = case_modes(resolved, at)
    draw_modes(modes, files, mode, case.title or file.stem, force)
    with printed(as_json):
        print_title(case.title or file.name)
        print_reasons(resolved, verbose)
        print_craft(case, modes, number, verbose)
        for kind, path in files.items():
            print_line(kind, path)


def draw_modes(modes: SystemModes, files: dict[str, Path], mode: int | None, title: str, force: bool) -> None:
    """Draw the requested files."""
    from femflex.view import craft_montage, craft_movie

    moving = [k + 1 for k, is_rigid in enumerate(modes.known) if not is_rigid]
    if PICTURE in files:
        numbers = moving[:DRAWN]
        if not numbers:
            raise ValueError("the craft has only rigid-body modes, which are not drawn")
        captions = [caption(modes, k) for k in numbers]
        craft_montage(modes.skin(numbers), captions, files[PICTURE], title, force=force)
    if MOVIE in files:
        mode = mode or (moving[0] if moving else 1)
        if not 1 <= mode <= len(modes.names):
            raise ValueError(f"--mode is {mode}; the modes of the craft are 1 to {len(modes.names)}")
        with Bar("drawing", unit="frames") as bar:
            craft_movie(modes.skin([mode]), caption(modes, mode), files[MOVIE], force=force, progress=bar)
    if REPORT in files:
        from femflex.report.studies import write_modes_report

        write_modes_report(modes, title, files[REPORT], force)


def print_craft(case: Case, modes: SystemModes, number: int | None, verbose: bool) -> None:
    """Print the table of modes, what they are about, stability and verdicts; verbose: frequencies also in rad/s."""
    from femflex.cli.equilibrium import print_about, print_stability
    from femflex.measures.verdicts import mode_verdicts

    count = min(number or SHOWN, len(modes.names))
    rows = [
        [
            k + 1, modes.label(k + 1), modes.frequencies[k], *[modes.eigenvalues[k].imag] * verbose,
            CellValue(ratio, f"{ratio:.4g}" + "*" * bool(modes.growing[k])), kinetic_energy(modes, k),
        ]
        for k, ratio in enumerate(modes.damping_ratios)
    ]  # fmt: skip
    heads = ["mode", "name", "Hz", *["rad/s"] * verbose, "damping ratio", "kinetic energy"]
    print_table(heads, rows, name="modes", shown=count)
    if modes.growing[:count].any():
        print_folded("*           the motion grows")
    if note := damping_note(case, modes):
        print_line("damping", note)
    print_about(modes.about, modes.left_out)
    if modes.held_controllers:
        print_line(
            "held", f"commands of the sampled controllers {', '.join(modes.held_controllers)}: their loops are open"
        )
    print_stability(modes.about)
    for verdict in mode_verdicts(case, modes):
        print_line("expected", verdict)


def damping_note(case: Case, modes: SystemModes) -> str:
    """Describe the first mode whose damping ratio is far from the one given to its body; empty if there is none."""
    from femflex.linear.rigid_motions import MOTIONS

    case_ratios: dict[str, float] = {}
    for name, table in case.bodies.items():
        damping = getattr(table, "damping", None)
        ratio = getattr(damping, "ratio", damping)
        if isinstance(ratio, float) and ratio > 0.0:
            case_ratios[name] = ratio
    for k in range(len(modes.names)):
        shares = {
            body: float(share[k]) for body, share in modes.energy.items() if body.partition(".")[0] in case_ratios
        }
        body = max(shares, key=lambda body_name: shares[body_name], default="")
        damping_ratio = float(modes.damping_ratios[k])
        if (
            modes.known[k]
            or modes.names[k].startswith(MOTIONS)
            or "." in modes.names[k]  # mostly a state of an effector
            or not shares
            or shares[body] < CARRIES
            or not 0.0 < damping_ratio < 1.0
        ):
            continue
        ratio = case_ratios[body.partition(".")[0]]
        if abs(damping_ratio / ratio - 1.0) > CHANGED:
            return (
                f"mode {k + 1} has a ratio of {damping_ratio:.4g}, and body {body!r} is given {ratio:g}. The "
                "given ratio applies to the modes of the clamped body; in the craft it differs, and "
                "dampers of joints and control add to it"
            )
    return ""


def kinetic_energy(modes: SystemModes, k: int) -> CellValue:
    """Shares of the bodies in the kinetic energy of a mode, as text in per cent of those that hold some."""
    shares = {body: float(share[k]) for body, share in modes.energy.items()}
    largest_first = sorted(((share, body) for body, share in shares.items()), reverse=True)
    return CellValue(
        shares, ", ".join(f"{body} {100 * share:.0f} %" for share, body in largest_first if share >= CARRIES)
    )
