"""Abaqus input as keyword blocks: parameters and data lines, includes, flat or with one part."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Keyword:
    """One keyword, its parameters in lower case (None: a flag), and its data lines split at commas."""

    name: str
    parameters: dict[str, str | None]
    data: list[list[str]]

    def parameter(self, name: str) -> str:
        """Value of a parameter without quotation marks, "" if absent."""
        return (self.parameters.get(name) or "").strip("\"' ")


def read_keywords(path: Path) -> list[Keyword]:
    """Keywords of a file; comments and blank lines are dropped, included files put in."""
    keywords: list[Keyword] = []
    head = ""
    for line in _lines(path, 0):
        if head or line.startswith("*"):
            head += line
            if head.rstrip().endswith(","):  # parameters go on in the next line
                continue
            keywords.append(_keyword(head))
            head = ""
        elif keywords:
            keywords[-1].data.append([word.strip().strip('"') for word in line.split(",")])
    return keywords


def _lines(path: Path, depth: int) -> Iterator[str]:
    if not path.is_file():
        raise ValueError(f"{path} is included in an Abaqus deck but does not exist.")
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if text.upper().startswith("*INCLUDE") and depth < 10:
            yield from _lines(path.parent / _keyword(text).parameter("input"), depth + 1)
        else:
            yield text


def _keyword(line: str) -> Keyword:
    words = [word.strip() for word in line.lstrip("* ").split(",") if word.strip()]
    parameters: dict[str, str | None] = {}
    for word in words[1:]:
        key, _, value = word.partition("=")
        parameters[key.strip().lower()] = value.strip() or None
    return Keyword(" ".join(words[0].upper().split()), parameters, [])
