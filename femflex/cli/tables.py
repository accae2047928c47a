"""Printing: aligned tables and lines on standard output."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import Any

WIDTH = 80  # columns where standard output is no terminal, and the least width of one
GAP = 2  # spaces between columns
NUMERIC = tuple("0123456789+-.")  # what cells of a column of numbers begin with


def print_table(heads: Sequence[str], rows: Iterable[Sequence[str]], title: str = "", keys: int = 1) -> None:
    """Print a table: text to the left, numbers to the right.

    A table that is wider than the terminal is folded: its columns follow in several tables one below the other, each
    with the first `keys` columns.
    """
    cells = [list(map(str, row)) for row in rows]
    is_left = [k == 0 or not any(row[k][:1] in NUMERIC for row in cells) for k in range(len(heads))]
    widths = [max(len(cell) for cell in (head, *(row[k] for row in cells))) for k, head in enumerate(heads)]
    lines = [title] * bool(title)
    for group in folded_columns(widths, keys, screen_width()):
        lines += ["  ".join(aligned_cell(heads[k], widths[k], is_left[k]) for k in group).rstrip()]
        lines += ["─" * _table_width(widths, group)]
        lines += ["  ".join(aligned_cell(row[k], widths[k], is_left[k]) for k in group).rstrip() for row in cells]
        lines += [""]
    print("\n".join(lines))


def print_folded(text: str) -> None:
    """Print lines, those that are wider than the terminal folded under the text behind their first word."""
    print("\n".join(piece for line in text.split("\n") for piece in folded_line(line, screen_width())))


def folded_line(line: str, width: int) -> list[str]:
    """Split a line into parts of at most `width` columns; longer words are kept whole.

    >>> folded_line("note      one two three", 20)
    ['note      one two', '          three']
    """
    if len(line) <= width:
        return [line]
    label = re.match(r"\s*\S.*?\s{2,}", line)
    indent = " " * (len(label[0]) if label and len(label[0]) <= width / 2 else 4)
    return wrap(
        line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False, drop_whitespace=True
    )


def folded_columns(widths: Sequence[int], keys: int, width: int) -> list[list[int]]:
    """Numbers of the columns of each table that a table of these widths (n,) is folded into.

    Columns are spread evenly over as few tables as will do, or else fill one table after the other.

    >>> folded_columns([4, 30, 30, 30, 30], 1, 80), folded_columns([4, 10, 10, 10, 70], 1, 80)
    ([[0, 1, 2], [0, 3, 4]], [[0, 1, 2, 3], [0, 4]])
    """
    key_columns, value_columns = list(range(keys)), list(range(keys, len(widths)))
    packed = _filled_tables(widths, key_columns, value_columns, width)
    for count in range(1, len(packed) + 1) if value_columns else ():
        size = -(-len(value_columns) // count)
        groups = [key_columns + value_columns[k : k + size] for k in range(0, len(value_columns), size)]
        if all(_table_width(widths, group) <= width for group in groups):
            return groups
    return packed


def _filled_tables(
    widths: Sequence[int], key_columns: list[int], value_columns: list[int], width: int
) -> list[list[int]]:
    """Columns in the fewest tables, each as full as possible."""
    groups = [list(key_columns)]
    for k in value_columns:
        if len(groups[-1]) > len(key_columns) and _table_width(widths, [*groups[-1], k]) > width:
            groups.append(list(key_columns))
        groups[-1].append(k)
    return groups


def _table_width(widths: Sequence[int], group: Sequence[int]) -> int:
    return sum(widths[k] for k in group) + GAP * (len(group) - 1)


def aligned_cell(text: str, width: int, is_left: bool) -> str:
    """A cell filled up to its width with spaces, behind it or before it."""
    return text.ljust(width) if is_left else text.rjust(width)


def screen_width() -> int:
    """Number of columns that a table may have."""
    import shutil
    import sys

    return max(shutil.get_terminal_size((WIDTH, 24)).columns, 40) if sys.stdout.isatty() else WIDTH


def print_json(data: Any) -> None:
    """Print data as JSON, numbers that are not finite as null."""
    import json
    import math

    def clean(value: Any) -> Any:
        if isinstance(value, dict):
            return {str(key): clean(entry) for key, entry in value.items()}
        if isinstance(value, list | tuple):
            return [clean(entry) for entry in value]
        if hasattr(value, "tolist"):
            return clean(value.tolist())
        return None if isinstance(value, float) and not math.isfinite(value) else value

    print(json.dumps(clean(data), indent=1))
