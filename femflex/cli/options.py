"""The parts that several verbs share: their options, the texts in them, and the files of -o by their suffixes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from femflex.extras import require

CaseFile = Annotated[Path, typer.Argument(help="Case file (TOML).", show_default=False)]
RunFile = Annotated[Path, typer.Argument(help="Result file of a run.", show_default=False)]
MovedCase = Annotated[
    Path | None,
    typer.Option("--case", help="Where the case file of a run is now, if it has moved, with its meshes beside it."),
]
At = Annotated[
    str | None,
    typer.Option("--at", help="Time at which loads that vary are taken: seconds, or a text such as '2 min'."),
]
Start = Annotated[str | None, typer.Option("--from", help="First time: seconds, or a text such as '2 min'.")]
End = Annotated[str | None, typer.Option("--to", help="Last time. Default: the end of the run, or of its motion.")]
Plot = Annotated[Path | None, typer.Option("-o", "--output", help="PNG or SVG picture.")]
Files = Annotated[
    list[Path] | None,
    typer.Option(
        "-o",
        "--output",
        help="File by its suffix: table (.csv), picture (.png, .svg) or page (.html). Repeatable.",
    ),
]
SceneCamera = Annotated[
    str, typer.Option("--camera", help="Axes of a scene: auto, fixed, follow, orbital, body or body:NAME.")
]
Theme = Annotated[str, typer.Option("--theme", help="light or dark.")]
Title = Annotated[str | None, typer.Option("--title", help="Title. Default: that of the case.")]
Force = Annotated[bool, typer.Option("--force", help="Overwrite existing files.")]
Json = Annotated[bool, typer.Option("--json", help="Print for programs, as JSON.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print also tables of detail and reasons of choices.")]

PICTURE, TABLE, MOVIE, REPORT = "picture", "table", "movie", "report"
DIAGRAM_SUFFIXES = (".png", ".svg")
PAGE_SUFFIXES = (".html", ".htm")


def split_names(texts: Iterable[str]) -> list[str]:
    """The names in lists with commas.

    >>> split_names(["a, b", "c"])
    ['a', 'b', 'c']
    """
    return [name.strip() for text in texts for name in text.split(",") if name.strip()]


def read_quantity(text: str, unit: str, option: str) -> float:
    """A number in an SI unit from "12.5" or "2 min". Raises ValueError naming the option.

    >>> read_quantity("2 min", "s", "--at"), read_quantity("1 mm", "m", "--backbone")
    (120.0, 0.001)
    """
    if re.fullmatch(r"\s*[-+.\deE]+\s*", text):
        try:
            return float(text)
        except ValueError:
            pass
    from femflex.noun.units import UnitError, to_si

    try:
        return to_si(text.strip(), unit)
    except UnitError as error:
        raise ValueError(f"{option}: {error}") from None


def read_seconds(text: str | None, option: str) -> float | None:
    """A time [s] from "12.5" or "2 min"; None for None. Raises ValueError naming the option."""
    return None if text is None else read_quantity(text, "s", option)


def outputs(
    paths: Sequence[Path] | None,
    kinds: Mapping[str, Sequence[str]],
    force: bool,
    theme: str = "light",
    kept: Sequence[str] = (),
) -> dict[str, Path]:
    """Return the requested files by their kind, all of which can be written.

    kinds: suffixes (lower case) that each kind of file may have;  kept: kinds whose files may be there already.

    Raises ValueError for another suffix, for two files of one kind and for an unknown theme, FileExistsError, and
    MissingExtra where pictures need it.
    """
    from femflex.view.theme import theme_of
    from femflex.writing import check_destination

    theme_of(theme)
    files: dict[str, Path] = {}
    for path in paths or ():
        kind = next((kind for kind, suffixes in kinds.items() if path.suffix.lower() in suffixes), None)
        if kind is None:
            expected = "; ".join(f"{', '.join(suffixes)} for a {kind}" for kind, suffixes in kinds.items())
            raise ValueError(f"-o {path}: found the suffix {path.suffix!r}; expected {expected}")
        if kind in files:
            raise ValueError(f"found -o {files[kind]} and -o {path}, both for the {kind}; give one")
        if kind in (PICTURE, MOVIE):
            require("view", "pictures")
        files[kind] = path
    for kind, path in files.items():
        check_destination(path, force or kind in kept)
    return files
