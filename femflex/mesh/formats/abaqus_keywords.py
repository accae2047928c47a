"""Abaqus input as keyword blocks: parameters and data lines with their file and line; included files are inserted."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from femflex.mesh.formats.guards import MAX_INCLUDE_DEPTH, check_include_depth

# keywords in which a blank data line stands for the defaults
BLANK_LINES_COUNT = (
    "BEAM SECTION",
    "BEAM GENERAL SECTION",
)
DATA_IN_OTHER_FILE = {  # keywords whose data lines may be in another file, which INPUT names
    "NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "EQUATION", "MPC", "TIE", "BOUNDARY", "NODAL THICKNESS",
    "ORIENTATION", "DISTRIBUTION", "NGEN", "ELGEN",
}  # fmt: skip
COMMA = re.compile(r',(?=(?:[^"]*"[^"]*")*[^"]*$)')  # outside quotation marks


@dataclass
class Keyword:
    """One keyword, its parameters in lower case (None: a flag), and its data lines.

    file, line    its location
    lines         data lines as written, without comments
    line_numbers  line number of every data line
    files         the file of every data line
    """

    name: str
    parameters: dict[str, str | None]
    file: str
    line: int
    lines: list[str] = field(default_factory=list)
    line_numbers: list[int] = field(default_factory=list)
    files: list[str] = field(default_factory=list)

    @cached_property
    def data(self) -> list[list[str]]:
        """The data lines split at commas."""
        return [[word.strip().strip('"') for word in split_at_commas(text)] for text in self.lines]

    def parameter(self, name: str) -> str:
        """Value of a parameter without quotation marks, "" if absent."""
        return (self.parameters.get(name) or "").strip("\"' ")

    def location(self, row: int | None = None) -> str:
        """File and line of the keyword, or of one of its data lines."""
        return f"{self.file}, line {self.line}" if row is None else f"{self.files[row]}, line {self.line_numbers[row]}"

    def error(self, text: str, row: int | None = None) -> ValueError:
        """An error with the location, and the name of the keyword before the text."""
        return ValueError(f"{self.location(row)}: *{self.name}{'' if text[:1] in ',:' else ' '}{text}")

    def add(self, text: str, file: str, line: int) -> None:
        """Add a data line with its file and line number."""
        self.lines.append(text)
        self.line_numbers.append(line)
        self.files.append(file)

    def integer(self, word: str, row: int, what: str) -> int:
        """A word of a data line as a whole number; ValueError with its location if it is none."""
        try:
            return int(word)
        except ValueError:
            number = _float(word)
            if number is not None and math.isfinite(number) and number == int(number):
                return int(number)
            raise self.error(f"has {word!r} where {what} belongs; it is no whole number.", row) from None

    def real(self, word: str, row: int | None, what: str) -> float:
        """A word of a data line as a number, blank as zero; ValueError with its location if it is none."""
        number = _float(word) if word else 0.0
        if number is None:
            raise self.error(f"has {word!r} where {what} belongs; it is no number.", row)
        return number


def split_at_commas(text: str) -> list[str]:
    """Words of a line between commas; commas in quotation marks do not separate words."""
    return COMMA.split(text) if '"' in text else text.split(",")


def read_keywords(path: Path) -> list[Keyword]:
    """Keywords of a file. Comments, bare stars and meaningless blank lines are dropped; included files are inserted."""
    keywords: list[Keyword] = []
    head, start = "", ("", 0)
    for text, file, line in _lines(path, path, 0):
        if (head and text) or text.startswith("*"):
            start = start if head else (file, line)
            head += text
            if head.endswith(","):  # parameters continue on the next line
                continue
            keyword = _keyword(head, *start)
            keywords += [keyword] if keyword.name else []
            head = ""
            if keyword.name in DATA_IN_OTHER_FILE and keyword.parameter("input"):
                _add_input(keyword, path)
        elif keywords and (text or keywords[-1].name in BLANK_LINES_COUNT):
            keywords[-1].add(text, file, line)
    return keywords


def _add_input(keyword: Keyword, main: Path) -> None:
    """Add the data lines of the file named by INPUT, which is in the folder of the deck."""
    for text, file, line in _lines(_input_file(keyword, [main.parent]), main, MAX_INCLUDE_DEPTH):
        if text.startswith("*"):
            raise ValueError(
                f"{file}, line {line}: {text.split(',')[0]} stands in a file of data lines, which *{keyword.name}, "
                f"INPUT at {keyword.location()} names. Put the file in by *INCLUDE, or leave data lines in it alone."
            )
        if text:
            keyword.add(text, file, line)


def _lines(path: Path, main: Path, depth: int) -> Iterator[tuple[str, str, int]]:
    """Lines with their file and number, without comments; included files are in the folder of the including file or of
    the deck."""
    for number, line in enumerate(path.read_text(encoding="utf-8-sig", errors="replace").splitlines(), 1):
        text = line.strip()
        if text.startswith("**"):
            continue
        if not re.match(r"\*INCLUDE\b", text, re.I):
            yield text, path.name, number
            continue
        keyword = _keyword(text, path.name, number)
        included = _input_file(keyword, [path.parent, main.parent])
        check_include_depth(depth, keyword.location())
        yield from _lines(included, main, depth + 1)


def _input_file(keyword: Keyword, folders: list[Path]) -> Path:
    """The file named by INPUT, from the first of these folders that contains it."""
    name = keyword.parameter("input").replace("\\", "/")
    path = next((folder / name for folder in folders if (folder / name).is_file()), None)
    if path is None:
        raise keyword.error(
            f": {folders[0] / name} is named by *{keyword.name} in an Abaqus deck but does not exist. Put the file "
            "there, or take the line out."
        )
    return path


def _keyword(text: str, file: str, line: int) -> Keyword:
    words = [word.strip() for word in split_at_commas(text.lstrip("* ")) if word.strip()]
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
        match = re.fullmatch(r"([+-]?[0-9.]+)([+-][0-9]+)", text)
        return float(f"{match[1]}E{match[2]}") if match else None
