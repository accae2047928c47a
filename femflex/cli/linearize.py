"""`femflex linearize`: the linear model of a craft as poles, state space and frequency response."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.options import (
    DIAGRAM_SUFFIXES,
    PICTURE,
    At,
    CaseFile,
    Force,
    Json,
    Theme,
    Verbose,
    outputs,
    read_seconds,
    split_names,
)
from femflex.cli.progress import Patience
from femflex.cli.tables import CellValue, print_line, print_reasons, print_table, print_title, printed, record
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.studies.linear import LinearModel, Pole, StateSpace

MODEL, SOURCE, FMU = "model", "source", "FMU"
SHOWN = 24  # poles printed as text
PARTS = 3  # states named per pole


@verb("femflex linearize cases/panel_slew.toml --outputs bodies/hub/rate:y -o model.mat -o bode.png")
def linearize(
    case: CaseFile,
    inputs: Annotated[
        str | None,
        typer.Option(
            help="Inputs, separated by commas, such as loads/slew/torque:y. Default: all loads, motions and commands."
        ),
    ] = None,
    output_channels: Annotated[
        str | None,
        typer.Option(
            "--outputs", help="Outputs: channels separated by commas, such as bodies/hub/rate:y,attitude/angles."
        ),
    ] = None,
    at: At = None,
    run: Annotated[
        Path | None,
        typer.Option(help="Result file of a run: linearise about its state at --at, not about an equilibrium."),
    ] = None,
    below: Annotated[
        float | None, typer.Option(help="Keep only the poles up to this frequency [Hz] (modal truncation).")
    ] = None,
    balanced: Annotated[
        int | None, typer.Option(help="Number of states kept in addition to rigid-body motion (balanced truncation).")
    ] = None,
    zeros: Annotated[bool, typer.Option("--zeros", help="List the transmission zeros too.")] = False,
    nichols: Annotated[
        bool, typer.Option("--nichols", help="Draw gain over phase (Nichols chart), not over frequency.")
    ] = False,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="Model (.mat, .npz, .h5), C source (.c), FMU (.fmu) or Bode plot (.png, .svg); may be repeated.",
        ),
    ] = None,
    theme: Theme = "light",
    force: Force = False,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Make the linear model of a craft: state space with named inputs and outputs, poles, frequency response.

    About the equilibrium nearest to the case's initial state (at rest, in steady spin, in orbit), or about the state of
    a run at a time. Loads that vary do not act in the equilibrium unless --at says when.
    """
    files = outputs(
        output,
        {MODEL: (".mat", ".npz", ".h5"), SOURCE: (".c",), FMU: (".fmu",), PICTURE: DIAGRAM_SUFFIXES},
        force,
        theme,
    )
    time = read_seconds(at, "--at")
    if run is not None and time is None:
        raise ValueError("--run names a run, whose state at a time is taken; give the time too (--at '3 s')")
    if below is not None and balanced is not None:
        raise ValueError("found --below and --balanced; give one of them")
    with Patience("building bodies and linearising the equations of motion"):
        from femflex.case import read_case
        from femflex.pipeline.case_equilibrium import resolve_at_rest
        from femflex.studies.linear import balanced_truncation, linear_model, modal_truncation
        from femflex.studies.linear.files import state_of_run

        parsed_case = read_case(case)
        resolved = resolve_at_rest(parsed_case)
        state = None
        if run is not None and time is not None:
            time, state = state_of_run(run, resolved.system, time)
        selected = (None if text is None else split_names([text]) for text in (inputs, output_channels))
        model = linear_model(resolved.system, *selected, at=time, state=state)
        reduced_model: StateSpace = model
        if below is not None:
            reduced_model = modal_truncation(model, 6.283185307179586 * below)
        if balanced is not None:
            reduced_model = balanced_truncation(model, balanced)
    if SOURCE in files or FMU in files:
        from femflex.export.linear import check_constant

        check_constant(model)
    written_files = write_files(reduced_model, files, parsed_case.title or case.stem, (theme, force, nichols))
    with printed(as_json):
        print_title(parsed_case.title or case.name)
        print_reasons(resolved, verbose)
        print_model(model, reduced_model, zeros, verbose)
        for kind, path in written_files:
            print_line(kind, path)


