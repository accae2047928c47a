"""The natural modes of a craft about its equilibrium, on the screen, as JSON, as a montage and as a movie."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from femflex.cli.options import MOVIE, PICTURE, REPORT
from femflex.cli.progress import Bar, Patience
from femflex.cli.tables import CellValue, print_folded, print_line, print_reasons, print_table, print_title, printed

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.equilibria.system_modes import SystemModes

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
        print_modes(case, modes, number, verbose)
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


def print_modes(case: Case, modes: SystemModes, number: int | None, verbose: bool) -> None:
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
    if modes.held:
        print_line("held", f"commands of the sampled controllers {', '.join(modes.held)}: their loops are open")
    print_stability(modes.about)
    for verdict in mode_verdicts(case, modes):
        print_line("expected", verdict)


def damping_note(case: Case, modes: SystemModes) -> str:
    """Describe the first mode whose damping ratio is far from the one given to its body; empty if there is none."""
    from femflex.equilibria.rigid_motions import MOTIONS

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
