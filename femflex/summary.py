"""Summaries of large objects: a few lines of text in a terminal, a table in a notebook."""

from __future__ import annotations

from html import escape

Rows = list[tuple[str, str]]


class Summarised:
    """An object that prints its summary instead of its arrays."""

    def summary(self) -> tuple[str, Rows]:
        """Title, and rows of a name and a text."""
        raise NotImplementedError

    def __repr__(self) -> str:
        title, rows = self.summary()
        width = max((len(name) for name, _ in rows), default=0)
        return "\n".join([title, *(f"  {name:<{width}}  {text}" for name, text in rows)])

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str:
        title, rows = self.summary()
        cells = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th><td style='text-align:left'>{escape(text)}</td></tr>"
            for name, text in rows
        )
        return f"<table><caption style='text-align:left'><b>{escape(title)}</b></caption>{cells}</table>"


def listed(names: list[str] | tuple[str, ...], limit: int = 8) -> str:
    """Names separated by commas, the first `limit` of them.

    >>> listed(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    if len(names) <= limit:
        return ", ".join(names) or "none"
    return f"{', '.join(names[:limit])} and {len(names) - limit} more"
