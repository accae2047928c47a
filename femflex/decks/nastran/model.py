"""State shared by all readers of elements and connections: grids, materials and the model under construction."""

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
    """The parts of a deck that have been read, and the model built from them."""

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
    # grid points that stand for scalar points -> the components that exist
    scalar_points: dict[int, set[int]] = field(default_factory=dict)
    free_points: list[int] = field(default_factory=list)  # rows of points with displacements that are no grids
    turning: set[int] = field(default_factory=set)  # grids with rotations from elements or connections
    moving: set[int] = field(default_factory=set)  # grids with displacements from elements or connections
    required: set[int] = field(default_factory=set)  # grids whose displacements masses and springs need
    required_turning: set[int] = field(default_factory=set)  # grids whose rotations they need
    depending: dict[tuple[int, int], Card] = field(default_factory=dict)  # (grid, component) -> card it depends by

    def row(self, grid: int) -> int:
        """Row of a grid in the points of the mesh."""
        return self.build.node(grid, self.grids[grid].position)

    def group(self, grid: int) -> str:
        """Name of the group of one grid, such as node_17, which is added if needed."""
        name = f"node_{grid}"
        if name not in self.build.point_groups:
            self.build.point_group(self.row(grid), name)
        return name

    def new_name(self, name: str) -> str:
        """The name, with a number appended if a group has it already."""
        k, unique_name = 1, name
        while unique_name in self.build.point_groups:
            k += 1
            unique_name = f"{name}-{k}"
        return unique_name

    def depend(self, grid: int, components: tuple[int, ...], card: Card) -> bool:
        """Record that components (1 to 6) of a grid are dependent; add a problem and return False if they already
        are."""
        independent = True
        for c in components:
            first = self.depending.get((grid, c))
            if first is not None:
                self.bulk.findings.problem(
                    f"{card} makes component {c} of grid {grid} dependent, which {first} ({first.location}) does "
                    "already; make it dependent once",
                    card.location,
                )
                independent = False
            else:
                self.depending[grid, c] = card
        return independent
