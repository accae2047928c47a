"""A Structure: mass and stiffness of a mesh with members on it, its two tables, and the motion of nodes and skin."""

from __future__ import annotations

import difflib
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.conditions import conditions, zero_columns
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.bushing import Bushing, ScalarSpring
from femflex.fem.connections.connection import Connection
from femflex.fem.connections.hanging import hanging_dependences, hanging_note
from femflex.fem.connections.middle_nodes import middles_left_out, with_raised_boundaries
from femflex.fem.family import FAMILIES, Contribution, SkinPart, StrainPlaces, prepare_mesh, with_own_cells
from femflex.fem.internal_force import InternalForce
from femflex.fem.point_mass import PointMass, point_mass_block
from femflex.fem.sections.materials import Anisotropic, Material, Orthotropic
from femflex.fem.support import COMPONENTS, Support, Supports, as_support
from femflex.fem.tables import InertiaBlock, StrainBlock, mass_and_stiffness
from femflex.mesh.regions import with_whole_groups
from femflex.summary import Rows, Summarised, listed
from femflex.warning import warn_of_physics

if TYPE_CHECKING:
    from femflex.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Member:
    """A mesh group that becomes structure: the family of its elements, their section, material and options.

    Which sections, materials and options a family takes is stated in its own docstring (`femflex.fem.FAMILIES`).
    """

    group: str
    family: str
    section: Any = None
    material: Material | Orthotropic | Anisotropic | None = None
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class StructureSkin:
    """Drawable surface of a Structure: points (n_p, 3), cells by meshio name, motion (3 n_p, n_dof) of the points."""

    points: Array
    cells: dict[str, IntArray]
    operator: sparse.csr_array


