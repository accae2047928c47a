"""Loads over time from CSV files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.noun.problems import suggestion_text
from femflex.noun.units import UnitError, to_si
from femflex.noun.values import counted_noun
from femflex.system.columns import HEAD, csv_rows, finite

COLUMNS = {"time": "s", **dict.fromkeys(("fx", "fy", "fz"), "N"), **dict.fromkeys(("tx", "ty", "tz"), "N m")}


def read_load_file(path: Path) -> tuple[Array, Array, Array]:
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
        match = HEAD.fullmatch(cell)
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
