"""What all readers of elements and connections share: the deck's grids, materials and the model they build."""

from __future__ import annotations

from dataclasses import dataclass, field

from femflex.arrays import Array
from femflex.decks.builder import Builder
from femflex.decks.nastran.bar_properties import BarProperties
from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.grids import Grids
from femflex.decks.nastran.materials import Materials
from femflex.decks.nastran.nonstructural_mass import NonstructuralMass
from femflex.decks.nastran.systems import Systems
from femflex.fem import Bushing, PointMass, ScalarSpring
from femflex.fem.connections.connection import Connection

WORDS = ("x", "y", "z", "rx", "ry", "rz")


@dataclass
class NastranModel:
    """The parts of a deck that are read, and those that come from them."""

    bulk: Bulk
    systems: Systems
    grids: Grids
    materials: Materials
    bars: BarProperties
    nonstructural: NonstructuralMass
    build: Builder = field(default_factory=Builder)
    point_masses: list[PointMass] = field(default_factory=list)
    connections: list[Connection] = field(default_factory=list)
    bushings: list[Bushing | ScalarSpring] = field(default_factory=list)
    twisting: list[tuple[int, int, float, Card]] = field(default_factory=list)  # rods: grids, GJ / L [N m], card
    middles: dict[tuple[int, int], int] = field(default_factory=dict)  # edge between grids -> row of its middle
    incomplete: set[str] = field(default_factory=set)  # kinds of elements with some middle nodes left out
    masses: list[tuple[int, float, Array | None, Array, Card]] = field(default_factory=list)
    inertias: list[tuple[int, Array, Card]] = field(default_factory=list)  # without mass
    springs: list[tuple[Bushing | ScalarSpring, list[int], bool, Card]] = field(default_factory=list)  # grids, turns
    scalar_springs: list[tuple[list[tuple[int, tuple[int, ...]]], float, Card]] = field(default_factory=list)
    scalar_masses: dict[int, tuple[float, Card]] = field(default_factory=dict)  # by scalar point, in the deck's unit
    free_points: list[int] = field(default_factory=list)  # rows of points that move, and are no grids
    turning: set[int] = field(default_factory=set)  # grids that elements or connections give a rotation
    moving: set[int] = field(default_factory=set)  # grids that elements or connections move
    wanted: set[int] = field(default_factory=set)  # grids that masses and springs need
    wanted_turning: set[int] = field(default_factory=set)  # those whose rotations they need
    depending: dict[tuple[int, int], Card] = field(default_factory=dict)  # (grid, component) -> card it depends by

    def row(self, grid: int) -> int:
        """Row of the mesh's points of a grid."""
        return self.build.node(grid, self.grids[grid].position)

    def group(self, grid: int) -> str:
        """The group of one point, node_17, of a grid."""
        name = f"node_{grid}"
        if name not in self.build.point_groups:
            self.build.point_group(self.row(grid), name)
        return name

    def new_name(self, name: str) -> str:
        """The name, or one like it that no group has yet."""
        k, found = 1, name
        while found in self.build.point_groups:
            k += 1
            found = f"{name}-{k}"
        return found

    def depend(self, grid: int, components: tuple[int, ...], card: Card) -> bool:
        """Say that components (1 to 6) of a grid follow others; a problem where they do already."""
        fine = True
        for c in components:
            first = self.depending.get((grid, c))
            if first is not None:
                self.bulk.found.problem(
                    f"{card} makes component {c} of grid {grid} dependent, which {first} ({first.place}) does "
                    "already; make it dependent once",
                    card.place,
                )
                fine = False
            else:
                self.depending[grid, c] = card
        return fine
