"""The structure of a deck while it is read, of any solver: nodes, connections, springs, supports; and its Deck."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.decks.builder import Builder, direction_key
from femflex.decks.deck import Deck, SupportSet
from femflex.decks.findings import Findings, Location
from femflex.decks.materials import Elastic
from femflex.decks.units import Units
from femflex.fem import Bushing, Member, MultiPointConstraint, PointMass, Rigid, ScalarSpring, Support
from femflex.fem.connections.connection import Connection
from femflex.fem.point_mass import DeckMass
from femflex.fem.static_loads import StaticLoads
from femflex.fem.support import COMPONENTS, Rows
from femflex.mesh.check import reorient_solids

NODE_MEMBERS = {"lone_nodes": False, "lone_nodes_turning": True}  # group -> whether its nodes have rotations
Components = tuple[int, ...]  # 1 to 6
MASSLESS = 1e-18  # [s^2/m^2] mass per length over EA given to bars without mass
NO_MASS = 1e-9  # [kg] given to inertias without mass
LARGE_EXTENT = 1e9  # [m] of a beam whose deck decides whether it has transverse shear
MAX_TRIANGLE_SHARE = 0.2  # share of triangles in a property above which they become flat facets with a quadratic field


@dataclass(kw_only=True)
class DeckModel:
    """The parts of a structure that have been read.

    moving, turning              nodes with displacements, and rotations, from elements or connections
    required, required_turning   nodes whose displacements, and rotations, masses, springs and equations need
    depending                    (node, component 1 to 6) -> what makes it dependent
    free_points                  rows of points with displacements that are no nodes of the deck
    masses                       node, mass [kg], inertia, offset [m], name and location of every mass
    """

    findings: Findings = field(default_factory=Findings)
    build: Builder = field(default_factory=Builder)
    point_masses: list[PointMass] = field(default_factory=list)
    connections: list[Connection] = field(default_factory=list)
    bushings: list[Bushing | ScalarSpring] = field(default_factory=list)
    moving: set[int] = field(default_factory=set)
    turning: set[int] = field(default_factory=set)
    required: set[int] = field(default_factory=set)
    required_turning: set[int] = field(default_factory=set)
    depending: dict[tuple[int, int], str] = field(default_factory=dict)
    free_points: list[int] = field(default_factory=list)
    masses: list[tuple[int, float, Array | None, Array, str, Location]] = field(default_factory=list)

    def x(self, node: int) -> Array:
        """Position (3,) of a node [m]."""
        raise NotImplementedError

    def representative(self, node: int) -> int:
        """The node that stands for this node in the mesh."""
        return node

    def row(self, node: int) -> int:
        """Row of a node in the points of the mesh."""
        node = self.representative(node)
        return self.build.node(node, self.x(node))

    def group(self, node: int) -> str:
        """Name of the group of one node, such as node_17, which is added if needed."""
        name = f"node_{self.representative(node)}"
        if name not in self.build.point_groups:
            self.build.point_group(self.row(node), name)
        return name

    def new_group(self, name: str, nodes: Iterable[int]) -> str:
        """Add a group of nodes under this name, with a number appended if it exists; returns the name."""
        k, unique_name = 1, name
        while unique_name in self.build.point_groups:
            k += 1
            unique_name = f"{name}-{k}"
        self.build.point_groups[unique_name] = list(dict.fromkeys(map(self.row, nodes)))
        return unique_name

    def make_dependent(
        self, node: int, components: Components, label: str, by: str, location: Location, where: str = ""
    ) -> bool:
        """Record that components of a node, called `label`, depend on others; add a problem and return False if one
        already does.

        by, where  what makes it dependent, and its place for a later message
        """
        for c in components:
            if (first := self.depending.get((node, c))) is not None:
                self.findings.problem(
                    f"{by} makes component {c} of {label} dependent, which {first} does already; make it dependent "
                    "once", location,
                )  # fmt: skip
                return False
        self.depending |= {(node, c): f"{by}{where}" for c in components}
        return True

    def add_rigid(
        self, name: str, nodes: Iterable[int], reference: int, components: Components, axes: Callable[[int], Array]
    ) -> None:
        """Let components of nodes, along the axes (3, 3) of each, follow a reference node rigidly [m]."""
        nodes_by_axes: dict[tuple[float, ...], list[int]] = {}
        for node in nodes:
            nodes_by_axes.setdefault(direction_key(axes(node).ravel()), []).append(node)
        for key, alike in nodes_by_axes.items():
            group = self.new_group(name, alike)
            options: dict[str, Any] = {"components": _words(components), "axes": _rows(key)}
            self.connections.append(Rigid(group=group, reference=self.group(reference), **options))

    def add_equations(
        self, node: int, components: Components, leaders: list[int], matrix: Array, axes: Array, label: str
    ) -> None:
        """Let components of a node, along axes (3, 3), be combinations, matrix (k, 6 n), of those of n leaders in basic
        axes; [m], [rad]."""
        group, *groups = map(self.group, [node, *leaders])
        rows = tuple(map(tuple, axes.tolist()))
        self.connections.append(MultiPointConstraint(group, _words(components), tuple(groups), matrix, rows, label))
        self.required.update([node, *leaders])
        turns = np.asarray(matrix.reshape(len(matrix), len(leaders), 2, 3)[:, :, 1].any(axis=(0, 2)))
        self.required_turning.update(leaders[k] for k in np.flatnonzero(turns).tolist())

    def equation(
        self, terms: Sequence[tuple[int, int, float]], axes: Callable[[int], Array], length: float
    ) -> tuple[list[int], Array]:
        """Leaders and matrix (1, 6 n) of an equation: the sum of factors times components (1 to 6) of nodes along their
        axes is zero, and the first component is dependent. length: the deck's unit [m], in factors between a
        displacement and a rotation."""
        (node, component, first), *others = terms
        leaders = list(dict.fromkeys(other for other, _, _ in others)) or [node]
        matrix = np.zeros((1, 6 * len(leaders)))
        for other, c, factor in others:
            start = 6 * leaders.index(other) + (3 if c > 3 else 0)
            unit = length ** (int(component <= 3) - int(c <= 3))
            matrix[0, start : start + 3] -= factor / first * unit * axes(other)[(c - 1) % 3]
        return leaders, matrix

    def link(self, node: int, other: int, component: int, axes: Array) -> tuple[list[int], Array]:
        """Leaders and matrix (1, 12) [1] that keep the distance of two nodes by a component (1 to 3) of the first along
        its axes (3, 3)."""
        t = self.x(other) - self.x(node)
        own = axes[component - 1]
        matrix = np.zeros((1, 12))
        matrix[0, :3] = t / (own @ t)
        matrix[0, 6:9] = own - matrix[0, :3]
        return [other, node], matrix

    def add_mass(
        self, node: int, mass: float, inertia: Array | None, offset: Array, label: str, location: Location
    ) -> None:
        """Add a mass [kg] with an inertia (3, 3) [kg m^2] about its centre at an offset (3,) [m] from a node."""
        inertia = inertia if inertia is not None and inertia.any() else None
        if not mass and inertia is None:
            return
        self.masses.append((node, mass, inertia, offset, label, location))
        self.required.add(node)
        if inertia is not None or offset.any():
            self.required_turning.add(node)

    def finish_masses(self) -> None:
        """Create the point masses, once it is known which nodes have rotations."""
        for node, mass, inertia, offset, label, location in self.masses:
            if node not in self.turning and (inertia is not None or offset.any()):
                words = " and ".join(["inertia"] * (inertia is not None) + ["offset"] * bool(offset.any()))
                text = "its node has no rotation (solids, rods): its mass acts at the node"
                self.findings.unused(f"{label.split(' ')[0]} {words}", text, location)
                inertia, offset = None, np.zeros(3)
            if not mass and inertia is None:
                continue
            if not mass:
                self.findings.note(f"{label} has an inertia and no mass; it gets {NO_MASS:g} kg")
            places: dict[str, Any] = {"inertia": inertia, "offset": tuple(offset)}
            self.point_masses.append(DeckMass(group=self.group(node), mass=mass or NO_MASS, **places))

    def spring_term(self, node: int, turns: bool, direction: Array) -> tuple[str, Any, tuple[float, float, float]]:
        """A term of a ScalarSpring: the translation or the rotation of a node along a direction (3,), with its
        factor."""
        x, y, z = map(float, direction)
        return self.group(node), "rotation" if turns else "translation", (x, y, z)

    def scalar_spring(self, ends: Sequence[tuple[int, int, Array]], stiffness: float, units: Units) -> ScalarSpring:
        """A spring between components (1 to 6) of nodes along axes (3, 3), the second with a minus; in units of the
        deck.

        Between a displacement and a rotation, the displacement is in the deck's unit of length.
        """
        some_turn = any(component > 3 for _, component, _ in ends)
        terms = []
        for sign, (node, component, axes) in zip((1.0, -1.0), ends, strict=False):
            turns = component > 3
            factor = sign / units.length if some_turn and not turns else sign
            terms.append(self.spring_term(node, turns, factor * axes[(component - 1) % 3]))
            self.required.add(node)
            self.required_turning.update([node] * turns)
        return ScalarSpring(tuple(terms), stiffness * (units.moment if some_turn else units.spring))

    def nodal_load(self, node: int, vector: Array, is_force: bool, units: Units) -> StaticLoads:
        """A force or a moment (3,) at a node, in units of the deck. Raises ValueError where nothing resists it."""
        if node not in (self.moving if is_force else self.turning):
            raise ValueError(f"no element has {'displacements' if is_force else 'rotations'} at a node that it names")
        if is_force:
            return StaticLoads.at_points([self.row(node)], forces=vector * units.force)
        return StaticLoads.at_points([self.row(node)], torques=vector * units.moment)

    def support_set(
        self, fixed: Mapping[int, Collection[int]], axes: Callable[[int], Array], name: Callable[[Components], str]
    ) -> dict[str, Support]:
        """Group -> support of nodes with their fixed components: one group per combination of components and axes."""
        nodes_by_support: dict[tuple[Components, tuple[float, ...]], list[int]] = {}
        for node, components in fixed.items():
            present = tuple(c for c in sorted(components) if c <= 3 or node in self.turning)
            if present:
                nodes_by_support.setdefault((present, direction_key(axes(node).ravel())), []).append(node)
        return {
            self.new_group(name(components), nodes): Support(_words(components), _rows(key))
            for (components, key), nodes in nodes_by_support.items()
        }

    def add_lone_nodes(self) -> None:
        """Add groups of nodes that belong only to masses, springs and constraints."""
        lone = sorted(self.required - self.moving)
        if not self.build.cells and self.connections:  # rigid elements that join only masses and springs
            lone = sorted(self.required | self.moving)
            self.required_turning |= self.turning
        for name, turns in NODE_MEMBERS.items():
            nodes = [node for node in lone if (node in self.required_turning) == turns]
            rows = [*map(self.row, nodes), *([] if turns else self.free_points)]
            if rows:
                self.build.point_groups[name] = rows
                self.turning.update(nodes if turns else [])
        self.moving.update(lone)

    def members(self) -> tuple[Member, ...]:
        """The members of elements, and those of lone nodes."""
        groups = {name: turns for name, turns in NODE_MEMBERS.items() if name in self.build.point_groups}
        lone = [Member(name, "nodes", options={"rotations": turns}) for name, turns in groups.items()]
        return (*self.build.members(), *lone)

    def deck(
        self, path: Path, solver: str, units: Units, supports: Mapping[str, SupportSet], default: tuple[str, ...],
        materials: Sequence[Elastic], area_masses: Mapping[str, float] | None = None,
        bare_sections: Mapping[str, str] | None = None, **more: Any,
    ) -> Deck:  # fmt: skip
        """The Deck of what has been read; more: further fields of it. Raises DeckError with all problems.

        area_masses    of sections that are given by their stiffness, by name [kg/m^2]
        bare_sections  location by name of those of these sections that have no mass
        """
        self.findings.check(path)
        densities, bare_sections = [m.density for m in materials], bare_sections or {}
        no_density = self.findings.note_no_mass(
            [*densities, *(area_masses or {}).values()], [m.name for m in materials],
            materials[0].location if materials else "", bare_sections,
        )  # fmt: skip
        mesh = self.build.mesh()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = reorient_solids(mesh, path.name) if mesh.cells else mesh
        return Deck(
            path.name, solver, mesh, self.members(), tuple(self.point_masses), tuple(self.connections),
            tuple(self.bushings), supports, default, dict(self.build.row_of), units,
            moduli=tuple(m.values[key] for m in materials for key in ("E", "E1") if m.values.get(key, 0.0) > 0),
            densities=tuple(rho for rho in densities if rho > 0), materials=tuple(m.name for m in materials),
            no_density=no_density,
            weightless=(*((m.name, "density") for m in materials), *((n, "nonstructural_mass") for n in bare_sections)),
            used=dict(sorted(self.findings.used.items())), unused=self.findings.left_out, notes=self.findings.notes,
            **more,
        )  # fmt: skip


def _words(components: Components) -> tuple[str, ...]:
    return tuple(COMPONENTS[c - 1] for c in components)


def _rows(key: tuple[float, ...]) -> Rows:
    a, b, c = (key[j : j + 3] for j in (0, 3, 6))
    return a, b, c  # type: ignore[return-value]
