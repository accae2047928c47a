"""Nastran bulk data as cards: free, small and large fields, continuations, includes; case-control SETs and names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from femflex.mesh.formats.guards import check_count, check_include_depth
from femflex.mesh.formats.numbers import Numbers, inclusive_range

NAME = "Nastran bulk data"
WIDTH = {False: 8, True: 16}  # columns of a data field, small and large
# of a line in free format
FREE_FIELD = re.compile(r"[A-Za-z]\w*|[+-]?(\d+\.?\d*|\.\d+)([EeDd]?[+-]?\d+)?|=|==|\*\([^()]+\)")
REPEATED_FIELD = re.compile(r"==?|\*\([^()]+\)")  # a field copied from the previous card, possibly with a number added
REPEAT = re.compile(r"=\(?(\d*)\)?")
# Nastran lists the middle nodes of upright edges before those of the upper face, meshio after them; each order turns
# one list into the other.
ORDER = {
    "hexahedron20": [*range(12), *range(16, 20), *range(12, 16)],
    "wedge15": [*range(9), *range(12, 15), *range(9, 12)],
}
EXPONENT = re.compile(r"(?<=[0-9.])([+-])(?=\d+$)")  # of a number without E
INCLUDE = re.compile(r"\s*INCLUDE\s+(.*)$", re.I)


@dataclass(frozen=True)
class Line:
    """A line of a file, with its file and line number."""

    text: str
    file: str
    number: int


@dataclass(frozen=True)
class RawCard:
    """A card: its name, the data fields of all its lines, and its first line."""

    name: str
    fields: list[str]
    file: str = ""
    line: int = 0


@dataclass
class Deck:
    """Cards, SETs of case control by number, and names of sets and properties from comments.

    control  lines of executive and case control other than SETs
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
    """Deck of a file; without BEGIN BULK all of it is bulk data. Raises ValueError if an included file is missing."""
    lines = list(_lines(path, path, 0))
    deck = Deck()
    for line in lines:
        if line.text.startswith("$"):
            _read_comment(line.text, deck)
    text = [Line(_without_comment(line.text), line.file, line.number) for line in lines]
    begin = next((k for k, line in enumerate(text) if re.match(r"\s*BEGIN(\s+BULK|\s*$)", line.text, re.I)), None)
    other_lines = _read_case_control(text if begin is None else text[:begin], deck)
    deck.control = [] if begin is None else other_lines
    deck.raw = _cards(other_lines if begin is None else text[begin + 1 :])
    return deck


def real(word: str) -> float:
    """A number in any of Nastran's formats (1.5-3, 2.D+4, 2.0 E+7). Raises ValueError if it is none."""
    text = word.replace(" ", "").upper().replace("D", "E")
    return float(text if "E" in text else EXPONENT.sub(r"E\1", text))


def read_number_list(words: list[str]) -> Numbers:
    """The numbers in a list such as 1, 3, THRU, 7, BY, 2."""
    numbers: list[int | range] = []
    rest = [word.upper() for word in reversed(words) if word]
    while rest:
        word = rest.pop()
        if word == "EXCEPT":
            return Numbers(tuple(numbers), read_number_list(rest[::-1]))
        if word != "THRU":
            numbers.append(_integer(word, words))
            continue
        if not numbers or not rest:
            raise ValueError(f"the list {' '.join(words[:20])} has THRU without a number on both sides")
        first, last, step = numbers[-1], _integer(rest.pop(), words), 1
        if rest and rest[-1] == "BY":
            rest.pop()
            step = _integer(rest.pop() if rest else "", words)
        if isinstance(first, range):
            raise ValueError(f"the list {' '.join(words[:20])} has THRU after a range; a number stands before it")
        try:
            numbers.append(inclusive_range(first, last, step)[1:])
        except ValueError as error:
            raise ValueError(f"the list {' '.join(words[:20])}: {error}") from None
    return Numbers(tuple(numbers))


def named_sets(deck: Deck) -> tuple[dict[int, tuple[Numbers, str]], list[tuple[RawCard, str]]]:
    """Number -> members and kind (1 nodes, 2 elements, "" not known) of every SET, SET1 and SET3; cards that cannot be
    read, with the reason."""
    kinds = {number: kind for number, (kind, _) in deck.set_names.items()}
    sets, wrong = dict(deck.sets), list[tuple[RawCard, str]]()
    for card in deck.raw:
        name, words = card.name.upper(), [word.strip().upper() for word in card.fields]
        if name not in ("SET1", "SET3") or not words or not re.fullmatch(r"[+-]?\d+", words[0]):
            continue
        try:
            if name == "SET1":
                sets[int(words[0])] = read_number_list([word for word in words[1:] if word not in ("", "SKIN")])
            elif words[1] in ("GRID", "ELEM", "ELEMENT"):
                sets[int(words[0])] = read_number_list([word for word in words[2:] if word])
                kinds[int(words[0])] = "1" if words[1] == "GRID" else "2"
        except ValueError as error:
            wrong.append((card, str(error)))
    return {number: (members, kinds.get(number, "")) for number, members in sets.items()}, wrong


