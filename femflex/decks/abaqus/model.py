"""What all readers of an Abaqus deck share: the deck as one model, what is built of it, and what is found."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from femflex.arrays import Array
from femflex.decks.builder import Builder
from femflex.decks.findings import Findings, Place
from femflex.decks.units import Units
from femflex.fem import Bushing, PointMass, ScalarSpring
from femflex.fem.connections.connection import Connection
from femflex.mesh.abaqus_flat import Flat, Placement, Scoped
from femflex.mesh.abaqus_keywords import Keyword

WORDS = ("x", "y", "z", "rx", "ry", "rz")


def place_of(keyword: Keyword, row: int | None = None) -> Place:
    """Where a keyword stands, or one of its data lines."""
    return Place(keyword.file, keyword.line) if row is None else Place(keyword.files[row], keyword.at[row])


@dataclass
class AbaqusModel:
    """The deck and the parts of the structure that come from it.

    moving, turning   nodes that elements or connections move, and give a rotation
    wanted, wanted_turning   those that masses and springs need to move, and to turn
    depending         (node, component 0 to 5) -> what lets it follow others
    rotation_nodes    CalculiX: node whose displacements are the rotations of another
    """

    flat: Flat
    units: Units
    overrides: Mapping[str, Mapping[str, Any]]
    found: Findings = field(default_factory=Findings)
    build: Builder = field(default_factory=Builder)
    point_masses: list[PointMass] = field(default_factory=list)
    connections: list[Connection] = field(default_factory=list)
    bushings: list[Bushing | ScalarSpring] = field(default_factory=list)
    moving: set[int] = field(default_factory=set)
    turning: set[int] = field(default_factory=set)
    wanted: set[int] = field(default_factory=set)
    wanted_turning: set[int] = field(default_factory=set)
    depending: dict[tuple[int, int], str] = field(default_factory=dict)
    rotation_nodes: dict[int, int] = field(default_factory=dict)
    taken: set[str] = field(default_factory=set)  # overrides that were found
    merged: dict[int, int] = field(default_factory=dict)  # tied node -> the node it coincides with
    lumped: dict[int, tuple[float, Array | None, str]] = field(default_factory=dict)  # mass, inertia, place by node
    area_masses: dict[str, float] = field(default_factory=dict)  # of sections by stiffness, by ELSET [kg/m^2]
    bare_sections: dict[str, str] = field(default_factory=dict)  # those without one -> their place
    flat_rigid: set[int] = field(default_factory=set)  # elements of rigid types, which give their nodes alone

    def x(self, node: int) -> Array:
        """Position (3,) of a node [m]."""
        return self.flat.nodes[node] * self.units.length

    def same(self, node: int) -> int:
        """The node, or the one it is tied to."""
        while node in self.merged:
            node = self.merged[node]
        return node

    def row(self, node: int) -> int:
        """Row of the mesh's points of a node."""
        node = self.same(node)
        return self.build.node(node, self.x(node))

    def group(self, node: int) -> str:
        """The group of one point, node_17, of a node."""
        name = f"node_{self.same(node)}"
        if name not in self.build.point_groups:
            self.build.point_group(self.row(node), name)
        return name

    def group_of(self, nodes: list[int], name: str) -> str:
        """A group of several nodes, of that name or one like it."""
        name = re.sub(r"\W+", "_", name).strip("_").lower()
        k, own = 1, name
        while own in self.build.point_groups:
            k += 1
            own = f"{name}_{k}"
        self.build.point_groups[own] = list(dict.fromkeys(self.row(node) for node in nodes))
        return own

    def each(self, *names: str, use: bool = True) -> Iterator[Scoped]:
        """Keywords of these names with their instance, in order, counted as used."""
        for one in self.flat.keywords:
            if one.keyword.name in names:
                if use:
                    self.found.use(f"*{one.keyword.name}")
                yield one

    def trying(self, action: Callable[[Scoped], object], *names: str, use: bool = True) -> None:
        """Do something with each keyword of these names; a ValueError becomes a problem at its place."""
        for one in self.each(*names, use=use):
            self.attempt(one.keyword, lambda one=one: action(one))  # type: ignore[misc]

    def attempt(self, keyword: Keyword, action: Callable[[], object]) -> None:
        """Do something for a keyword; a ValueError becomes a problem."""
        try:
            action()
        except ValueError as error:
            text = str(error)
            self.found.problem(text, None if f"{keyword.file}, line" in text else place_of(keyword))

    def nodes_of(self, word: str, scope: str, keyword: Keyword, row: int | None = None) -> list[int]:
        """Nodes that a word names. Raises ValueError where it names none."""
        listed = self.flat.nodes_of(word, scope, keyword.place(row))
        if not listed:
            raise ValueError(
                f"{keyword.place(row)}: *{keyword.name} names {word!r}, which holds no node of the deck; correct it."
            )
        return listed

    def node_of(self, word: str, scope: str, keyword: Keyword, row: int | None = None) -> int:
        """The one node that a word names. Raises ValueError where it names none or several."""
        listed = self.nodes_of(word, scope, keyword, row)
        if len(listed) != 1:
            raise ValueError(
                f"{keyword.place(row)}: *{keyword.name} needs one node; {word!r} has {len(listed)}. Name a single node."
            )
        return listed[0]

    def placement(self, scope: str) -> Placement:
        """Motion of an instance."""
        return self.flat.placements.get(scope.upper(), Placement())

    def override(self, name: str, values: dict[str, float], where: str) -> dict[str, float]:
        """Values with those replaced that the overrides of a name give. Raises ValueError on unknown keys."""
        found = dict(values)
        own = next((key for key in self.overrides if key.upper() == name.upper()), None)
        for key, value in self.overrides[own].items() if own is not None else ():
            self.taken.add(str(own))
            if key not in found:
                raise ValueError(f"{where}: override of {name!r} names {key!r}; it has {sorted(found)}")
            found[key] = float(value)
        return found

    def depend(self, node: int, components: tuple[int, ...], what: str, keyword: Keyword) -> bool:
        """Say that components (0 to 5) of a node follow others; a problem where they do already."""
        node = self.same(node)
        for c in components:
            first = self.depending.get((node, c))
            if first is not None:
                self.found.problem(
                    f"{what} makes component {c + 1} of node {self.flat.label(node)} dependent, which {first} does "
                    "already; make it dependent once", place_of(keyword),
                )  # fmt: skip
                return False
        self.depending |= {(node, c): what for c in components}
        return True
