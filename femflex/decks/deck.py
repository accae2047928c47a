"""A deck: the finite element model that another solver's input file describes, in SI and neutral between solvers."""

from __future__ import annotations

import difflib
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from femflex.arrays import IntArray
from femflex.decks.findings import BY_MATRICES, UnusedCard
from femflex.decks.singular import singular_components
from femflex.decks.units import Units
from femflex.fem import Bushing, Member, PointMass, ScalarSpring, Structure, Support, build_structure
from femflex.fem.connections.connection import Connection
from femflex.fem.static_loads import StaticLoads
from femflex.fem.support import GLOBAL
from femflex.mesh import Mesh

SupportSet = Mapping[str, Support]  # group -> its support

MAX_SHOWN = 6  # maximum number of nodes of one kind, and of kinds, listed in a note


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

    def with_autospc(self) -> Deck:
        """The deck with an active set of supports "autospc" for the components of nodes without stiffness.

        Returns the deck itself if there are none, or if it cannot become a structure (reported when it is built).
        """
        active = self.active_supports()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                structure = self.structure(active)
        except ValueError:
            return self
        if not structure.K.diagonal().any():  # a rigid body
            return self
        points = np.array(sorted(self.points_of_ids.values()), np.int64)
        singular = singular_components(structure, points)
        supported = {
            (int(node), component)
            for group, support in active.items()
            if support.axes == GLOBAL
            for node in self.mesh.group_points(group)
            for component in support.components
        }
        groups, new_supports = {}, {}
        for k, (nodes, support) in enumerate(singular):
            if support.axes == GLOBAL:
                nodes = nodes[[any((int(n), c) not in supported for c in support.components) for n in nodes]]
            if len(nodes):
                groups[f"autospc-{k + 1}"], new_supports[f"autospc-{k + 1}"] = nodes, support
        notes = self._note_loose(structure, [*structure.constrained_dofs(active)], [*groups.values()])
        if not new_supports:
            return replace(self, notes=(*self.notes, *notes)) if notes else self
        count = sum(len(support.components) * len(groups[name]) for name, support in new_supports.items())
        text = (
            f"{count} components of nodes have no stiffness and are fixed (as by AUTOSPC; set of supports 'autospc'): "
            f"{self._list_supports([(groups[name], support) for name, support in new_supports.items()])}; if they "
            "shall move, connect these nodes by elements that resist there"
        )
        return replace(
            self,
            mesh=self.mesh.with_groups(points=groups),
            supports={**self.supports, "autospc": new_supports},
            default_supports=(*self.default_supports, "autospc"),
            notes=(*self.notes, text, *notes),
        )

    def _note_loose(self, structure: Structure, held: list[int], fixed: list[IntArray]) -> list[str]:
        """A note, if any, on dofs without stiffness that are neither held (their numbers) nor at fixed nodes."""
        loose = np.setdiff1d(np.flatnonzero(structure.K.diagonal() == 0), held)
        motion = abs(structure.translation[:, loose]) + abs(structure.rotation[:, loose])
        nodes = np.setdiff1d(motion.tocoo().coords[0] // 3, np.concatenate([np.zeros(0, np.int64), *fixed]))
        names = [self.point_names().get(int(node), "") for node in nodes]
        if not (names := [name for name in names if name]):
            return []
        more = f" and {len(names) - MAX_SHOWN} more" if len(names) > MAX_SHOWN else ""
        return [
            f"no stiffness at {', '.join(names[:MAX_SHOWN])}{more} in a direction beside one that a connection ties, "
            f"askew to the axes of the deck; it is not fixed as by AUTOSPC. Support it, or {BY_MATRICES}"
        ]

    def _list_supports(self, singular: list[tuple[IntArray, Support]]) -> str:
        """Text that lists components and the numbers of their nodes in the deck, the first MAX_SHOWN of each."""
        number_of_point = {row: node_number for node_number, row in self.points_of_ids.items()}
        texts = []
        for nodes, support in singular:
            ids = sorted(number_of_point[int(node)] for node in nodes)
            more_text = f" and {len(ids) - MAX_SHOWN} more" if len(ids) > MAX_SHOWN else ""
            skew_text = "" if support.axes == GLOBAL else " of skew axes"
            words = ", ".join(support.components)
            plural = "s" if len(ids) > 1 else ""
            texts.append(f"{words}{skew_text} at node{plural} {', '.join(map(str, ids[:MAX_SHOWN]))}{more_text}")
        more_text = f"; and {len(texts) - MAX_SHOWN} more groups" if len(texts) > MAX_SHOWN else ""
        return "; ".join(texts[:MAX_SHOWN]) + more_text

    def structure(self, clamp: Mapping[str, Support] | None = None) -> Structure:
        """The Structure of the deck; its dofs lie along the axes of `clamp`; None: of the active supports."""
        supports = self.active_supports() if clamp is None else dict(clamp)
        built = build_structure(self.mesh, self.members, self.point_masses, supports, self.connections, self.bushings)
        return replace(built, unresisted=self.autospc_dofs(built), point_names=self.point_names())

    def autospc_dofs(self, structure: Structure) -> IntArray:
        """Numbers (k,) of the dofs of its Structure that autospc supports fix, except those along skew axes."""
        supports = {
            group: support for group, support in self.supports.get("autospc", {}).items() if support.axes == GLOBAL
        }
        return structure.constrained_dofs(supports) if supports else np.zeros(0, np.int64)

    def point_names(self) -> dict[int, str]:
        """Point of the mesh -> its name in the deck: "GRID 17" of Nastran, "node 17" of others."""
        word = "GRID" if self.solver == "Nastran" else "node"
        return {point: f"{word} {number}" for number, point in self.points_of_ids.items()}


def _suggestion(name: str, names: Iterable[str]) -> str:
    matches = difflib.get_close_matches(name, list(names), n=1)
    return f" Did you mean {matches[0]!r}?" if matches else ""