def _integer(word: str, words: list[str]) -> int:
    if not re.fullmatch(r"[+-]?\d+", word):
        raise ValueError(f"the list {' '.join(words[:20])} has {word!r} where a whole number belongs")
    return int(word)


def _without_comment(text: str) -> str:
    """A line without comment, tabs and trailing blanks."""
    return text.split("$")[0].expandtabs(8).rstrip()


def _lines(path: Path, main: Path, depth: int) -> Iterator[Line]:
    """Lines of a file and of its included files."""
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    k = 0
    while k < len(lines):
        number, match = k + 1, INCLUDE.match(lines[k])
        k += 1
        if match is None:
            yield Line(lines[k - 1], path.name, number)
            continue
        name = match[1].strip()
        quote = name[:1]
        if quote in ("'", '"'):
            while name.count(quote) < 2 and k < len(lines):  # a long name continues on the next line
                name += lines[k].strip()
                k += 1
            name = name[1:].split(quote)[0]
        else:
            name = name.split("$")[0].strip()
        if depth == 0 and any(re.match(r"\s*CEND\b", line, re.I) for line in lines[k:]):
            continue  # included in executive control: no part of the model
        check_include_depth(depth, f"{path.name}:{number}")
        yield from _lines(_included_file(name, path, main, number), main, depth + 1)


def _included_file(name: str, path: Path, main: Path, number: int) -> Path:
    """The included file, in the folder of the including file or of the main file; capitals may differ."""
    relative = Path(name.replace("\\", "/").strip())
    folders = list(dict.fromkeys((path.parent, main.parent)))
    for folder in folders:
        if (folder / relative).is_file():
            return folder / relative
    for folder in folders:
        folder_of_file = (folder / relative).parent
        for candidate in folder_of_file.iterdir() if folder_of_file.is_dir() else ():
            if candidate.name.lower() == relative.name.lower() and candidate.is_file():
                return candidate
    raise ValueError(
        f"{path.name}:{number}: the file {name!r} that is included does not exist in "
        f"{' or '.join(str(folder) for folder in folders)}."
    )


def _read_comment(line: str, deck: Deck) -> None:
    """Store names from comments of HyperMesh ($HMNAME PROP, $HMSET) and Femap."""
    if match := re.match(r'\$HMSET\s+(\d+)\s+([12])\s+"(.*)"', line):
        deck.set_names[int(match[1])] = (match[2], match[3])
    elif match := re.match(r'\$HMNAME PROP\s+(\d+)\s*"(.*)"', line) or re.match(
        r"\$ Femap.* Property (\d+) : (.*\S)", line
    ):
        deck.property_names[int(match[1])] = match[2]
    elif line.startswith("$ Created by Gmsh"):
        deck.by_gmsh = True


def _read_case_control(lines: list[Line], deck: Deck) -> list[Line]:
    """Store the SETs of case control (a comma at the end continues a SET); return the other lines."""
    other_lines, k = [], 0
    while k < len(lines):
        match = re.match(r"\s*SET\s+(\d+)\s*=\s*(.*)$", lines[k].text, re.I)
        if not match:
            other_lines.append(lines[k])
            k += 1
            continue
        text = match[2]
        while text.rstrip().endswith(",") and k + 1 < len(lines):
            k += 1
            text += lines[k].text
        words = text.replace(",", " ").split()
        if all(re.fullmatch(r"\d+|THRU|BY|EXCEPT", word, re.I) for word in words):  # not ALL, not real numbers
            deck.sets[int(match[1])] = read_number_list(words)
        k += 1
    return other_lines


