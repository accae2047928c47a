"""State shared by all readers of elements and connections: grids, materials and the model under construction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from femflex.arrays import Array
from femflex.decks.model import Components, DeckModel
from femflex.decks.nastran.bar_properties import BarProperties
from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.grids import Grids
from femflex.decks.nastran.materials import Materials
from femflex.decks.nastran.nonstructural_mass import NonstructuralMass
from femflex.decks.nastran.systems import Systems
from femflex.fem import Bushing, ScalarSpring
from femflex.mesh.cells import CELL_TYPES


@dataclass(frozen=True)
class ScalarPoints:
    """Number of a scalar point -> the grid point that stands for it and its component (1 to 6); and the scalar points
    that nothing joins to a grid point."""

    places: dict[int, tuple[int, int]]
    alone: set[int]

    def components(self) -> dict[int, set[int]]:
        """Grid points that stand for scalar points -> the components that exist."""
        components: dict[int, set[int]] = {}
        for grid, component in self.places.values():
            components.setdefault(grid, set()).add(component)
        return components


@dataclass
class NastranModel(DeckModel):
    """The parts of a deck that have been read, and the model built from them."""

    bulk: Bulk
    systems: Systems
    grids: Grids
    materials: Materials
    bars: BarProperties
    nonstructural: NonstructuralMass
    scalars: ScalarPoints
    twisting: list[tuple[int, int, float, Card]] = field(default_factory=list)  # rods: grids, GJ / L [N m], card
    middles: dict[tuple[int, int], int] = field(default_factory=dict)  # edge between grids -> row of its middle
    incomplete: set[str] = field(default_factory=set)  # kinds of elements with some middle nodes left out
    springs: list[tuple[Bushing | ScalarSpring, list[int], bool, Card]] = field(default_factory=list)  # grids, turns

    def x(self, node: int) -> Array:
        """Position (3,) of a grid [m]."""
        return self.grids[node].position

    def placed_ends(self, card: Card, ends: Sequence[tuple[int, Components]]) -> list[tuple[int, Components]]:
        """Grid points and components, those of scalar points in their place; none, with a finding, where a scalar point
        is joined to no grid point."""
        if self.scalars.alone & {number for number, _ in ends}:
            text = "of scalar points that nothing joins to a grid point; they are left out, and missing"
            self.bulk.findings.unused(card.name, text, card.location)
            return []
        places = self.scalars.places
        return [(places[n][0], places[n][1:]) if n in places else (n, components) for n, components in ends]

    def ends(self, card: Card) -> list[tuple[int, Components]]:
        """The grid points and components that a scalar spring or mass joins."""
        ends = [(card.integer(k, 0), card.components(k + 1)) for k in (2, 4)]
        return self.placed_ends(card, [(number, components) for number, components in ends if number])

    def depend(self, grid: int, components: Components, card: Card) -> bool:
        """Record that a card makes components of a grid dependent; add a problem and return False if they already
        are."""
        return self.make_dependent(grid, components, f"grid {grid}", str(card), card.location, f" ({card.location})")


def with_middles(
    model: NastranModel, cell: str, corners: Sequence[int], middles: Sequence[int], card: Card
) -> list[int]:
    """Rows of the points of the middle nodes of a cell; missing ones (0) are added at the middle of their edges, once
    per edge."""
    rows = []
    for parents, grid in zip(CELL_TYPES[cell].parents, middles, strict=True):
        if grid:
            rows.append(model.row(grid))
            continue
        a, b = sorted(corners[k] for k in parents)
        if (a, b) not in model.middles:
            model.middles[a, b] = model.build.point((model.grids[a].position + model.grids[b].position) / 2)
        rows.append(model.middles[a, b])
    if not all(middles) and card.name not in model.incomplete:
        model.incomplete.add(card.name)
        model.bulk.findings.note(
            f"{card} and other {card.name} leave out some of their middle nodes; these are put in the middle of the "
            "edges"
        )
    return rows
