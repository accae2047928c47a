"""Systems and bodies of cases, with strain and additional shapes decided where their tables leave them open.

The bodies are built as their tables say, linear where these say nothing. Advice on the system that they make is written
into the tables, and the bodies that it changes are built again, of the same structures.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femflex.advice.advice import Advice, doubt, notes_of, warn_of
from femflex.advice.advise import strain_doubt
from femflex.advice.bodies import KnownBodies
from femflex.advice.buckling.margin import (
    BucklingMargin,
    assessed_bodies,
    buckling_margins,
    buckling_warnings,
    unassessed_bodies,
)
from femflex.advice.curved import response_advice, shape_notes
from femflex.advice.deployed_estimate import deployed_estimates, slender_members
from femflex.advice.model_warnings import model_warnings
from femflex.advice.motion_estimate import RigidEstimate, estimate_motion, estimate_rigid_motion
from femflex.advice.spin_shapes import spin_advice
from femflex.advice.strain import strain_advice
from femflex.advice.truncation import (
    RicherCraft,
    joint_advice,
    richer_craft,
    truncation_warnings,
    unassessed_truncation,
)
from femflex.assembly.bodies import BuiltBody, built_bodies, built_body
from femflex.assembly.deploying import held_at
from femflex.assembly.initial import wanted_displacement
from femflex.assembly.open_choices import (
    open_joints,
    open_strains,
    table_text,
    with_joints,
    with_responses_to,
    with_spin,
    with_strains,
)
from femflex.assembly.shared import shared_structures
from femflex.assembly.system import problems_of_loads
from femflex.body import FlexibleBody
from femflex.case.body import FlexibleTable, Strain
from femflex.case.case import Case
from femflex.case.problems import CaseError, Problem
from femflex.case.reduction import CantileverTable
from femflex.pipeline.periods import check_periods
from femflex.pipeline.references import duration_of
from femflex.pipeline.start import system_of
from femflex.reduction.origin import Origin
from femflex.system import Part, Segments, System
from femflex.warning import PhysicsWarning, TruncationWarning

Array = NDArray[np.float64]
Built = dict[str, BuiltBody]

FAR = 0.1  # displacement over length above which linear strain is doubtful
OTHER: dict[Strain, Strain] = {"condensed": "nonlinear", "nonlinear": "condensed"}  # tried where one cannot be built


@dataclass(frozen=True, eq=False)
class Decided:
    """A case with everything that it left open written out, its system, and the advice that this follows.

    origins: what its bodies were reduced from, by name.
    """

    case: Case
    system: System
    advice: tuple[Advice, ...]
    origins: Mapping[str, Origin]

    @property
    def known(self) -> KnownBodies:
        """Its bodies, by what they were reduced from."""
        return KnownBodies(self.origins)

    @property
    def notes(self) -> dict[str, str]:
        """Notes on each body, without its warnings."""
        return notes_of(self.advice)


def build_system(case: Case, bodies: Mapping[str, Part] | None = None) -> System:
    """The System a case describes, with these bodies or with its own.

    Its own bodies that do not say their strain get the one that their places in the system call for. Warns
    (PhysicsWarning) of what is doubtful of them. Raises CaseError with everything that does not fit together.
    """
    found = decided(case, bodies)
    warn_of_build(found.advice)
    return found.system


def warn_of_build(advice: Iterable[Advice]) -> None:
    """Give the doubts as warnings that hold whatever is done with a system: how much of the mass moves does not."""
    warn_of((one for one in advice if one.decision != "mass"), stacklevel=4)


def decided(
    case: Case, bodies: Mapping[str, Part] | None = None, *, thorough: bool = False, loaded: bool = True
) -> Decided:
    """The case with all choices made, and its system: of these bodies, or of its own.

    Doubts are in its advice, not given as warnings; a run watches on its own what linear strain leaves out of bodies
    that ask for it. thorough: that is estimated here too. loaded: bodies whose strain is given are assessed by what
    buckles them, which costs a Lanczos run for each.

    Raises CaseError with everything that does not fit together.
    """
    with shared_structures():
        return _given(case, bodies) if bodies is not None else _decided(case, thorough, loaded)


def with_own_joints(case: Case) -> Case:
    """The case with the static shapes of joints written out that its bodies get in its system.

    Raises CaseError where that cannot be built.
    """
    if not open_joints(case):
        return case
    with shared_structures():
        return _joined(case)[0]


def _given(case: Case, bodies: Mapping[str, Part]) -> Decided:
    system = system_of(case, bodies)
    check_periods(system, duration_of(case, system))
    advice = [*_large_displacements(case, system), *model_warnings(system, KnownBodies({}), duration_of(case, system))]
    return Decided(case, system, tuple(advice), {})


def _decided(case: Case, thorough: bool, loaded: bool) -> Decided:
    case, built, views, joints = _joined(case)
    names = open_strains(case)
    linear = with_strains(case, dict.fromkeys(names, "linear"))
    system, known = _system(linear, built)
    duration = duration_of(case, system)
    check_periods(system, duration)
    strains: list[Advice] = []
    rigid: RigidEstimate | None = None
    why, near = "", dict[str, BucklingMargin]()
    if names or thorough:
        view = estimate_motion(system, duration)
        rigid, why = view.rigid, view.short
        near = buckling_margins(rigid, system, known)
    elif assessed_bodies(system, known):
        rigid, why = estimate_rigid_motion(system, duration)
    case, spun = _spun(case, system, rigid, known)
    changed = _again(case, [one.body for one in spun if one.body not in names and _bends(case, one.body)])
    if names or thorough:
        ask = [name for name in system.bodies if name in names or _is_linear(system, name)]
        wanted, snapping = strain_advice(system, ask, near, view, known, _fastest(case))
        chosen = {name: one for name, one in wanted.items() if name in names}
        strains = [strain_doubt(system, known, one) for name, one in wanted.items() if name not in names]
        strains = [one for one in strains if one.doubt]
        case, others, chosen_forms = _stretching(
            case, system, known, chosen, [name for name in snapping if name in names]
        )
        changed |= others
        strains = [*chosen_forms.values(), *strains]
    if changed:
        built |= changed
        system, known = _system(with_strains(case, _forms(system, names, strains)), built)
    if loaded and not names and not thorough:
        near = buckling_margins(rigid, system, known)
    advice = [*joints, *spun, *strains]
    advice += [Advice(name, "shapes", None, text) for name, one in built.items() for text in one.notes]
    advice += shape_notes(system.bodies, known)
    advice += unassessed_bodies(system, known, rigid, why if rigid is None else rigid.short)
    advice += unassessed_truncation(system, known, views[0].richer)
    advice += buckling_warnings(system, known, near)
    advice += _deployed(rigid, system, duration) if loaded else []
    advice += _truncated(case, system, views)
    advice += _large_displacements(case, system)
    advice += model_warnings(system, known, duration)
    case = with_strains(case, _forms(system, names, strains))
    return Decided(case, system, tuple(advice), {name: one.origin for name, one in built.items() if one.origin})


def _large_displacements(case: Case, system: System) -> list[Advice]:
    """Doubts on bodies with linear strain that start far from their undeformed shape."""
    out = []
    for name, table in case.bodies.items():
        if table.initial is None or table.initial.marker is None or name not in system.bodies:
            continue
        if not _is_linear(system, name):
            continue
        body = system.bodies[name]
        held_at = body.marker(system.joint_of(name).child_marker).position
        wanted, length = wanted_displacement(table.initial, body, held_at)
        size = float(np.linalg.norm(wanted))
        if size > FAR * length > 0.0:
            text = (
                f"initial displacement of marker {table.initial.marker!r} of body {name!r} is {size:.4g} m, "
                f"{size / length:.0%} of the length {length:.4g} m (limit {FAR:.0%}), and its strain is linear; give "
                "it strain = 'condensed', or displace it less"
            )
            out.append(doubt(name, "bend", text, size / length, FAR))
    return out


def _deployed(rigid: RigidEstimate | None, system: System, duration: float) -> list[Advice]:
    """Doubts on deploying members, from the rigid motion that is known or their own."""
    if rigid is None and slender_members(system):
        rigid, _ = estimate_rigid_motion(system, duration)
    return deployed_estimates(rigid, system)


def _system(case: Case, built: Mapping[str, BuiltBody]) -> tuple[System, KnownBodies]:
    """The system of these bodies, and of which of them it is known what they were reduced from."""
    origins = {name: one.origin for name, one in built.items() if one.origin is not None}
    return system_of(case, {name: one.part for name, one in built.items()}), KnownBodies(origins)


def _is_linear(system: System, name: str) -> bool:
    body = system.bodies[name]
    return bool(body.n_modes) and body.strain_form == "linear"


def _bends(case: Case, name: str) -> bool:
    """Whether a body says a strain that is not linear: static shapes of a spin are for such."""
    return getattr(case.bodies[name], "strain", None) not in (None, "linear")


def _forms(system: System, names: Iterable[str], strains: Iterable[Advice]) -> dict[str, Strain]:
    """The strain of each body that leaves it open."""
    forms: dict[str, Strain] = dict.fromkeys(names, "linear")
    return forms | {one.body: one.choice for one in strains if one.body in forms}


def _fastest(case: Case) -> Array | None:
    """The fastest steady spin (3,) of a case's diagram over speeds [rad/s]; None without one."""
    given = None if case.campbell is None else case.campbell.axis or case.attitude.spin
    if case.campbell is None or given is None:
        return None
    return np.array(given) / np.linalg.norm(given) * case.campbell.speeds[-1]


