"""Abaqus input as keyword blocks: parameters and data lines with their places, included files put in."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

MOST_INCLUDES = 10  # files within files
COMMA = re.compile(r',(?=(?:[^"]*"[^"]*")*[^"]*$)')  # outside quotation marks


@dataclass
class Keyword:
    """One keyword, its parameters in lower case (None: a flag), and its data lines.

    file, line  where it stands
    lines       data lines as written, without comments
    at          line number of every data line
    """

    name: str
    parameters: dict[str, str | None]
    file: str
    line: int
    lines: list[str] = field(default_factory=list)
    at: list[int] = field(default_factory=list)

    @cached_property
    def data(self) -> list[list[str]]:
        """The data lines split at commas."""
        return [[word.strip().strip('"') for word in split(text)] for text in self.lines]

    def parameter(self, name: str) -> str:
        """Value of a parameter without quotation marks, "" if absent."""
        return (self.parameters.get(name) or "").strip("\"' ")

    def place(self, row: int | None = None) -> str:
        """File and line of the keyword, or of one of its data lines."""
        return f"{self.file}, line {self.line if row is None else self.at[row]}"

    def integer(self, word: str, row: int, what: str) -> int:
        """A word of a data line as a whole number; ValueError with the place where it is none."""
        try:
            return int(word)
        except ValueError:
            number = _float(word)
            if number is not None and math.isfinite(number) and number == int(number):
                return int(number)
            raise ValueError(
                f"{self.place(row)}: *{self.name} has {word!r} where {what} belongs; it is no whole number."
            ) from None

    def real(self, word: str, row: int, what: str) -> float:
        """A word of a data line as a number, blank as zero; ValueError with the place where it is none."""
        number = _float(word) if word else 0.0
        if number is None:
            raise ValueError(f"{self.place(row)}: *{self.name} has {word!r} where {what} belongs; it is no number.")
        return number


def split(text: str) -> list[str]:
    """Words of a line between commas, of which those in quotation marks do not count."""
    return COMMA.split(text) if '"' in text else text.split(",")


def read_keywords(path: Path) -> list[Keyword]:
    """Keywords of a file; comments, blank lines and bare stars are dropped, included files put in."""
    keywords: list[Keyword] = []
    head, start = "", ("", 0)
    for text, file, line in _lines(path, path, 0):
        if head or text.startswith("*"):
            start = start if head else (file, line)
            head += text
            if head.endswith(","):  # parameters go on in the next line
                continue
            keyword = _keyword(head, *start)
            keywords += [keyword] if keyword.name else []
            head = ""
        elif keywords:
            keywords[-1].lines.append(text)
            keywords[-1].at.append(line)
    return keywords


def _lines(path: Path, main: Path, depth: int) -> Iterator[tuple[str, str, int]]:
    """Lines with their file and number; an included file is in the folder of its includer, or of the deck."""
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if not re.match(r"\*INCLUDE\b", text, re.I):
            yield text, path.name, number
            continue
        name = _keyword(text, path.name, number).parameter("input").replace("\\", "/")
        places = [folder / name for folder in (path.parent, main.parent)]
        found = next((place for place in places if place.is_file()), None)
        if found is None or depth >= MOST_INCLUDES:
            why = "does not exist" if found is None else f"is the {MOST_INCLUDES}th within one another"
            raise ValueError(
                f"{path.name}, line {number}: {places[0]} is included in an Abaqus deck but {why}. Put the file there, "
                "or take the line out."
            )
        yield from _lines(found, main, depth + 1)


def _keyword(text: str, file: str, line: int) -> Keyword:
    words = [word.strip() for word in split(text.lstrip("* ")) if word.strip()]
    parameters: dict[str, str | None] = {}
    for word in words[1:]:
        key, _, value = word.partition("=")
        parameters["".join(key.lower().split())] = value.strip() or None
    return Keyword(" ".join(words[0].upper().split()) if words else "", parameters, file, line)


def _float(word: str) -> float | None:
    """A Fortran number (1.5, 1.D3, 2.5+3) as a float."""
    text = word.strip().upper().replace("D", "E")
    try:
        return float(text)
    except ValueError:
        found = re.fullmatch(r"([+-]?[0-9.]+)([+-][0-9]+)", text)
        return float(f"{found[1]}E{found[2]}") if found else None
