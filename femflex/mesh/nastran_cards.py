"""Nastran bulk data as cards: free, small and large fields, continuations, includes; case-control SETs and names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from femflex.mesh.numbers import Numbers

NAME = "Nastran bulk data"
WIDTH = {False: 8, True: 16}  # columns of a data field, small and large


@dataclass
class Deck:
    """Cards (name, fields), SETs of case control by number, and names given in comments by what they name."""

    cards: list[tuple[str, list[str]]] = field(default_factory=list)
    sets: dict[int, Numbers] = field(default_factory=dict)
    set_names: dict[int, tuple[str, str]] = field(default_factory=dict)  # number -> (1 nodes | 2 elements, name)
    property_names: dict[int, str] = field(default_factory=dict)
    by_gmsh: bool = False  # Gmsh puts the middle node of a second-order line where CBAR has its orientation point


def read_deck(path: Path) -> Deck:
    """Deck of a file; without BEGIN BULK all of it is bulk data."""
    lines = list(_lines(path, 0))
    deck = Deck()
    for line in lines:
        if line.startswith("$"):
            _comment(line, deck)
    text = [line.split("$")[0].expandtabs(8).rstrip() for line in lines]
    begin = next((k for k, line in enumerate(text) if re.match(r"\s*BEGIN\s+BULK", line, re.I)), None)
    rest = _case_control(text if begin is None else text[:begin], deck)
    deck.cards = _cards(rest if begin is None else text[begin + 1 :])
    return deck


def listed(words: list[str]) -> Numbers:
    """Numbers of a list such as 1, 3, THRU, 7, BY, 2."""
    numbers: list[int | range] = []
    rest = [word.upper() for word in reversed(words) if word]
    while rest:
        word = rest.pop()
        if word == "EXCEPT":
            return Numbers(tuple(numbers), listed(rest[::-1]))
        if word != "THRU":
            numbers.append(int(word))
            continue
        first, last, step = numbers[-1], int(rest.pop()), 1
        if rest and rest[-1] == "BY":
            rest.pop()
            step = int(rest.pop())
        if isinstance(first, range):
            raise ValueError(f"the list {' '.join(words[:20])} has THRU after a range; a number stands before it")
        numbers.append(range(first + step, last + 1, step))
    return Numbers(tuple(numbers))


def _lines(path: Path, depth: int) -> Iterator[str]:
    """Lines of a file with those it includes."""
    if not path.is_file():
        raise ValueError(f"{path} is included in a Nastran deck but does not exist.")
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        found = re.match(r"\s*INCLUDE\s+['\"]?([^'\"]+)['\"]?\s*$", line, re.I)
        if found and depth < 10:
            yield from _lines(path.parent / found[1].strip(), depth + 1)
        else:
            yield line


def _comment(line: str, deck: Deck) -> None:
    """Names as HyperMesh ($HMNAME PROP, $HMSET) and Femap write them."""
    if found := re.match(r'\$HMSET\s+(\d+)\s+([12])\s+"(.*)"', line):
        deck.set_names[int(found[1])] = (found[2], found[3])
    elif found := re.match(r'\$HMNAME PROP\s+(\d+)\s*"(.*)"', line) or re.match(
        r"\$ Femap.* Property (\d+) : (.*\S)", line
    ):
        deck.property_names[int(found[1])] = found[2]
    elif line.startswith("$ Created by Gmsh"):
        deck.by_gmsh = True


def _case_control(lines: list[str], deck: Deck) -> list[str]:
    """Take the SETs out of case control (a comma at the end continues them); the other lines."""
    rest, k = [], 0
    while k < len(lines):
        found = re.match(r"\s*SET\s+(\d+)\s*=\s*(.*)$", lines[k], re.I)
        if not found:
            rest.append(lines[k])
            k += 1
            continue
        text = found[2]
        while text.rstrip().endswith(",") and k + 1 < len(lines):
            k += 1
            text += lines[k]
        words = text.replace(",", " ").split()
        if all(re.fullmatch(r"\d+|THRU|BY|EXCEPT", word, re.I) for word in words):  # not ALL, not real numbers
            deck.sets[int(found[1])] = listed(words)
        k += 1
    return rest


def _cards(lines: list[str]) -> list[tuple[str, list[str]]]:
    """Cards with their fields; a continuation goes to the card whose last line ended in its mark, wherever that is."""
    cards: list[tuple[str, list[str]]] = []
    marked: dict[str, int] = {}  # mark at the end of a line -> card that it continues
    waiting: list[_Line] = []  # continuations of a mark that no line before them had
    last = ""
    end = next((k for k, text in enumerate(lines) if re.match(r"\s*ENDDATA", text, re.I)), len(lines))
    every = [_fields(text) for text in lines[:end] if text.strip()]
    marks = {line.mark for line in every if line.mark}
    for line in every:
        mark = line.first.lstrip("+*").strip()
        if line.first and line.first[0] not in "+*":
            cards.append((line.first.rstrip("*").strip().upper(), line.fields))
        elif mark and mark != last and mark in marked:
            cards[marked[mark]][1].extend(line.fields)
            marked |= {line.mark: marked[mark]} if line.mark else {}
            continue
        elif mark and mark != last and mark in marks:
            waiting.append(line)
            continue
        elif cards:
            cards[-1][1].extend(line.fields)
        last = line.mark
        if last:
            marked[last] = len(cards) - 1
    while waiting:  # the card came later, or the line before
        found = next((line for line in waiting if line.first.lstrip("+*").strip() in marked), waiting[0])
        waiting.remove(found)
        card = marked.get(found.first.lstrip("+*").strip())
        if card is not None:
            cards[card][1].extend(found.fields)
            marked |= {found.mark: card} if found.mark else {}
    return cards


class _Line(NamedTuple):
    """First field, data fields padded to a full line (8, or 4 when large), and the mark at the end without + and *."""

    first: str
    fields: list[str]
    mark: str


def _fields(line: str) -> _Line:
    """One line, free or in columns; a free line may have more than nine fields, its continuations then in it."""
    if "," in line:
        words = [word.strip() for word in line.split(",")]
        first, words = words[0], words[1:]
        size = 4 if "*" in first else 8
        fields, mark = list[str](), ""
        while words:
            part, rest = words[:size], words[size:]
            fields += part + [""] * (size - len(part))
            mark = rest[0].lstrip("+*").strip() if rest else ""
            words = rest[1:]
        return _Line(first, fields or [""] * size, mark)
    first, large = line[:8].strip(), "*" in line[:8]
    size, width = (4, WIDTH[True]) if large else (8, WIDTH[False])
    words = [line[8 + k * width : 8 + (k + 1) * width].strip() for k in range(size)]
    return _Line(first, words, line[72:80].strip().lstrip("+*").strip())
