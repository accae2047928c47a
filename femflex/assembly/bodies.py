"""Tables of bodies -> FlexibleBody, with what each was reduced from."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from femflex.assembly.acting_loads import acting_loads, added_shapes_text
from femflex.assembly.decks import with_deck
from femflex.assembly.deploying import added_note, build_deploying, deployed_origin
from femflex.assembly.extents import warn_of_doubtful_extents
from femflex.assembly.functions import functions_of
from femflex.assembly.matrices import build_matrix_body
from femflex.assembly.open_choices import bound_to_linear, open_choices, remedy_of
from femflex.assembly.rigid_skins import rigid_skin
from femflex.assembly.segments import build_segments
from femflex.assembly.shared import shared_parts
from femflex.assembly.structures import PLACE, build_mesh, build_modes, preload_of, structure_of, supports_of
from femflex.assembly.torques import check_torques, has_torque
from femflex.body import FlexibleBody, Marker, rigid_body
from femflex.case.body import AnalyticTable, BodyTable, FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.deploying import DeployingTable
from femflex.case.load import LoadTable
from femflex.case.matrices import MatricesTable
from femflex.case.problems import CaseError, Problem, suggestion_text
from femflex.case.reduction import DampingTable, Stretchable
from femflex.case.support import SkewSupport
from femflex.fem.deflected import tension_blocks
from femflex.fem.structure import Structure
from femflex.fem.tension.strain import UNITS
from femflex.reduction import (
    ModalDamping,
    RayleighDamping,
    UniformBeam,
    beam_body,
    bending_damping,
    is_added,
    is_unanswered,
    load_body,
    missing_stretch,
    reduce_structure,
    require_stretch,
    with_derivatives,
)
from femflex.reduction.modes.half_waves import half_wave_text, warn_of_few_elements
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.origin import Analytic, Meshed, Origin
from femflex.reduction.preload.equilibrium import is_preloaded
from femflex.reduction.small_motions import small_motion_body
from femflex.system import Part, Segments
from femflex.warning import PhysicsWarning


@dataclass(frozen=True, eq=False)
class BuiltBody:
    """A body as its table says it, its origin, and notes on how it was made.

    origin: None of a body cut into segments; notes: what is in its set in addition to the table.
    """

    part: Part
    origin: Origin | None = None
    notes: tuple[str, ...] = ()


def build_bodies(case: Case) -> dict[str, Part]:
    """All bodies of a case by name, as `built_bodies`."""
    return {name: built.part for name, built in built_bodies(case).items()}


def built_bodies(case: Case, drafts: Collection[str] = ()) -> dict[str, BuiltBody]:
    """All bodies of a case by name, with their origins.

    drafts: bodies of elements that are made for small motions about rest alone, from which shapes are chosen.
    Bodies whose tables say the same but for their initial state, and that carry alike, are built once and shared.
    Raises CaseError with the problems of all bodies together.
    """
    bodies: dict[str, BuiltBody] = {}
    alike: dict[str, BuiltBody] = {}
    problems: list[Problem] = []
    for name in case.bodies:
        key = f"{name in drafts} {_content(case, name)}"
        if key in alike:
            bodies[name] = alike[key]
            continue
        try:
            with warnings.catch_warnings():
                if name in drafts:
                    warnings.simplefilter("ignore", PhysicsWarning)  # given when the body itself is made
                bodies[name] = alike[key] = built_body(case, name, draft=name in drafts)
        except CaseError as error:
            problems += error.problems
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
    """The body of that name, or its Segments when it is cut (into `segments` instead of the case's number, if given).

    modes: another number of modes; refine: how many times finer its mesh is. Its strain is what the case says, or
    linear. What the case leaves open is decided above (`pipeline.decisions`). draft: as of `built_bodies`.

    Raises CaseError with what is wrong with it.
    """
    if name not in case.bodies:
        raise CaseError(
            case.path.name, [Problem("bodies", f"found no body {name!r}; {suggestion_text(name, case.bodies)}")]
        )
    made = shared_parts()
    if made is None:
        return _built(case, name, modes, refine, segments, draft)
    rest = case.model_copy(update={"bodies": {}, "initial": None})
    key = f"{case.path} {name} {modes} {refine} {segments} {draft} {_content(case, name)} {rest!r}"
    return made.part(key, lambda: _built(case, name, modes, refine, segments, draft))


def _content(case: Case, name: str) -> str:
    """What decides how a body is built and what is warned of: its table but for its initial state, and what acts."""
    table = case.bodies[name]
    if isinstance(table, FlexibleTable) and isinstance(table.reduction, Stretchable) and table.reduction.joints == {}:
        open_ = table.reduction.model_copy(update={"joints": None})  # which builds the same
        table = table.model_copy(update={"reduction": open_})
    context, apart = [str(sorted(turning_markers(case, name)))], {"initial"}
    if isinstance(table, DeployingTable) and table.length is not None and table.length.profile is not None:
        context.append(str(table.length.profile(case.path.parent).numbers))
        apart.add("length")
    if isinstance(table, FlexibleTable):
        context.append(str(acting_loads(case, name, table, marker_groups(table))))
    return f"{type(table).__name__} {table.model_dump_json(exclude=apart)} {context}"


def _built(case: Case, name: str, modes: int | None, refine: int, segments: int | None, draft: bool) -> BuiltBody:
    """`built_body`, anew."""
    table = case.bodies[name]
    try:
        if isinstance(table, FlexibleTable) and table.segmented_member is not None:
            cut = _segments(case, name, table, (modes, refine, segments))
            return BuiltBody(Segments(tuple(_turned(body, table) for body in cut.bodies)))
        if isinstance(table, DeployingTable):
            made = build_deploying(case, name, table, modes)
            return BuiltBody(made.body, deployed_origin(case, name, table, made), added_note(case, name, table))
        body, source, notes = _body(case, name, table, modes, refine, draft)
        open_ = Origin(source, open_choices(table), bound_to_linear(table), remedy_of(table))
        if isinstance(source, Meshed) and not draft:
            warn_of_doubtful_extents(case, name, table, source.structure.mesh, body.moments.mass)
        return BuiltBody(_with_markers(body, name, table), None if isinstance(table, RigidTable) else open_, notes)
    except CaseError:
        raise
    except (ValueError, OSError) as error:
        raise CaseError(case.path.name, [Problem(f"bodies.{name}", str(error))]) from error
    except RuntimeError as error:  # of the eigen-solver
        raise RuntimeError(f"{case.path.name}: bodies.{name}: {error}") from error


Made = tuple[FlexibleBody, Meshed | Analytic | None, tuple[str, ...]]  # body, source, notes


def _body(case: Case, name: str, table: BodyTable, modes: int | None, refine: int, draft: bool) -> Made:
    if isinstance(table, RigidTable):
        return _rigid(case, table), None, ()
    if isinstance(table, AnalyticTable):
        return _analytic(case, name, table, modes)
    if isinstance(table, FileTable):
        return _from_file(case, name, table, modes), None, ()
    if isinstance(table, MatricesTable):
        made = build_matrix_body(case, table, modes, _damping(table.damping), turning_markers(case, name))
        return made.body, None, made.notes
    assert isinstance(table, FlexibleTable)
    table = with_deck(case, name, table)
    given = structure_of(case, name, table, refine)
    added = acting_loads(case, name, table, marker_groups(table))
    structure, modeset = build_modes(given, table, modes, name, added, preload_of(case, name, table))
    if draft:
        body = small_motion_body(structure, modeset, marker_groups(table), turning_markers(case, name))
    else:
        body, modeset = _meshed(case, name, table, structure, modeset)
    r = table.reduction
    joints = getattr(r, "joints", None) or {}
    source = Meshed(
        structure,
        modeset,
        marker_groups(table),
        supports_of(_partial(getattr(r, "clamp", {}))),
        tuple(getattr(r, "loads", ())),
        getattr(r, "deflection", None),
        getattr(r, "third_derivatives", None),
    )
    texts = [added_shapes_text(added, modeset, joints), tension_text(structure, modeset, body)]
    texts.append(half_wave_text(structure, modeset))
    warn_of_few_elements(structure, modeset)
    return body, source, (*given.notes, *filter(None, texts))


def tension_text(structure: Structure, modeset: ModeSet, body: FlexibleBody) -> str:
    """A line on the tension of tethers and membranes, and on the frequencies of a body about its preload."""
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


def _partial(clamp: Mapping[str, tuple[str, ...] | SkewSupport]) -> dict[str, tuple[str, ...] | SkewSupport]:
    """The groups of a clamp of which some components alone are held."""
    return {group: value for group, value in clamp.items() if value}


def _meshed(
    case: Case, name: str, table: FlexibleTable, structure: Structure, modeset: ModeSet
) -> tuple[FlexibleBody, ModeSet]:
    """The body of a structure with the strain that the case says, or linear, and the set that it wants for that."""
    r, strain = table.reduction, table.strain or "linear"
    keep = r.derivatives if isinstance(r, Stretchable) else "none"
    groups, turning = marker_groups(table), turning_markers(case, name)
    if modeset.n_modes:
        check_torques(case, name, groups, structure)
    if strain == "condensed" and keep is None:
        modeset = with_derivatives(structure, modeset)
    body = reduce_structure(structure, modeset, groups, _damping(table.damping), strain, turning)
    if strain == "nonlinear" and isinstance(r, Stretchable) and body.n_modes:
        if keep == "none" and not r.responses:
            _warn_of_stiffness(name, structure, modeset, body)
        elif "response" not in modeset.kinds:
            require_stretch(structure, modeset, body.strain)
    return body, modeset


def _warn_of_stiffness(name: str, structure: Structure, modeset: ModeSet, body: FlexibleBody) -> None:
    """Warn of a set that was requested unchanged and cannot stretch."""
    if lack := missing_stretch(structure, modeset, body.strain):
        warning = PhysicsWarning(
            "{body_or_joint}: {lack}; derivatives = 'none' is set, so it is used unchanged, and its deflections are "
            "far too small",
            body_or_joint=f"bodies.{name}",
            lack=lack,
        )
        warnings.warn(warning, stacklevel=2)


def turning_markers(case: Case, name: str) -> set[str]:
    """Markers of a body whose rotation something uses: joints, ball joints apart, torques, and the attitude."""
    turned = [joint for joint in case.joints if joint.kind != "spherical"]
    used = {joint.child_marker for joint in turned if joint.child == name}
    used |= {joint.parent_marker for joint in turned if joint.parent == name}
    used |= {load.marker for load in case.loads if load.body == name and _turns(case, load)}
    return used | ({case.attitude.marker} if case.attitude.marker else set())


def _turns(case: Case, load: LoadTable) -> bool:
    return load.frame == "marker" or has_torque(case, load)


def _segments(case: Case, name: str, table: FlexibleTable, other: tuple[int | None, int, int | None]) -> Segments:
    """The segments of a body with other numbers of modes, refinements and segments."""
    modes, refine, count = other
    mesh = build_mesh(case, name, table, refine)
    return build_segments(case, name, table, mesh, marker_groups(table), _damping(table.damping), modes, count)


def marker_groups(table: FlexibleTable) -> dict[str, str]:
    """The mesh group of every marker a body names."""
    return {
        marker: PLACE.format(marker) if entry.position is not None else (entry.group or marker)
        for marker, entry in table.markers.items()
    }


def _turned(body: FlexibleBody, table: FlexibleTable) -> FlexibleBody:
    """A segment with its markers turned as the case says."""
    markers = dict(body.markers)
    for key, entry in table.markers.items():
        if key in markers and entry.orientation is not None:
            markers[key] = markers[key].with_orientation(np.array(entry.orientation))
    return replace(body, markers=markers)


def _rigid(case: Case, table: RigidTable) -> FlexibleBody:
    centre, J = np.array(table.center_of_mass), np.array(table.inertia)
    if table.inertia_about == "origin":
        J = J - table.mass * ((centre @ centre) * np.eye(3) - np.outer(centre, centre))
    if table.imbalance is not None:
        offset = np.array([table.imbalance.static / table.mass, 0.0, 0.0])
        J = J - table.imbalance.dynamic * (np.eye(3)[[0]].T @ np.eye(3)[[2]] + np.eye(3)[[2]].T @ np.eye(3)[[0]])
        J = J - table.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        centre = centre + offset
    markers = {name: Marker.at(np.array(entry.position or (0.0, 0.0, 0.0))) for name, entry in table.markers.items()}
    return rigid_body(table.mass, J, centre, markers, rigid_skin(case, table))


def _analytic(case: Case, name: str, table: AnalyticTable, modes: int | None) -> Made:
    values = table.model_dump(include=set(UniformBeam.__dataclass_fields__) - {"mass_per_length"})
    values["bounded_energy"] = table.strain == "nonlinear" and table.bounded_energy is not False
    mass = table.mass_per_length if table.mass is None else table.mass / table.length
    assert mass is not None
    beam = UniformBeam(mass_per_length=mass, **values)
    chosen, note = functions_of(case, name, table, modes, beam.frame)
    body = beam_body(beam, chosen, _damping(table.damping), strain=table.strain or "linear")
    names = {marker: entry.group or marker for marker, entry in table.markers.items()}
    return body, Analytic(beam, chosen, names), (note,) if note else ()


def _from_file(case: Case, name: str, table: FileTable, modes: int | None) -> FlexibleBody:
    body = load_body(case.file_path(table.file))
    n = table.modes if modes is None else modes
    if n is not None:
        if n > body.n_modes:
            text = f"found {n}; {table.file} holds {body.n_modes} elastic coordinates"
            raise CaseError(case.path.name, [Problem(f"bodies.{name}.modes", text)])
        lost = body.kinds[n : body.n_modes].count("derivative")
        if lost and not body.strain.is_linear:
            text = (
                f"found {n}, which leaves out {lost} of the derivative shapes that {table.file} needs for its "
                f"nonlinear strain; keep all {body.n_modes}, or make the body with fewer modes"
            )
            raise CaseError(case.path.name, [Problem(f"bodies.{name}.modes", text)])
        body = body.truncated(n)
    damping = _damping(table.damping)
    if damping is not None:
        kinds = (body.kinds or ("",) * body.n_modes)[: body.n_modes]
        damped = [body.strain.is_linear or kind != "derivative" for kind in kinds]
        Me = body.without_slaves().moments.elastic_mass()
        body = replace(
            body,
            damping=bending_damping(damping, Me, body.strain.V1, damped, is_added(kinds), is_unanswered(kinds)),
        )
    return body


def _damping(table: DampingTable | None) -> ModalDamping | RayleighDamping | None:
    if table is None:
        return None
    if table.ratio is not None:
        return ModalDamping(table.ratio)
    return RayleighDamping(table.mass or 0.0, table.stiffness or 0.0)


def _with_markers(body: FlexibleBody, name: str, table: BodyTable) -> FlexibleBody:
    """The body with markers turned as the case says; on bodies without a mesh, new ones are copies of those named."""
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
        if entry.orientation is not None:
            markers[key] = markers[key].with_orientation(np.array(entry.orientation))
    return replace(body, markers=markers)
