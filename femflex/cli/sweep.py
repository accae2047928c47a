"""`femflex sweep`: many runs of one case with varied values."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.outputs import DIAGRAM_SUFFIXES, PICTURE, outputs
from femflex.cli.progress import Bar
from femflex.cli.tables import print_json, print_table
from femflex.cli.verb import print_error, verb
from femflex.worker_processes import started

if TYPE_CHECKING:
    from femflex.studies.sweep import Sweep

RESULT = "result"
FAILURES = 3  # failed members whose problems are printed


@verb("femflex sweep study.toml -o sweep.h5 -o scatter.png")
def sweep(
    study: Annotated[Path, typer.Argument(help="File of the sweep (TOML).", show_default=False)],
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", help="Results (.h5) or picture (.png, .svg); may be repeated."),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with a sweep that was broken off.")] = False,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Number of processes. Default: one per core.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Address of a Dask scheduler, such as tcp://host:8786.")
    ] = None,
    envelope: Annotated[bool, typer.Option("--envelope", help="Draw histories, not outputs over inputs.")] = False,
    indices: Annotated[
        bool, typer.Option("--indices", help="Draw Sobol indices (design = 'sobol_indices'), not outputs over inputs.")
    ] = False,
    theme: Annotated[str, typer.Option("--theme", help="light or dark.")] = "light",
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print for programs.")] = False,
) -> None:
    """Run a case many times with values from a grid, lists or distributions, on all cores.

    Keeps chosen numbers and histories of every run, and their percentiles. Runs that fail are counted and kept with
    their problem. A sweep that was killed goes on with --resume; its numbers depend neither on that nor on the number
    of workers.
    """
    from femflex.writing import check_destination

    files = outputs(output or (), {RESULT: (".h5",), PICTURE: DIAGRAM_SUFFIXES})
    result = files.get(RESULT, Path(f"{study.stem}.h5"))
    if PICTURE in files:
        check_destination(files[PICTURE], force)
    if scheduler is None and workers != 1:
        started(["femflex.studies.sweep.member"])  # while this process loads the same
    from femflex.studies.sweep import sweep as swept
    from femflex.studies.sweep.sweep import count_of

    try:
        with Bar("sweeping", float(count_of(study)), unit="runs") as bar:
            found = swept(study, result, force=force, resume=resume, workers=workers, scheduler=scheduler, progress=bar)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; femflex sweep {study} -o {result} --resume goes on") from None
    if PICTURE in files:
        draw(found, files[PICTURE], study.stem, (theme, force), "indices" if indices else "envelope" * envelope)
    failed = [(k, text) for k, text in enumerate(found.problems) if text]
    for number, text in failed[:FAILURES]:
        print_error(f"run {number} failed: {text}")
    statistics = found.statistics()
    if as_json:
        print_json({
            "statistics": {name: dict(zip(("mean", "sigma", "run_of_least", "run_of_largest"), row, strict=True))
                           for name, row in statistics.items()},
            "runs": len(found.problems), "failed": [{"run": k, "problem": text} for k, text in failed],
            "inputs": {k: v.tolist() for k, v in found.inputs.items()},
            "outputs": {k: v.tolist() for k, v in found.outputs.items()}, "units": found.units,
            "percentiles": found.percentiles.tolist(),
            "percentiles_of_outputs": {k: v.tolist() for k, v in found.of_outputs().items()},
            "sobol_indices": {k: v.tolist() for k, v in found.sobol.items()},
        })  # fmt: skip
        return
    print_table(
        ["output", "mean", "sigma", *(f"{p:g} %" for p in found.percentiles), "unit"],
        [
            [name, *(f"{v:.6g}" for v in (*statistics.get(name, ())[:2], *row)), found.units.get(name, "")]
            for name, row in found.of_outputs().items()
        ],
    )
    for name, (_, _, *extremes) in statistics.items():
        for what, k in zip(("least", "largest"), extremes, strict=True):
            values = ", ".join(
                f"{key} = {v[k]:.6g} {found.units.get(key, '')}".strip() for key, v in found.inputs.items()
            )
            print(f"{what:11} {name} {found.outputs[name][k]:.6g} {found.units.get(name, '')} in run {k}: {values}")
    for name, shares in found.sobol.items():
        rows = [[key, f"{one:.4g}", f"{total:.4g}"] for key, (one, total) in zip(found.inputs, shares, strict=True)]
        print_table(["value", "first order", "total"], rows, f"share in the variance of {name} (Sobol indices)")
    print(f"runs        {len(found.problems)}, of which {len(failed)} failed")
    print(f"kept        {result}")
    if PICTURE in files:
        print(f"picture     {files[PICTURE]}")


def draw(found: Sweep, path: Path, title: str, how: tuple[str, bool], kind: str) -> None:
    """Draw outputs over inputs, the envelopes of histories, or Sobol indices."""
    from femflex.view.sweep_plots import plot_envelopes, plot_indices, plot_scatter

    theme, force = how
    if kind == "indices":
        plot_indices(list(found.inputs), found.sobol, path, theme, title, force=force)
    elif kind == "envelope":
        bands = found.of_histories()
        plot_envelopes(
            found.time, found.histories, bands, found.percentiles, path, theme, title, force=force, units=found.units
        )
    else:
        plot_scatter(found.inputs, found.outputs, found.units, path, theme, title, force=force)
