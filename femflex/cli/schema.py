"""`femflex schema`: the JSON Schema of case files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.verb import verb


@verb("femflex schema -o case.schema.json")
def schema(
    output: Annotated[Path | None, typer.Option("-o", "--output", help="JSON file. Default: standard output.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Print the JSON Schema of case files; `unit` names the SI unit of plain numbers."""
    from femflex.case.schema import json_schema

    text = json.dumps(json_schema(), indent=1)
    if output is None:
        print(text)
        return
    from femflex.writing import atomic_file

    with atomic_file(output, force) as part:
        part.write_text(text + "\n", encoding="utf-8")
    print(f"schema      {output}")
