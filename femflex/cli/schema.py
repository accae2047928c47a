"""`femflex schema`: the JSON Schema of case files."""

from __future__ import annotations

from femflex.cli.tables import print_json
from femflex.cli.verb import verb


@verb("femflex schema > case.schema.json")
def schema() -> None:
    """Print the JSON Schema of case files; `unit` names the SI unit of plain numbers."""
    from femflex.case.schema import json_schema

    print_json(json_schema())
