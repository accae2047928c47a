"""JSON Schema of the case file."""

from __future__ import annotations

import json
from typing import Any

from femflex.case.case import case_class

UNNAMED_KIND = "isotropic"  # the one that cases may leave out


def json_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of a case; `unit` next to a value names the SI unit of plain numbers."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "femflex case"}
    schema = case_class().model_json_schema()
    for table in schema["$defs"].values():
        kind = table["properties"].get("kind", {}) if "properties" in table else {}
        if "const" in kind and kind.get("default", UNNAMED_KIND) != UNNAMED_KIND:
            del kind["default"]  # of the object in Python; a case tells the tables of a heading apart by it
            table["required"] = ["kind", *table.get("required", ())]
    return {**schema, **head}


def schema_text() -> str:
    """The schema as the text of a file, always the same for the same keys."""
    return json.dumps(json_schema(), separators=(",", ":"), sort_keys=True) + "\n"
