"""A column of a CSV file over time, in SI."""

from __future__ import annotations

import csv
import re
from pathlib import Path

from femflex.case.units import to_si


def column_of(path: Path, column: str, unit: str) -> tuple[list[float], list[float]]:
    """Times [s] and a column of a CSV file with a head such as "time [s],azimuth [deg]", in SI.

    Raises ValueError naming the line and column of what cannot be read.
    """
    if not path.is_file():
        raise ValueError(f"found file {path.name!r}, which does not exist beside the case; names are relative to it")
    with open(path, newline="", encoding="utf-8") as file:
        rows = [(k, row) for k, row in enumerate(csv.reader(file), start=1) if row and not row[0].startswith("#")]
    heads = [re.fullmatch(r"\s*(\w+)\s*(?:[\[(](.*)[\])])?\s*", cell) for cell in (rows[0][1] if rows else [])]
    names = [head[1] if head else "" for head in heads]
    for wanted in ("time", column):
        if wanted not in names:
            raise ValueError(f"column {wanted!r} is not in {path.name}; its first line names {names}")
    out = []
    for name, its in (("time", "s"), (column, unit)):
        j = names.index(name)
        head = heads[j]
        factor = to_si(f"1 {(head[2] if head else None) or its}", its)
        out.append([factor * _number(row, j, line, name, path.name) for line, row in rows[1:]])
    return out[0], out[1]


def _number(row: list[str], j: int, line: int, name: str, file: str) -> float:
    try:
        return float(row[j])
    except (ValueError, IndexError):
        found = row[j].strip() if j < len(row) else ""
        raise ValueError(f"line {line} of {file} has {found!r} for {name}; expected a number") from None
