"""Levels of a study: numbers of modes or refinements of meshes, and the bodies of each level."""

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

COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)  # default numbers of modes
REFINEMENTS = 4  # default number of refinements; two if the mesh would have more than POINTS
POINTS = 30_000  # of the refined mesh
WITH_MODE_COUNT = ("cantilever", "free_free", "craig_bampton")  # reductions that keep a number of modes


@dataclass(frozen=True, eq=False)
class LevelBodies:
    """The varied bodies at a level, their number of dofs, and the relative rounding of a mode's frequency.

    other_bodies: bodies that the study does not vary, with other static shapes of joints than in the case
    """

    bodies: dict[str, Any]
    count: int
    rounding: float = 0.0
    other_bodies: dict[str, Any] = field(default_factory=dict)

    @property
    def added(self) -> int:
        """Number of coordinates of all bodies that are static shapes in addition to modes."""
        return sum(int(is_added(getattr(body, "kinds", ())).sum()) for body in self.bodies.values())

    @property
    def derivatives(self) -> int:
        """Number of coordinates of all bodies that are derivative shapes."""
        return sum(_derivative_counts(body)[0] for body in self.bodies.values())

    @property
    def followers(self) -> int:
        """Number of derivative shapes that depend on the coordinates of condensed bodies."""
        return sum(_derivative_counts(body)[1] for body in self.bodies.values())


@dataclass(frozen=True, eq=False)
class Level:
    """A level: number of modes or of refinements, its share of the work, and the function that builds its bodies."""

    level: int
    weight: float
    build: Callable[[], LevelBodies]


@dataclass(frozen=True, eq=False)
class LevelSet:
    """The levels of a study, coarse to fine, the bodies it varies, and the level of the case (None for several).

    exhaustive: the level at which bodies retain all existing shapes, if there is one.
    """

    varied: tuple[str, ...]
    levels: tuple[Level, ...]
    case_level: int | None
    exhaustive: int | None = None


@dataclass(frozen=True, eq=False)
class ModalFrequencies:
    """Natural frequencies [rad/s] of a meshed body, all that a frequency study needs of it."""

    omega: np.ndarray


def _derivative_counts(body: Any) -> tuple[int, int]:
    """Numbers of derivative shapes that are coordinates, and of those that depend on coordinates."""
    if isinstance(body, Segments):
        pairs = [_derivative_counts(piece) for piece in body.bodies]
        return sum(independent for independent, _ in pairs), sum(dependent for _, dependent in pairs)
    kinds, n = getattr(body, "kinds", ()), getattr(body, "n_modes", 0)
    return kinds[:n].count("derivative"), kinds[n:].count("derivative")


def mode_levels(case: Case, levels: Sequence[int] | None = None, case_as_given: Case | None = None) -> LevelSet:
    """The levels over the number of modes; the largest set is built here, and smaller ones are cut from it if possible.

    case_as_given: the case before its strains and static shapes were filled in. Static shapes of joints that it leaves
    open are chosen at each level.

    Raises ValueError when no body has a number of modes, CaseError when a body cannot have that many.
    """
    names = mode_names(case)
    case_as_given = case_as_given or case
    case_without_joints = without_joints(case, set(open_joints(case_as_given)) & set(names))
    if _study(case).quantity.of in OF_BODY:  # it does not depend on joints
        case = case_as_given = case_without_joints
    case_counts = {_case_mode_count(case, case.bodies[name]) or 0 for name in names}
    case_count, requested = max(1, *case_counts), levels or _study(case).modes
    counts = sorted(
        {*requested} if requested else {*(k for k in COUNTS if k < 2 * case_count), case_count, 2 * case_count}
    )
    try:
        largest = build_each(case_without_joints, names, modes=counts[-1])
    except CaseError:
        if requested:
            raise
        counts = [
            k for k in counts if k <= case_count
        ]  # the mesh has no more, or the case has damping for that many only
        largest = build_each(case_without_joints, names, modes=case_count)
    if len(names) == 1 and _truncates(
        case_without_joints.bodies[names[0]]
    ):  # the level is the retained number, which does not split close pairs
        counts = sorted({_retained_count(largest[names[0]], n) for n in counts})
        case_counts = {_retained_count(largest[names[0]], case_count) if case_count <= counts[-1] else case_count}
    level_list = (
        Level(n, float(n) ** 2, partial(_bodies_with_modes, case, case_as_given, largest, n, counts[-1]))
        for n in counts
    )
    return LevelSet(tuple(names), tuple(level_list), case_counts.pop() if len(case_counts) == 1 else None)


def mode_names(case: Case) -> list[str]:
    """Names of the bodies that a study over modes varies. Raises ValueError when there is none."""
    return varied_names(case, lambda table: _case_mode_count(case, table) is not None, "modes to vary")


def mesh_names(case: Case) -> list[str]:
    """Names of the bodies that a study over meshes varies. Raises ValueError when there is none."""
    return varied_names(case, lambda table: isinstance(table, FlexibleTable), "mesh to refine")


def _retained_count(body: FlexibleBody, n: int) -> int:
    """Number of modes retained of n requested, so that no close pair is split."""
    if n >= body.n_modes or not np.isfinite(body.omega).all():
        return min(n, body.n_modes)
    return count_without_split_cluster(body.omega, n) or body.n_modes


