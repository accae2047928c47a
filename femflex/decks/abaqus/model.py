"""State shared by all readers of an Abaqus deck: the flat deck, the structure under construction, and findings."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from femflex.arrays import Array
from femflex.decks.findings import Location, Overrides
from femflex.decks.model import DeckModel
from femflex.decks.units import Units
from femflex.mesh.formats.abaqus_flat import FlatDeck, InstanceKeyword, Placement
from femflex.mesh.formats.abaqus_keywords import Keyword


def location_of(keyword: Keyword, row: int | None = None) -> Location:
    """Location of a keyword, or of one of its data lines."""
    return (
        Location(keyword.file, keyword.line) if row is None else Location(keyword.files[row], keyword.line_numbers[row])
    )


@dataclass
class AbaqusModel(DeckModel):
    """The deck and the parts of the structure built from it.

    rotation_nodes  CalculiX: node whose displacements are the rotations of another
    """

    flat: FlatDeck
    units: Units
    override: Overrides
    rotation_nodes: dict[int, int] = field(default_factory=dict)
    merged: dict[int, int] = field(default_factory=dict)  # tied node -> the node it coincides with
    # mass of sections given by stiffness, by ELSET [kg/m^2]
    area_masses: dict[str, float] = field(default_factory=dict)
    bare_sections: dict[str, str] = field(default_factory=dict)  # ELSETs of such sections without mass -> location
    flat_rigid: set[int] = field(default_factory=set)  # elements of rigid types, of which only the nodes are used

    def x(self, node: int) -> Array:
        """Position (3,) of a node [m]."""
        return self.flat.nodes[node] * self.units.length

    def representative(self, node: int) -> int:
        """The node that represents this node: the one it is tied to, or itself."""
        while node in self.merged:
            node = self.merged[node]
        return node

    def group_of(self, nodes: list[int], name: str) -> str:
        """Add a group of several nodes under this name, in small letters; returns the name."""
        return self.new_group(plain_name(name), nodes)

    def keywords_named(self, *names: str, use: bool = True) -> Iterator[InstanceKeyword]:
        """Keywords of these names with their instance, in order, counted as used."""
        for entry in self.flat.keywords:
            if entry.keyword.name in names:
                if use:
                    self.findings.use(f"*{entry.keyword.name}")
                yield entry

    def for_each_keyword(self, action: Callable[[InstanceKeyword], object], *names: str, use: bool = True) -> None:
        """Call the action for each keyword of these names; a ValueError becomes a problem at its location."""
        for entry in self.keywords_named(*names, use=use):
            self.attempt(entry.keyword, lambda entry=entry: action(entry))  # type: ignore[misc]

    def attempt(self, keyword: Keyword, action: Callable[[], object]) -> bool:
        """Call the action for a keyword; a ValueError becomes a problem. Whether there was none."""
        try:
            action()
            return True
        except ValueError as error:
            text = str(error)
            self.findings.problem(text, None if f"{keyword.file}, line" in text else location_of(keyword))
            return False

    def nodes_of(self, word: str, scope: str, keyword: Keyword, row: int | None = None) -> list[int]:
        """Nodes named by a word. Raises ValueError if there are none."""
        nodes = self.flat.nodes_of(word, scope, keyword.location(row))
        if not nodes:
            raise keyword.error(f"names {word!r}, which holds no node of the deck; correct it.", row)
        return nodes

    def node_of(self, word: str, scope: str, keyword: Keyword, row: int | None = None) -> int:
        """The single node named by a word. Raises ValueError if it names none or several."""
        nodes = self.nodes_of(word, scope, keyword, row)
        if len(nodes) != 1:
            raise keyword.error(f"needs one node; {word!r} has {len(nodes)}. Name a single node.", row)
        return nodes[0]

    def placement(self, scope: str) -> Placement:
        """Placement of an instance."""
        return self.flat.placements.get(scope.upper(), Placement())

    def depend(self, node: int, components: tuple[int, ...], label: str, keyword: Keyword) -> bool:
        """Record that components (0 to 5) of a node are dependent; add a problem and return False if they already
        are."""
        node, numbers = self.representative(node), tuple(c + 1 for c in components)
        return self.make_dependent(node, numbers, f"node {self.flat.label(node)}", label, location_of(keyword))


def plain_name(name: str) -> str:
    """The words of a text as the name of a group."""
    return re.sub(r"\W+", "_", name).strip("_").lower()
