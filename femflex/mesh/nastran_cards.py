"""Nastran bulk data as cards: free, small and large fields, continuations, includes; case-control SETs and names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from femflex.mesh.numbers import Numbers, check_count, spanned

NAME = "Nastran bulk data"
WIDTH = {False: 8, True: 16}  # columns of a data field, small and large
DEPTH = 10  # of files that include files
ITEM = re.compile(r"[A-Za-z]\w*|[+-]?(\d+\.?\d*|\.\d+)([EeDd]?[+-]?\d+)?|=|==|\*\([^()]+\)")  # of a line in free form
AGAIN = re.compile(r"==?|\*\([^()]+\)")  # a field of the card before, or with a number added
REPEAT = re.compile(r"=\(?(\d*)\)?")
INCLUDE = re.compile(r"\s*INCLUDE\s+(.*)$", re.I)


@dataclass(frozen=True)
class Line:
    """A line of a file, and where it stands."""

    text: str
    file: str
    number: int


@dataclass(frozen=True)
class RawCard:
    """A card: its name, the data fields of all its lines, and where it begins."""

    name: str
    fields: list[str]
    file: str = ""
    line: int = 0


@dataclass
class Deck:
    """Cards, SETs of case control by number, and names given in comments by what they name.

    control  lines of executive and case control that are no SETs
    """

    raw: list[RawCard] = field(default_factory=list)
    control: list[Line] = field(default_factory=list)
    sets: dict[int, Numbers] = field(default_factory=dict)
    set_names: dict[int, tuple[str, str]] = field(default_factory=dict)  # number -> (1 nodes | 2 elements, name)
    property_names: dict[int, str] = field(default_factory=dict)
    by_gmsh: bool = False  # Gmsh puts the middle node of a second-order line where CBAR has its orientation point

    @property
    def cards(self) -> list[tuple[str, list[str]]]:
        """Cards as (name, fields)."""
        return [(card.name, card.fields) for card in self.raw]


def read_deck(path: Path) -> Deck:
    """Deck of a file; without BEGIN BULK all of it is bulk data. Raises ValueError where one to include is missing."""
    lines = list(_lines(path, path, 0))
    deck = Deck()
    for line in lines:
        if line.text.startswith("$"):
            _comment(line.text, deck)
    text = [Line(_plain(line.text), line.file, line.number) for line in lines]
    begin = next((k for k, line in enumerate(text) if re.match(r"\s*BEGIN(\s+BULK|\s*$)", line.text, re.I)), None)
    rest = _case_control(text if begin is None else text[:begin], deck)
    deck.control = [] if begin is None else rest
    deck.raw = _cards(rest if begin is None else text[begin + 1 :])
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
        if not numbers or not rest:
            raise ValueError(f"the list {' '.join(words[:20])} has THRU without a number on both sides")
        first, last, step = numbers[-1], int(rest.pop()), 1
        if rest and rest[-1] == "BY":
            rest.pop()
            step = int(rest.pop())
        if isinstance(first, range):
            raise ValueError(f"the list {' '.join(words[:20])} has THRU after a range; a number stands before it")
        try:
            numbers.append(spanned(first, last, step)[1:])
        except ValueError as error:
            raise ValueError(f"the list {' '.join(words[:20])}: {error}") from None
    return Numbers(tuple(numbers))


def _plain(text: str) -> str:
    """A line without its comment, tabs and blanks at its end."""
    return text.split("$")[0].expandtabs(8).rstrip()


def _lines(path: Path, main: Path, depth: int) -> Iterator[Line]:
    """Lines of a file with those it includes."""
    held = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    k = 0
    while k < len(held):
        number, found = k + 1, INCLUDE.match(held[k])
        k += 1
        if found is None:
            yield Line(held[k - 1], path.name, number)
            continue
        name = found[1].strip()
        quote = name[:1]
        if quote in ("'", '"'):
            while name.count(quote) < 2 and k < len(held):  # a long name goes on in the next line
                name += held[k].strip()
                k += 1
            name = name[1:].split(quote)[0]
        else:
            name = name.split("$")[0].strip()
        if depth == 0 and any(re.match(r"\s*CEND\b", line, re.I) for line in held[k:]):
            continue  # of executive control: no part of the model
        if depth >= DEPTH:
            raise ValueError(f"{path.name}:{number}: files include each other more than {DEPTH} deep.")
        yield from _lines(_included(name, path, main, number), main, depth + 1)


def _included(name: str, path: Path, main: Path, number: int) -> Path:
    """The file that is included: in the folder of the file that includes it, or of the main one; case may differ."""
    plain = Path(name.replace("\\", "/").strip())
    folders = list(dict.fromkeys((path.parent, main.parent)))
    for folder in folders:
        if (folder / plain).is_file():
            return folder / plain
    for folder in folders:
        near = (folder / plain).parent
        for one in near.iterdir() if near.is_dir() else ():
            if one.name.lower() == plain.name.lower() and one.is_file():
                return one
    raise ValueError(
        f"{path.name}:{number}: the file {name!r} that is included does not exist in "
        f"{' or '.join(str(folder) for folder in folders)}."
    )


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


def _case_control(lines: list[Line], deck: Deck) -> list[Line]:
    """Take the SETs out of case control (a comma at the end continues them); the other lines."""
    rest, k = [], 0
    while k < len(lines):
        found = re.match(r"\s*SET\s+(\d+)\s*=\s*(.*)$", lines[k].text, re.I)
        if not found:
            rest.append(lines[k])
            k += 1
            continue
        text = found[2]
        while text.rstrip().endswith(",") and k + 1 < len(lines):
            k += 1
            text += lines[k].text
        words = text.replace(",", " ").split()
        if all(re.fullmatch(r"\d+|THRU|BY|EXCEPT", word, re.I) for word in words):  # not ALL, not real numbers
            deck.sets[int(found[1])] = listed(words)
        k += 1
    return rest


def _cards(lines: list[Line]) -> list[RawCard]:
    """Cards with their fields; a continuation goes to the card whose last line ended in its mark, wherever that is."""
    cards: list[RawCard] = []
    marked: dict[str, int] = {}  # mark at the end of a line -> card that it continues
    waiting: list[_Fields] = []  # continuations of a mark that no line before them had
    last = ""
    end = next((k for k, line in enumerate(lines) if re.match(r"\s*ENDDATA", line.text, re.I)), len(lines))
    every = [(line, _fields(line.text)) for line in lines[:end] if line.text.strip()]
    marks = {found.mark for _, found in every if found.mark}
    changes = list[str]()
    for k, (line, found) in enumerate(every):
        mark = found.first.lstrip("+*").strip()
        again = REPEAT.fullmatch(found.first)
        if again and cards:
            changes = found.fields if any(found.fields) else changes
            check_count(int(again[1] or 1), f"{line.file}:{line.number}")
            for _ in range(int(again[1] or 1)):
                cards.append(_replicated(changes, cards[-1], line))
            last = ""
        elif found.first and found.first[0] not in "+*":
            made = RawCard(found.first.rstrip("*").strip().upper(), found.fields, line.file, line.number)
            if cards and cards[-1].name == made.name and any(AGAIN.fullmatch(word) for word in found.fields):
                goes_on = k + 1 < len(every) and every[k + 1][1].first[:1] in ("", "+", "*")
                made = _replicated(found.fields, cards[-1], line, len(found.fields) if goes_on else None)
            cards.append(made)
        elif mark and mark != last and mark in marked:
            cards[marked[mark]].fields.extend(found.fields)
            marked |= {found.mark: marked[mark]} if found.mark else {}
            continue
        elif mark and mark != last and mark in marks:
            waiting.append(found)
            continue
        elif cards:
            cards[-1].fields.extend(found.fields)
        last = found.mark
        if last:
            marked[last] = len(cards) - 1
    while waiting:  # the card came later, or the line before
        found = next((one for one in waiting if one.first.lstrip("+*").strip() in marked), waiting[0])
        waiting.remove(found)
        card = marked.get(found.first.lstrip("+*").strip())
        if card is not None:
            cards[card].fields.extend(found.fields)
            marked |= {found.mark: card} if found.mark else {}
    return cards


def _parted(word: str) -> list[str]:
    """Fields of a free line between two commas: blanks part numbers and words too (PBAR, 1 11 .785)."""
    words = word.split()
    return words if len(words) > 1 and all(ITEM.fullmatch(one) for one in words) else [word]


def _replicated(fields: list[str], before: RawCard, line: Line, size: int | None = None) -> RawCard:
    """The card that repeats another one: = a field again, *(x) with x added, == all that follow again, up to `size`.

    Raises ValueError where a number is to be added to what is none.
    """
    made, k = list[str](), 0
    for k, word in enumerate(fields):
        old = before.fields[k] if k < len(before.fields) else ""
        if word == "==":
            return RawCard(before.name, [*made, *before.fields[k:size]], line.file, line.number)
        added = re.fullmatch(r"\*\(?([^()]+)\)?", word)
        if added is None:
            made.append(old if word == "=" else word)
            continue
        try:
            numbers = [float(re.sub(r"(?<=[\d.])([+-])(?=\d+$)", r"e\1", one)) for one in (old or "0", added[1])]
        except ValueError:
            given = ", ".join(word for word in fields if word)
            raise ValueError(
                f"{line.file}:{line.number}: the line repeats {before.name} with {given}, where a number is added to "
                "what is none; write the cards out"
            ) from None
        whole = all(re.fullmatch(r"[+-]?\d+", one) for one in (old or "0", added[1]))
        made.append(str(round(sum(numbers))) if whole else f"{float(f'{sum(numbers):.13g}')!r}")
    return RawCard(before.name, made, line.file, line.number)


class _Fields(NamedTuple):
    """First field, data fields padded to a full line (8, or 4 when large), and the mark at the end without + and *."""

    first: str
    fields: list[str]
    mark: str


def _fields(line: str) -> _Fields:
    """One line, free or in columns; a free line may have more than nine fields, its continuations then in it."""
    if "," in line:
        words = [part for word in line.split(",") for part in _parted(word.strip())]
        first, words = words[0], words[1:]
        size = 4 if "*" in first else 8
        fields, mark = list[str](), ""
        while words:
            part, rest = words[:size], words[size:]
            fields += part + [""] * (size - len(part))
            mark = rest[0].lstrip("+*").strip() if rest else ""
            words = rest[1:]
        return _Fields(first, fields or [""] * size, mark)
    first, large = line[:8].strip(), "*" in line[:8]
    size, width = (4, WIDTH[True]) if large else (8, WIDTH[False])
    words = [line[8 + k * width : 8 + (k + 1) * width].strip() for k in range(size)]
    return _Fields(first, words, line[72:80].strip().lstrip("+*").strip())
