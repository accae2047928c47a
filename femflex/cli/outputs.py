"""The option -o of verbs that write several kinds of files, which are told by their suffix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from femflex.extras import require

PICTURE, TABLE, MOVIE, REPORT = "picture", "table", "movie", "report"
DIAGRAM_SUFFIXES = (".png", ".svg")
PAGE_SUFFIXES = (".html", ".htm")


def outputs(paths: Sequence[Path], kinds: Mapping[str, Sequence[str]]) -> dict[str, Path]:
    """Return the requested files by their kind.

    kinds: suffixes (lower case) that each kind of file may have.

    Raises ValueError for another suffix and for two files of one kind, and MissingExtra where pictures need it.

    >>> outputs([Path("c.csv")], {"table": (".csv",), "picture": (".png", ".svg")})
    {'table': PosixPath('c.csv')}
    """
    files: dict[str, Path] = {}
    for path in paths:
        kind = next((kind for kind, suffixes in kinds.items() if path.suffix.lower() in suffixes), None)
        if kind is None:
            expected = "; ".join(f"{', '.join(suffixes)} for a {kind}" for kind, suffixes in kinds.items())
            raise ValueError(f"-o {path}: found the suffix {path.suffix!r}; expected {expected}")
        if kind in files:
            raise ValueError(f"found -o {files[kind]} and -o {path}, both for the {kind}; give one")
        if kind in (PICTURE, MOVIE):
            require("view", "pictures")
        files[kind] = path
    return files