@dataclass(frozen=True, eq=False, repr=False)
class Structure(Summarised):
    """Finite elements of a mesh, in mesh coordinates.

    M, K0        (n_dof, n_dof)        mass, and stiffness without that of initial stress, on the independent dofs
    T            (n_raw, n_dof)        raw dofs, which the tables use, from the independent ones
    inertia      InertiaBlock, ...     points with mass; M = sum over them
    strain       StrainBlock, ...      points with stiffness; K0 = sum over them
    translation  (3 n_points, n_dof)   displacement of the mesh's points, row 3 * point + axis; zero where none
    rotation     (3 n_points, n_dof)   small rotation of the mesh's points, likewise
    skin_parts   () -> SkinPart, ...   the drawn surfaces of the members
    places       StrainPlaces, ...     positions of the points of each strain block; None where its family has none
    notes        sentence, ...         changes that families made to the mesh
    unresisted   (k,)                  dofs without stiffness, which a deck's AUTOSPC fixes; none for a mesh
    point_names  point -> its name in the file it was read from, such as "GRID 17"; none for a mesh
    known        key -> (object, ...)  stored results (`recalled`); a changed copy starts with none
    """

    mesh: Mesh
    M: sparse.csr_array
    K0: sparse.csr_array
    T: sparse.csr_array
    inertia: tuple[InertiaBlock, ...]
    strain: tuple[StrainBlock, ...]
    translation: sparse.csr_array
    rotation: sparse.csr_array
    skin_parts: tuple[Callable[[], SkinPart], ...]
    numbering: Numbering
    places: tuple[StrainPlaces | None, ...]
    notes: tuple[str, ...] = ()
    unresisted: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    point_names: Mapping[int, str] = field(default_factory=dict)
    known: dict[tuple[Any, ...], tuple[Any, ...]] = field(default_factory=dict, init=False, repr=False)

    def summary(self) -> tuple[str, Rows]:
        """Mass, degrees of freedom, cells and groups."""
        mass = sum(float(block.dm.sum()) for block in self.inertia)
        cells = [f"{len(nodes)} {cell}" for cell, nodes in self.mesh.cells.items()]
        rows = [("mass", f"{mass:.6g} kg"), ("degrees of freedom", str(self.n_dof))]
        rows += [("points", str(len(self.mesh.points))), ("cells", listed(cells)), ("groups", listed(self.mesh.groups))]
        return "Structure", rows + [("initial stress", "yes")] * self.stressed + [("note", note) for note in self.notes]

    def recalled(self, key: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """Return the result of `make` for this structure, computed once; its warnings are repeated at every call."""
        if key not in self.known:
            with warnings.catch_warnings(record=True) as recorded:
                warnings.simplefilter("always")
                value = make()
            self.known[key] = value, *(warning.message for warning in recorded)
        value, *messages = self.known[key]
        for message in messages:
            warnings.warn(message, stacklevel=3)
        return value

    def forget(self) -> None:
        """Drop all stored results of this structure and of structures derived from it: factors take hundreds of MB."""
        for value, *_ in self.known.values():
            if isinstance(value, Structure):
                value.forget()
        self.known.clear()

    @cached_property
    def skin(self) -> StructureSkin | None:
        """The drawn surface of all members, made at the first request; None when no member has one."""
        return _merged_skin([part() for part in self.skin_parts], self.T)

    @cached_property
    def stressed(self) -> bool:
        """Whether any member has initial stress."""
        return any(block.stress.any() for block in self.strain)

    @cached_property
    def K(self) -> sparse.csr_array:
        """Stiffness (n_dof, n_dof) [N/m, N, N m] with that of initial stress, added at the first request; K0 itself
        where there is none."""
        return (self.K0 + self.internal_force.initial_stiffness()).tocsr() if self.stressed else self.K0

    @cached_property
    def f0(self) -> Array:
        """Elastic force (n_dof,) [N, N m] that initial stress leaves unbalanced."""
        return self.internal_force.initial_force() if self.stressed else np.zeros(self.n_dof)

    @cached_property
    def internal_force(self) -> InternalForce:
        """The full nonlinear elastic force on the independent dofs."""
        return InternalForce(self.strain, self.T)

    @property
    def n_dof(self) -> int:
        """Number of independent dofs."""
        return self.T.shape[1]

    def clamped_dofs(self, group: str, components: Sequence[str] | Support = COMPONENTS) -> IntArray:
        """Numbers of independent dofs (k,), ascending, zero where the group's nodes are supported; see
        `constrained_dofs`."""
        return self.constrained_dofs({group: components})

    def constrained_dofs(self, supports: Supports) -> IntArray:
        """Numbers of the independent dofs (k,), ascending, that are zero under the supports.

        supports: group -> components of "x", "y", "z", "rx", "ry", "rz" (global axes), all six for a clamp, the first
        three for a ball joint; or a Support with axes of its own. They act on the nodes, and on all that lies between
        them: sides of plates, twists, bubbles. Raises ValueError when a group is unknown, when no member gave its
        nodes such dofs, and when a support sets combinations of dofs to zero, so that `build_structure` needs to know
        it.
        """
        key = tuple((group, as_support(value)) for group, value in supports.items())
        constrained: IntArray = self.recalled(("held", *key), lambda: self._find_constrained_dofs(supports))
        return constrained

    def _find_constrained_dofs(self, supports: Supports) -> IntArray:
        for group, value in supports.items():
            nodes, support = self.mesh.group_points(group), as_support(value)
            moves = [c for c in support.components if c in COMPONENTS[:3]]
            dofs_of_nodes = [self.numbering.translation_of(nodes)] * bool(moves)
            dofs_of_nodes += [self.numbering.rotation_of(nodes)] * (len(support.components) > len(moves))
            if not any((dofs >= 0).any() for dofs in dofs_of_nodes):
                raise ValueError(
                    f"no member moves the {len(nodes)} nodes of group {group!r} in {', '.join(support.components)}; "
                    "clamp a group that lies on a member"
                )
        rows = self.numbering.layout(conditions(self.mesh, supports)).conditions @ self.T
        zero_dofs = zero_columns(rows)
        if zero_dofs is None:
            groups = [group for group, value in supports.items() if set(as_support(value).components) < set(COMPONENTS)]
            raise ValueError(
                f"the supports of {groups} set combinations of dofs to zero (planes askew, edges of curved shells), "
                "which this structure does not have as dofs; give build_structure(..., supports=...) the same supports"
            )
        self._warn_of_free_middles(supports, zero_dofs)
        return zero_dofs

    def _warn_of_free_middles(self, supports: Supports, zero_dofs: IntArray) -> None:
        """Warn of middle nodes that are free between corners, where a support lists these alone."""
        free = np.ones(self.n_dof)
        free[zero_dofs] = 0.0
        for group, value in supports.items():
            nodes = self.mesh.group_points(group)
            moves, _ = as_support(value).projectors()
            middles = middles_left_out(self.mesh, self.numbering.members, nodes) if moves.any() else nodes[:0]
            if not len(middles):
                continue
            motion = abs(self.translation[(3 * middles[:, None] + np.arange(3)).ravel()]) @ free
            count = np.count_nonzero(motion.reshape(-1, 3)[:, np.diag(moves) > 0].any(axis=1))
            if count:
                warn_of_physics(
                    "the support at {body_or_joint!r} lists corners of second-order elements alone: {value} middle "
                    "nodes between them are free.",
                    body_or_joint=group,
                    value=count,
                    remedy="List the middle nodes too, or name a group of the faces or edges",
                )


def build_structure(
    mesh: Mesh,
    members: Sequence[Member],
    point_masses: Sequence[PointMass] = (),
    supports: Supports | None = None,
    connections: Sequence[Connection] = (),
    bushings: Sequence[Bushing | ScalarSpring] = (),
) -> Structure:
    """The Structure of a mesh with these members, concentrated masses, connections, springs and bushings.

    supports: those that mode sets will use. They fix nothing here, but the dofs lie along their axes, so that
    `Structure.constrained_dofs` finds them in inclined planes and on edges of curved shells too.
    Members may share nodes and cells; nodes without a member carry no dofs. Raises ValueError on an unknown group or
    family, on cells, sections, materials or options a family cannot use, and on masses at nodes without a member.
    """
    if not members:
        raise ValueError("a structure needs at least one member; found none")
    mesh = with_whole_groups(mesh, [*(member.group for member in members), *(supports or {})])
    mesh, members, cell_notes = with_own_cells(mesh, members)
    warn_of_doubled_cells(mesh, members)
    mesh, notes = prepare_mesh(mesh, members)
    mesh, middle_notes = with_raised_boundaries(mesh, members)
    for connection in connections:
        mesh = connection.with_reference_node(mesh)
    numbering = Numbering(len(mesh.points), members)
    parts = [contribution(mesh, member, numbering) for member in members]
    connected = [dependence for connection in connections for dependence in connection.dependences(mesh, numbering)]
    hanging = hanging_dependences(mesh, numbering, connected)
    numbering.connect([*connected, *hanging])
    parts += [bushing.contribution(mesh, numbering) for bushing in bushings]
    inertia = tuple(block for part in parts for block in part.inertia)
    inertia += tuple(point_mass_block(mesh, point_mass, numbering) for point_mass in point_masses)
    late = tuple(block for part in parts if part.late is not None for block in part.late())
    strain = (*(block for part in parts for block in part.strain), *late)
    places: list[StrainPlaces | None] = []
    for k, part in enumerate(parts):
        group = members[k].group if k < len(members) else ""
        member_places = tuple(replace(strain_places, group=group) for strain_places in part.places)
        places += member_places or (None,) * len(part.strain)
    T = numbering.independent(conditions(mesh, supports or {}))
    translation, rotation = numbering.node_rows(T.shape[0])
    M, K0 = mass_and_stiffness(inertia, strain, T)
    return Structure(
        mesh=mesh,
        M=M,
        K0=K0,
        T=T,
        inertia=inertia,
        strain=strain,
        translation=_on_independent(translation, T),
        rotation=_on_independent(rotation, T),
        skin_parts=tuple(part.skin for part in parts if part.skin is not None),
        numbering=numbering,
        places=(*places, *(None,) * len(late)),
        notes=cell_notes + notes + middle_notes + hanging_note(mesh, numbering, hanging),
    )


def contribution(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Return the contribution of the member's family; ValueError with the known families when there is no such
    family."""
    if member.family not in FAMILIES:
        close = difflib.get_close_matches(member.family, list(FAMILIES), n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        raise ValueError(
            f"member on group {member.group!r} names family {member.family!r}; the families are "
            f"{sorted(FAMILIES)}.{hint}"
        )
    return FAMILIES[member.family](mesh, member, numbering)


def warn_of_doubled_cells(mesh: Mesh, members: Sequence[Member]) -> None:
    """Warn when two members of one family lie on the same cells: their mass and stiffness add."""
    if not _has_doubled_cells(mesh, members):
        return
    for i, first in enumerate(members):
        for second in members[i + 1 :]:
            if first.family != second.family:
                continue
            a, b = (mesh.cell_groups.get(member.group, {}) for member in (first, second))
            shared = sum(np.intersect1d(a[kind], b[kind]).size for kind in a.keys() & b.keys())
            if shared:
                size = sum(len(cells) for cells in b.values())
                warn_of_physics(
                    f"{shared} of the {size} cells of group {second.group!r} already belong to the {first.family} "
                    f"member on group {first.group!r}; mass and stiffness of the two add"
                )


def _has_doubled_cells(mesh: Mesh, members: Sequence[Member]) -> bool:
    """Whether any cell belongs to two members of one family; quick where decks have thousands of members."""
    rows: dict[tuple[str, str], list[IntArray]] = {}
    for member in members:
        for kind, numbers in mesh.cell_groups.get(member.group, {}).items():
            rows.setdefault((member.family, kind), []).append(numbers)
    return any(len(np.unique(all_numbers := np.concatenate(numbers))) < len(all_numbers) for numbers in rows.values())


def _on_independent(rows: sparse.csr_array, T: sparse.csr_array) -> sparse.csr_array:
    n = T.shape[0]
    if T.shape == (n, n) and T.nnz == n and np.array_equal(T.indices, np.arange(n)) and (T.data == 1.0).all():
        return rows  # T is the identity
    return (rows @ T).tocsr()


def _merged_skin(parts: list[SkinPart], T: sparse.csr_array) -> StructureSkin | None:
    if not parts:
        return None
    points = np.concatenate([part.points for part in parts])
    starts = np.cumsum([0] + [len(part.points) for part in parts[:-1]])
    parts_with_start = list(zip(parts, starts, strict=True))
    kinds = sorted({kind for part in parts for kind in part.cells})
    cells = {
        k: np.concatenate([part.cells[k] + start for part, start in parts_with_start if k in part.cells]) for k in kinds
    }
    rows = np.concatenate([part.rows + 3 * start for part, start in parts_with_start])
    cols, values = (np.concatenate([getattr(part, name) for part in parts]) for name in ("cols", "values"))
    raw = sparse.coo_array((values, (rows, cols)), shape=(points.size, T.shape[0])).tocsr()
    return StructureSkin(points, cells, _on_independent(raw, T))
