"""`femflex sweep`: many runs of one case with varied values."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.interrupt import name_continuation
from femflex.cli.options import DIAGRAM_SUFFIXES, PAGE_SUFFIXES, PICTURE, REPORT, Force, Json, Theme, outputs
from femflex.cli.progress import Bar
from femflex.cli.tables import print_line, print_table, printed, record
from femflex.cli.verb import print_error, verb
from femflex.worker_processes import worker_context

if TYPE_CHECKING:
    from femflex.studies.sweep import Sweep
    from femflex.view.plot import PlotOptions

RESULT = "result"
FAILURES = 3  # failed members whose problems are printed


@verb("femflex sweep study.toml -o sweep.h5 -o scatter.png")
def sweep(
    study: Annotated[Path, typer.Argument(help="File of the sweep (TOML).", show_default=False)],
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", help="Results (.h5), picture (.png, .svg) or page (.html); may be repeated."),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with a sweep that was broken off.")] = False,
    workers: Annotated[int | None, typer.Option(min=1, help="Number of processes. Default: one per core.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler, such as tcp://host:8786.")] = None,
    envelope: Annotated[bool, typer.Option("--envelope", help="Draw histories, not outputs over inputs.")] = False,
    indices: Annotated[
        bool, typer.Option("--indices", help="Draw Sobol indices (design = 'sobol_indices'), not outputs over inputs.")
    ] = False,
    theme: Theme = "light",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Run a case many times with values from a grid, lists or distributions, on all cores.

    Keeps chosen numbers and histories of every run, and their percentiles. Runs that fail are counted and kept with
    their problem. A sweep that was killed goes on with --resume; its numbers depend neither on that nor on the number
    of workers.
    """
    kinds = {RESULT: (".h5",), PICTURE: DIAGRAM_SUFFIXES, REPORT: PAGE_SUFFIXES}
    files = outputs(output, kinds, force, theme, kept=(RESULT,))
    result = files.get(RESULT, Path(f"{study.stem}.h5"))
    if scheduler is None and workers != 1:
        worker_context(["femflex.studies.sweep.member"])  # while this process loads the same
    from femflex.studies.sweep import sweep as run_sweep
    from femflex.studies.sweep.sweep import count_of

    name_continuation(f"femflex sweep {quote(str(study))} -o {quote(str(result))} --resume")
    try:
        with Bar("sweeping", float(count_of(study)), unit="runs") as bar:
            results = run_sweep(
                study, result, force=force, resume=resume, workers=workers, scheduler=scheduler, progress=bar
            )
    finally:
        name_continuation("")
    if PICTURE in files:
        draw_sweep(results, files[PICTURE], study.stem, (theme, force), "indices" if indices else "envelope" * envelope)
    if REPORT in files:
        from femflex.report.studies import write_sweep_report

        write_sweep_report(results, study.stem, files[REPORT], force)
    failed = [(k, text) for k, text in enumerate(results.problems) if text]
    for number, text in failed[:FAILURES]:
        print_error(f"run {number} failed: {text}")
    with printed(as_json):
        print_results(results)
        print_line("runs", f"{len(results.problems)}, of which {len(failed)} failed", len(results.problems))
        record("failed", [{"run": k, "problem": text} for k, text in failed])
        print_line("kept", result)
        for kind in (PICTURE, REPORT):
            if kind in files:
                print_line(kind, files[kind])


def print_results(results: Sweep) -> None:
    """Print mean, deviation and percentiles of every output, the runs of its extremes, and the Sobol indices."""
    statistics = results.statistics()
    percentiles = [f"{p:g} %" for p in results.percentiles]
    rows = [
        [name, *statistics.get(name, (None, None))[:2], *row, results.units.get(name, "")]
        for name, row in results.output_percentiles().items()
    ]
    print_table(["output", "mean", "sigma", *percentiles, "unit"], rows, name="statistics")
    record("inputs", results.inputs)
    record("outputs", results.outputs)
    for name, (_, _, *extremes) in statistics.items():
        for head, k in zip(("least", "largest"), extremes, strict=True):
            values = ", ".join(
                f"{key} = {v[k]:.6g} {results.units.get(key, '')}".strip() for key, v in results.inputs.items()
            )
            text = f"{name} {results.outputs[name][k]:.6g} {results.units.get(name, '')} in run {k}: {values}"
            print_line(head, text, [{"output": name, "run": k}])
    for name, shares in results.sobol.items():
        rows = [[key, *share] for key, share in zip(results.inputs, shares, strict=True)]
        heads = ["value", ("first order", ".4g"), ("total", ".4g")]
        print_table(heads, rows, f"share in the variance of {name} (Sobol indices)")


def draw_sweep(results: Sweep, path: Path, title: str, style: tuple[str, bool], kind: str) -> None:
    """Draw outputs over inputs, the envelopes of histories, or Sobol indices."""
    from femflex.view.convergence import plot_envelopes, plot_indices, plot_scatter

    theme, force = style
    options: PlotOptions = {"theme": theme, "title": title, "force": force}
    if kind == "indices":
        plot_indices(list(results.inputs), results.sobol, path, **options)
    elif kind == "envelope":
        bands = results.history_percentiles()
        values = results.time, results.histories, bands, results.percentiles
        plot_envelopes(*values, path, units=results.units, **options)
    else:
        plot_scatter(results.inputs, results.outputs, results.units, path, **options)
