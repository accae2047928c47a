"""JSON Schema of the case file."""

from __future__ import annotations

import json
from typing import Any

from femflex.case.case import case_class


def json_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of a case; `unit` next to a value names the SI unit of plain numbers."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "femflex case"}
    return {**case_class().model_json_schema(), **head}


def schema_text() -> str:
    """The schema as the text of a file, always the same for the same keys."""
    return json.dumps(json_schema(), separators=(",", ":"), sort_keys=True) + "\n"
