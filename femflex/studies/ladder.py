"""The levels of a study: which numbers of modes, or how fine meshes, and what makes the bodies of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from femflex.assembly import build_mesh, build_modes, build_part
from femflex.assembly.decks import with_deck
from femflex.assembly.open_choices import open_joints
from femflex.assembly.shared import shared_structures
from femflex.assembly.structures import preload_of, structure_of
from femflex.body import FlexibleBody
from femflex.case import Case, CaseError
from femflex.case.body import AnalyticTable, BodyTable, FileTable, FlexibleTable
from femflex.case.deploying import DeployingTable
from femflex.case.matrices import MatricesTable
from femflex.case.measure import OF_BODY
from femflex.case.reduction import Stretchable
from femflex.case.run import StudyTable
from femflex.fem.eigen.canonical import count_without_split_cluster
from femflex.fem.eigen.modes import stiffness_ratio
from femflex.mesh.cells import CELL_TYPES
from femflex.pipeline.case_bodies import build_body, build_each
from femflex.reduction import is_added, load_body
from femflex.studies.joints_of_level import joints_of, with_joints_of_level, without_joints
from femflex.system import Segments

COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)  # numbers of modes tried when none are named
REFINED = 4  # refinements tried when none are named, if the mesh stays below
POINTS = 30_000  # points, or else two
VARIED = ("cantilever", "free_free", "craig_bampton")  # reductions that keep a number of modes


@dataclass(frozen=True, eq=False)
class Built:
    """The bodies that differ at a level, how many dofs they have, and the relative rounding of a mode's frequency.

    others: bodies that the study does not vary, with other static shapes of joints than in the case
    """

    bodies: dict[str, Any]
    count: int
    rounding: float = 0.0
    others: dict[str, Any] = field(default_factory=dict)

    @property
    def added(self) -> int:
        """How many of the coordinates of all bodies are static shapes in addition to modes."""
        return sum(int(is_added(getattr(body, "kinds", ())).sum()) for body in self.bodies.values())

    @property
    def derivatives(self) -> int:
        """How many of the coordinates of all bodies are derivative shapes."""
        return sum(_derivatives(body)[0] for body in self.bodies.values())

    @property
    def followers(self) -> int:
        """How many derivative shapes follow the coordinates of condensed bodies."""
        return sum(_derivatives(body)[1] for body in self.bodies.values())


@dataclass(frozen=True, eq=False)
class Rung:
    """One level: modes a body keeps or refinements of its mesh, its share of the work, and what builds it."""

    level: int
    weight: float
    build: Callable[[], Built]


@dataclass(frozen=True, eq=False)
class Ladder:
    """The rungs of a study, coarse to fine, the bodies it varies, and the level of the case (None for several).

    whole: the level at which bodies keep all the shapes there are, where there is one.
    """

    varied: tuple[str, ...]
    rungs: tuple[Rung, ...]
    own: int | None
    whole: int | None = None


@dataclass(frozen=True, eq=False)
class Modal:
    """What a frequency study asks of a meshed body: natural frequencies alone [rad/s]."""

    omega: np.ndarray


def _derivatives(body: Any) -> tuple[int, int]:
    """Derivative shapes that are coordinates, and those that follow."""
    if isinstance(body, Segments):
        pairs = [_derivatives(piece) for piece in body.bodies]
        return sum(own for own, _ in pairs), sum(led for _, led in pairs)
    kinds, n = getattr(body, "kinds", ()), getattr(body, "n_modes", 0)
    return kinds[:n].count("derivative"), kinds[n:].count("derivative")


def mode_ladder(case: Case, levels: Sequence[int] | None = None, given: Case | None = None) -> Ladder:
    """The ladder over the number of modes; the largest set is made here, and others are cut from it where that is all.

    given: the case before its strains and static shapes were written out. Static shapes of joints that it leaves open
    are chosen at each level.

    Raises ValueError when no body keeps a number of modes, CaseError when a body cannot have so many.
    """
    names = mode_names(case)
    given = given or case
    bare = without_joints(case, set(open_joints(given)) & set(names))
    if _study(case).quantity.of in OF_BODY:  # no joint matters to it
        case = given = bare
    owns = {_own_count(case, case.bodies[name]) or 0 for name in names}
    own, wanted = max(1, *owns), levels or _study(case).modes
    counts = sorted({*wanted} if wanted else {*(k for k in COUNTS if k < 2 * own), own, 2 * own})
    try:
        largest = build_each(bare, names, modes=counts[-1])
    except CaseError:
        if wanted:
            raise
        counts = [k for k in counts if k <= own]  # the mesh has no more, or the case has damping for so many alone
        largest = build_each(bare, names, modes=own)
    if len(names) == 1 and _truncates(bare.bodies[names[0]]):  # the level is what is kept: no close pair is parted
        counts = sorted({_kept(largest[names[0]], n) for n in counts})
        owns = {_kept(largest[names[0]], own) if own <= counts[-1] else own}
    rungs = (Rung(n, float(n) ** 2, partial(_with_modes, case, given, largest, n, counts[-1])) for n in counts)
    return Ladder(tuple(names), tuple(rungs), owns.pop() if len(owns) == 1 else None)


def mode_names(case: Case) -> list[str]:
    """Names of the bodies a study over modes varies. Raises ValueError when there is none."""
    return varied(case, lambda table: _own_count(case, table) is not None, "modes to vary")


def mesh_names(case: Case) -> list[str]:
    """Names of the bodies a study over meshes varies. Raises ValueError when there is none."""
    return varied(case, lambda table: isinstance(table, FlexibleTable), "mesh to refine")


def _kept(body: FlexibleBody, n: int) -> int:
    """How many modes are kept of n asked: no close pair is parted."""
    if n >= body.n_modes or not np.isfinite(body.omega).all():
        return min(n, body.n_modes)
    return count_without_split_cluster(body.omega, n) or body.n_modes


def _with_modes(case: Case, given: Case, largest: dict[str, FlexibleBody], n: int, last: int) -> Built:
    level = with_joints_of_level(case, given, largest, n)
    bodies = {}
    for name, body in largest.items():
        if _truncates(level.bodies[name]):
            bodies[name] = body.truncated(_kept(body, n))
        else:
            own = joints_of(level.bodies[name]) in (None, [], {}, joints_of(given.bodies[name]))
            bodies[name] = body if n == last and own else build_body(level, name, modes=n)
    changed = [name for name in case.bodies if joints_of(level.bodies[name]) != joints_of(case.bodies[name])]
    others = {name: build_part(level, name) for name in changed if name not in largest}
    return Built(bodies, sum(body.n_modes for body in bodies.values()), others=others)


def mesh_ladder(case: Case, levels: Sequence[int] | None = None) -> Ladder:
    """The ladder over refinements of the meshes. Raises ValueError when no body has a mesh."""
    names = mesh_names(case)
    wanted = levels or _study(case).refinements
    meshes = {name: build_mesh(case, name, _flexible(case, name)) for name in names}
    sizes = np.array([len(mesh.points) for mesh in meshes.values()], float)
    growth = np.array([2.0 ** max(CELL_TYPES[cell].dimension for cell in mesh.cells) for mesh in meshes.values()])
    if wanted is None:
        wanted = [r for r in range(REFINED + 1) if r <= 2 or (sizes * growth**r).sum() <= POINTS]
    rungs = (Rung(r, float((sizes * growth**r).sum()), partial(_refined, case, names, r)) for r in sorted(set(wanted)))
    return Ladder(tuple(names), tuple(rungs), 0)


def _refined(case: Case, names: list[str], r: int) -> Built:
    """Bodies on meshes refined r times; for the frequency of a mode the modes alone, with their rounding."""
    with shared_structures():
        return _refined_once(case, names, r)


def _refined_once(case: Case, names: list[str], r: int) -> Built:
    quantity = _study(case).quantity
    structures = {name: structure_of(case, name, _flexible(case, name), r) for name in names}
    count = sum(structure.n_dof for structure in structures.values())
    if quantity.of != "mode_frequency":
        return Built({name: build_part(case, name, refine=r) for name in names}, count)
    name = names[0]
    table = _flexible(case, name)
    structure, modes = build_modes(structures[name], table, preload=preload_of(case, name, table))
    ratio = stiffness_ratio(structure.K, modes.phi[:, quantity.mode - 1 : quantity.mode])
    summed = np.sqrt(count)  # rounding of so many terms, with signs at random
    rounding = float(np.finfo(float).eps / (2.0 * summed * ratio[0])) if ratio.size and ratio[0] > 0 else 0.0
    return Built({name: Modal(modes.omega)}, count, rounding)


def varied(case: Case, can: Callable[[BodyTable], bool], what: str) -> list[str]:
    """Names of the bodies a study varies: that of the quantity, that of [study], or all that can."""
    study = _study(case)
    named = study.quantity.body if study.quantity.of in OF_BODY else study.body
    names = [name for name in case.bodies if named in (None, name) and can(case.bodies[name])]
    if not names:
        text = ", ".join(f"{name} ({_described(table)})" for name, table in case.bodies.items())
        about = f"there is no {what}" if named is None else f"body {named!r}, which the study is about, has no {what}"
        raise ValueError(
            f"{case.path.name}: {about}; its bodies are {text}. Vary something else (modes, mesh, "
            "derivatives, segments, strain), or another body."
        )
    return names


def _described(table: BodyTable) -> str:
    if not isinstance(table, FlexibleTable):
        return str(getattr(table, "kind", "?"))
    if table.cut is not None:
        return f"flexible, {table.cut.segments} segments"
    method = f", {table.reduction.method}" if table.reduction is not None else ""
    return f"{getattr(table, 'kind', '?')}{method}"


def _own_count(case: Case, table: BodyTable) -> int | None:
    """The number of modes the case gives a body, None when it gives none."""
    if isinstance(table, FlexibleTable):
        if table.cut is not None or table.reduction is None:
            return None
        return table.reduction.modes if table.reduction.method in VARIED else None  # type: ignore[union-attr]
    if isinstance(table, AnalyticTable | DeployingTable):
        f = table.functions
        return (f and max(f.y, f.z, f.axial, f.torsion)) or None
    if isinstance(table, MatricesTable):
        method = getattr(table.reduction, "method", "none")
        return table.reduction.modes if method in VARIED else None  # type: ignore[union-attr]
    if isinstance(table, FileTable):
        return table.modes or load_body(case.file_path(table.file)).n_modes or None
    return None


def _truncates(table: BodyTable) -> bool:
    """Whether fewer modes are the first ones of more."""
    if isinstance(table, FlexibleTable):
        r = table.reduction
        if r is None or table.strain == "condensed":  # what follows is made for the modes that are kept
            return False
        if isinstance(r, Stretchable) and r.derivatives not in (None, "none", 0):
            return False
        if isinstance(r, Stretchable) and r.joints:
            return False
        return r.method == "free_free" or (r.method == "cantilever" and not (r.attachment or r.loads))
    return isinstance(table, FileTable)


def _study(case: Case) -> StudyTable:
    assert case.study is not None
    return case.study


def _flexible(case: Case, name: str) -> FlexibleTable:
    table = case.bodies[name]
    assert isinstance(table, FlexibleTable)
    return with_deck(case, name, table)
