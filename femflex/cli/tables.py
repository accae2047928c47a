"""Printing: aligned tables and lines on standard output."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any


def print_table(heads: Sequence[str], rows: Iterable[Sequence[str]], title: str = "") -> None:
    """Print a table; the first column is text, the others are aligned to the right."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, title=title or None, title_justify="left", pad_edge=False, title_style="bold")
    for k, head in enumerate(heads):
        table.add_column(head, justify="left" if k == 0 else "right", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    console().print(table)


def console() -> Any:
    """Standard output, as wide as needed where it is no terminal."""
    import sys

    from rich.console import Console

    return Console(highlight=False, width=None if sys.stdout.isatty() else 200, soft_wrap=True)


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