def _cards(lines: list[Line]) -> list[RawCard]:
    """Cards with their fields; a continuation is added to the card whose last line ended in its mark, wherever that
    is."""
    cards: list[RawCard] = []
    marked: dict[str, int] = {}  # mark at the end of a line -> index of the card that it continues
    pending: list[_Fields] = []  # continuations whose mark occurs only in a later line
    last = ""
    end = next((k for k, line in enumerate(lines) if re.match(r"\s*ENDDATA", line.text, re.I)), len(lines))
    parsed_lines = [(line, _fields(line.text)) for line in lines[:end] if line.text.strip()]
    marks = {parsed.mark for _, parsed in parsed_lines if parsed.mark}
    changes = list[str]()
    for k, (line, parsed) in enumerate(parsed_lines):
        mark = parsed.first.lstrip("+*").strip()
        repeat = REPEAT.fullmatch(parsed.first)
        if repeat and cards:
            changes = parsed.fields if any(parsed.fields) else changes
            check_count(int(repeat[1] or 1), f"{line.file}:{line.number}")
            for _ in range(int(repeat[1] or 1)):
                cards.append(_replicated(changes, cards[-1], line))
            last = ""
        elif parsed.first and parsed.first[0] not in "+*":
            card = RawCard(parsed.first.rstrip("*").strip().upper(), parsed.fields, line.file, line.number)
            if cards and cards[-1].name == card.name and any(REPEATED_FIELD.fullmatch(word) for word in parsed.fields):
                is_continued = k + 1 < len(parsed_lines) and parsed_lines[k + 1][1].first[:1] in ("", "+", "*")
                card = _replicated(parsed.fields, cards[-1], line, len(parsed.fields) if is_continued else None)
            cards.append(card)
        elif mark and mark != last and mark in marked:
            cards[marked[mark]].fields.extend(parsed.fields)
            marked |= {parsed.mark: marked[mark]} if parsed.mark else {}
            continue
        elif mark and mark != last and mark in marks:
            pending.append(parsed)
            continue
        elif cards:
            cards[-1].fields.extend(parsed.fields)
        last = parsed.mark
        if last:
            marked[last] = len(cards) - 1
    while pending:  # continuations that precede their card, or the line that they continue
        parsed = next(
            (continuation for continuation in pending if continuation.first.lstrip("+*").strip() in marked), pending[0]
        )
        pending.remove(parsed)
        card_index = marked.get(parsed.first.lstrip("+*").strip())
        if card_index is not None:
            cards[card_index].fields.extend(parsed.fields)
            marked |= {parsed.mark: card_index} if parsed.mark else {}
    return cards


def _split_blanks(word: str) -> list[str]:
    """Fields of a free-format line between two commas; blanks also separate numbers and words (PBAR, 1 11 .785)."""
    words = word.split()
    return words if len(words) > 1 and all(FREE_FIELD.fullmatch(item) for item in words) else [word]


def _replicated(fields: list[str], before: RawCard, line: Line, size: int | None = None) -> RawCard:
    """The card that repeats another one: = copies a field, *(x) adds x to it, == copies all following ones up to
    `size`.

    Raises ValueError if a number is added to a field that is no number.
    """
    new_fields, k = list[str](), 0
    for k, word in enumerate(fields):
        previous = before.fields[k] if k < len(before.fields) else ""
        if word == "==":
            return RawCard(before.name, [*new_fields, *before.fields[k:size]], line.file, line.number)
        added = re.fullmatch(r"\*\(?([^()]+)\)?", word)
        if added is None:
            new_fields.append(previous if word == "=" else word)
            continue
        try:
            numbers = [real(number) for number in (previous or "0", added[1])]
        except ValueError:
            changes = ", ".join(word for word in fields if word)
            raise ValueError(
                f"{line.file}:{line.number}: the line repeats {before.name} with {changes}, where a number is added to "
                "what is none; write the cards out"
            ) from None
        all_integers = all(re.fullmatch(r"[+-]?\d+", number) for number in (previous or "0", added[1]))
        new_fields.append(str(round(sum(numbers))) if all_integers else f"{float(f'{sum(numbers):.13g}')!r}")
    return RawCard(before.name, new_fields, line.file, line.number)


class _Fields(NamedTuple):
    """First field, data fields padded to a full line (8, or 4 when large), and the mark at the end without + and *."""

    first: str
    fields: list[str]
    mark: str


def _fields(line: str) -> _Fields:
    """Fields of one line, free or in columns; a free-format line with more than nine fields includes its
    continuations."""
    if "," in line:
        words = [part for word in line.split(",") for part in _split_blanks(word.strip())]
        first, words = words[0], words[1:]
        size = 4 if "*" in first else 8
        fields, mark = list[str](), ""
        while words:
            part, rest = words[:size], words[size:]
            fields += part + [""] * (size - len(part))
            mark = rest[0].lstrip("+*").strip() if rest else ""
            words = rest[1:]
        return _Fields(first, fields or [""] * size, mark)
    if REPEAT.fullmatch(line.strip()):  # a count may be longer than a field
        return _Fields(line.strip(), [""] * 8, "")
    first, large = line[:8].strip(), "*" in line[:8]
    size, width = (4, WIDTH[True]) if large else (8, WIDTH[False])
    words = [line[8 + k * width : 8 + (k + 1) * width].strip() for k in range(size)]
    return _Fields(first, words, line[72:80].strip().lstrip("+*").strip())
