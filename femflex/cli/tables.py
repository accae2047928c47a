"""Printing: tables whose rows are data, and lines, as text or as JSON, and the same rows as CSV files.

A verb prints once. Within `printed(as_json=True)` its tables and lines become entries of one JSON object.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from femflex.pipeline.decisions import ResolvedCase

WIDTH = 80  # columns where standard output is no terminal, and the least width of one
GAP = 2  # spaces between columns
NUMERIC = tuple("0123456789+-.")  # what cells of a column of numbers begin with

Head = str | Sequence[str]  # of a column: its name, or the name and the format of its numbers (.6g where it has none)
_objects: list[dict[str, Any]] = []  # JSON objects under construction, the innermost last; none where text is printed


@dataclass(frozen=True)
class CellValue:
    """A value with its text in a table."""

    value: Any
    text: str


@contextmanager
def _collected(then: Callable[[dict[str, Any]], object]) -> Iterator[None]:
    """Collect what is recorded inside in an object, and pass it on at the end, also of what is broken off."""
    _objects.append({})
    try:
        yield
    finally:
        then(_objects.pop())


@contextmanager
def printed(as_json: bool) -> Iterator[None]:
    """Print what is printed inside as one JSON object, if requested: tables as lists of rows, lines by their labels."""
    if not as_json:
        yield
        return
    with _collected(print_json):
        yield


@contextmanager
def section(name: str) -> Iterator[None]:
    """Let what is printed inside be an object of that name in JSON."""
    if not _objects:
        yield
        return
    with _collected(lambda inner: record(name, inner)):
        yield


def record(name: str, value: Any) -> bool:
    """Enter a value in the JSON object, as one more of a list where the name is there; return whether JSON is printed.

    Without JSON nothing happens.
    """
    if not _objects:
        return False
    entries = _objects[-1]
    if name in entries:
        before = entries[name] if isinstance(entries[name], list) else [entries[name]]
        value = [*before, *(value if isinstance(value, list) else [value])]
    entries[name] = value
    return True


def print_table(
    heads: Sequence[Head],
    rows: Iterable[Sequence[Any]],
    title: str = "",
    keys: int = 1,
    name: str = "",
    shown: int | None = None,
) -> None:
    """Print a table: text to the left, numbers to the right, nothing for None and nan; "<" is the format of texts.

    A table that is wider than the terminal is folded: its columns follow in several tables one below the other, each
    with the first `keys` columns. name: of the rows in JSON, by default the title or the first head. shown: number of
    rows that are printed as text.
    """
    names, formats = zip(*((head, ".6g") if isinstance(head, str) else head for head in heads), strict=True)
    rows = list(rows)
    if _objects:
        values = [[cell.value if isinstance(cell, CellValue) else cell for cell in row] for row in rows]
        record(name or title or names[0], [dict(zip(names, row, strict=True)) for row in values])
        return
    more, rows = len(rows[shown:]) if shown is not None else 0, rows[:shown]
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
    if more:
        print(f"and {more} rows more, which --json lists\n")


def cell_text(value: Any, form: str = ".6g") -> str:
    """The text of a cell: a number in the format of its column, nothing for None and nan.

    >>> cell_text(1234.5678), cell_text(3), cell_text(float("nan")), cell_text("flap 1"), cell_text(0.25, ".0%")
    ('1234.57', '3', '', 'flap 1', '25%')
    """
    if isinstance(value, CellValue):
        return value.text
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
    """Print lines, those that are wider than the terminal folded under the text behind their first word; not in
    JSON."""
    if not _objects:
        print("\n".join(piece for line in text.split("\n") for piece in folded_line(line, screen_width())))


def print_title(text: str) -> None:
    """Print a line at the head of what follows, "title" in JSON."""
    if not record("title", text):
        print(text)


def print_line(label: str, text: object, value: Any = None) -> None:
    """Print a line of the report of a verb: a word and what it is about, folded where it is wider than the terminal.

    value: in JSON, by default the text
    """
    if not record(label, str(text) if value is None else value):
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


def print_notes(notes: Mapping[str, str]) -> None:
    """Print the notes, a folded line for each body that has one."""
    for name, note in notes.items():
        if note:
            print_line("body", f"{name}: {note}", [{"body": name, "note": note}])


def print_reasons(resolved: ResolvedCase, verbose: bool) -> None:
    """Print what the meshes and decks of bodies lack; verbose: and the reasons of all choices."""
    from femflex.advice import notes_of

    print_notes(notes_of(resolved.advice, () if verbose else ("mesh",)))