@dataclass(frozen=True, eq=False)
class _View:
    """A craft in richer sets, with the lengths that its members have at a time [s]."""

    t: float
    richer: RicherCraft


def _joined(case: Case) -> tuple[Case, Built, list[_View], list[Advice]]:
    """The case with the static shapes of joints written out, its bodies, its craft in richer sets, and the choices.

    Bodies that do not say their strain are linear. Members that deploy are assessed at their first and last lengths.
    """
    linear = with_strains(case, dict.fromkeys(open_strains(case), "linear"))
    built = _built_with_loads(linear)
    system, known = _system(linear.model_copy(update={"initial": None}), built)
    alike = {name: table_text(case.bodies[name]) for name in open_joints(case)}
    views = [_View(0.0, richer_craft(system, known))]
    end = duration_of(case, system)
    if (later := _system_at(linear, end)) is not None:
        views.append(_View(end, richer_craft(*later)))
    chosen = joint_advice([view.richer for view in views], known, alike, case.run.band or 0.0)
    case = with_joints(case, {name: one.choice for name, one in chosen.items()})
    built |= _again(case, [name for name, one in chosen.items() if one.choice], silent=True)
    return case, built, views, list(chosen.values())


def _system_at(case: Case, t: float) -> tuple[System, KnownBodies] | None:
    """The system, and what is known of it, with the lengths that its members have at a time [s].

    None where they have the first ones, or where it does not fit together, as of loops that follow the members.
    """
    held = held_at(case, t)
    if held is None:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # given of the members as they start
        try:
            return _system(held.model_copy(update={"initial": None}), built_bodies(held))
        except CaseError:
            return None


