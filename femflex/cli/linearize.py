"""`femflex linearize`: the linear model of a craft as poles, state space and frequency response."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.advice_lines import print_notes
from femflex.cli.outputs import DIAGRAM_SUFFIXES, PICTURE, outputs
from femflex.cli.progress import Patience
from femflex.cli.tables import print_json, print_table
from femflex.cli.times import read_seconds
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.studies.linear import LinearModel, StateSpace

MODEL = "model"
SHOWN = 24  # poles printed; --json lists all
PARTS = 3  # states named per pole


@verb("femflex linearize cases/panel_slew.toml --outputs bodies/hub/rate:y -o model.mat -o bode.png")
def linearize(
    case: Annotated[Path, typer.Argument(help="Case file (TOML).", show_default=False)],
    inputs: Annotated[
        str | None,
        typer.Option(
            "--inputs",
            help="Inputs, separated by commas, such as loads/slew/torque:y. Default: all loads, motions and commands.",
        ),
    ] = None,
    outputs_wanted: Annotated[
        str | None,
        typer.Option(
            "--outputs", help="Outputs: channels separated by commas, such as bodies/hub/rate:y,attitude/angles."
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option("--at", help="Time at which loads and motions are taken: seconds, or a text such as '2 min'."),
    ] = None,
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
    theme: Annotated[str, typer.Option("--theme", help="light or dark.")] = "light",
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print for programs.")] = False,
) -> None:
    """Make the linear model of a craft: state space with named inputs and outputs, poles, frequency response.

    About the equilibrium nearest to the case's initial state (at rest, in steady spin, in orbit), or about the state of
    a run at a time. Loads that vary do not act in the equilibrium unless --at says when.
    """
    from femflex.writing import check_destination

    files = outputs(output or (), {MODEL: (".mat", ".npz", ".h5"), PICTURE: DIAGRAM_SUFFIXES})
    for path in files.values():
        check_destination(path, force)
    time = read_seconds(at, "--at")
    if run is not None and time is None:
        raise ValueError("--run names a run, whose state at a time is taken; give the time too (--at '3 s')")
    if below is not None and balanced is not None:
        raise ValueError("found --below and --balanced; give one of them")
    with Patience("building bodies and linearising the equations of motion"):
        from femflex.case import read_case
        from femflex.pipeline.balanced import decided_at_rest
        from femflex.studies.linear import balanced_truncation, linear_model, modal_truncation
        from femflex.studies.linear.instant import state_of_run

        read = read_case(case)
        decided = decided_at_rest(read)
        state = None
        if run is not None and time is not None:
            time, state = state_of_run(run, decided.system, time)
        model = linear_model(decided.system, listed(inputs), listed(outputs_wanted), at=time, state=state)
        small: StateSpace = model
        if below is not None:
            small = modal_truncation(model, 6.283185307179586 * below)
        if balanced is not None:
            small = balanced_truncation(model, balanced)
    data = model_data(model, small, zeros)
    made = written(small, files, read.title or case.stem, (theme, force, nichols))
    if as_json:
        print_json(data)
        return
    print(read.title or case.name)
    print_notes(decided.notes)
    print_model(model, small, data)
    for kind, path in made:
        print(f"{kind:11} {path}")


def listed(text: str | None) -> list[str] | None:
    """The words of a list with commas.

    >>> listed("a, b")
    ['a', 'b']
    """
    return None if text is None else [word.strip() for word in text.split(",") if word.strip()]


def written(
    small: StateSpace, files: dict[str, Path], title: str, how: tuple[str, bool, bool]
) -> list[tuple[str, Path]]:
    """Write the requested files: kind and path of each."""
    from femflex.studies.linear import save_model
    from femflex.studies.linear.grid import response_grid
    from femflex.view.bode import plot_bode, plot_nichols

    theme, force, nichols = how
    made = []
    if MODEL in files:
        made.append((MODEL, save_model(small, files[MODEL], force)))
    if PICTURE in files:
        omega = response_grid(small)
        G = small.frequency_response(omega)
        pairs = {
            f"{out} / {into}": G[:, o, i]
            for i, (into, _) in enumerate(small.inputs)
            for o, (out, _) in enumerate(small.outputs)
        }
        if nichols:
            made.append((PICTURE, plot_nichols(pairs, files[PICTURE], theme, title, force=force)))
        else:
            made.append((PICTURE, plot_bode(omega, pairs, files[PICTURE], theme, title, force=force)))
    return made


def model_data(model: LinearModel, small: StateSpace, zeros: bool) -> dict[str, Any]:
    """What --json prints."""
    from femflex.studies.linear import poles_of, transmission_zeros

    found: dict[str, Any] = {
        "states": [name for name, _ in small.states],
        "inputs": [{"name": name, "unit": unit} for name, unit in small.inputs],
        "outputs": [{"name": name, "unit": unit} for name, unit in small.outputs],
        "about": "an instant of a motion" if model.about is None else "equilibrium",
        "left_out": list(model.left_out),
        "poles": [pole.to_dict() for pole in poles_of(small)],
        **{key: getattr(small, key).tolist() for key in "ABCD"},
    }
    if zeros:
        found["zeros"] = [[float(z.real), float(z.imag)] for z in transmission_zeros(small)]
    return found


def print_model(model: LinearModel, small: StateSpace, data: dict[str, Any]) -> None:
    """Print the poles, the inputs and outputs, and what the model is about."""
    from femflex.cli.equilibrium import frame_text, length_lines, print_stability

    rows = [
        [
            pole["name"], f"{pole['real']:.6g}", f"{pole['imag']:.6g}", f"{pole['frequency_hz']:.6g}",
            f"{pole['damping_ratio']:.4g}",
            ", ".join(f"{name} {100 * part:.0f} %" for name, part in list(pole["participation"].items())[:PARTS]),
        ]
        for pole in data["poles"][:SHOWN]
    ]  # fmt: skip
    print_table(["pole", "real, 1/s", "imaginary, 1/s", "Hz", "damping ratio", "participation"], rows)
    if len(data["poles"]) > SHOWN:
        print(f"and {len(data['poles']) - SHOWN} poles above, which --json lists\n")
    if "zeros" in data:
        print_table(["zero, real, 1/s", "imaginary, 1/s"], [[f"{re:.6g}", f"{im:.6g}"] for re, im in data["zeros"]])
    print(f"states      {len(small.states)}, of {len(model.states)}")
    for key in ("inputs", "outputs"):
        names = [one["name"] for one in data[key]]
        more = f" and {len(names) - SHOWN} more, which --json lists" if len(names) > SHOWN else ""
        print(f"{key:11} {', '.join(names[:SHOWN]) or 'none'}{more}")
    hankel = getattr(small, "hankel", ())
    if len(hankel):
        print(f"error       below {small.bound:.4g}, as largest singular value")  # type: ignore[attr-defined]
    if model.about is None:
        print(f"about       the state at {model.t:.9g} s")
        return
    print(f"about       {frame_text(model.about)}")
    for line in length_lines(model.about):
        print(line)
    if model.left_out:
        print(f"left out    {', '.join(model.left_out)}. Time-varying loads are ignored here; --at TIME freezes them")
    print_stability(model.about)
