"""Surfaces of an Abaqus deck, and the faces of elements by their labels S1 to S6."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from femflex.decks.abaqus.model import AbaqusModel
from femflex.mesh.cells import CELL_TYPES, side_of
from femflex.mesh.formats.abaqus_flat import Element, InstanceKeyword

# Corners of the faces by cell shape, in Abaqus' numbering S1, S2, ...
FACES: dict[str, list[tuple[int, ...]]] = {
    "tetra": [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)],
    "hexahedron": [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)],
    "wedge": [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)],
    "pyramid": [(0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)],
}


@dataclass(frozen=True)
class Surface:
    """A surface: its nodes, and (element, label) of its faces, none of a surface of nodes."""

    nodes: list[int]
    faces: list[tuple[int, str]]


Surfaces = dict[tuple[str, str], Surface]  # by instance and name, in capitals


def read_surfaces(model: AbaqusModel) -> Surfaces:
    """The surfaces of a deck (*SURFACE)."""
    surfaces: Surfaces = {}

    def add(entry: InstanceKeyword) -> None:
        scope, keyword = entry
        kind = (keyword.parameter("type") or "ELEMENT").upper()
        nodes: dict[int, None] = {}
        faces: list[tuple[int, str]] = []
        for k, row in enumerate(keyword.data):
            word = row[0]
            if not word:
                continue
            if kind == "NODE":
                nodes |= dict.fromkeys(model.nodes_of(word, scope, keyword, k))
                continue
            label = row[1].upper() if len(row) > 1 else ""
            for number in model.flat.elements_of(word, scope, keyword.location(k)):
                nodes |= dict.fromkeys(face_nodes(model.flat.elements[number], label))
                faces.append((number, label))
        surfaces[scope.upper(), keyword.parameter("name").upper()] = Surface(list(nodes), faces)

    model.for_each_keyword(add, "SURFACE")
    return surfaces


def surface_named(surfaces: Surfaces, word: str, scope: str) -> Surface | None:
    """The surface that a keyword of an instance names; None where there is none, or several."""
    instance, _, name_in_instance = word.upper().rpartition(".")
    for key in ((scope.upper(), word.upper()), ("", word.upper()), (instance, name_in_instance)):
        if key in surfaces:
            return surfaces[key]
    matches = [surface for (_, name), surface in surfaces.items() if name == word.upper()]
    return matches[0] if len(matches) == 1 else None


def face_nodes(element: Element, label: str) -> list[int]:
    """Nodes of a face of a solid, including middle nodes, or all nodes of another kind of element."""
    if not element.cell:
        return list(element.nodes)
    kind = CELL_TYPES[element.cell]
    number = int(label[1:]) - 1 if label[:1] in ("S", "E") and label[1:].isdigit() else -1
    if kind.shape in FACES and 0 <= number < len(FACES[kind.shape]):
        corners: Sequence[int] = FACES[kind.shape][number]
    elif kind.dimension == 2 and label.startswith("E") and 0 <= number < kind.n_corners:
        corners = (number, (number + 1) % kind.n_corners)
    else:
        return list(element.nodes)
    return [element.nodes[j] for j in side_of(kind, corners)[1]]
