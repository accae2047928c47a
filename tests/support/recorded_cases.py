"""What a run of each shipped case warns of, reports and computes, when it was last looked at: files in tests/recorded.

`python tests/recorded_cases.py [CASE ...]` writes them anew; what then changes is to be read before it is kept.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

import femflex
from femflex.results import Run
from support.compared import listed, some_rows

CASES = Path(__file__).parents[2] / "cases"
RECORDS = Path(__file__).parents[1] / "recorded"
BY_SHAPES = re.compile(r"q|u|z|bodies/[^/]+/delta")  # differ by processor where two frequencies of a body are alike


def done(run: Run) -> tuple[dict[str, str], dict[str, Any]]:
    """Every channel of a run in words, and some rows of those that no choice of shapes matters to."""
    words = {
        path: f"[{one.unit}] {one.shape} {', '.join(one.names)} {one.frame}: {one.description}"
        for path, one in sorted(run.channels.items())
    }
    return words, some_rows({path: run[path] for path in words if not BY_SHAPES.fullmatch(path)})


def known(name: str) -> tuple[list[str], dict[str, str], dict[str, Any]]:
    """Warnings, channels in words and numbers of a case, as they were recorded."""
    found = json.loads((RECORDS / f"{name}.json").read_text(encoding="utf-8"))
    return found["said"], found["channels"], {key: np.array(value, float) for key, value in found["numbers"].items()}


def record(name: str) -> None:
    """Writes the record of a case."""
    with warnings.catch_warnings(record=True) as caught, tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("always")
        with femflex.run(CASES / f"{name}.toml", Path(folder) / "run.h5") as run:
            words, numbers = done(run)
    said = sorted(str(one.message) for one in caught)
    rows = [f"{json.dumps(key)}: {listed(value)}" for key, value in numbers.items()]
    parts = [
        '"said": [\n' + ",\n".join(map(json.dumps, said)) + "]",
        '"channels": {\n' + ",\n".join(f"{json.dumps(key)}: {json.dumps(one)}" for key, one in words.items()) + "}",
        '"numbers": {\n' + ",\n".join(rows) + "}",
    ]
    (RECORDS / f"{name}.json").write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    RECORDS.mkdir(exist_ok=True)
    for case in sys.argv[1:] or sorted(path.stem for path in RECORDS.glob("*.json")):
        record(case)
