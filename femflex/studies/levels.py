"""Levels of a study, coarse to fine: numbers of modes, derivative shapes or segments, or refinements of meshes.

`VARIED` has a row for each property that a study can vary, forms of strain and types of functions among them: which
bodies have it, and their tables at a level.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
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
from femflex.case.run import StudyTable
from femflex.fem.eigen.modes import stiffness_ratio
from femflex.fem.eigen.shift_invert import count_without_split_cluster
from femflex.measures.measure import OF_BODY
from femflex.mesh.cells import CELL_TYPES
from femflex.pipeline.case_bodies import build_body, build_each
from femflex.pipeline.decisions import with_own_joints
from femflex.reduction import load_body
from femflex.reduction.methods import Stretchable
from femflex.reduction.modes.damping import is_added
from femflex.system import Segments
from femflex.warning import PhysicsWarning

MODES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)  # default numbers of modes
DERIVATIVES = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48)  # of derivative shapes, up to the largest possible one
EVERY = 10**6  # more derivative shapes than any body can have
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
    def parts(self) -> list[Any]:
        """The bodies, those that are cut into segments by their pieces."""
        each = (body.bodies if isinstance(body, Segments) else (body,) for body in self.bodies.values())
        return [piece for pieces in each for piece in pieces]

    @property
    def added(self) -> int:
        """Number of coordinates of all bodies that are static shapes in addition to modes."""
        return sum(int(is_added(getattr(body, "kinds", ())).sum()) for body in self.bodies.values())

    @property
    def derivatives(self) -> int:
        """Number of coordinates of all bodies that are derivative shapes."""
        return sum(getattr(p, "kinds", ())[: getattr(p, "n_modes", 0)].count("derivative") for p in self.parts)

    @property
    def followers(self) -> int:
        """Number of derivative shapes that depend on the coordinates of condensed bodies."""
        return sum(getattr(p, "kinds", ())[getattr(p, "n_modes", 0) :].count("derivative") for p in self.parts)


@dataclass(frozen=True, eq=False)
class Level:
    """A level: its number, its share of the work, and the function that builds its bodies."""

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


@dataclass(frozen=True, eq=False)
class Varied:
    """A property that a study can vary over numbers.

    noun   what a level counts, such as "mode";  least  level
    suitable       whether a body of a case has it, and `subject`, what one without it lacks
    with_level     the table of a body at a level
    """

    noun: str
    least: int
    subject: str
    suitable: Callable[[Case, BodyTable], bool]
    with_level: Callable[[Any, Any], BodyTable]


def level_set(
    case: Case, over: str, levels: Sequence[int] | None = None, case_as_given: Case | None = None
) -> LevelSet:
    """The levels of a study over a property of `VARIED`, by default those of the case, or usual ones.

    case_as_given: the case before its strains and static shapes were filled in. Static shapes of joints that it leaves
    open are chosen at each number of modes. Raises ValueError when no body has the property, CaseError when a body
    cannot have such a level.
    """
    names = varied_names(case, over)
    if over == "modes":
        return _mode_levels(case, names, levels, case_as_given or case)
    return {"mesh": _mesh_levels, "segments": _segment_levels, "derivatives": _derivative_levels}[over](
        case, names, levels
    )


def varied_names(case: Case, over: str) -> list[str]:
    """Names of the bodies that a study varies: that of the quantity, that of [study], or all that are suitable."""
    varied, study = VARIED[over], _study(case)
    body_name = study.quantity.body if study.quantity.of in OF_BODY else study.body
    names = [name for name, table in case.bodies.items() if body_name in (None, name) and varied.suitable(case, table)]
    if not names:
        text = ", ".join(f"{name} ({_table_text(table)})" for name, table in case.bodies.items())
        reason = f"there is no {varied.subject}"
        if body_name is not None:
            reason = f"body {body_name!r}, which the study is about, has no {varied.subject}"
        raise ValueError(
            f"{case.path.name}: {reason}; its bodies are {text}. Vary something else (modes, mesh, "
            "derivatives, segments, strain), or another body."
        )
    return names


def with_level(case: Case, names: Iterable[str], over: str, level: int | str) -> Case:
    """The case with these bodies at a level of a property."""
    tables = {name: VARIED[over].with_level(case.bodies[name], level) for name in names}
    return case.model_copy(update={"bodies": {**case.bodies, **tables}})


# levels


def _mode_levels(case: Case, names: list[str], levels: Sequence[int] | None, case_as_given: Case) -> LevelSet:
    """The levels over the number of modes; the largest set is built, and smaller ones are cut from it if possible."""
    open_names = set(open_joints(case_as_given)) & set(names)  # whose static shapes of joints are left open
    tables = {name: _with_joints_of(case.bodies[name], None) for name in open_names}
    without_joints = case.model_copy(update={"bodies": {**case.bodies, **tables}})
    if _study(case).quantity.of in OF_BODY:  # it does not depend on joints
        case = case_as_given = without_joints
    case_counts = {_mode_count(case, case.bodies[name]) or 0 for name in names}
    case_count, requested = max(1, *case_counts), levels or _study(case).modes
    counts = sorted({*(requested or (*(k for k in MODES if k < 2 * case_count), case_count, 2 * case_count))})
    try:
        largest = build_each(without_joints, names, modes=counts[-1])
    except CaseError:
        if requested:
            raise
        # the mesh has no more, or the case has damping for that many only
        counts = [k for k in counts if k <= case_count]
        largest = build_each(without_joints, names, modes=case_count)
    if len(names) == 1 and _truncates(without_joints.bodies[names[0]]):
        # the level is the retained number, which does not split close pairs
        body = largest[names[0]]
        counts = sorted({_retained_count(body, n) for n in counts})
        case_counts = {_retained_count(body, case_count) if case_count <= counts[-1] else case_count}
    build = partial(_bodies_with_modes, case, case_as_given, largest, counts[-1])
    return _level_set(names, {n: float(n) ** 2 for n in counts}, build, case_counts)


def _bodies_with_modes(
    case: Case, case_as_given: Case, largest: dict[str, FlexibleBody], largest_count: int, n: int
) -> LevelBodies:
    level = _with_joints_of_level(case, case_as_given, largest, n)
    bodies = {}
    for name, body in largest.items():
        joints, given = _joints_of(level.bodies[name]), _joints_of(case_as_given.bodies[name])
        if _truncates(level.bodies[name]):
            bodies[name] = body.truncated(_retained_count(body, n))
        elif n == largest_count and joints in (None, [], {}, given):
            bodies[name] = body
        else:
            bodies[name] = build_body(level, name, modes=n)
    changed = [name for name in case.bodies if _joints_of(level.bodies[name]) != _joints_of(case.bodies[name])]
    further_bodies = {name: build_part(level, name) for name in changed if name not in largest}
    return LevelBodies(bodies, sum(body.n_modes for body in bodies.values()), other_bodies=further_bodies)


def _mesh_levels(case: Case, names: list[str], levels: Sequence[int] | None) -> LevelSet:
    meshes = [build_mesh(case, name, _flexible(case, name)) for name in names]
    sizes = np.array([len(mesh.points) for mesh in meshes], float)
    growth = np.array([2.0 ** max(CELL_TYPES[cell].dimension for cell in mesh.cells) for mesh in meshes])
    points = {r: float((sizes * growth**r).sum()) for r in levels or _study(case).refinements or range(REFINEMENTS + 1)}
    if not (levels or _study(case).refinements):
        points = {r: count for r, count in points.items() if r <= 2 or count <= POINTS}
    return _level_set(names, points, partial(_bodies_on_refined_meshes, case, names), {0})


def _bodies_on_refined_meshes(case: Case, names: list[str], r: int) -> LevelBodies:
    """Bodies on meshes refined r times; for the frequency of a mode only the modes, with their rounding."""
    quantity = _study(case).quantity
    with shared_structures():
        structures = {name: structure_of(case, name, _flexible(case, name), r) for name in names}
        count = sum(structure.n_dof for structure in structures.values())
        if quantity.of != "mode_frequency":
            return LevelBodies({name: build_part(case, name, refine=r) for name in names}, count)
        name, table = names[0], _flexible(case, names[0])
        structure, modes = build_modes(structures[name], table, preload=preload_of(case, name, table))
    ratio = stiffness_ratio(structure.K, modes.phi[:, quantity.mode - 1 : quantity.mode])
    growth = np.sqrt(count)  # rounding of the sum of that many terms with random signs
    rounding = float(np.finfo(float).eps / (2.0 * growth * ratio[0])) if ratio.size and ratio[0] > 0 else 0.0
    return LevelBodies({name: ModalFrequencies(modes.omega)}, count, rounding)


def _segment_levels(case: Case, names: list[str], levels: Sequence[int] | None) -> LevelSet:
    """By default from a quarter of the case's own number to four times it."""
    case_counts = {_segment_count(case.bodies[name]) or 0 for name in names}
    n = max(case_counts)
    counts = levels or _study(case).segments or [max(1, n // 4), max(1, n // 2), n, 2 * n, 4 * n]

    def build(k: int) -> LevelBodies:
        bodies = LevelBodies({name: build_part(case, name, segments=k) for name in names}, 0)
        return LevelBodies(bodies.bodies, sum(piece.n_modes for piece in bodies.parts))

    return _level_set(names, {k: float(k) for k in counts}, build, case_counts)


def _derivative_levels(case: Case, names: list[str], levels: Sequence[int] | None) -> LevelSet:
    """By default up to the largest possible number, with the case's number of modes."""

    def build(n: int | None) -> LevelBodies:
        changed = case if n is None else with_level(case, names, "derivatives", n)
        bodies = LevelBodies({name: build_body(changed, name) for name in names}, 0)
        return LevelBodies(bodies.bodies, sum(body.n_modes for body in bodies.parts) + bodies.followers)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # EVERY is more than any set has
        largest = max(body.kinds.count("derivative") for body in build(EVERY).parts)
    case_counts = {body.kinds.count("derivative") for body in build(None).parts}
    counts = {*(levels or [k for k in DERIVATIVES if k < largest] + [largest])}
    if any(getattr(case.bodies[name], "strain", None) == "condensed" for name in names):  # it needs at least one
        counts -= {0}
    return _level_set(names, {n: 1.0 + n**2 for n in counts}, build, case_counts, largest)


def _level_set(
    names: list[str],
    weights: dict[int, float],
    build: Callable[[int], LevelBodies],
    case_levels: set[int],
    exhaustive: int | None = None,
) -> LevelSet:
    """The set of levels with these weights."""
    levels = tuple(Level(n, weights[n], partial(build, n)) for n in sorted(weights))
    return LevelSet(tuple(names), levels, next(iter(case_levels)) if len(case_levels) == 1 else None, exhaustive)


# tables of bodies


def _with_mode_count(table: BodyTable, n: int) -> BodyTable:
    if isinstance(table, AnalyticTable | DeployingTable):
        counts = {key: n for key in ("y", "z", "axial", "torsion") if getattr(table.functions, key)}
        return _with_part(table, "functions", counts)
    if isinstance(table, FileTable):
        return table.model_copy(update={"modes": n})
    return table if getattr(table, "reduction", None) is None else _with_part(table, "reduction", {"modes": n})


def _with_segments(table: FlexibleTable, n: int) -> BodyTable:
    members = [m.model_copy(update={"segments": n}) if m.segments is not None else m for m in table.members]
    return table.model_copy(update={"members": members})


def _with_strain(table: BodyTable, strain: str) -> BodyTable:
    """The table with that form of strain: derivatives as they are or "auto", none with linear strain."""
    changed, reduction = table.model_copy(update={"strain": strain}), getattr(table, "reduction", None)
    if not isinstance(reduction, Stretchable):
        return changed
    derivatives = "auto" if reduction.derivatives in (None, "none", 0) else reduction.derivatives
    linear = {"derivatives": "none", "deflection": None}
    return _with_part(changed, "reduction", linear if strain == "linear" else {"derivatives": derivatives})


def _with_part(table: BodyTable, key: str, update: dict[str, Any]) -> BodyTable:
    """The table with changes in its table of functions or of the reduction."""
    return table.model_copy(update={key: getattr(table, key).model_copy(update=update)})


def _mode_count(case: Case, table: BodyTable) -> int | None:
    """The number of modes of a body in the case, None if it has none."""
    if isinstance(table, AnalyticTable | DeployingTable):
        f = table.functions
        return (f and max(f.y, f.z, f.axial, f.torsion)) or None
    if isinstance(table, FileTable):
        return table.modes or load_body(case.file_path(table.file)).n_modes or None
    if _segment_count(table) is not None or not isinstance(table, FlexibleTable | MatricesTable):
        return None
    method = getattr(table.reduction, "method", "none")
    return table.reduction.modes if method in WITH_MODE_COUNT else None  # type: ignore[union-attr]


def _segment_count(table: BodyTable) -> int | None:
    member = table.segmented_member if isinstance(table, FlexibleTable) else None
    return None if member is None else member.segments


def _has_derivatives(case: Case, table: BodyTable) -> bool:
    if not isinstance(table, FlexibleTable) or table.segmented_member is not None or table.strain in (None, "linear"):
        return False
    return isinstance(table.reduction, Stretchable)


def _has_strain(case: Case, table: BodyTable) -> bool:
    if isinstance(table, AnalyticTable):
        return bool(table.functions.y or table.functions.z)
    return isinstance(table, FlexibleTable) and (
        table.segmented_member is not None or isinstance(table.reduction, Stretchable)
    )


def _has_functions(case: Case, table: BodyTable) -> bool:
    return isinstance(table, AnalyticTable | DeployingTable) and table.functions is not None


def _table_text(table: BodyTable) -> str:
    if (segments := _segment_count(table)) is not None:
        return f"flexible, {segments} segments"
    method = getattr(getattr(table, "reduction", None), "method", "") if isinstance(table, FlexibleTable) else ""
    return f"{getattr(table, 'kind', '?')}{f', {method}' if method else ''}"


def _retained_count(body: FlexibleBody, n: int) -> int:
    """Number of modes retained of n requested, so that no close pair is split."""
    if n >= body.n_modes or not np.isfinite(body.omega).all():
        return min(n, body.n_modes)
    return count_without_split_cluster(body.omega, n) or body.n_modes


def _truncates(table: BodyTable) -> bool:
    """Whether a smaller number of modes is the first part of a larger set."""
    if not isinstance(table, FlexibleTable):
        return isinstance(table, FileTable)
    r = table.reduction
    if r is None or table.strain == "condensed":  # dependent shapes are computed for the retained modes
        return False
    if isinstance(r, Stretchable) and (r.derivatives not in (None, "none", 0) or r.joints):
        return False
    return r.method == "free_free" or (r.method == "cantilever" and not (r.attachment or r.loads))


# static shapes of joints


def _with_joints_of_level(case: Case, case_as_given: Case, names: Iterable[str], n: int) -> Case:
    """The case with the static shapes of joints that the case as given has when the named bodies have n modes.

    case: with strains and static shapes filled in. If the system with so few modes cannot be built, the case is
    returned unchanged; the problem is reported when the level is run.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # issued where the bodies are built
            joined = with_own_joints(with_level(case_as_given, names, "modes", n))
    except CaseError:
        return case
    bodies = {name: _with_joints_of(table, joined.bodies[name]) for name, table in case.bodies.items()}
    return case.model_copy(update={"bodies": bodies})


def _with_joints_of(table: BodyTable, source: BodyTable | None) -> BodyTable:
    """The table with the static shapes of joints of another table, or without any."""
    if source is not None and _joints_of(table) == _joints_of(source):
        return table
    if isinstance(table, AnalyticTable | DeployingTable):
        return _with_part(table, "functions", {"joints": [] if source is None else _joints_of(source)})
    return _with_part(table, "reduction", {"joints": {} if source is None else _joints_of(source)})


def _joints_of(table: BodyTable) -> object:
    """Static shapes of joints that a table requests."""
    key = "functions" if isinstance(table, AnalyticTable | DeployingTable) else "reduction"
    return getattr(getattr(table, key, None), "joints", None)


def _study(case: Case) -> StudyTable:
    assert case.study is not None
    return case.study


def _flexible(case: Case, name: str) -> FlexibleTable:
    table = case.bodies[name]
    assert isinstance(table, FlexibleTable)
    return with_deck(case, name, table)


VARIED = {
    "modes": Varied(
        "mode", 1, "modes to vary",
        lambda case, table: _mode_count(case, table) is not None, _with_mode_count,
    ),
    "mesh": Varied(
        "refinement", 0, "mesh to refine",
        lambda case, table: isinstance(table, FlexibleTable),
        lambda table, r: table.model_copy(update={"refine": table.refine + r}),
    ),
    "derivatives": Varied(
        "derivative shape", 0, "nonlinear strain with derivatives to vary",
        _has_derivatives, lambda table, n: _with_part(table, "reduction", {"derivatives": n or "none"}),
    ),
    "segments": Varied(
        "segment", 1, "line cut into segments",
        lambda case, table: bool(_segment_count(table)), _with_segments,
    ),
    "strain": Varied("form", 0, "form of strain to choose", _has_strain, _with_strain),
    "functions": Varied("type", 0, "functions to vary", _has_functions, _with_mode_count),
}  # fmt: skip
