"""Tables of bodies -> FlexibleBody."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from femflex.advice.bearings import bearing_of_analytic, bearing_of_meshed
from femflex.advice.curved import of_curved, of_responses, softening_of
from femflex.advice.enrichment import BeamEnrichment, MeshedEnrichment
from femflex.advice.sheet import of_sheet
from femflex.assembly.acting import acting, told
from femflex.assembly.functions import functions_of
from femflex.assembly.rigid_skins import rigid_skin
from femflex.assembly.segments import build_segments
from femflex.assembly.shared import shared
from femflex.assembly.structures import PLACE, build_mesh, build_modes, structure_of
from femflex.assembly.torques import check_torques, has_torque
from femflex.body import FlexibleBody, Marker, rigid_body
from femflex.case.body import AnalyticTable, BodyTable, FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.load import LoadTable
from femflex.case.problems import CaseError, Problem, near
from femflex.case.reduction import DampingTable, LumpedTable, Stretchable
from femflex.fem.structure import Structure
from femflex.reduction import (
    ModalDamping,
    RayleighDamping,
    UniformBeam,
    beam_body,
    bending_damping,
    foreshortening,
    foreshortening_of,
    hardening,
    is_added,
    is_unanswered,
    lack_of_stretch,
    load_body,
    reduce_structure,
    require_stretch,
    with_derivatives,
)
from femflex.reduction.modes.modeset import ModeSet
from femflex.system import Part, Segments
from femflex.warning import PhysicsWarning

MANY = 1200  # coordinates up to which the lowest shape of a set is sought


def build_bodies(case: Case, modes: int | None = None, refine: int = 0) -> dict[str, Part]:
    """All bodies of a case by name, with other numbers of modes or finer meshes if asked.

    Bodies whose tables say the same but for their initial state, and that carry alike, are built once and shared.
    Raises CaseError with the problems of all bodies together.
    """
    bodies: dict[str, Part] = {}
    alike: dict[str, Part] = {}
    problems: list[Problem] = []
    for name in case.bodies:
        key = _content(case, name)
        if key in alike:
            bodies[name] = alike[key]
            continue
        try:
            bodies[name] = alike[key] = build_part(case, name, modes, refine)
        except CaseError as error:
            problems += error.problems
    if problems:
        raise CaseError(case.path.name, problems)
    return bodies


def build_part(case: Case, name: str, modes: int | None = None, refine: int = 0, segments: int | None = None) -> Part:
    """The body of that name, or its Segments when it is cut (into `segments` instead of the case's number, if given).

    Its strain is what the case says, or linear. `build_body` looks at the system for what the case does not say.

    Raises CaseError with what is wrong with it.
    """
    if name not in case.bodies:
        raise CaseError(case.path.name, [Problem("bodies", f"found no body {name!r}; {near(name, case.bodies)}")])
    made = shared()
    if made is None:
        return _part(case, name, modes, refine, segments)
    rest = case.model_copy(update={"bodies": {}, "initial": None})
    key = f"{case.path} {name} {modes} {refine} {segments} {_content(case, name)} {rest!r}"
    return made.part(key, lambda: _part(case, name, modes, refine, segments))


def _content(case: Case, name: str) -> str:
    """What decides how a body is built and what is warned of: its table but for its initial state, and what acts."""
    table = case.bodies[name]
    if isinstance(table, FlexibleTable) and isinstance(table.reduction, Stretchable) and table.reduction.joints == {}:
        open_ = table.reduction.model_copy(update={"joints": None})  # which builds the same
        table = table.model_copy(update={"reduction": open_})
    beside = [str(sorted(turning_markers(case, name)))]
    if isinstance(table, FlexibleTable):
        beside.append(str(acting(case, name, table, marker_groups(table))))
    return f"{type(table).__name__} {table.model_dump_json(exclude={'initial'})} {beside}"


def _part(case: Case, name: str, modes: int | None, refine: int, segments: int | None) -> Part:
    """`build_part`, anew."""
    table = case.bodies[name]
    try:
        if isinstance(table, FlexibleTable) and table.cut is not None:
            cut = _segments(case, name, table, (modes, refine, segments))
            return Segments(tuple(_turned(body, table) for body in cut.bodies))
        return _with_markers(_body(case, name, table, modes, refine), name, table)
    except CaseError:
        raise
    except (ValueError, OSError) as error:
        raise CaseError(case.path.name, [Problem(f"bodies.{name}", str(error))]) from error


def _body(case: Case, name: str, table: BodyTable, modes: int | None, refine: int) -> FlexibleBody:
    if isinstance(table, RigidTable):
        return _rigid(case, table)
    if isinstance(table, AnalyticTable):
        return _analytic(case, name, table, modes)
    if isinstance(table, FileTable):
        return _from_file(case, name, table, modes)
    assert isinstance(table, FlexibleTable)
    given = structure_of(case, name, table, refine)
    added = acting(case, name, table, marker_groups(table))
    structure, modeset = build_modes(given, table, modes, name, added)
    body = _meshed(case, name, table, structure, modeset)
    joints = getattr(table.reduction, "joints", None) or {}
    return replace(body, note="; ".join(filter(None, (told(added, modeset, joints), body.note))))


def _meshed(case: Case, name: str, table: FlexibleTable, structure: Structure, modeset: ModeSet) -> FlexibleBody:
    """The body of a structure and its set, with the strain that the case says, or linear."""
    r, strain = table.reduction, table.strain or "linear"
    keep = r.derivatives if isinstance(r, Stretchable) else "none"
    groups, turning = marker_groups(table), turning_markers(case, name)
    if modeset.n_modes:
        check_torques(case, name, groups, structure)
    ignored = None
    if strain == "linear" and 0 < modeset.n_modes <= MANY and not isinstance(r, LumpedTable):
        ignored = foreshortening(structure, modeset, groups)
    if ignored is not None and keep in ("none", 0):
        ignored = replace(ignored, remedy=f"drop derivatives = {keep!r} and {ignored.remedy}")
    if strain == "condensed" and keep is None:
        modeset = with_derivatives(structure, modeset)
    body = reduce_structure(structure, modeset, groups, _damping(table.damping), strain, turning)
    note = ""
    if strain == "nonlinear" and isinstance(r, Stretchable) and body.n_modes:
        if keep == "none" and not r.responses:
            _warn_of_stiffness(name, structure, modeset, body)
        elif "response" in modeset.kinds:
            note = of_responses(structure, modeset, body.strain)
        else:
            require_stretch(structure, modeset, body.strain)
    if not note and strain != "linear" and isinstance(r, Stretchable) and r.deflection is None:
        curved = of_curved(structure, modeset) if modeset.held.size else ""
        note = "; ".join(filter(None, (curved, of_sheet(structure, modeset, r))))
    bearing, softening = bearing_of_meshed(groups, structure, modeset), softening_of(structure, modeset)
    hardens = partial(hardening, structure, modeset) if strain == "linear" and modeset.n_modes <= MANY else None
    judged = isinstance(r, Stretchable) and 0 < modeset.n_modes <= MANY
    return replace(
        body,
        note=note,
        ignored=ignored,
        buckling=bearing,
        softening=softening,
        hardening=hardens,
        enrichment=MeshedEnrichment(structure, modeset, _places(groups, modeset)) if judged else None,
    )


def _places(groups: Mapping[str, str], modeset: ModeSet) -> dict[str, str]:
    """The mesh group of every marker of a body on this set."""
    return {**{group: group for group in modeset.groups}, **groups}


def _warn_of_stiffness(name: str, structure: Structure, modeset: ModeSet, body: FlexibleBody) -> None:
    """Warn of a set that was asked for as it is and cannot stretch."""
    if lack := lack_of_stretch(structure, modeset, body.strain):
        text = f"bodies.{name}: {lack}; it is taken as it is, as derivatives = 'none' asks, and bends far too little"
        warnings.warn(text, PhysicsWarning, stacklevel=2)


def turning_markers(case: Case, name: str) -> set[str]:
    """Markers of a body whose rotation something uses: joints, torques, and the attitude."""
    used = {joint.child_marker for joint in case.joints if joint.child == name}
    used |= {joint.parent_marker for joint in case.joints if joint.parent == name}
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
            markers[key] = markers[key].turned(np.array(entry.orientation))
    return replace(body, markers=markers)


def _rigid(case: Case, table: RigidTable) -> FlexibleBody:
    centre, J = np.array(table.center_of_mass), np.array(table.inertia)
    if table.inertia_about == "origin":
        J = J - table.mass * ((centre @ centre) * np.eye(3) - np.outer(centre, centre))
    markers = {name: Marker.rigid(np.array(entry.position or (0.0, 0.0, 0.0))) for name, entry in table.markers.items()}
    return rigid_body(table.mass, J, centre, markers, rigid_skin(case, table))


def _analytic(case: Case, name: str, table: AnalyticTable, modes: int | None) -> FlexibleBody:
    values = table.model_dump(include=set(UniformBeam.__dataclass_fields__) - {"mass_per_length"})
    values["far_bends"] = table.strain == "nonlinear" and table.far_bends is not False
    mass = table.mass_per_length if table.mass is None else table.mass / table.length
    assert mass is not None
    beam = UniformBeam(mass_per_length=mass, **values)
    chosen, note = functions_of(case, name, table, modes)
    strain, ignored = table.strain or "linear", None
    if strain == "linear" and (chosen.y or chosen.z):
        bending = replace(chosen, axial=0, torsion=0)
        ignored = foreshortening_of(beam_body(beam, bending, strain="condensed"))
    body = beam_body(beam, chosen, _damping(table.damping), strain=strain)
    enrichment = BeamEnrichment(beam, chosen)
    return replace(
        body, note=note, ignored=ignored, buckling=bearing_of_analytic(beam, chosen, table), enrichment=enrichment
    )


def _from_file(case: Case, name: str, table: FileTable, modes: int | None) -> FlexibleBody:
    body = load_body(case.beside(table.file))
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
    if body.ignored is not None:
        remedy = f"make {table.file} anew (femflex body) from a case that gives it strain = 'condensed'"
        body = replace(body, ignored=replace(body.ignored, remedy=remedy))
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
            markers[key] = markers[key].turned(np.array(entry.orientation))
    return replace(body, markers=markers)
