"""A deck: the finite element model that another solver's input file describes, in SI and neutral between solvers."""

from __future__ import annotations

import difflib
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from femflex.arrays import IntArray
from femflex.decks.findings import UnusedCard
from femflex.decks.singular import unresisted
from femflex.decks.units import Units
from femflex.fem import Bushing, Member, PointMass, ScalarSpring, Structure, Support, build_structure
from femflex.fem.connections.connection import Connection
from femflex.fem.support import GLOBAL
from femflex.mesh import Mesh

Held = Mapping[str, Support]  # group -> its support

SHOWN = 6  # nodes of one kind, and kinds, that a note lists


@dataclass(frozen=True, eq=False)
class Deck:
    """What a deck describes, ready to become a Structure; all in SI units, in the deck's basic coordinates.

    name             of the file
    solver           "Nastran", "Abaqus", ...
    mesh             points, cells and groups: one group of cells for every member, besides groups by which a case names
                     parts: pid_3, set_4, names of ELSETs and NSETs
    members          elements with section, material and options
    point_masses, connections, bushings   as `build_structure` takes them
    supports         name of a set or step of supports (spc_1, "step 1") -> {group -> Support}
    default_supports names of those in force where nobody names any
    points_of_ids    number of a node in the deck -> row of mesh.points; a node without a row is used by nothing
    units            that the deck was declared to be in
    moduli, densities  of its materials, Young's [Pa] and [kg/m^3], by which the units are judged
    materials        names by which overrides name its materials
    used             kind of card -> how many were used
    unused           cards the structure is made without, with the consequence of each
    notes            sentences on what was decided in reading
    no_density       which material lacks a density where none has one, with file and line; else ""
    weightless       names of what overrides can give a mass to, with the key: density, or nonstructural_mass
    """

    name: str
    solver: str
    mesh: Mesh
    members: tuple[Member, ...]
    point_masses: tuple[PointMass, ...] = ()
    connections: tuple[Connection, ...] = ()
    bushings: tuple[Bushing | ScalarSpring, ...] = ()
    supports: Mapping[str, Held] = field(default_factory=dict)
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

    def held(self, names: Iterable[str] | None = None) -> dict[str, Support]:
        """Group -> support of the sets of supports of these names, those in force by default where None.

        Raises ValueError on a name the deck has no set of.
        """
        found: dict[str, Support] = {}
        for name in self.default_supports if names is None else names:
            if name not in self.supports:
                raise ValueError(
                    f"{self.name} has no set of supports {name!r}; it has {sorted(self.supports) or 'none'}."
                    f"{_near(name, self.supports)}"
                )
            found |= self.supports[name]
        return found

    def with_named(self, names: Iterable[str]) -> Deck:
        """The deck with a group of one point for each of the names that is node_17 and no group yet.

        Raises ValueError where the deck has no such node, or nothing is attached to it.
        """
        added = {}
        for name in names:
            found = re.fullmatch(r"node_(\d+)", name)
            if not found or name in self.mesh.groups:
                continue
            number = int(found[1])
            if number not in self.points_of_ids:
                close = sorted(self.points_of_ids, key=lambda known: abs(known - number))[:3]
                raise ValueError(
                    f"{self.name} has no node {number} with an element or a connection; near it are {sorted(close)}"
                )
            added[name] = [self.points_of_ids[number]]
        return replace(self, mesh=self.mesh.with_groups(points=added)) if added else self

    def with_unresisted_held(self) -> Deck:
        """The deck with a set of supports "autospc", in force, of the components that nothing resists at nodes.

        The deck itself where there are none, or where it cannot become a structure, which is said when it shall.
        """
        held = self.held()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                structure = self.structure(held)
        except ValueError:
            return self
        if not structure.K.diagonal().any():  # a rigid body
            return self
        points = np.array(sorted(self.points_of_ids.values()), np.int64)
        loose = unresisted(structure, points, structure.held_dofs(held).tolist())
        fixed = {
            (int(node), component)
            for group, support in held.items()
            if support.axes == GLOBAL
            for node in self.mesh.group_points(group)
            for component in support.components
        }
        groups, own = {}, {}
        for k, (nodes, support) in enumerate(loose):
            if support.axes == GLOBAL:
                nodes = nodes[[any((int(n), c) not in fixed for c in support.components) for n in nodes]]
            if len(nodes):
                groups[f"autospc-{k + 1}"], own[f"autospc-{k + 1}"] = nodes, support
        if not own:
            return self
        count = sum(len(support.components) * len(groups[name]) for name, support in own.items())
        text = (
            f"{count} components of nodes have no stiffness and are fixed (as by AUTOSPC; set of supports 'autospc'): "
            f"{self._listed([(groups[name], support) for name, support in own.items()])}; if they shall move, connect "
            "these nodes by elements that resist there"
        )
        return replace(
            self,
            mesh=self.mesh.with_groups(points=groups),
            supports={**self.supports, "autospc": own},
            default_supports=(*self.default_supports, "autospc"),
            notes=(*self.notes, text),
        )

    def _listed(self, loose: list[tuple[IntArray, Support]]) -> str:
        """Components and the numbers of their nodes in the deck, the first SHOWN of each."""
        number = {row: own for own, row in self.points_of_ids.items()}
        listed = []
        for nodes, support in loose:
            ids = sorted(number[int(node)] for node in nodes)
            more = f" and {len(ids) - SHOWN} more" if len(ids) > SHOWN else ""
            skew = "" if support.axes == GLOBAL else " of skew axes"
            words = ", ".join(support.components)
            plural = "s" if len(ids) > 1 else ""
            listed.append(f"{words}{skew} at node{plural} {', '.join(map(str, ids[:SHOWN]))}{more}")
        more = f"; and {len(listed) - SHOWN} more groups" if len(listed) > SHOWN else ""
        return "; ".join(listed[:SHOWN]) + more

    def structure(self, clamp: Mapping[str, Support] | None = None) -> Structure:
        """The Structure of the deck; its dofs lie along the axes of `clamp`, the supports in force where None."""
        supports = self.held() if clamp is None else dict(clamp)
        built = build_structure(self.mesh, self.members, self.point_masses, supports, self.connections, self.bushings)
        return replace(built, unresisted=self.unresisted(built), point_names=self.point_names())

    def unresisted(self, structure: Structure) -> IntArray:
        """Numbers (k,) of the dofs of its Structure that nothing resists; none where a support lies along skew axes."""
        own = {group: support for group, support in self.supports.get("autospc", {}).items() if support.axes == GLOBAL}
        return structure.held_dofs(own) if own else np.zeros(0, np.int64)

    def point_names(self) -> dict[int, str]:
        """Point of the mesh -> what the deck calls it: "GRID 17" of Nastran, "node 17" of others."""
        word = "GRID" if self.solver == "Nastran" else "node"
        return {point: f"{word} {number}" for number, point in self.points_of_ids.items()}


def _near(name: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, list(known), n=1)
    return f" Did you mean {close[0]!r}?" if close else ""
