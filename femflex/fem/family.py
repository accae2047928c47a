"""What a member family contributes to a Structure, and the register of families by name.

A new family is one new file in this folder: a function decorated with `family("name", options)` that asks the
numbering for dofs and returns its inertia and strain blocks and the skin it is drawn with.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.option import OPTIONS, Options
from femflex.fem.tables import InertiaBlock, StrainBlock

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


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
    """Where the points of a strain block lie, x (e, q, 3) [m], and of what they are a part: line, plate or solid.

    sampled (e, q, 3): those of `StrainBlock.sampled`, left out where they are the same. lever: of lines the section's
    polar radius (e, q) that twist is carried with, of plates half the thickness [m]; sampled_lever: the same at the
    points of `sampled`, left out where it is the same. fibres (e|1, q|1, 4): of lines `Shape.fibres`, where known.
    plies (e|1, q|1, k, 2, 3, 6): of plates `PlateSection.plies` per strains of the block, where known; sampled_plies:
    the same at the points of `sampled`, left out where it is the same. group: name of the member's group.
    """

    kind: str
    x: Array
    sampled: Array | None = None
    lever: Array | float = 0.0
    sampled_lever: Array | float | None = None
    fibres: Array | None = None
    plies: Array | None = None
    sampled_plies: Array | None = None
    group: str = ""


@dataclass(frozen=True, eq=False)
class Contribution:
    """What one member adds to the tables and to the picture; skin() makes what is drawn, on request.

    places go with the blocks of strain, one by one; a family without them is not coloured by strain
    late() makes further blocks of strain, which depend on what other members have given the nodes
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


def family(name: str, options: Options | None = None, prepare: Preparer | None = None) -> Callable[[Family], Family]:
    """Register a member family, with its options, under the name used in Member.family and in case files.

    prepare  changes the mesh for all members before anything is numbered, and says in sentences what it changed
    """

    def register(function: Family) -> Family:
        FAMILIES[name], OPTIONS[name] = function, options or {}
        if prepare is not None:
            PREPARERS[name] = prepare
        return function

    return register


def prepared(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, tuple[str, ...]]:
    """The mesh as the families of these members want it, and sentences about what they changed."""
    notes: tuple[str, ...] = ()
    for name in dict.fromkeys(member.family for member in members):
        if name in PREPARERS:
            mesh, said = PREPARERS[name](mesh, members)
            notes += said
    return mesh, notes


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
    return cells
