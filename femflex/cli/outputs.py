"""The option -o of verbs that leave several kinds of files: the suffix says what a file is to hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

PICTURE, TABLE, MOVIE = "picture", "table", "movie"
DIAGRAM_SUFFIXES = (".png", ".svg")


def outputs(paths: Sequence[Path], kinds: Mapping[str, Sequence[str]]) -> dict[str, Path]:
    """The requested files, by their kind.

    kinds: suffixes (lower case) that each kind of file may have.

    Raises ValueError for another suffix, and for two files of one kind.

    >>> outputs([Path("c.csv")], {"table": (".csv",), "picture": (".png", ".svg")})
    {'table': PosixPath('c.csv')}
    """
    found: dict[str, Path] = {}
    for path in paths:
        kind = next((kind for kind, suffixes in kinds.items() if path.suffix.lower() in suffixes), None)
        if kind is None:
            known = "; ".join(f"{', '.join(suffixes)} for a {kind}" for kind, suffixes in kinds.items())
            raise ValueError(f"-o {path}: found the suffix {path.suffix!r}; expected {known}")
        if kind in found:
            raise ValueError(f"found -o {found[kind]} and -o {path}, both for the {kind}; give one")
        found[kind] = path
    return found
