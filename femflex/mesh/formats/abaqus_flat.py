"""An Abaqus deck without its parts: nodes, elements and sets of all instances, numbered and positioned as one model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from femflex.arrays import Array
from femflex.mesh.formats.abaqus_elements import END_MIDDLE_END, cell_of
from femflex.mesh.formats.abaqus_keywords import Keyword, read_keywords
from femflex.mesh.formats.abaqus_nodes import NodeReader, Sets
from femflex.mesh.formats.guards import check_count
from femflex.mesh.formats.numbers import Numbers, inclusive_range

NODES = ("NODE", "SYSTEM", "NGEN", "NFILL")
UNSUPPORTED = {"NCOPY", "NMAP", "ELCOPY"}
OFFSET_BASE = 10  # numbers of each further instance start at the next power of ten


class InstanceKeyword(NamedTuple):
    """A keyword and its instance, "" for the deck or the assembly. Keywords of a part appear once for each instance."""

    scope: str
    keyword: Keyword


class Element(NamedTuple):
    """One element: Abaqus type, cell ("" if it is no mesh cell), its nodes in meshio's order, and extra nodes.

    extra: the orientation node of a beam.
    """

    kind: str
    cell: str
    number: int
    nodes: tuple[int, ...]
    extra: tuple[int, ...]
    location: str


@dataclass(frozen=True)
class Placement:
    """Motion of an instance: x -> C (x + shift - origin) + origin."""

    shift: Array = field(default_factory=lambda: np.zeros(3))
    C: Array = field(default_factory=lambda: np.eye(3))
    origin: Array = field(default_factory=lambda: np.zeros(3))

    def assembly_position(self, x: Array) -> Array:
        """Positions (..., 3) [m] in the assembly."""
        return (x + self.shift - self.origin) @ self.C.T + self.origin


@dataclass(frozen=True)
class FlatDeck:
    """A whole deck as one model.

    nodes        number -> position (3,), in the deck's units
    elements     number -> Element, ascending
    nsets, elsets   named sets over these numbers
    keywords     all keywords with their instance, in order
    shifts       offset added to the numbers of an instance, by its name in capitals
    placements   rigid motion of every instance, by the same name
    """

    nodes: dict[int, Array]
    elements: dict[int, Element]
    nsets: Sets
    elsets: Sets
    keywords: list[InstanceKeyword]
    shifts: Mapping[str, int]
    placements: Mapping[str, Placement]

    def nodes_of(self, word: str, scope: str, location: str = "") -> list[int]:
        """Distinct numbers of the existing nodes that a word of a data line names; the word is a number or a set."""
        return list(dict.fromkeys(Numbers(tuple(self.nsets.numbers_in(word, scope, location))).among(self.nodes)))

    def elements_of(self, word: str, scope: str, location: str = "") -> list[int]:
        """Distinct numbers of the existing elements that a word names."""
        return list(dict.fromkeys(Numbers(tuple(self.elsets.numbers_in(word, scope, location))).among(self.elements)))

    def label(self, number: int, element: int | None = None) -> str:
        """A number as written in the file, with its instance, such as "7 of instance 'wing-2'".

        element: number of the element that uses an undefined node, which is then assigned to the element's instance
        """
        candidates = [
            scope for scope, shift in self.shifts.items() if shift <= (number if element is None else element)
        ]
        number_in_instance = number - self.shifts[candidates[-1]]
        spelling = {keyword.scope.upper(): keyword.scope for keyword in self.keywords}
        return (
            f"{number_in_instance} of instance {spelling[candidates[-1]]!r}"
            if candidates[-1]
            else str(number_in_instance)
        )


def read_flat(path: Path) -> FlatDeck:
    """The FlatDeck of a deck; ValueError with file and line if the deck cannot be read."""
    scoped, placements = _keywords_by_instance(read_keywords(path))
    unsupported = sorted({keyword.name for _, keyword in scoped} & UNSUPPORTED)
    if unsupported:
        raise ValueError(
            f"{path.name} makes nodes or elements by *{', *'.join(unsupported)}; only those written out, and *NGEN, "
            "*NFILL and *ELGEN, are read. Write it again with its nodes and elements (*PREPRINT, MODEL=YES lists them)."
        )
    readers: dict[str, NodeReader] = {}
    node_lists: list[tuple[str, str, list[int]]] = []  # instance, node set, own numbers
    for scope, keyword in scoped:
        if keyword.name in NODES:
            numbers = readers.setdefault(scope.upper(), NodeReader()).read_keyword(keyword)
            node_lists.append((scope, keyword.parameter("nset"), numbers))
    if not any(reader.nodes for reader in readers.values()):
        raise ValueError(f"{path.name} has no *NODE block; it is no Abaqus input with a mesh.")
    elements_of_scope = {scope: list[Element]() for scope in ["", *placements]}
    element_lists: list[tuple[str, str, list[int]]] = []
    for scope, keyword in scoped:
        if keyword.name in ("ELEMENT", "ELGEN"):
            known_elements = elements_of_scope[scope.upper()]
            new_elements = (
                _elements(keyword) if keyword.name == "ELEMENT" else _copied_elements(keyword, known_elements)
            )
            known_elements += new_elements
            masters = (
                []
                if keyword.name == "ELEMENT"
                else [keyword.integer(row[0], k, "an element") for k, row in enumerate(keyword.data)]
            )
            # the set also contains the master element
            set_members = dict.fromkeys([*masters, *(element.number for element in new_elements)])
            element_lists.append((scope, keyword.parameter("elset"), list(set_members)))
    shifts = _number_offsets(readers, elements_of_scope)
    nsets, elsets = Sets("NSET", shifts), Sets("ELSET", shifts)
    for scope, _ in scoped:
        nsets.spell_instance(scope)
        elsets.spell_instance(scope)
    nodes = {
        number + shifts[scope]: placements.get(scope, Placement()).assembly_position(x)
        for scope, reader in readers.items()
        for number, x in reader.nodes.items()
    }
    for sets, lists in ((nsets, node_lists), (elsets, element_lists)):
        for scope, name, numbers in lists:
            sets.add(scope, name, [number + shifts[scope.upper()] for number in numbers])
    elements = {}
    for scope, scope_elements in elements_of_scope.items():
        for element in scope_elements:
            offset = shifts[scope]
            elements[element.number + offset] = element._replace(
                number=element.number + offset,
                nodes=_global_node_numbers(element, element.nodes, offset, shifts),
                extra=_global_node_numbers(element, element.extra, offset, shifts),
            )
    elements = dict(sorted(elements.items()))
    flat = FlatDeck(nodes, elements, nsets, elsets, scoped, shifts, placements)
    _read_sets(flat)
    return flat


def _keywords_by_instance(keywords: list[Keyword]) -> tuple[list[InstanceKeyword], dict[str, Placement]]:
    """Keywords with their instance, those of a part once for each of its instances; and the placements of the
    instances."""
    parts: dict[str, list[Keyword]] = {}
    outside: list[Keyword] = []
    part: list[Keyword] | None = None
    for keyword in keywords:
        if keyword.name == "PART":
            part = parts.setdefault(keyword.parameter("name").upper(), [])
        elif keyword.name == "END PART":
            part = None
        else:
            (outside if part is None else part).append(keyword)
    placements: dict[str, Placement] = {}
    scoped: list[InstanceKeyword] = []
    scope = ""
    if not any(keyword.name == "INSTANCE" for keyword in outside):  # no instances: each part where it is defined
        for name, part_keywords in parts.items():
            scope = name if len(parts) > 1 else ""  # the numbers of one part are those of the deck
            placements[scope] = Placement()
            scoped += [InstanceKeyword(scope, keyword) for keyword in part_keywords]
    for keyword in outside:
        if keyword.name == "INSTANCE":
            scope = keyword.parameter("name")
            name = keyword.parameter("part").upper()
            if name and name not in parts:
                raise keyword.error(
                    f": instance {scope!r} is of part {keyword.parameter('part')!r}, which is not in the deck; its "
                    f"parts are {sorted(parts)}."
                )
            placements[scope.upper()] = _placement(keyword)
            scoped.append(InstanceKeyword(scope, keyword))
            scoped += [InstanceKeyword(scope, part_keyword) for part_keyword in parts.get(name, [])]
        elif keyword.name == "END INSTANCE":
            scope = ""
        else:
            scoped.append(InstanceKeyword(scope, keyword))
    return scoped, placements


def _placement(keyword: Keyword) -> Placement:
    """Translation on the first data line; on the second two points of an axis and the angle about it in degrees."""
    rows = [[keyword.real(word, k, "a number") for word in row] for k, row in enumerate(keyword.data)]
    shift = np.array([*(rows[0] if rows else []), 0.0, 0.0, 0.0][:3])
    if len(rows) < 2:
        return Placement(shift)
    if len(rows[1]) != 7:
        raise keyword.error(": a rotation of an instance has two points and an angle; give 7 numbers.", 1)
    a, b, angle = np.array(rows[1][:3]), np.array(rows[1][3:6]), np.radians(rows[1][6])
    axis = (b - a) / (np.linalg.norm(b - a) or 1.0)
    cross = np.cross(np.eye(3), axis)
    C = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross  # cross @ x = axis x x
    return Placement(shift, C, a)


def _elements(keyword: Keyword) -> list[Element]:
    """Elements of one block. Those that are no mesh cells (masses, springs, connectors) have any number of nodes.

    Nodes of such elements written as INSTANCE.NUMBER are kept as text; `_global_node_numbers` resolves them.
    """
    kind = keyword.parameter("type").upper()
    cell, count = cell_of(kind)
    elements, row, start = [], list[str](), 0
    for k, words in enumerate(keyword.data):
        start = start if row else k
        row += [word for word in words if word]
        if k + 1 < len(keyword.data) and (len(row) <= count if cell else words[-1] == "" and len(words) > 2):
            continue  # continued on the next line
        if not row:
            continue
        number = keyword.integer(row[0], start, "the number of an element")
        if cell:
            nodes = [keyword.integer(word, k, "the number of an element or a node") for word in row[1:]]
            if not count <= len(nodes) <= count + (cell in ("line", "line3")):  # a beam may add a node to orient it
                raise keyword.error(
                    f": element {number} of type {kind} has {len(nodes)} nodes; it needs {count}.", start
                )
            main = [nodes[j] for j in END_MIDDLE_END] if cell == "line3" else nodes[:count]
            elements.append(Element(kind, cell, number, tuple(main), tuple(nodes[count:]), keyword.location(start)))
        else:
            words_or_numbers = tuple(int(word) if word.isdigit() else word for word in row[1:])
            elements.append(Element(kind, "", number, words_or_numbers, (), keyword.location(start)))  # type: ignore[arg-type]
        row = []
    return elements


def _global_node_numbers(
    element: Element, nodes: tuple[int | str, ...], offset: int, offsets: Mapping[str, int]
) -> tuple[int, ...]:
    """Numbers of the nodes of an element in the whole model."""
    numbers = []
    for node in nodes:
        if isinstance(node, int):
            numbers.append(node + offset)
            continue
        instance, _, number = str(node).upper().rpartition(".")
        if not number.isdigit() or instance not in offsets:
            raise ValueError(
                f"{element.location}: element {element.number} has {node!r} where the number of a node belongs."
            )
        numbers.append(int(number) + offsets[instance])
    return tuple(numbers)


def _copied_elements(keyword: Keyword, previous: list[Element]) -> list[Element]:
    """Copies of a master element in up to three directions (*ELGEN)."""
    by_number = {element.number: element for element in previous}
    new_elements: list[Element] = []
    for k, row in enumerate(keyword.data):
        values = [keyword.integer(word, k, "a number") if word else 0 for word in row]
        if values[0] not in by_number:
            raise keyword.error(f"copies element {values[0]}, which is not defined before.", k)
        values += [0] * (10 - len(values))
        copies = [by_number[values[0]]]
        check_count(math.prod(max(count, 1) for count in values[1::3]), keyword.location(k))
        for count, by_node, by_element in (values[1:4], values[4:7], values[7:10]):
            copies = [
                element._replace(
                    number=element.number + j * (by_element or 1),
                    nodes=tuple(n + j * (by_node or 1) for n in element.nodes),
                )
                for j in range(max(count, 1))
                for element in copies
            ]
        new_elements += [element for element in copies if element.number not in by_number]
    return new_elements


def _number_offsets(readers: Mapping[str, NodeReader], elements: Mapping[str, list[Element]]) -> dict[str, int]:
    """Offset added to the numbers of every instance so that all numbers differ; zero for the first instance."""
    offsets: dict[str, int] = {}
    next_offset = 0
    scopes = dict.fromkeys([*(scope for scope in elements if scope), ""])
    for scope in scopes:
        reader = readers.get(scope)
        numbers = [*(reader.nodes if reader else ()), *(element.number for element in elements[scope])]
        offsets[scope] = next_offset
        if numbers:
            size = 1
            while size <= max(numbers):
                size *= OFFSET_BASE
            next_offset = -(-(next_offset + max(numbers) + 1) // size) * size
    return offsets


def _read_sets(flat: FlatDeck) -> None:
    """Add every *NSET and *ELSET; a set that refers to another one is read after it."""
    by_key: dict[tuple[str, str, str], list[InstanceKeyword]] = {}
    for entry in flat.keywords:
        scope, keyword = entry
        if keyword.name in ("NSET", "ELSET"):
            name = keyword.parameter(keyword.name.lower())
            _sets_of_keyword(flat, keyword).add(scope, name, [])
            by_key.setdefault((scope, keyword.name, name.upper()), []).append(entry)
    begun = set[tuple[str, str, str]]()

    def read_set(key: tuple[str, str, str]) -> None:
        entries = () if key in begun else by_key.get(key, ())
        begun.add(key)
        for scope, keyword in entries:
            if "generate" not in keyword.parameters:
                for word in {word.upper() for row in keyword.data for word in row if word}:
                    read_set((scope, keyword.name, word))
            _read_set(flat, scope, keyword)

    for key in by_key:
        read_set(key)


def _sets_of_keyword(flat: FlatDeck, keyword: Keyword) -> Sets:
    return flat.nsets if keyword.name == "NSET" else flat.elsets


def _read_set(flat: FlatDeck, scope: str, keyword: Keyword) -> None:
    """Add an *NSET or *ELSET: numbers, GENERATE triples, names of other sets, or the nodes of an ELSET."""
    sets, name = _sets_of_keyword(flat, keyword), keyword.parameter(keyword.name.lower())
    instance = keyword.parameter("instance")
    search_scope = instance if instance.upper() in flat.shifts and instance else scope
    if keyword.name == "NSET" and keyword.parameter("elset"):
        elements = flat.elements_of(keyword.parameter("elset"), search_scope, keyword.location())
        sets.add(scope, name, sorted({node for number in elements for node in flat.elements[number].nodes}))
        return
    for k, row in enumerate(keyword.data):
        words = [word for word in row if word]
        if "generate" not in keyword.parameters:
            for word in words:
                sets.add(scope, name, sets.numbers_in(word, search_scope, keyword.location(k)))
            continue
        if len(words) < 2:
            raise keyword.error(f", GENERATE needs first, last and step; got {words}.", k)
        first, last, step = (keyword.integer(word, k, "a number") for word in [*words, "1"][:3])
        offset = flat.shifts[search_scope.upper()]
        try:
            numbers = inclusive_range(first, last, step)
        except ValueError as error:
            raise keyword.error(f", GENERATE: {error}", k) from None
        sets.add(scope, name, [range(numbers.start + offset, numbers.stop + offset, step)])
