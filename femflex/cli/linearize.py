"""`femflex linearize`: the linear model of a craft as poles, state space and frequency response."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.advice_lines import print_reasons
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
from femflex.cli.tables import print_folded, print_json, print_table
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.studies.linear import LinearModel, StateSpace

MODEL = "model"
SHOWN = 24  # poles printed; --json lists all
PARTS = 3  # states named per pole


@verb("femflex linearize cases/panel_slew.toml --outputs bodies/hub/rate:y -o model.mat -o bode.png")
def linearize(
    case: CaseFile,
    inputs: Annotated[
        str | None,
        typer.Option(
            "--inputs",
            help="Inputs, separated by commas, such as loads/slew/torque:y. Default: all loads, motions and commands.",
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
        typer.Option(
            "--run", help="Result file of a run: linearise about its state at --at, not about an equilibrium."
        ),
    ] = None,
    below: Annotated[
        float | None, typer.Option("--below", help="Keep only the poles up to this frequency [Hz] (modal truncation).")
    ] = None,
    balanced: Annotated[
        int | None,
        typer.Option(
            "--balanced", help="Number of states kept in addition to rigid-body motion (balanced truncation)."
        ),
    ] = None,
    zeros: Annotated[bool, typer.Option("--zeros", help="List the transmission zeros too.")] = False,
    nichols: Annotated[
        bool, typer.Option("--nichols", help="Draw gain over phase (Nichols chart), not over frequency.")
    ] = False,
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", help="Model (.mat, .npz, .h5) or Bode plot (.png, .svg); may be repeated."),
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
    files = outputs(output, {MODEL: (".mat", ".npz", ".h5"), PICTURE: DIAGRAM_SUFFIXES}, force, theme)
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
    data = model_data(model, reduced_model, zeros)
    written_files = write_files(reduced_model, files, parsed_case.title or case.stem, (theme, force, nichols))
    if as_json:
        print_json(data)
        return
    print(parsed_case.title or case.name)
    print_reasons(resolved, verbose)
    print_model(model, reduced_model, data, verbose)
    for kind, path in written_files:
        print(f"{kind:11} {path}")


def write_files(
    model: StateSpace, files: dict[str, Path], title: str, style: tuple[str, bool, bool]
) -> list[tuple[str, Path]]:
    """Write the requested files; return the kind and the path of each."""
    from femflex.studies.linear import save_model
    from femflex.studies.linear.space import response_grid
    from femflex.view.bode import plot_bode, plot_nichols
    from femflex.view.plot import PlotOptions

    theme, force, nichols = style
    written_files = []
    if MODEL in files:
        written_files.append((MODEL, save_model(model, files[MODEL], force)))
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


def model_data(model: LinearModel, reduced_model: StateSpace, zeros: bool) -> dict[str, Any]:
    """Return the model for --json."""
    from femflex.studies.linear import poles_of, transmission_zeros

    data: dict[str, Any] = {
        "states": [name for name, _ in reduced_model.states],
        "inputs": [{"name": name, "unit": unit} for name, unit in reduced_model.inputs],
        "outputs": [{"name": name, "unit": unit} for name, unit in reduced_model.outputs],
        "about": "an instant of a motion" if model.about is None else "equilibrium",
        "left_out": list(model.left_out),
        "poles": [pole.to_dict() for pole in poles_of(reduced_model)],
        **{key: getattr(reduced_model, key) for key in "ABCD"},
    }
    if zeros:
        data["zeros"] = transmission_zeros(reduced_model)
    return data


def print_model(model: LinearModel, reduced_model: StateSpace, data: dict[str, Any], verbose: bool) -> None:
    """Print the poles, verbose: with their participation, the inputs and outputs, and the state that it is about."""
    from femflex.cli.equilibrium import frame_text, length_lines, print_stability

    numbers = ("real", "imag", "frequency_hz", "damping_ratio")
    heads = ["pole", "real, 1/s", "imaginary, 1/s", "Hz", ("damping ratio", ".4g"), *["participation"] * verbose]
    rows = [
        [pole["name"], *(pole[key] for key in numbers), *[_participation_text(pole)] * verbose]
        for pole in data["poles"][:SHOWN]
    ]
    print_table(heads, rows)
    if len(data["poles"]) > SHOWN:
        print(f"and {len(data['poles']) - SHOWN} poles above, which --json lists\n")
    if "zeros" in data:
        print_table(["zero, real, 1/s", "imaginary, 1/s"], [[f"{z.real:.6g}", z.imag] for z in data["zeros"]])
    print_folded(f"states      {len(reduced_model.states)}, of {len(model.states)}")
    for key in ("inputs", "outputs"):
        names = [entry["name"] for entry in data[key]]
        more_text = f" and {len(names) - SHOWN} more, which --json lists" if len(names) > SHOWN else ""
        print_folded(f"{key:11} {', '.join(names[:SHOWN]) or 'none'}{more_text}")
    hankel = getattr(reduced_model, "hankel", ())
    if len(hankel):
        print(f"error       below {reduced_model.bound:.4g}, as largest singular value")  # type: ignore[attr-defined]
    if model.about is None:
        print_folded(f"about       the state at {model.t:.9g} s")
        return
    print_folded(f"about       {frame_text(model.about)}")
    for line in length_lines(model.about):
        print_folded(line)
    if model.left_out:
        names_text = ", ".join(model.left_out)
        print_folded(f"left out    {names_text}. Time-varying loads are ignored here; --at TIME freezes them")
    print_stability(model.about)


def _participation_text(pole: dict[str, Any]) -> str:
    return ", ".join(f"{name} {100 * share:.0f} %" for name, share in list(pole["participation"].items())[:PARTS])
