"""`femflex report`: a run as one page for a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.progress import Patience
from femflex.cli.verb import verb


@verb("femflex report orbiter_beam.h5 -o orbiter_beam.html")
def report(
    file: Annotated[Path, typer.Argument(help="Result file of a run.", show_default=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="HTML file. Default: in the folder of the run.")
    ] = None,
    case: Annotated[
        Path | None, typer.Option("--case", help="Where the case file of the run is now, if it has moved.")
    ] = None,
    camera: Annotated[
        str, typer.Option("--camera", help="Axes of the scene: auto, fixed, follow, orbital, body or body:NAME.")
    ] = "auto",
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write a run as one HTML page, which opens without network: craft in motion, plots, modes, energy, case.

    The page has everything in it: it can be sent by mail and opened from a disk.
    """
    from femflex.report.run import write_run_report
    from femflex.results import open_run
    from femflex.writing import check_destination

    target = output or file.with_suffix(".html")
    if target.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"-o {target}: a report is a page for browsers; give a name that ends in .html")
    check_destination(target, force)
    with open_run(file) as run, Patience("drawing the bodies") as say:
        lines = write_run_report(run, target, case, camera, force, say)
    print(f"report      {target}, {lines[0]}")
