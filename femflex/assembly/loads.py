"""Build the loads of a case: constant, or from inline tables or CSV files."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.case.case import Case
from femflex.case.load import LoadTable
from femflex.noun.problems import CaseError, Problem, suggestion_text
from femflex.noun.units import UnitError, to_si
from femflex.noun.values import counted_noun
from femflex.system import Load
from femflex.system.columns import csv_rows, finite

COLUMNS = {"time": "s", **dict.fromkeys(("fx", "fy", "fz"), "N"), **dict.fromkeys(("tx", "ty", "tz"), "N m")}


def build_loads(case: Case) -> tuple[Load, ...]:
    """The loads of a case. Raises CaseError with the problems of its CSV files."""
    problems: list[Problem] = []
    loads = []
    for table in case.loads:
        try:
            loads.append(build_load(case, table))
        except (ValueError, OSError) as error:
            problems.append(Problem(f"loads[{table.name}]", str(error)))
    if problems:
        raise CaseError(case.path.name, problems)
    return tuple(loads)


def build_load(case: Case, table: LoadTable) -> Load:
    """The load of a table. Raises ValueError if its CSV file cannot be read."""
    where: dict[str, Any] = {"name": table.name, "body": table.body, "marker": table.marker, "frame": table.frame}
    if table.table is not None:
        times, force, torque = read_load_table(case.file_path(table.table))
        return Load(times=times, force=force, torque=torque, **where)
    shape = (3,) if table.times is None else (len(table.times), 3)
    force, torque = (np.zeros(shape) if v is None else np.array(v, float) for v in (table.force, table.torque))
    return Load(times=None if table.times is None else np.array(table.times), force=force, torque=torque, **where)


def read_load_table(path: Path) -> tuple[Array, Array, Array]:
    """Times (n,) [s], forces (n, 3) [N] and torques (n, 3) [N m] of a CSV file with a head like "time [s],tz [N m]".

    Raises ValueError with the line and column of an entry that cannot be read.
    """
    rows = csv_rows(path)
    if not rows:
        raise ValueError(f"{path.name} is empty; its first line names the columns, such as time [s],tz [N m]")
    names, factors = _column_names(rows[0][1], path.name)
    values = np.array([_row_values(row, names, k, path.name) for k, row in rows[1:]]).reshape(-1, len(names)) * factors
    column = dict(zip(names, values.T, strict=True))
    times = column["time"]
    if len(times) < 2:
        raise ValueError(
            f"{path.name} holds {counted_noun(len(times), 'row', 'rows')} of numbers; a table needs at least two"
        )
    falls = np.flatnonzero(np.diff(times) < 0)
    if len(falls):
        k = falls[0]
        raise ValueError(
            f"line {rows[k + 2][0]} of {path.name} has time {times[k + 1]:g} s after {times[k]:g} s; times must "
            f"not decrease"
        )
    zero = np.zeros(len(times))
    force, torque = (np.stack([column.get(f"{kind}{axis}", zero) for axis in "xyz"], axis=1) for kind in "ft")
    return times, force, torque


def _column_names(cells: list[str], file: str) -> tuple[list[str], Array]:
    names, factors = [], []
    for cell in cells:
        match = re.fullmatch(r"\s*(\w+)\s*(?:[\[(](.*)[\])])?\s*", cell)
        name = match[1].lower() if match else cell.strip()
        if match is None or name not in COLUMNS:
            raise ValueError(f"column {cell.strip()!r} of {file} is not known; {suggestion_text(name, COLUMNS)}")
        if name in names:
            raise ValueError(f"column {name!r} stands twice in {file}")
        try:
            factors.append(to_si(f"1 {match[2] or COLUMNS[name]}", COLUMNS[name]))
        except UnitError as error:
            raise ValueError(f"column {name!r} of {file}: {error}") from None
        names.append(name)
    if "time" not in names or len(names) < 2:
        raise ValueError(f"{file} has the columns {names}; it needs time and at least one of fx, fy, fz, tx, ty, tz")
    return names, np.array(factors)


def _row_values(cells: list[str], names: list[str], line: int, file: str) -> list[float]:
    if len(cells) != len(names):
        raise ValueError(
            f"line {line} of {file} has {counted_noun(len(cells), 'entry', 'entries')}; its head names "
            f"{len(names)} columns"
        )
    return [finite(cell, name, line, file) for cell, name in zip(cells, names, strict=True)]
