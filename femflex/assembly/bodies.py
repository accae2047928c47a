"""Build the bodies of a case, each with the structure and the set of shapes that it was reduced from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from femflex.assembly.acting_loads import acting_loads, added_shapes_text, check_torques, induced_groups, torque_loads
from femflex.assembly.decks import load_sets_of, with_deck
from femflex.assembly.deploying import added_note, build_deploying, deployed_origin
from femflex.assembly.extents import warn_of_doubtful_extents
from femflex.assembly.functions import functions_of
from femflex.assembly.rigid_skins import central_inertia, rigid_skin
from femflex.assembly.segments import build_segments
from femflex.assembly.shared import shared_parts
from femflex.assembly.structures import PLACE, build_mesh, build_modes, preload_of, structure_of
from femflex.body import FlexibleBody, Marker, rigid_body
from femflex.case.body import AnalyticTable, BodyTable, FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.deploying import DeployingTable
from femflex.case.matrices import MatricesTable
from femflex.fem.deflected import tension_blocks
from femflex.fem.matrix_structure import MatrixStructure
from femflex.fem.structure import Structure
from femflex.fem.tension.strain import UNITS
from femflex.matrices import MatrixModel, StatedMass, read_matrices
from femflex.matrices.body import matrix_body, without_rounding
from femflex.noun.problems import CaseError, Problem, suggestion_text
from femflex.reduction import ModeSet, beam_body, load_body, reduce_structure, with_derivatives
from femflex.reduction.large_deflection.stretch import missing_stretch, require_stretch
from femflex.reduction.matrices import MatrixBody
from femflex.reduction.methods import FreeFree, Nodal, Stiff, Stretchable
from femflex.reduction.mode_warnings import half_wave_text, warn_of_few_elements
from femflex.reduction.modes.damping import bending_damping, is_added, is_unanswered
from femflex.reduction.origin import Analytic, Meshed, Origin
from femflex.reduction.preload.equilibrium import is_preloaded
from femflex.reduction.reduce import small_motion_body
from femflex.system import Part, Segments
from femflex.warning import warn_of_physics

Note = tuple[str, str]  # subject and text


@dataclass(frozen=True, eq=False)
class BuiltBody:
    """A body built from its table, its origin, and notes on how it was built.

    origin: None for a body cut into segments; notes: subject and text, on its "mesh" or on "shapes" that were added
    to those which the table requests.
    """

    part: Part
    origin: Origin | None = None
    notes: tuple[Note, ...] = ()


def build_bodies(case: Case) -> dict[str, Part]:
    """All bodies of a case by name, as `built_bodies`."""
    return {name: built.part for name, built in built_bodies(case).items()}


def built_bodies(case: Case) -> dict[str, BuiltBody]:
    """All bodies of a case by name, with their origins.

    Bodies whose tables differ only in the initial state, and that carry the same loads, are built once and shared.
    Raises CaseError with the problems of all bodies together.
    """
    bodies: dict[str, BuiltBody] = {}
    built_by_inputs: list[tuple[Inputs, BuiltBody]] = []
    problems: list[Problem] = []
    for name in case.bodies:
        inputs = _inputs(case, name)
        alike = next((built for other, built in built_by_inputs if other == inputs), None)
        try:
            bodies[name] = built_body(case, name) if alike is None else alike
        except CaseError as error:
            problems += error.problems
            continue
        if alike is None:
            built_by_inputs.append((inputs, bodies[name]))
    if problems:
        raise CaseError(case.path.name, problems)
    return bodies


def build_part(case: Case, name: str, modes: int | None = None, refine: int = 0, segments: int | None = None) -> Part:
    """The body of that name, as `built_body`."""
    return built_body(case, name, modes, refine, segments).part


def built_body(
    case: Case,
    name: str,
    modes: int | None = None,
    refine: int = 0,
    segments: int | None = None,
    draft: bool = False,
) -> BuiltBody:
    """The body of that name, or its Segments if it is cut (into `segments` of them instead of the case's number).

    modes: another number of modes; refine: number of additional refinements of the mesh. The strain is that of the
    case, linear by default; automatic choices are resolved before (`pipeline.decisions`).
    draft: for small motions about rest only, which is enough to see whether it can be built.

    Raises CaseError with the problems of the body.
    """
    if name not in case.bodies:
        raise CaseError(
            case.path.name, [Problem("bodies", f"found no body {name!r}; {suggestion_text(name, case.bodies)}")]
        )
    shared = shared_parts()
    if shared is None:
        return _build_body(case, name, modes, refine, segments, draft)
    others = {key: value for key, value in vars(case).items() if key not in ("bodies", "initial")}
    inputs = Inputs((case.path, name, modes, refine, segments, draft, *_inputs(case, name).values), others)
    return shared.body(inputs, lambda: _build_body(case, name, modes, refine, segments, draft))


@dataclass(frozen=True)
class Inputs:
    """All that a body is built from: values, equal for bodies alike, and tables, the same objects for these."""

    values: tuple[Any, ...]
    tables: Mapping[str, Any] = field(default_factory=dict)

    def __eq__(self, other: object) -> bool:
        """Whether the other inputs build the same body."""
        if not isinstance(other, Inputs) or self.tables.keys() != other.tables.keys():
            return False
        return self.values == other.values and all(self.tables[key] is other.tables[key] for key in self.tables)


def _inputs(case: Case, name: str) -> Inputs:
    """The table of a body without its initial state, its loads, and the markers and groups that are used."""
    table, context, excluded = case.bodies[name], list[Any](), {"initial": None}
    if isinstance(table, FlexibleTable) and isinstance(table.reduction, Stretchable) and table.reduction.joints == {}:
        as_open = table.reduction.model_copy(update={"joints": None})  # this builds the same body
        table = table.model_copy(update={"reduction": as_open})
    if isinstance(table, DeployingTable) and table.length is not None and table.length.profile is not None:
        context.append(table.length.profile(case.path.parent).numbers.tolist())
        excluded["length"] = None
    if isinstance(table, FlexibleTable):
        context += [acting_loads(case, name, table, marker_groups(table)), sorted(load_sets_of(case, name, table))]
    used = turning_markers(case, name), patch_groups(case, name), induced_groups(case, name)
    return Inputs((table.model_copy(update=excluded), *used, *context))


def _build_body(case: Case, name: str, modes: int | None, refine: int, segments: int | None, draft: bool) -> BuiltBody:
    """The body of that name as `built_body`, built anew."""
    table = case.bodies[name]
    try:
        if isinstance(table, FlexibleTable) and table.segmented_member is not None:
            cut = _segments(case, name, table, (modes, refine, segments))
            return BuiltBody(Segments(tuple(_with_marker_axes(body, table) for body in cut.bodies)))
        if isinstance(table, DeployingTable):
            member = build_deploying(case, name, table, modes)
            notes = tuple(("shapes", text) for text in added_note(case, name, table))
            return BuiltBody(member.body, deployed_origin(case, name, table, member), notes)
        body, source, notes = _body_from_table(case, name, table, modes, refine, draft)
        origin = Origin(source, linear_strain_reason(table), stiffening_remedy(table))
        if isinstance(source, Meshed) and not draft:
            warn_of_doubtful_extents(case, name, table, source.structure.mesh, body.moments.mass)
        return BuiltBody(with_markers(body, name, table), None if isinstance(table, RigidTable) else origin, notes)
    except CaseError:
        raise
    except (ValueError, OSError) as error:
        raise CaseError(case.path.name, [Problem(f"bodies.{name}", str(error))]) from error
    except RuntimeError as error:  # of the eigen-solver
        raise RuntimeError(f"{case.path.name}: bodies.{name}: {error}") from error


BodyWithSource = tuple[FlexibleBody, Meshed | Analytic | None, tuple[Note, ...]]  # body, source, notes


def _body_from_table(
    case: Case, name: str, table: BodyTable, modes: int | None, refine: int, draft: bool
) -> BodyWithSource:
    if isinstance(table, RigidTable):
        return _rigid_body(case, table), None, ()
    if isinstance(table, AnalyticTable):
        return _beam_body(case, name, table, modes)
    if isinstance(table, FileTable):
        return _body_from_file(case, name, table, modes), None, ()
    if isinstance(table, MatricesTable):
        matrix_body = build_matrix_body(case, table, modes, turning_markers(case, name))
        return matrix_body.body, None, tuple(("mesh", text) for text in matrix_body.notes)
    assert isinstance(table, FlexibleTable)
    table = with_deck(case, name, table)
    as_built = structure_of(case, name, table, refine)
    acting = acting_loads(case, name, table, marker_groups(table))
    structure, modeset = build_modes(as_built, table, modes, name, acting, preload_of(case, name, table))
    if draft:
        turning, groups = turning_markers(case, name), patch_groups(case, name)
        loads = load_sets_of(case, name, table)
        induced = induced_groups(case, name)
        body = small_motion_body(structure, modeset, marker_groups(table), turning, groups, loads, induced)
    else:
        body, modeset = _reduce_with_strain(case, name, table, structure, modeset)
    reduction = table.reduction
    joints = getattr(reduction, "joints", None) or {}
    source = Meshed(
        structure,
        modeset,
        marker_groups(table),
        {group: s for group, s in getattr(reduction, "clamp", {}).items() if not s.is_clamped},
        tuple(getattr(reduction, "loads", ())),
        getattr(reduction, "deflection", None),
        getattr(reduction, "third_derivatives", None),
    )
    texts = [added_shapes_text(acting, modeset, joints), tension_text(structure, modeset, body)]
    texts.append(half_wave_text(structure, modeset))
    warn_of_few_elements(structure, modeset)
    of_mesh = [("mesh", text) for text in as_built.notes]
    return body, source, (*of_mesh, *(("shapes", text) for text in texts if text))


def tension_text(structure: Structure, modeset: ModeSet, body: FlexibleBody) -> str:
    """A note on the tension of tethers and membranes, and on the frequencies of a body about its preload."""
    parts = []
    for block in tension_blocks(structure):
        lowest, s = block.lowest_tension(), len(block.linear_map)
        parts.append(f"{block.group} {lowest.min():.4g} to {lowest.max():.4g} {UNITS[s]}")
    text = f"at rest with tension in {', '.join(parts)}" if parts else ""
    if is_preloaded(structure, modeset.held) and body.condensed and modeset.omega.size:
        hertz = ", ".join(f"{f:.4g}" for f in modeset.omega[np.isfinite(modeset.omega)][:4] / (2 * np.pi))
        text += (
            f"{'; ' if text else ''}about its preload its first modes have {hertz} Hz; its strain is condensed, so "
            "that its tension comes from the loads of the run, and frequencies of its table are those without it"
        )
    return text


def _reduce_with_strain(
    case: Case, name: str, table: FlexibleTable, structure: Structure, modeset: ModeSet
) -> tuple[FlexibleBody, ModeSet]:
    """The body of a structure with the strain of the case (default linear), and its set with the derivatives needed."""
    r, strain = table.reduction, table.strain or "linear"
    keep = r.derivatives if isinstance(r, Stretchable) else "none"
    groups, turning = marker_groups(table), turning_markers(case, name)
    if modeset.n_modes:
        check_torques(case, name, groups, structure)
    if strain == "condensed" and keep is None:
        modeset = with_derivatives(structure, modeset)
    damping, patches, loads = (
        table.damping,
        patch_groups(case, name),
        load_sets_of(case, name, table),
    )
    induced = induced_groups(case, name)
    body = reduce_structure(structure, modeset, groups, damping, strain, turning, patches, loads, induced)
    if strain == "nonlinear" and isinstance(r, Stretchable) and body.n_modes:
        if keep == "none" and not r.responses:
            _warn_of_stiffness(name, structure, modeset, body)
        elif "response" not in modeset.kinds:
            require_stretch(structure, modeset, body.strain)
    return body, modeset


def _warn_of_stiffness(name: str, structure: Structure, modeset: ModeSet, body: FlexibleBody) -> None:
    """Warn of a set that cannot stretch and was requested without derivatives."""
    if text := missing_stretch(structure, modeset, body.strain):
        warn_of_physics(
            "{body_or_joint}: {lack}; derivatives = 'none' is set, so it is used unchanged, and its deflections are "
            "far too small",
            body_or_joint=f"bodies.{name}",
            lack=text,
        )


def turning_markers(case: Case, name: str) -> set[str]:
    """Markers of a body whose rotation is used: by joints other than ball joints, by torques, and by the attitude."""
    transmitting_moments = [joint for joint in case.joints if joint.kind != "spherical"]
    used = {joint.child_marker for joint in transmitting_moments if joint.child == name}
    used |= {joint.parent_marker for joint in transmitting_moments if joint.parent == name}
    used |= {load.marker for load in case.loads if load.body == name and load.frame == "marker"}
    used |= {load.marker for load in torque_loads(case, name)}
    return used | ({case.attitude.marker} if case.attitude.marker else set())


def patch_groups(case: Case, name: str) -> list[str]:
    """Groups of a body over which effectors of the case spread forces."""
    nouns = [noun for named in case.effectors.values() for noun in named.values()]
    return sorted({group for noun in nouns for body, group in noun.needed_patches() if body == name})


def _segments(case: Case, name: str, table: FlexibleTable, counts: tuple[int | None, int, int | None]) -> Segments:
    """The segments of a body. counts: numbers of modes, refinements and segments, None for those of the case."""
    modes, refine, count = counts
    mesh = build_mesh(case, name, table, refine)
    patches = patch_groups(case, name)
    return build_segments(case, name, table, mesh, marker_groups(table), modes, count, patches)


def marker_groups(table: FlexibleTable) -> dict[str, str]:
    """The mesh group of every marker a body names."""
    return {
        marker: PLACE.format(marker) if entry.position is not None else (entry.group or marker)
        for marker, entry in table.markers.items()
    }


def _rigid_body(case: Case, table: RigidTable) -> FlexibleBody:
    centre, J = np.array(table.center_of_mass), central_inertia(table)
    if table.imbalance is not None:
        offset = np.array([table.imbalance.static / table.mass, 0.0, 0.0])
        J = J - table.imbalance.dynamic * (np.eye(3)[[0]].T @ np.eye(3)[[2]] + np.eye(3)[[2]].T @ np.eye(3)[[0]])
        J = J - table.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        centre = centre + offset
    markers = {
        name: Marker.at_position(np.array(entry.position or (0.0, 0.0, 0.0))) for name, entry in table.markers.items()
    }
    return rigid_body(table.mass, J, centre, markers, rigid_skin(case, table))


def _beam_body(case: Case, name: str, table: AnalyticTable, modes: int | None) -> BodyWithSource:
    bounded = table.strain == "nonlinear" and table.bounded_energy is not False
    beam = table.model_copy(update={"bounded_energy": bounded})
    functions, note = functions_of(case, name, table, modes)
    strain, patches = table.strain or "linear", patch_groups(case, name)
    induced = induced_groups(case, name)
    body = beam_body(beam, functions, table.damping, strain=strain, patches=patches, induced=induced)
    names = {marker: entry.group or marker for marker, entry in table.markers.items()}
    return body, Analytic(beam, functions, names), (("shapes", note),) if note else ()


def _body_from_file(case: Case, name: str, table: FileTable, modes: int | None) -> FlexibleBody:
    body = load_body(case.file_path(table.file))
    n = table.modes if modes is None else modes
    if n is not None:
        if n > body.n_modes:
            text = f"found {n}; {table.file} holds {body.n_modes} elastic coordinates"
            raise CaseError(case.path.name, [Problem(f"bodies.{name}.modes", text)])
        n_lost = body.kinds[n : body.n_modes].count("derivative")
        if n_lost and not body.strain.is_linear:
            text = (
                f"found {n}, which leaves out {n_lost} of the derivative shapes that {table.file} needs for its "
                f"nonlinear strain; keep all {body.n_modes}, or make the body with fewer modes"
            )
            raise CaseError(case.path.name, [Problem(f"bodies.{name}.modes", text)])
        body = body.truncated(n)
    damping = table.damping
    if damping is not None:
        kinds = (body.kinds or ("",) * body.n_modes)[: body.n_modes]
        damped = [body.strain.is_linear or kind != "derivative" for kind in kinds]
        Me = body.without_slaves().moments.elastic_mass()
        body = replace(
            body,
            damping=bending_damping(damping, Me, body.strain.V1, damped, is_added(kinds), is_unanswered(kinds)),
        )
    return body


def with_markers(body: FlexibleBody, name: str, table: BodyTable) -> FlexibleBody:
    """The body whose markers have the orientations of the case; without a mesh, new markers copy those they name."""
    markers = dict(body.markers)
    for key, entry in table.markers.items():
        if key not in markers:
            if entry.position is not None:
                raise ValueError(
                    f"marker {key!r} cannot be put at a position of a body without a mesh; its markers are "
                    f"{sorted(markers)}"
                )
            group = entry.group or key
            if group not in markers:
                raise ValueError(f"marker {key!r} needs marker {group!r} of body {name!r}, which has {sorted(markers)}")
            markers[key] = markers[group]
    return _with_marker_axes(replace(body, markers=markers), table)


def _with_marker_axes(body: FlexibleBody, table: BodyTable) -> FlexibleBody:
    """The body whose markers have the orientations of the case."""
    axes = {key: entry.orientation for key, entry in table.markers.items() if entry.orientation is not None}
    turned = {key: marker.with_orientation(np.array(axes[key])) for key, marker in body.markers.items() if key in axes}
    return replace(body, markers={**body.markers, **turned})


def matrix_model(case: Case, table: MatricesTable) -> MatrixModel:
    """The MatrixModel of the files of a body, with its spin."""
    model = read_matrices(table.matrices, table.units, table.groups, case.path.parent)
    return model if table.spin is None else model.spinning(table.spin.rate, table.spin.axis)


def build_matrix_body(case: Case, table: MatricesTable, modes: int | None, turning: set[str]) -> MatrixBody:
    """The body of a table, with `modes` modes instead of the case's if given, and notes on it."""
    markers = {name: entry.group or name for name, entry in table.markers.items()}
    r = table.reduction
    named = [*getattr(r, "clamp", {}), *getattr(r, "interfaces", ()), *getattr(r, "loads", {})]
    named += [group for group in getattr(r, "joints", None) or {} if group not in named]
    stated = StatedMass(
        table.mass,
        None if table.center_of_mass is None else np.array(table.center_of_mass),
        None if table.inertia is None else np.array(table.inertia),
    )
    reduce = None if r is None else partial(_modes_of_matrices, table=table, modes=modes)
    return matrix_body(matrix_model(case, table), reduce, named, markers, table.damping, turning, stated)


def _modes_of_matrices(structure: MatrixStructure, table: MatricesTable, modes: int | None) -> ModeSet:
    r = table.reduction
    if isinstance(r, Stretchable):
        smoothed = without_rounding(structure) if isinstance(r, FreeFree) else structure
        return r.vibration_set(smoothed, modes)
    assert isinstance(r, Nodal | Stiff)
    return r.shapes(structure)[1]


def stiffening_remedy(table: BodyTable) -> str:
    """The remedy for a body with linear strain that axial loads stiffen, as part of a sentence."""
    if isinstance(table, FileTable):
        return f"make {table.file} anew (femflex body) from a case that gives it strain = 'condensed'"
    if isinstance(table, MatricesTable):
        return (
            "matrices hold linear strain alone (the second number is an estimate that takes the body as a line "
            "along its longest extent): give their geometric stiffness and spin, or make the body of elements, with "
            "strain = 'condensed'"
        )
    r = getattr(table, "reduction", None)
    if isinstance(r, Stretchable) and r.derivatives in ("none", 0):
        return f"drop derivatives = {r.derivatives!r} and give it strain = 'condensed'"
    return "give it strain = 'condensed'"


def linear_strain_reason(table: BodyTable) -> str:
    """The reason why a body cannot have another strain than linear; empty if it can."""
    if not isinstance(table, FlexibleTable):
        return ""
    if not isinstance(table.reduction, Stretchable):
        method = getattr(table.reduction, "method", "none")
        return f"its reduction method {method!r} has no other form; use one with derivatives, such as 'cantilever'"
    if table.reduction.derivatives in ("none", 0):
        return (
            f"with derivatives = {table.reduction.derivatives!r} its shapes cannot bend without stretching; remove "
            "that key for condensed strain"
        )
    return ""
