"""A column of a CSV file over time, in SI."""

from __future__ import annotations

import csv
import os
import re
from pathlib import Path

from femflex.noun.units import to_si
from femflex.noun.values import ValueProblem, check_magnitude

HEAD = re.compile(r"\s*(\w+)\s*(?:[\[(](.*)[\])])?\s*")  # of a column: its name and unit


def column_of(path: Path, column: str, unit: str) -> tuple[list[float], list[float]]:
    """Times [s] and a column of a CSV file with a head such as "time [s],azimuth [deg]", in SI.

    Raises ValueError that names the line and column of an invalid cell.
    """
    if not os.path.isfile(path):  # not of a name too long, either
        raise ValueError(f"found file {path.name!r}, which does not exist; names are relative to the case file")
    rows = csv_rows(path)
    heads = [HEAD.fullmatch(cell) for cell in (rows[0][1] if rows else [])]
    names = [head[1] if head else "" for head in heads]
    for required in ("time", column):
        if required not in names:
            raise ValueError(f"column {required!r} is not in {path.name}; its first line names {names}")
    out = []
    for name, si_unit in (("time", "s"), (column, unit)):
        j = names.index(name)
        head = heads[j]
        factor = to_si(f"1 {(head[2] if head else None) or si_unit}", si_unit)
        out.append([factor * _number(row, j, line, name, path.name) for line, row in rows[1:]])
    return out[0], out[1]


def csv_rows(path: Path) -> list[tuple[int, list[str]]]:
    """Line numbers and cells of the lines of a CSV file that are neither empty nor comments.

    Raises ValueError for a file that is no text.
    """
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            rows = list(enumerate(csv.reader(file), start=1))
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path.name} is no CSV file in UTF-8 ({error})") from None
    return [(k, row) for k, row in rows if row and not row[0].lstrip().startswith("#")]


def finite(text: str, name: str, line: int, file: str) -> float:
    """The finite number in a cell of the column of that name; ValueError with the line for anything else."""
    try:
        number = float(text)
    except ValueError:
        raise ValueError(f"line {line} of {file} has {text.strip()[:60]!r} for {name}; expected a number") from None
    try:
        check_magnitude(number)
    except ValueProblem as problem:
        allowed = str(problem).partition("; ")[2]
        raise ValueError(f"line {line} of {file} has {text.strip()[:60]} for {name}; {allowed}") from None
    return number


def _number(row: list[str], j: int, line: int, name: str, file: str) -> float:
    return finite(row[j] if j < len(row) else "", name, line, file)
