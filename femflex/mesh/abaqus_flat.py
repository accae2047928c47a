"""An Abaqus deck without its parts: nodes, elements and sets of all instances, numbered and placed as one model."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from femflex.arrays import Array
from femflex.mesh.abaqus_elements import END_MIDDLE_END, cell_of
from femflex.mesh.abaqus_keywords import Keyword, read_keywords
from femflex.mesh.abaqus_nodes import NodeReader
from femflex.mesh.abaqus_sets import Sets
from femflex.mesh.numbers import Numbers, check_count, spanned

NODES = ("NODE", "SYSTEM", "NGEN", "NFILL")
REFUSED = {"NCOPY", "NMAP", "ELCOPY"}
STEP = 10  # numbers of a further instance start at the next power of ten


class Scoped(NamedTuple):
    """A keyword and the instance it is of, "" for the deck or the assembly; those of a part come once per instance."""

    scope: str
    keyword: Keyword


class Element(NamedTuple):
    """One element: Abaqus type, cell ("" where it is no cell of a mesh), its nodes in meshio's order, extra nodes.

    extra: the orientation node of a beam.
    """

    kind: str
    cell: str
    number: int
    nodes: tuple[int, ...]
    extra: tuple[int, ...]
    place: str


@dataclass(frozen=True)
class Placement:
    """Motion of an instance: x -> C (x + shift - origin) + origin."""

    shift: Array = field(default_factory=lambda: np.zeros(3))
    C: Array = field(default_factory=lambda: np.eye(3))
    origin: Array = field(default_factory=lambda: np.zeros(3))

    def moved(self, x: Array) -> Array:
        """Positions (..., 3) [m] in the assembly."""
        return (x + self.shift - self.origin) @ self.C.T + self.origin


@dataclass(frozen=True)
class Flat:
    """All of a deck as one model.

    nodes        number -> position (3,), in the deck's units
    elements     number -> Element, ascending
    nsets, elsets   named sets over these numbers
    keywords     all keywords with their instance, in order
    shifts       what is added to the numbers of an instance, by its name in capitals
    placements   motion of every instance, likewise
    """

    nodes: dict[int, Array]
    elements: dict[int, Element]
    nsets: Sets
    elsets: Sets
    keywords: list[Scoped]
    shifts: Mapping[str, int]
    placements: Mapping[str, Placement]

    def nodes_of(self, word: str, scope: str, place: str = "") -> list[int]:
        """Numbers of the nodes that a word of a data line names: a number or a set, those that exist, each once."""
        return list(dict.fromkeys(Numbers(tuple(self.nsets.named(word, scope, place))).among(self.nodes)))

    def elements_of(self, word: str, scope: str, place: str = "") -> list[int]:
        """Numbers of the elements that a word names, likewise."""
        return list(dict.fromkeys(Numbers(tuple(self.elsets.named(word, scope, place))).among(self.elements)))

    def label(self, number: int, element: int | None = None) -> str:
        """A number as the file has it, with the instance that it is of, such as "7 of instance 'wing-2'".

        element: number of the one that uses a node which does not exist, and is then taken for one of its instance
        """
        below = [scope for scope, shift in self.shifts.items() if shift <= (number if element is None else element)]
        own = number - self.shifts[below[-1]]
        spelled = {one.scope.upper(): one.scope for one in self.keywords}
        return f"{own} of instance {spelled[below[-1]]!r}" if below[-1] else str(own)


def read_flat(path: Path) -> Flat:
    """The Flat of a deck; ValueError with file and line where it cannot be read."""
    scoped, placements = _by_instance(read_keywords(path))
    made = sorted({keyword.name for _, keyword in scoped} & REFUSED)
    if made:
        raise ValueError(
            f"{path.name} makes nodes or elements by *{', *'.join(made)}; only those written out, and *NGEN, *NFILL "
            "and *ELGEN, are read. Write it again with its nodes and elements (*PREPRINT, MODEL=YES lists them)."
        )
    readers: dict[str, NodeReader] = {}
    named: list[tuple[str, str, list[int]]] = []  # instance, node set, own numbers
    for scope, keyword in scoped:
        if keyword.name in NODES:
            numbers = readers.setdefault(scope.upper(), NodeReader()).read(keyword)
            named.append((scope, keyword.parameter("nset"), numbers))
    if not any(reader.nodes for reader in readers.values()):
        raise ValueError(f"{path.name} has no *NODE block; it is no Abaqus input with a mesh.")
    own = {scope: list[Element]() for scope in ["", *placements]}
    grouped: list[tuple[str, str, list[int]]] = []
    for scope, keyword in scoped:
        if keyword.name in ("ELEMENT", "ELGEN"):
            into = own[scope.upper()]
            new = _elements(keyword) if keyword.name == "ELEMENT" else _generated(keyword, into)
            into += new
            masters = (
                []
                if keyword.name == "ELEMENT"
                else [keyword.integer(row[0], k, "an element") for k, row in enumerate(keyword.data)]
            )
            own_set = dict.fromkeys([*masters, *(element.number for element in new)])  # its set holds the master too
            grouped.append((scope, keyword.parameter("elset"), list(own_set)))
    shifts = _shifts(readers, own)
    nsets, elsets = Sets("NSET", shifts), Sets("ELSET", shifts)
    for scope, _ in scoped:
        nsets.spell_instance(scope)
        elsets.spell_instance(scope)
    nodes = {
        number + shifts[scope]: placements.get(scope, Placement()).moved(x)
        for scope, reader in readers.items()
        for number, x in reader.nodes.items()
    }
    for sets, listed in ((nsets, named), (elsets, grouped)):
        for scope, name, numbers in listed:
            sets.add(scope, name, [number + shifts[scope.upper()] for number in numbers])
    elements = {}
    for scope, mine in own.items():
        for element in mine:
            by = shifts[scope]
            elements[element.number + by] = element._replace(
                number=element.number + by,
                nodes=_resolved(element, element.nodes, by, shifts),
                extra=_resolved(element, element.extra, by, shifts),
            )
    elements = dict(sorted(elements.items()))
    flat = Flat(nodes, elements, nsets, elsets, scoped, shifts, placements)
    _read_sets(flat)
    return flat


def _by_instance(keywords: list[Keyword]) -> tuple[list[Scoped], dict[str, Placement]]:
    """Keywords with their instance, those of a part once for each of its instances; and where the instances are."""
    parts: dict[str, list[Keyword]] = {}
    rest: list[Keyword] = []
    part: list[Keyword] | None = None
    for keyword in keywords:
        if keyword.name == "PART":
            part = parts.setdefault(keyword.parameter("name").upper(), [])
        elif keyword.name == "END PART":
            part = None
        else:
            (rest if part is None else part).append(keyword)
    placements: dict[str, Placement] = {}
    scoped: list[Scoped] = []
    scope = ""
    if not any(keyword.name == "INSTANCE" for keyword in rest):  # parts alone: each in place
        for name, own in parts.items():
            scope = name if len(parts) > 1 else ""  # the numbers of one part are those of the deck
            placements[scope] = Placement()
            scoped += [Scoped(scope, keyword) for keyword in own]
    for keyword in rest:
        if keyword.name == "INSTANCE":
            scope = keyword.parameter("name")
            name = keyword.parameter("part").upper()
            if name and name not in parts:
                raise ValueError(
                    f"{keyword.place()}: instance {scope!r} is of part {keyword.parameter('part')!r}, which is not in "
                    f"the deck; its parts are {sorted(parts)}."
                )
            placements[scope.upper()] = _placement(keyword)
            scoped.append(Scoped(scope, keyword))
            scoped += [Scoped(scope, one) for one in parts.get(name, [])]
        elif keyword.name == "END INSTANCE":
            scope = ""
        else:
            scoped.append(Scoped(scope, keyword))
    return scoped, placements


def _placement(keyword: Keyword) -> Placement:
    """Translation on the first data line; on the second two points of an axis and the angle about it in degrees."""
    rows = [[keyword.real(word, k, "a number") for word in row] for k, row in enumerate(keyword.data)]
    shift = np.array([*(rows[0] if rows else []), 0.0, 0.0, 0.0][:3])
    if len(rows) < 2:
        return Placement(shift)
    if len(rows[1]) != 7:
        raise ValueError(f"{keyword.place(1)}: a rotation of an instance has two points and an angle; give 7 numbers.")
    a, b, angle = np.array(rows[1][:3]), np.array(rows[1][3:6]), np.radians(rows[1][6])
    axis = (b - a) / (np.linalg.norm(b - a) or 1.0)
    cross = np.cross(np.eye(3), axis)
    C = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross  # cross @ x = axis x x
    return Placement(shift, C, a)


def _elements(keyword: Keyword) -> list[Element]:
    """Elements of one block."""
    kind = keyword.parameter("type").upper()
    cell, count = cell_of(kind)
    if not cell:
        return _strangers(keyword, kind)
    found, row, start = [], list[int](), 0
    for k, words in enumerate(keyword.data):
        start = start if row else k
        row += [keyword.integer(word, k, "the number of an element or a node") for word in words if word]
        if len(row) <= count:
            continue  # goes on in the next line
        if len(row) > count + 1 + (cell in ("line", "line3")):  # a beam may add a node for its orientation
            raise ValueError(
                f"{keyword.place(start)}: element {row[0]} of type {kind} has {len(row) - 1} nodes; it needs {count}."
            )
        nodes = [row[1 + j] for j in END_MIDDLE_END] if cell == "line3" else row[1 : count + 1]
        extra = tuple(row[count + 1 :])
        found.append(Element(kind, cell, row[0], tuple(nodes), extra, keyword.place(start)))
        row = []
    if row:
        raise ValueError(
            f"{keyword.place(start)}: element {row[0]} of type {kind} has {len(row) - 1} nodes; it needs {count}."
        )
    return found


def _strangers(keyword: Keyword, kind: str) -> list[Element]:
    """Elements that are no cells (masses, springs, connectors); a line that ends in a comma goes on in the next.

    Nodes written INSTANCE.NUMBER are left to the sets, as negative numbers cannot be.
    """
    found, row, start = [], list[str](), 0
    for k, words in enumerate(keyword.data):
        start = start if row else k
        row += [word for word in words if word]
        if words[-1] == "" and len(words) > 2 and k + 1 < len(keyword.data):
            continue
        if row:
            number = keyword.integer(row[0], start, "the number of an element")
            nodes = tuple(int(word) if word.isdigit() else word for word in row[1:])
            found.append(Element(kind, "", number, nodes, (), keyword.place(start)))  # type: ignore[arg-type]
        row = []
    return found


def _resolved(element: Element, nodes: tuple[int | str, ...], shift: int, shifts: Mapping[str, int]) -> tuple[int, ...]:
    """Numbers of the nodes of an element in the whole model."""
    found = []
    for node in nodes:
        if isinstance(node, int):
            found.append(node + shift)
            continue
        instance, _, number = str(node).upper().rpartition(".")
        if not number.isdigit() or instance not in shifts:
            raise ValueError(
                f"{element.place}: element {element.number} has {node!r} where the number of a node belongs."
            )
        found.append(int(number) + shifts[instance])
    return tuple(found)


def _generated(keyword: Keyword, known: list[Element]) -> list[Element]:
    """Copies of a master element in up to three directions (*ELGEN)."""
    by_number = {element.number: element for element in known}
    found: list[Element] = []
    for k, row in enumerate(keyword.data):
        values = [keyword.integer(word, k, "a number") if word else 0 for word in row]
        if values[0] not in by_number:
            raise ValueError(f"{keyword.place(k)}: *ELGEN copies element {values[0]}, which is not defined before.")
        values += [0] * (10 - len(values))
        copies = [by_number[values[0]]]
        check_count(math.prod(max(count, 1) for count in values[1::3]), keyword.place(k))
        for count, by_node, by_element in (values[1:4], values[4:7], values[7:10]):
            copies = [
                one._replace(
                    number=one.number + j * (by_element or 1), nodes=tuple(n + j * (by_node or 1) for n in one.nodes)
                )
                for j in range(max(count, 1))
                for one in copies
            ]
        found += [one for one in copies if one.number not in by_number]
    return found


def _shifts(readers: Mapping[str, NodeReader], elements: Mapping[str, list[Element]]) -> dict[str, int]:
    """What is added to the numbers of every instance, so that they differ: nothing for the first."""
    shifts: dict[str, int] = {}
    top = 0
    scopes = dict.fromkeys([*(scope for scope in elements if scope), ""])
    for scope in scopes:
        reader = readers.get(scope)
        numbers = [*(reader.nodes if reader else ()), *(element.number for element in elements[scope])]
        shifts[scope] = top
        if numbers:
            size = 1
            while size <= max(numbers):
                size *= STEP
            top = -(-(top + max(numbers) + 1) // size) * size
    return shifts


def _read_sets(flat: Flat) -> None:
    """Add every *NSET and *ELSET; a set that names one defined further on waits for it."""
    waiting = [one for one in flat.keywords if one.keyword.name in ("NSET", "ELSET")]
    for scope, keyword in waiting:
        _sets(flat, keyword).add(scope, keyword.parameter(keyword.name.lower()), [])
    defined = {(scope, keyword.name, keyword.parameter(keyword.name.lower()).upper()) for scope, keyword in waiting}
    done = set[tuple[str, str, str]]()
    while waiting:
        later = []
        for one in waiting:
            key = one.scope, one.keyword.name, one.keyword.parameter(one.keyword.name.lower()).upper()
            needs = {(one.scope, one.keyword.name, word.upper()) for row in one.keyword.data for word in row if word}
            if (needs & defined) - done - {key} and "generate" not in one.keyword.parameters:
                later.append(one)
                continue
            _read_set(flat, *one)
            done.add(key)
        if len(later) == len(waiting):  # sets of one another, or of one that comes in pieces
            for one in later:
                _read_set(flat, *one)
            return
        waiting = later


def _sets(flat: Flat, keyword: Keyword) -> Sets:
    return flat.nsets if keyword.name == "NSET" else flat.elsets


def _read_set(flat: Flat, scope: str, keyword: Keyword) -> None:
    """Add an *NSET or *ELSET: numbers, GENERATE triples, names of other sets, or the nodes of an ELSET."""
    mine, name = _sets(flat, keyword), keyword.parameter(keyword.name.lower())
    instance = keyword.parameter("instance")
    within = instance if instance.upper() in flat.shifts and instance else scope
    if keyword.name == "NSET" and keyword.parameter("elset"):
        wanted = flat.elements_of(keyword.parameter("elset"), within, keyword.place())
        mine.add(scope, name, sorted({node for number in wanted for node in flat.elements[number].nodes}))
        return
    for k, row in enumerate(keyword.data):
        words = [word for word in row if word]
        if "generate" in keyword.parameters:
            mine.add(scope, name, list(_ranges(flat, keyword, k, words, within)))
            continue
        for word in words:
            mine.add(scope, name, mine.named(word, within, keyword.place(k)))


def _ranges(flat: Flat, keyword: Keyword, row: int, words: list[str], scope: str) -> Iterator[range]:
    """The range of a GENERATE line: first, last, step."""
    if len(words) < 2:
        raise ValueError(f"{keyword.place(row)}: *{keyword.name}, GENERATE needs first, last and step; got {words}.")
    first, last, step = (keyword.integer(word, row, "a number") for word in [*words, "1"][:3])
    by = flat.shifts[scope.upper()]
    try:
        numbers = spanned(first, last, step)
    except ValueError as error:
        raise ValueError(f"{keyword.place(row)}: *{keyword.name}, GENERATE: {error}") from None
    yield range(numbers.start + by, numbers.stop + by, step)
