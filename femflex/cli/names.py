"""Names on the command line."""

from __future__ import annotations


def listed_names(texts: list[str] | None) -> list[str]:
    """The names in lists with commas."""
    return [name.strip() for text in texts or [] for name in text.split(",") if name.strip()]
