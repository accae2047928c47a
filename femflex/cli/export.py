"""`femflex export`: a run, or a craft to be stepped, as the file of another program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.options import Force, MovedCase, RunFile, SceneCamera, split_names
from femflex.cli.progress import Patience
from femflex.cli.verb import verb

FMU = ".fmu"


@verb("femflex export orbiter_beam.h5 -o orbiter_beam.glb")
def export(
    file: Annotated[
        Path, typer.Argument(help="Result file of a run; of an FMU the case file (TOML).", show_default=False)
    ],
    channels: Annotated[
        list[str] | None,
        typer.Argument(
            help="Channels of a table or an FMU, such as attitude/angles. Default: all; of an FMU the usual ones.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="File. Scenes: .glb (glTF), .vtkhdf and .pvd (ParaView). Tables: .csv, .parquet, .mat, .nc. "
            "Ephemerides of CCSDS: .oem, .aem. "
            "Craft for co-simulation: .fmu (FMI 3.0). Default: a .glb file in the folder of the run.",
        ),
    ] = None,
    camera: SceneCamera = "auto",
    instants: Annotated[
        int, typer.Option(min=0, help="Instants of a scene, equally spaced. 0: every row of the run.")
    ] = 0,
    inputs: Annotated[
        str | None,
        typer.Option(
            help="Inputs of an FMU, separated by commas, beside those of the case. Default: its loads and signals."
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Write a run for other programs: a moving scene for Blender, browsers or ParaView, or a table of channels.

    A case becomes an FMU, which other programs step; linearize writes its linear model as one without Python.
    """
    from femflex.export import export_run
    from femflex.results import open_run

    target = output or file.with_suffix(FMU if file.suffix.lower() == ".toml" else ".glb")
    if target.suffix.lower() == FMU:
        if camera != "auto" or instants:
            raise ValueError(f"{target.name} is a craft to be stepped; --camera and --instants are of scenes")
        _export_craft(file, target, inputs, channels, force)
        return
    if inputs is not None:
        raise ValueError(f"--inputs are of FMUs, and {target.name} is none")
    with open_run(file) as run, Patience(f"writing {target.name}"):
        lines = export_run(run, target, channels or (), camera, instants, force)
    print(f"export      {target}, {target.stat().st_size / 1e6:.2g} MB")
    for line in lines:
        print(f"            {line}")


def _export_craft(file: Path, target: Path, inputs: str | None, channels: list[str] | None, force: bool) -> None:
    """Write the craft of a case as an FMU."""
    from femflex.export.fmi import write_craft_fmu

    with Patience("building the craft"):
        lines = write_craft_fmu(
            file, target, None if inputs is None else split_names([inputs]), channels or None, force
        )
    print(f"export      {target}, {target.stat().st_size / 1e6:.2g} MB")
    for line in lines:
        print(f"            {line}")


@verb("femflex report orbiter_beam.h5 -o orbiter_beam.html")
def report(
    file: RunFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="HTML file. Default: in the folder of the run.")
    ] = None,
    case: MovedCase = None,
    camera: SceneCamera = "auto",
    force: Force = False,
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
