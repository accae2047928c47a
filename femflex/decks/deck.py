"""A deck: the finite element model that another solver's input file describes, in SI and neutral between solvers."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from femflex.arrays import IntArray
from femflex.decks.findings import UnusedCard
from femflex.decks.units import Units
from femflex.fem import Bushing, Member, PointMass, ScalarSpring, Structure, Support, build_structure
from femflex.fem.connections.connection import Connection
from femflex.fem.static_loads import StaticLoads
from femflex.mesh import Mesh

SupportSet = Mapping[str, Support]  # group -> its support

AUTOSPC = "autospc"  # name of the set of supports of components without stiffness


@dataclass(frozen=True, eq=False)
class Deck:
    """The finite element model in a deck, in SI units and the deck's basic coordinates.

    name             of the file
    solver           "Nastran", "Abaqus", ...
    mesh             points, cells and groups: one group of cells for every member, and groups that a case can name:
                     pid_3, set_4, names of ELSETs and NSETs
    members          elements with section, material and options
    point_masses, connections, bushings   as in `build_structure`
    supports         name of a set or step of supports (spc_1, "step 1") -> {group -> Support}
    default_supports names of the sets that are active by default
    loads            name of a set or step of static loads ("load 2", "step 1") -> StaticLoads
    points_of_ids    number of a node in the deck -> row of mesh.points; unused nodes have no row
    units            declared units of the deck
    moduli, densities  Young's moduli [Pa] and densities [kg/m^3] of its materials, to check the declared units
    materials        names of its materials in overrides
    used             kind of card -> how many were used
    unused           cards that the structure ignores, with the consequence of each
    notes            sentences on decisions made while reading
    no_density       if no material has a density: text naming the first one, with file and line; otherwise ""
    weightless       names of materials or sections that overrides can give a mass, with the key: density or
                     nonstructural_mass
    """

    name: str
    solver: str
    mesh: Mesh
    members: tuple[Member, ...]
    point_masses: tuple[PointMass, ...] = ()
    connections: tuple[Connection, ...] = ()
    bushings: tuple[Bushing | ScalarSpring, ...] = ()
    supports: Mapping[str, SupportSet] = field(default_factory=dict)
    default_supports: tuple[str, ...] = ()
    points_of_ids: Mapping[int, int] = field(default_factory=dict)
    units: Units = field(default_factory=Units)
    moduli: tuple[float, ...] = ()
    densities: tuple[float, ...] = ()
    materials: tuple[str, ...] = ()
    used: Mapping[str, int] = field(default_factory=dict)
    unused: tuple[UnusedCard, ...] = ()
    notes: tuple[str, ...] = ()
    no_density: str = ""
    weightless: tuple[tuple[str, str], ...] = ()
    loads: Mapping[str, StaticLoads] = field(default_factory=dict)

    def active_supports(self, names: Iterable[str] | None = None) -> dict[str, Support]:
        """Group -> support of the named sets of supports; None: the sets that are active by default.

        Raises ValueError for a name without a set of supports.
        """
        supports: dict[str, Support] = {}
        for name in self.default_supports if names is None else names:
            if name not in self.supports:
                raise ValueError(
                    f"{self.name} has no set of supports {name!r}; it has {sorted(self.supports) or 'none'}."
                    f"{_suggestion(name, self.supports)}"
                )
            supports |= self.supports[name]
        return supports

    def with_node_groups(self, names: Iterable[str]) -> Deck:
        """The deck with a group of one point for each name of the form node_17 that is no group yet.

        Raises ValueError if the deck has no such node, or nothing is attached to it.
        """
        added = {}
        for name in names:
            match = re.fullmatch(r"node_(\d+)", name)
            if not match or name in self.mesh.groups:
                continue
            number = int(match[1])
            if number not in self.points_of_ids:
                nearest = sorted(self.points_of_ids, key=lambda known: abs(known - number))[:3]
                raise ValueError(
                    f"{self.name} has no node {number} with an element or a connection; near it are {sorted(nearest)}"
                )
            added[name] = [self.points_of_ids[number]]
        return replace(self, mesh=self.mesh.with_groups(points=added)) if added else self

    def structure(self, clamp: Mapping[str, Support] | None = None) -> Structure:
        """The Structure of the deck; its dofs lie along the axes of `clamp`; None: of the active supports."""
        supports = self.active_supports() if clamp is None else dict(clamp)
        built = build_structure(self.mesh, self.members, self.point_masses, supports, self.connections, self.bushings)
        return replace(built, unresisted=self.autospc_dofs(built), point_names=self.point_names())

    def autospc_dofs(self, structure: Structure) -> IntArray:
        """Numbers (k,) of the dofs of its Structure that autospc supports fix."""
        supports = self.supports.get(AUTOSPC, {})
        return structure.constrained_dofs(supports) if supports else np.zeros(0, np.int64)

    def point_names(self) -> dict[int, str]:
        """Point of the mesh -> its name in the deck: "GRID 17" of Nastran, "node 17" of others."""
        word = "GRID" if self.solver == "Nastran" else "node"
        return {point: f"{word} {number}" for number, point in self.points_of_ids.items()}


def _suggestion(name: str, names: Iterable[str]) -> str:
    matches = difflib.get_close_matches(name, list(names), n=1)
    return f" Did you mean {matches[0]!r}?" if matches else ""
