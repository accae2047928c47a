"""`femflex examples`: the cases that come with femflex."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.tables import print_folded, print_table
from femflex.cli.verb import verb


@verb("femflex examples panel_slew -o my_cases")
def examples(
    names: Annotated[
        list[str] | None, typer.Argument(help="Names of cases. Default: all of them.", show_default=False)
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder to copy cases and meshes to. Default: list them.")
    ] = None,
) -> None:
    """List the cases that come with femflex, or copy them with their meshes. Files that are there stay as they are."""
    from femflex.cli.shipped import copy_cases, files_of, shipped_cases

    titles = shipped_cases()
    chosen = list(dict.fromkeys(names or titles))
    for name in chosen:
        next(files_of(name))  # one that is not known is reported before anything is copied
    if output is None:
        print_table(["case", "title"], [(name, titles[name]) for name in chosen])
        print_folded(
            "next        femflex examples NAME -o FOLDER copies a case with its mesh; without names, all of them"
        )
        return
    copies = copy_cases(chosen, output)
    print(f"copied      {len(copies)} case{'s' * (len(copies) != 1)} to {output}")
    print(f"next        femflex run {copies[0]}")
