"""`femflex new`: a commented case to start from."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.verb import verb


@verb("femflex new my_craft.toml --mesh boom.msh")
def new(
    name: Annotated[Path, typer.Argument(help="Case file to write, such as my_craft.toml.", show_default=False)],
    mesh: Annotated[
        Path | None, typer.Option("--mesh", help="Mesh of the flexible body. Default: a boom from beam theory.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing case.")] = False,
) -> None:
    """Write a commented case to start from, and the schema by which editors complete and check its keys."""
    from femflex.case.schema import schema_text
    from femflex.case.starting_case import starting_case
    from femflex.results.destination import check_destination
    from femflex.view.output import placed

    target = name if name.suffix else name.with_suffix(".toml")
    if target.suffix != ".toml":
        raise ValueError(f"{target.name}: found the suffix {target.suffix!r}; a case ends in .toml")
    check_destination(target, force)
    found, file = None, ""
    if mesh is not None:
        from femflex.mesh import read_mesh

        found, file = read_mesh(mesh), Path(os.path.relpath(mesh, target.parent)).as_posix()
    schema = target.with_name("case.schema.json")
    text, notes = starting_case(target.name, found, file, schema.name)
    with placed(target, force) as part:
        part.write_text(text, encoding="utf-8")
    print(f"case        {target}")
    if not schema.exists():
        with placed(schema) as part:
            part.write_text(schema_text(), encoding="utf-8")
        print(f"schema      {schema}, for editors")
    for note in notes:
        print(f"look at     {note}")
    print(f"next        femflex check {target}")