def _bodies_with_modes(
    case: Case, case_as_given: Case, largest: dict[str, FlexibleBody], n: int, largest_count: int
) -> LevelBodies:
    level = with_joints_of_level(case, case_as_given, largest, n)
    bodies = {}
    for name, body in largest.items():
        if _truncates(level.bodies[name]):
            bodies[name] = body.truncated(_retained_count(body, n))
        else:
            joints_unchanged = joints_of(level.bodies[name]) in (None, [], {}, joints_of(case_as_given.bodies[name]))
            bodies[name] = body if n == largest_count and joints_unchanged else build_body(level, name, modes=n)
    changed_names = [name for name in case.bodies if joints_of(level.bodies[name]) != joints_of(case.bodies[name])]
    further_bodies = {name: build_part(level, name) for name in changed_names if name not in largest}
    return LevelBodies(bodies, sum(body.n_modes for body in bodies.values()), other_bodies=further_bodies)


def mesh_levels(case: Case, levels: Sequence[int] | None = None) -> LevelSet:
    """The levels over refinements of the meshes. Raises ValueError when no body has a mesh."""
    names = mesh_names(case)
    requested = levels or _study(case).refinements
    meshes = {name: build_mesh(case, name, _flexible(case, name)) for name in names}
    sizes = np.array([len(mesh.points) for mesh in meshes.values()], float)
    growth = np.array([2.0 ** max(CELL_TYPES[cell].dimension for cell in mesh.cells) for mesh in meshes.values()])
    if requested is None:
        requested = [r for r in range(REFINEMENTS + 1) if r <= 2 or (sizes * growth**r).sum() <= POINTS]
    level_list = (
        Level(r, float((sizes * growth**r).sum()), partial(_bodies_on_refined_meshes, case, names, r))
        for r in sorted(set(requested))
    )
    return LevelSet(tuple(names), tuple(level_list), 0)


def _bodies_on_refined_meshes(case: Case, names: list[str], r: int) -> LevelBodies:
    """Bodies on meshes refined r times; for the frequency of a mode only the modes, with their rounding."""
    with shared_structures():
        return _refined_bodies(case, names, r)


def _refined_bodies(case: Case, names: list[str], r: int) -> LevelBodies:
    quantity = _study(case).quantity
    structures = {name: structure_of(case, name, _flexible(case, name), r) for name in names}
    count = sum(structure.n_dof for structure in structures.values())
    if quantity.of != "mode_frequency":
        return LevelBodies({name: build_part(case, name, refine=r) for name in names}, count)
    name = names[0]
    table = _flexible(case, name)
    structure, modes = build_modes(structures[name], table, preload=preload_of(case, name, table))
    ratio = stiffness_ratio(structure.K, modes.phi[:, quantity.mode - 1 : quantity.mode])
    growth = np.sqrt(count)  # rounding of the sum of that many terms with random signs
    rounding = float(np.finfo(float).eps / (2.0 * growth * ratio[0])) if ratio.size and ratio[0] > 0 else 0.0
    return LevelBodies({name: ModalFrequencies(modes.omega)}, count, rounding)


def varied_names(case: Case, is_suitable: Callable[[BodyTable], bool], subject: str) -> list[str]:
    """Names of the bodies that a study varies: that of the quantity, that of [study], or all that are suitable."""
    study = _study(case)
    body_name = study.quantity.body if study.quantity.of in OF_BODY else study.body
    names = [name for name in case.bodies if body_name in (None, name) and is_suitable(case.bodies[name])]
    if not names:
        text = ", ".join(f"{name} ({_table_text(table)})" for name, table in case.bodies.items())
        reason = (
            f"there is no {subject}"
            if body_name is None
            else f"body {body_name!r}, which the study is about, has no {subject}"
        )
        raise ValueError(
            f"{case.path.name}: {reason}; its bodies are {text}. Vary something else (modes, mesh, "
            "derivatives, segments, strain), or another body."
        )
    return names


def _table_text(table: BodyTable) -> str:
    if not isinstance(table, FlexibleTable):
        return str(getattr(table, "kind", "?"))
    if table.segmented_member is not None:
        return f"flexible, {table.segmented_member.segments} segments"
    method = f", {table.reduction.method}" if table.reduction is not None else ""
    return f"{getattr(table, 'kind', '?')}{method}"


def _case_mode_count(case: Case, table: BodyTable) -> int | None:
    """The number of modes of a body in the case, None if it has none."""
    if isinstance(table, FlexibleTable):
        if table.segmented_member is not None or table.reduction is None:
            return None
        return table.reduction.modes if table.reduction.method in WITH_MODE_COUNT else None  # type: ignore[union-attr]
    if isinstance(table, AnalyticTable | DeployingTable):
        f = table.functions
        return (f and max(f.y, f.z, f.axial, f.torsion)) or None
    if isinstance(table, MatricesTable):
        method = getattr(table.reduction, "method", "none")
        return table.reduction.modes if method in WITH_MODE_COUNT else None  # type: ignore[union-attr]
    if isinstance(table, FileTable):
        return table.modes or load_body(case.file_path(table.file)).n_modes or None
    return None


def _truncates(table: BodyTable) -> bool:
    """Whether a smaller number of modes is the first part of a larger set."""
    if isinstance(table, FlexibleTable):
        r = table.reduction
        if r is None or table.strain == "condensed":  # dependent shapes are computed for the retained modes
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