def write_files(
    model: StateSpace, files: dict[str, Path], title: str, style: tuple[str, bool, bool]
) -> list[tuple[str, Path | str]]:
    """Write the requested files; return the kind and the path of each, with what is worth saying."""
    from femflex.studies.linear import save_model
    from femflex.studies.linear.space import response_grid
    from femflex.view.plot import PlotOptions
    from femflex.view.spectra import plot_bode, plot_nichols

    theme, force, nichols = style
    written_files: list[tuple[str, Path | str]] = []
    if MODEL in files:
        written_files.append((MODEL, save_model(model, files[MODEL], force)))
    if SOURCE in files:
        from femflex.export.linear import write_c

        written_files.append((SOURCE, _with_lines(files[SOURCE], write_c(model, files[SOURCE], force))))
    if FMU in files:
        from femflex.export.fmi import write_linear_fmu

        written_files.append((FMU, _with_lines(files[FMU], write_linear_fmu(model, files[FMU], force))))
    if PICTURE in files:
        omega, options = response_grid(model), PlotOptions(theme=theme, title=title, force=force)
        G = model.frequency_response(omega)
        pairs = {
            f"{out} / {into}": G[:, o, i]
            for i, (into, _) in enumerate(model.inputs)
            for o, (out, _) in enumerate(model.outputs)
        }
        if nichols:
            written_files.append((PICTURE, plot_nichols(pairs, files[PICTURE], **options)))
        else:
            written_files.append((PICTURE, plot_bode(omega, pairs, files[PICTURE], **options)))
    return written_files


def _with_lines(path: Path, lines: list[str]) -> str:
    return "\n".join([str(path), *(f"{'':11} {line}" for line in lines)])


def print_model(model: LinearModel, reduced_model: StateSpace, zeros: bool, verbose: bool) -> None:
    """Print the poles, verbose: with their participation, the inputs and outputs, and the state that it is about."""
    from femflex.cli.equilibrium import print_about, print_stability
    from femflex.studies.linear import Truncated, poles_of, transmission_zeros

    heads = ["pole", "real, 1/s", "imaginary, 1/s", "Hz", ("damping ratio", ".4g"), *["participation"] * verbose]
    rows = [
        [
            pole.name,
            pole.value.real,
            pole.value.imag,
            pole.frequency,
            pole.damping_ratio,
            *[_participation(pole)] * verbose,
        ]
        for pole in poles_of(reduced_model)
    ]
    print_table(heads, rows, name="poles", shown=SHOWN)
    if zeros:
        rows = [[zero.real, zero.imag] for zero in transmission_zeros(reduced_model)]
        print_table(["zero, real, 1/s", "imaginary, 1/s"], rows, name="zeros")
    for key in "ABCD":
        record(key, getattr(reduced_model, key))
    states = [name for name, _ in reduced_model.states]
    print_line("states", f"{len(states)}, of {len(model.states)}", states)
    for key, pairs in (("inputs", reduced_model.inputs), ("outputs", reduced_model.outputs)):
        names = [name for name, _ in pairs]
        more_text = f" and {len(names) - SHOWN} more, which --json lists" if len(names) > SHOWN else ""
        values = [{"name": name, "unit": unit} for name, unit in pairs]
        print_line(key, f"{', '.join(names[:SHOWN]) or 'none'}{more_text}", values)
    if isinstance(reduced_model, Truncated) and len(reduced_model.hankel):
        bound = reduced_model.bound
        print_line("error", f"below {bound:.4g}, as largest singular value", bound)
    if model.about is None:
        print_line("about", f"the state at {model.t:.9g} s")
        return
    print_about(model.about, model.left_out)
    print_stability(model.about)


def _participation(pole: Pole) -> CellValue:
    shares = pole.participation
    return CellValue(shares, ", ".join(f"{name} {100 * share:.0f} %" for name, share in list(shares.items())[:PARTS]))
