"""Printing: tables whose rows are data, lines and JSON on standard output, and the same rows as CSV files."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any

WIDTH = 80  # columns where standard output is no terminal, and the least width of one
GAP = 2  # spaces between columns
NUMERIC = tuple("0123456789+-.")  # what cells of a column of numbers begin with

Head = str | Sequence[str]  # of a column: its name, or the name and the format of its numbers (.6g where it has none)


def print_table(heads: Sequence[Head], rows: Iterable[Sequence[Any]], title: str = "", keys: int = 1) -> None:
    """Print a table: text to the left, numbers to the right, nothing for None and nan; "<" is the format of texts.

    A table that is wider than the terminal is folded: its columns follow in several tables one below the other, each
    with the first `keys` columns.
    """
    names, formats = zip(*((head, ".6g") if isinstance(head, str) else head for head in heads), strict=True)
    cells = [[cell_text(value, form) for value, form in zip(row, formats, strict=True)] for row in rows]
    is_left = [
        k == 0 or form == "<" or not any(row[k][:1] in NUMERIC for row in cells) for k, form in enumerate(formats)
    ]
    widths = [max(len(row[k]) for row in (names, *cells)) for k in range(len(names))]
    lines = [title] * bool(title)
    for group in folded_columns(widths, keys, screen_width()):
        aligned = (
            "  ".join(row[k].ljust(widths[k]) if is_left[k] else row[k].rjust(widths[k]) for k in group).rstrip()
            for row in (names, *cells)
        )
        lines += [next(aligned), "─" * _table_width(widths, group), *aligned, ""]
    print("\n".join(lines))


def cell_text(value: Any, form: str = ".6g") -> str:
    """The text of a cell: a number in the format of its column, nothing for None and nan.

    >>> cell_text(1234.5678), cell_text(3), cell_text(float("nan")), cell_text("flap 1"), cell_text(0.25, ".0%")
    ('1234.57', '3', '', 'flap 1', '25%')
    """
    if value is None or isinstance(value, str):
        return value or ""
    if isinstance(value, int) or (hasattr(value, "dtype") and value.dtype.kind in "iu"):
        return str(value)
    return "" if math.isnan(value) else f"{value:{form}}"


def folded_columns(widths: Sequence[int], keys: int, width: int) -> list[list[int]]:
    """Numbers of the columns of each table that a table of these widths (n,) is folded into.

    Columns are spread evenly over as few tables as will do, or else fill one table after the other.

    >>> folded_columns([4, 30, 30, 30, 30], 1, 80), folded_columns([4, 10, 10, 10, 70], 1, 80)
    ([[0, 1, 2], [0, 3, 4]], [[0, 1, 2, 3], [0, 4]])
    """
    key_columns, value_columns = list(range(keys)), list(range(keys, len(widths)))
    packed = [list(key_columns)]
    for k in value_columns:
        if len(packed[-1]) > keys and _table_width(widths, [*packed[-1], k]) > width:
            packed.append(list(key_columns))
        packed[-1].append(k)
    for count in range(1, len(packed) + 1) if value_columns else ():
        size = -(-len(value_columns) // count)
        groups = [key_columns + value_columns[k : k + size] for k in range(0, len(value_columns), size)]
        if all(_table_width(widths, group) <= width for group in groups):
            return groups
    return packed


def _table_width(widths: Sequence[int], group: Sequence[int]) -> int:
    return sum(widths[k] for k in group) + GAP * (len(group) - 1)


def print_folded(text: str) -> None:
    """Print lines, those that are wider than the terminal folded under the text behind their first word."""
    print("\n".join(piece for line in text.split("\n") for piece in folded_line(line, screen_width())))


def print_line(label: str, text: object) -> None:
    """Print a line of the report of a verb: a word and what it is about, folded where it is wider than the terminal."""
    print_folded(f"{label:11} {text}")


def folded_line(line: str, width: int) -> list[str]:
    """Split a line into parts of at most `width` columns; longer words are kept whole.

    >>> folded_line("note      one two three", 20)
    ['note      one two', '          three']
    """
    if len(line) <= width:
        return [line]
    label = re.match(r"\s*\S.*?\s{2,}", line)
    indent = " " * (len(label[0]) if label and len(label[0]) <= width / 2 else 4)
    return wrap(line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def screen_width() -> int:
    """Number of columns that a table may have."""
    import shutil
    import sys

    return max(shutil.get_terminal_size((WIDTH, 24)).columns, 40) if sys.stdout.isatty() else WIDTH


def plain_data(value: Any) -> Any:
    """Data as JSON has it: arrays as lists, complex numbers as pairs, numbers that are not finite as None."""
    if isinstance(value, dict):
        return {str(key): plain_data(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain_data(entry) for entry in value]
    if hasattr(value, "tolist"):
        return plain_data(value.tolist())
    if isinstance(value, complex):
        return [value.real, value.imag]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_json(data: Any) -> None:
    """Print data as JSON."""
    import json

    print(json.dumps(plain_data(data), indent=1))


def write_csv(path: Path, heads: Sequence[str], rows: Iterable[Sequence[Any]], force: bool) -> None:
    """Write rows as a CSV file, nothing for None."""
    import csv

    from femflex.writing import atomic_file

    with atomic_file(path, force) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([heads, *rows])
