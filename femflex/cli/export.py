"""`femflex export`: a run as the file of another program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.progress import Patience
from femflex.cli.verb import verb


@verb("femflex export orbiter_beam.h5 -o orbiter_beam.glb")
def export(
    file: Annotated[Path, typer.Argument(help="Result file of a run.", show_default=False)],
    channels: Annotated[
        list[str] | None,
        typer.Argument(help="Channels of a table, such as attitude/angles. Default: all.", show_default=False),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="File. Scenes: .glb (glTF), .vtkhdf and .pvd (ParaView). Tables: .csv, .parquet, .mat, .nc. Default: "
            "a .glb file in the folder of the run.",
        ),
    ] = None,
    camera: Annotated[
        str,
        typer.Option("--camera", help="Axes of a scene: auto, fixed, follow, orbital, body or body:NAME."),
    ] = "auto",
    instants: Annotated[
        int, typer.Option("--instants", min=0, help="Instants of a scene, equally spaced. 0: every row of the run.")
    ] = 0,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write a run for other programs: a moving scene for Blender, browsers or ParaView, or a table of channels."""
    from femflex.export import export_run
    from femflex.results import open_run

    target = output or file.with_suffix(".glb")
    with open_run(file) as run, Patience(f"writing {target.name}"):
        lines = export_run(run, target, channels or (), camera, instants, force)
    print(f"export      {target}, {target.stat().st_size / 1e6:.2g} MB")
    for line in lines:
        print(f"            {line}")
