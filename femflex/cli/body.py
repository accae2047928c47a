"""`femflex body`: a reduced body to a file that cases can use instead of a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.options import CaseFile, Force
from femflex.cli.progress import Patience
from femflex.cli.verb import verb

MODELS = (".npz", ".mat", ".op4", ".bdf", ".pch", ".dmig")  # suffixes of models for other programs


@verb("femflex body cases/orbiter_beam.toml beam -o beam.h5")
def body(
    case: CaseFile,
    name: Annotated[str, typer.Argument(help="Name of the body in the case.", show_default=False)],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Body file; for other programs .SID_FEM (SIMPACK), .fem (MBDyn), .exudyn.npz. Default: NAME.h5.",
        ),
    ] = None,
    number: Annotated[
        int | None, typer.Option("-n", "--number", min=1, help="Number of modes. Default: that of the case.")
    ] = None,
    interface: Annotated[
        list[str] | None,
        typer.Option(
            help="Marker that is an interface of a Craig-Bampton model, written to .npz, .h5, .mat, .op4 or .bdf; "
            "may be repeated."
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Reduce one body of a case and save it; a case uses it with kind = "file".

    With --interface it is written as a Craig-Bampton model for other programs, and used with kind = "matrices".
    Files of other multibody programs have all markers as nodes.
    """
    from femflex.export.multibody import body_writer
    from femflex.writing import check_destination

    target = output or Path(f"{name}.npz" if interface else f"{name}.h5")
    writer = body_writer(target)
    if interface and writer is not None:
        raise ValueError(f"{target} has all markers as its nodes; leave --interface out")
    if not interface and writer is None and target.suffix.lower() in MODELS:
        raise ValueError(
            f"{target} would be a Craig-Bampton model, which needs interfaces: --interface MARKER; a body file for "
            "femflex is .h5"
        )
    check_destination(target, force)
    with Patience("reducing the body"):
        from femflex.case import read_case
        from femflex.case.named_files import check_no_input
        from femflex.pipeline.case_bodies import advised_bodies
        from femflex.reduction import save_body

        parsed_case = read_case(case)
        check_no_input(parsed_case, target)
        bodies, notes = advised_bodies(parsed_case, [name], modes=number)
        reduced = bodies[name]
        if interface:
            from femflex.matrices import craig_bampton_model, write_matrices

            model = craig_bampton_model(reduced, interface, name)
            write_matrices(model, target, force=force)
        elif writer is not None:
            lines = writer(reduced, target, name, force)
        else:
            save_body(target, reduced, force=force)
    if interface:
        print(
            f"{target}: Craig-Bampton model of {reduced.moments.mass:.6g} kg, {model.n_dof - model.n_modal} interface "
            f"and {model.n_modal} modal coordinates, interfaces {', '.join(interface)}; SI"
        )
        return
    if writer is not None:
        print("\n".join([f"{target}: {lines[0]}", *lines[1:]]))
        return
    print(
        f"{target}: {reduced.moments.mass:.6g} kg, {reduced.n_modes} elastic coordinates, "
        f"{reduced.strain_form} strain, markers {', '.join(sorted(reduced.markers))}"
    )
    if name in notes:
        print(notes[name])
