"""The contribution of a member family to a Structure, and the register of families and their options by name.

A new family is one new file in this folder: a function decorated with `family("name", options)` that asks the
numbering for dofs and returns its inertia and strain blocks and the skin it is drawn with.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.tables import InertiaBlock, StrainBlock
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.merge import doubled_cells

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


@dataclass(frozen=True)
class Option:
    """One option of a family of members.

    default  its value when left out
    meaning  in words, for the README and the schema
    unit     SI unit of its numbers ("" for plain ones); None for a word, a whole number or a truth value
    shapes   how many numbers it may take: 0 for one alone
    field    whether it may be a formula of x, y and z in place of numbers
    """

    default: Any
    meaning: str
    unit: str | None = None
    shapes: tuple[int, ...] = (0,)
    field: bool = False


Options = Mapping[str, Option]
OPTIONS: dict[str, Options] = {}  # by family, filled where a family is registered


def member_options(member: Member) -> dict[str, Any]:
    """The member's options over the defaults of its family.

    Raises ValueError for an option that the family does not have, with the most similar name.
    """
    options = OPTIONS[member.family]
    for name in member.options:
        if name not in options:
            close = difflib.get_close_matches(name, list(options), n=1)
            hint = f" Did you mean {close[0]!r}?" if close else ""
            raise ValueError(
                f"{member.family} on group {member.group!r} has no option {name!r}; its options are "
                f"{sorted(options)}.{hint}"
            )
    return {**{name: option.default for name, option in options.items()}, **member.options}


@dataclass(frozen=True, eq=False)
class SkinPart:
    """Drawable surface of one member: points (n_p, 3), cells by meshio name, and the points' motion as triplets.

    rows number 3 * point + axis, cols raw dofs: displacement of a point = sum of values over its row.
    """

    points: Array
    cells: dict[str, IntArray]
    rows: IntArray
    cols: IntArray
    values: Array


@dataclass(frozen=True, eq=False)
class StrainPlaces:
    """The positions x (e, q, 3) [m] of the points of a strain block, and the kind of part they belong to: line, plate
    or solid.

    sampled (e, q, 3): those of `StrainBlock.sampled`, left out where they are the same. lever: of lines the section's
    polar radius (e, q) that twist is carried with, of plates half the thickness [m]; sampled_lever: the same at the
    points of `sampled`, left out where it is the same. fibres (e|1, q|1, 4): of lines `Shape.fibres`, where known.
    plies (e|1, q|1, k, 2, 3, 6): of plates `PlateSection.plies` per strains of the block, where known; sampled_plies:
    the same at the points of `sampled`, left out where it is the same. axes (e|1, 3, 3): x, y, z of lines, or two
    tangents and the normal of plates, as rows; left out where the strains do not depend on them. group: name of the
    member's group.
    """

    kind: str
    x: Array
    sampled: Array | None = None
    lever: Array | float = 0.0
    sampled_lever: Array | float | None = None
    fibres: Array | None = None
    plies: Array | None = None
    sampled_plies: Array | None = None
    axes: Array | None = None
    group: str = ""


@dataclass(frozen=True, eq=False)
class Contribution:
    """The blocks that one member adds to the tables, and its drawn surface, which skin() computes on request.

    places correspond to the blocks of strain one by one; a family without them is not coloured by strain
    late() makes further blocks of strain, which depend on the dofs that other members gave to the nodes
    """

    inertia: tuple[InertiaBlock, ...]
    strain: tuple[StrainBlock, ...]
    skin: Callable[[], SkinPart] | None = None
    places: tuple[StrainPlaces, ...] = ()
    late: Callable[[], tuple[StrainBlock, ...]] | None = None


Family = Callable[["Mesh", "Member", Numbering], Contribution]
Preparer = Callable[["Mesh", Sequence["Member"]], tuple["Mesh", tuple[str, ...]]]
FAMILIES: dict[str, Family] = {}
PREPARERS: dict[str, Preparer] = {}
NO_LENGTH = 1e-14  # of a coordinate: a shorter line has no length
DIMENSIONS: dict[str, int] = {}  # of the cells of families that ignore other cells of their groups
EDGES: dict[str, str] = {}  # of families whose edges other nodes may follow: "interpolated", or "bent" by rotations
HALF_WAVES: dict[tuple[str, str], float] = {}  # by family and cell type, see `family`
CELLS = ("points", "lines", "surfaces", "solids")


def family(
    name: str,
    options: Options | None = None,
    prepare: Preparer | None = None,
    dimension: int | None = None,
    edges: Literal["", "interpolated", "bent"] = "",
    half_waves: Mapping[str, float] | None = None,
) -> Callable[[Family], Family]:
    """Register a member family, with its options, under the name used in Member.family and in case files.

    prepare     changes the mesh for all members before dofs are numbered, and returns sentences about the changes
    dimension   of its cells; in a group that has cells of other dimensions too, it uses only these
    edges       how its edges, which nodes between their ends may follow, move: interpolated between their nodes, or
                bent by the rotations of their ends
    half_waves  cell type -> elements that a half-wave needs for an error of 2 % of a frequency
    """

    def register(function: Family) -> Family:
        FAMILIES[name], OPTIONS[name] = function, options or {}
        HALF_WAVES.update({(name, kind): count for kind, count in (half_waves or {}).items()})
        if edges:
            EDGES[name] = edges
        if dimension is not None:
            DIMENSIONS[name] = dimension
        if prepare is not None:
            PREPARERS[name] = prepare
        return function

    return register


def prepare_mesh(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, tuple[str, ...]]:
    """Return the mesh as the families of these members need it, and sentences about the changes."""
    notes: tuple[str, ...] = ()
    for name in dict.fromkeys(member.family for member in members):
        if name in PREPARERS:
            mesh, sentences = PREPARERS[name](mesh, members)
            notes += sentences
    return mesh, notes


def with_own_cells(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, list[Member], tuple[str, ...]]:
    """Return the mesh and the members such that every member's group has only cells of its family's dimension, and
    sentences about the changes.

    A group of surfaces and lines gives a shell its surfaces, and a beam its lines.
    """
    groups: dict[str, dict[str, IntArray]] = {}
    new_members, notes = [], []
    for member in members:
        cells, dimension = mesh.cell_groups.get(member.group, {}), DIMENSIONS.get(member.family)
        kept = {kind: rows for kind, rows in cells.items() if CELL_TYPES[kind].dimension == dimension}
        if dimension and kept and len(kept) < len(cells):
            name = f"{member.group} {CELLS[dimension]}"
            groups[name] = kept
            others = [
                (kind, len(rows))
                for kind, rows in cells.items()
                if (d := CELL_TYPES[kind].dimension) not in (0, dimension)
                and not any(other.group == member.group and DIMENSIONS.get(other.family) == d for other in members)
            ]
            if others:
                unused = ", ".join(f"{count} {kind}" for kind, count in others)
                notes.append(
                    f"the {member.family} member on group {member.group!r} takes its {CELLS[dimension]}; its {unused} "
                    "cells belong to no member"
                )
            member = replace(member, group=name)
        new_members.append(member)
    mesh = mesh.with_groups(cells=groups) if groups else mesh
    return mesh, new_members, (*notes, *_notes_on_doubled_cells(mesh, new_members))


def _notes_on_doubled_cells(mesh: Mesh, members: Sequence[Member]) -> Iterator[str]:
    """Yield sentences about different cells of members that have the same nodes."""
    for kind, nodes in mesh.cells.items():
        used = [rows for member in members if (rows := mesh.cell_groups.get(member.group, {}).get(kind)) is not None]
        cells = nodes[np.unique(np.concatenate(used))] if used else nodes[:0]
        if len(cells) and len(twice := doubled_cells(cells)):
            position = ", ".join(f"{x:.6g}" for x in mesh.points[cells[twice[0]]].mean(axis=0))
            yield (
                f"{len(twice)} {kind} cells of members have the same nodes as another, the first at ({position}) m; "
                "stiffness and mass of the two add"
            )


def member_cells(mesh: Mesh, member: Member, accepted: tuple[str, ...]) -> dict[str, IntArray]:
    """Connectivity (n_c, nodes), numbers of points, by cell type of the member's group, all of types the family
    accepts.

    Raises ValueError when the group is unknown or empty, or holds cells the family cannot use.
    """
    cells = mesh.group_cells(member.group)
    foreign = sorted(set(cells) - set(accepted))
    if foreign:
        raise ValueError(
            f"group {member.group!r} holds {', '.join(foreign)} cells; the {member.family} family is made of "
            f"{', '.join(accepted)}. Choose another family, or a group of those cells."
        )
    for kind, nodes in cells.items():
        if CELL_TYPES[kind].dimension != 1:
            continue
        a, b = mesh.points[nodes[:, 0]], mesh.points[nodes[:, 1]]
        short = np.flatnonzero(np.linalg.norm(b - a, axis=1) <= NO_LENGTH * np.abs(a).max(axis=1, initial=0.0))
        if short.size:
            position = ", ".join(f"{x:.6g}" for x in a[short[0]])
            raise ValueError(
                f"{len(short)} of the {len(nodes)} {kind} cells of group {member.group!r} have no length, the first at "
                f"({position}) m; remove them, or move their nodes apart."
            )
    return cells