def _truncated(case: Case, system: System, views: Iterable[_View]) -> list[Advice]:
    """Doubts on the sets of a system's bodies, at the first and the last lengths of its members."""
    band, found = case.run.band or 0.0, list[Advice]()
    for view in views:
        if view.t:
            later = _system_at(case, view.t)
            found += [] if later is None else truncation_warnings(later[0], view.richer, band, view.t)
        else:
            found += truncation_warnings(system, view.richer, band)
    return sorted(found, key=lambda one: -(one.value or 0.0))[:1]


def _built_with_loads(case: Case) -> Built:
    """The bodies of a case. Raises CaseError with their problems and those of the loads together."""
    problems = problems_of_loads(case)
    try:
        built = built_bodies(case)
    except CaseError as error:
        raise CaseError(case.path.name, [*error.problems, *problems]) from None
    if problems:
        raise CaseError(case.path.name, problems)
    return built


def _again(case: Case, names: Iterable[str], silent: bool = False) -> Built:
    """These bodies of a case, built as its tables are now; silent: what was warned of before is not again."""
    asked = case.model_copy(update={"bodies": {name: case.bodies[name] for name in names}})
    if not asked.bodies:
        return {}
    with warnings.catch_warnings():
        if silent:
            warnings.simplefilter("ignore", PhysicsWarning)
        return built_bodies(with_strains(asked, dict.fromkeys(open_strains(asked), "linear")))


def _spun(case: Case, system: System, rigid: RigidEstimate | None, known: KnownBodies) -> tuple[Case, list[Advice]]:
    """The case with the shapes of spin of bodies that are spun up so far that they pay, and these choices."""
    found = [] if rigid is None else spin_advice(system, rigid, known)
    return with_spin(case, [one.body for one in found]), found


def _stretching(
    case: Case, system: System, known: KnownBodies, chosen: Mapping[str, Advice], snapping: Iterable[str]
) -> tuple[Case, Built, dict[str, Advice]]:
    """The case with responses written in, the bodies that are to be other than linear, and the strain of each.

    Those that cannot be the one form are the other; those that cannot be either stay linear.
    """
    built: Built = {}
    advised = dict(chosen)
    for name in snapping:
        table = case.bodies[name]
        assert isinstance(table, FlexibleTable) and isinstance(table.reduction, CantileverTable)
        answer = response_advice(known[name], system, name, table.reduction.loads, table.reduction.attachment)
        answering = with_responses_to(case, name, answer.choice)
        try:
            built |= _as(answering, {name: "nonlinear"})
        except CaseError as error:
            why = f"{advised[name].reason}; static responses to its loads are not possible ({_first(error)})"
            advised[name] = replace(advised[name], choice="condensed", reason=why)
            continue
        case = answering
        advised[name] = replace(advised[name], reason=f"{advised[name].reason}; {answer.reason}")
    others = {name: one for name, one in advised.items() if one.choice != "linear" and name not in built}
    for name in [name for name in others if name in known and known[name].origin.bound]:
        reason = f"{known[name].origin.bound}; {others.pop(name).reason}"
        advised[name] = replace(advised[name], choice="linear", reason=reason)
    try:
        return case, built | _as(case, {name: one.choice for name, one in others.items()}), advised
    except CaseError:
        for name, one in others.items():
            found, advised[name] = _alone(case, one)
            built |= found
        return case, built, advised


