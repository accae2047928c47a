"""`femflex budget`: torques, momentum and forces on a craft by source."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.options import Force, Json, MovedCase, Plot, Theme
from femflex.cli.progress import Bar, Patience
from femflex.cli.tables import print_line, print_table, printed
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.results import Run
    from femflex.studies.torque_budget import TorqueBudget


@verb("femflex budget cases/geostationary_momentum.toml -o budget.png")
def budget(
    file: Annotated[Path, typer.Argument(help="Case file, which is run, or result file of a run.", show_default=False)],
    output: Plot = None,
    case: MovedCase = None,
    theme: Theme = "light",
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Print the torque budget of a craft: gravity gradient, sunlight, air, field, loads and thrusters, and their sum.

    For each source: the mean torque over whole orbits in the axes of the root body, about the craft's centre of mass,
    the largest torque, the momentum that stays from orbit to orbit and the part that a wheel must store, the force,
    and what the deformation of the craft changes.
    """
    from femflex.pipeline import rebuilt
    from femflex.studies.torque_budget import torque_budget
    from femflex.writing import check_destination

    if output is not None:
        check_destination(output, force)
    with ExitStack() as stack:
        run = stack.enter_context(_run_of(file, stack))
        with Patience("building the model again from the case text") as say:
            model = rebuilt(run, case)
            say("evaluating the terms")
            body = f"bodies/{model.system.root}"
            needed = [f"{body}/attitude", f"{body}/position", "monitors/center_of_mass"]
            needed += [path for path in run if path.startswith("effectors/") and path.endswith("/force")]
            result = torque_budget(model, run.time, run.states(), {path: run[path] for path in needed})
        if output is not None:
            from femflex.view.terms import plot_budget

            torques = {source.name: source.torque for source in result.sources}
            plot_budget(run, result.time, torques, result.sources[-1].momentum, output, theme=theme, force=force)
        with printed(as_json):
            print_budget(result)
            if output is not None:
                print_line("picture", output)


def _run_of(file: Path, stack: ExitStack) -> Run:
    """The run of a result file, or that of a case, which is made in a folder for the time being."""
    from femflex import pipeline
    from femflex.results import open_run

    if file.suffix != ".toml":
        return open_run(file)
    folder = stack.enter_context(tempfile.TemporaryDirectory())
    path = Path(folder) / "budget.h5"
    with Patience("building bodies and reading the compiled equations of motion"):
        prepared = pipeline.prepare(file, path)
    with Bar("run", float(prepared.times[-1])) as bar:
        pipeline.integrate(prepared, path, progress=bar)
    return open_run(path)


def print_budget(result: TorqueBudget) -> None:
    """Print the table of a budget."""
    import numpy as np

    covered = f"{result.orbits:g} orbit{'s' if result.orbits != 1 else ''}"
    if not result.in_orbit:
        covered = "the whole run in place of an orbit"
    if not result.whole:
        covered += ", less than one: means and momentum are those of this part"
    span = f"{result.time[0]:g} to {result.time[-1]:g} s"
    print_line("budget", f"{span}, {covered}; about the centre of mass, body axes")
    heads = ["mean x, N m", "mean y, N m", "mean z, N m", "largest, N m", "secular per orbit, N m s", "cyclic, N m s"]
    rows = [
        (
            source.name, *source.mean, source.largest, np.linalg.norm(result.secular(source)), result.cyclic(source),
            source.mean_force, source.deformation,
        )
        for source in result.sources
    ]  # fmt: skip
    print_table(["source", *((head, ".3e") for head in (*heads, "mean force, N", "by deformation, N m"))], rows)