def _alone(case: Case, wanted: Advice) -> tuple[Built, Advice]:
    """A body in the form that is wanted, or else in the other, and the note on it."""
    refused: list[str] = []
    tried: list[Strain] = [wanted.choice, OTHER[wanted.choice]]
    for strain in tried:
        try:
            built = _as(case, {wanted.body: strain})
        except CaseError as error:
            refused.append(_first(error))
            continue
        text = f"; {wanted.choice} strain is not possible ({refused[0]})" if refused else ""
        return built, replace(wanted, choice=strain, reason=wanted.reason + text)
    text = f"; neither {' nor '.join(sorted(tried))} strain is possible ({refused[0]})"
    return {}, replace(wanted, choice="linear", reason=wanted.reason + text)


def _as(case: Case, strains: Mapping[str, Strain]) -> Built:
    if not strains:
        return {}
    made = with_strains(case, strains)
    return built_bodies(made.model_copy(update={"bodies": {name: made.bodies[name] for name in strains}}))


def _first(error: CaseError) -> str:
    """The first line of what an error says."""
    return error.problems[0].text.partition("\n")[0].rstrip(".")


def build_body(case: Case, name: str, modes: int | None = None) -> FlexibleBody:
    """The body of that name, in one piece, with the strain that it has in a run of the case.

    Raises CaseError with what is wrong with it.
    """
    return build_each(case, [name], modes)[name]


def build_each(case: Case, names: Iterable[str], modes: int | None = None) -> dict[str, FlexibleBody]:
    """The bodies of these names, as `advised_bodies`."""
    return advised_bodies(case, names, modes)[0]


def advised_bodies(
    case: Case, names: Iterable[str], modes: int | None = None
) -> tuple[dict[str, FlexibleBody], dict[str, str]]:
    """The bodies of these names, each in one piece, with the strain that they have in a run of the case; and notes.

    What a body says of its strain is taken; for what it does not say the whole system is built, and looked at. Where
    that cannot be built the body is linear, and its note says so. Raises CaseError with what is wrong with a body.
    """
    with shared_structures():
        names = list(names)
        silent = {*open_strains(case), *open_joints(case)} & set(names)
        silent_case, notes = _strain_notes(case, warning=True) if silent else (case, {})
        found = {}
        for name in names:
            built = built_body(silent_case, name, modes)
            if isinstance(built.part, Segments):
                text = (
                    f"found a body cut into {len(built.part.bodies)} segments, which has no one set of modes; leave "
                    "out segments, in a copy of the case, to see the whole"
                )
                raise CaseError(case.path.name, [Problem(f"bodies.{name}", text)])
            found[name] = built.part
            if name not in notes and (own := _own_notes(name, built)):
                notes[name] = own
        return found, {name: notes[name] for name in names if notes.get(name)}


def _own_notes(name: str, built: BuiltBody) -> str:
    """Note on a body alone."""
    if built.origin is None or not isinstance(built.part, FlexibleBody):
        return ""
    advice = [Advice(name, "shapes", None, text) for text in built.notes]
    more = shape_notes({name: built.part}, KnownBodies({name: built.origin}))
    return notes_of([*advice, *more]).get(name, "")


def with_own_strain(case: Case) -> Case:
    """The case with the strain written out that each body without a word of it gets in its system.

    Where that cannot be built all is left as it is: what it lacks is reported where it is needed.
    """
    return with_strain_notes(case)[0]


def with_strain_notes(case: Case) -> tuple[Case, dict[str, str]]:
    """The same, and why each of these bodies has that strain."""
    return _strain_notes(case) if open_strains(case) or open_joints(case) else (case, {})


def _strain_notes(case: Case, warning: bool = False) -> tuple[Case, dict[str, str]]:
    """The case with strains and static shapes written out, and the notes on its bodies.

    warning: warn of sets that are too small for the craft's frequencies.
    """
    names = open_strains(case)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # reported where the bodies are built
            found = decided(case, loaded=False)
    except CaseError as error:
        first = error.problems[0]
        note = f"strain is linear: its system cannot be built for a motion estimate ({first.where}: {first.text})"
        return case, dict.fromkeys(names, note)
    if warning:
        warn_of((one for one in found.advice if one.category is TruncationWarning), stacklevel=4)
    forms = {name: found.system.bodies[name].strain_form for name in names}
    notes = found.notes
    silent = {*names, *open_joints(case)}
    return with_strains(found.case, forms), {name: notes.get(name, "") for name in silent}
