"""Systems and bodies of cases, with the strain forms and static shapes that their tables leave open.

There is one pass. The tables give bodies with linear strain and all static shapes of their joints, and these give a
first system. Its motion is estimated with all bodies rigid, and then with their small elastic response. From this
follow the static shapes and the strain of each body. The bodies are built once more with these choices and give the
system of the run. Only a case with [initial], which starts from another state, is estimated a second time.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from femflex.advice.advice import Advice, doubt, notes_of, warn_of
from femflex.advice.advise import strain_doubt
from femflex.advice.bodies import BodyOrigins
from femflex.advice.buckling import (
    BucklingMargin,
    assessed_bodies,
    buckling_margins,
    buckling_warnings,
    unassessed_bodies,
)
from femflex.advice.curved import shape_notes
from femflex.advice.elastic_motion import ElasticResponse
from femflex.advice.limits import LARGE_DISPLACEMENT, MOST_CALLS
from femflex.advice.model_warnings import model_warnings
from femflex.advice.motion_estimate import MotionEstimate, RigidEstimate, estimate_motion, estimate_rigid_motion
from femflex.advice.strain import strain_advice
from femflex.advice.truncation import (
    CraftModes,
    are_assessable,
    craft_modes,
    joint_advice,
    truncation_warnings,
    unassessed_truncation,
)
from femflex.arrays import Array
from femflex.assembly.bodies import BuiltBody, built_bodies, built_body
from femflex.assembly.deploying import with_lengths_at
from femflex.assembly.initial import requested_displacement
from femflex.assembly.open_choices import (
    open_joints,
    open_strains,
    static_shapes,
    with_all_static_shapes,
    with_deflections,
    with_joints,
    with_strains,
)
from femflex.assembly.shared import shared_structures
from femflex.assembly.system import problems_of_loads
from femflex.case.body import Strain
from femflex.case.case import Case
from femflex.noun.problems import CaseError, Problem
from femflex.pipeline.references import duration_of
from femflex.pipeline.start import system_of
from femflex.reduction.origin import Origin
from femflex.system import Part, System
from femflex.warning import PhysicsWarning

Built = dict[str, BuiltBody]
OTHER: dict[Strain, Strain] = {"condensed": "nonlinear", "nonlinear": "condensed"}  # tried where one cannot be built


@dataclass(frozen=True, eq=False)
class ResolvedCase:
    """A case in which every automatic choice is filled in, its system, and the advice for these choices.

    origins: origins of its bodies by name.
    """

    case: Case
    system: System
    advice: tuple[Advice, ...]
    origins: Mapping[str, Origin]

    @property
    def body_origins(self) -> BodyOrigins:
        """The origins of its bodies, with the properties that follow from them."""
        return BodyOrigins(self.origins)

    @property
    def notes(self) -> dict[str, str]:
        """Notes on each body, without its warnings."""
        return notes_of(self.advice)


def build_system(case: Case, bodies: Mapping[str, Part] | None = None) -> System:
    """The System that a case describes, with these bodies or with its own.

    Bodies of the case whose strain is open get the form that the motion of the system requires. Issues the physics
    warnings about the bodies (PhysicsWarning). Raises CaseError with all errors of the case.
    """
    resolved = resolve_choices(case, bodies)
    warn_of(resolved.advice, stacklevel=3)
    return resolved.system


def refuse_rotation_without_inertia(resolved: ResolvedCase) -> None:
    """Raise CaseError where joints turn a body without inertia, with its name, its coordinates and the remedy."""
    if problems := [Problem("", advice.reason) for advice in resolved.advice if advice.decision == "inertia"]:
        raise CaseError(resolved.case.path.name, problems)


def resolve_choices(
    case: Case, bodies: Mapping[str, Part] | None = None, *, thorough: bool = False, loaded: bool = True
) -> ResolvedCase:
    """A copy of the case in which every automatic choice is filled in, with its system of these bodies or of its own.

    Physics warnings are in its advice and not issued. thorough: the stiffening that linear strain omits is estimated
    even if no body leaves its strain open; a run checks it in any case. loaded: bodies of requested strain are assessed
    for buckling as well, which costs a Lanczos iteration for each. Raises CaseError with all errors of the case.
    """
    with shared_structures():
        return _with_given_bodies(case, bodies) if bodies is not None else _resolve_open_choices(case, thorough, loaded)


def with_own_joints(case: Case) -> Case:
    """The case with the static shapes of joints that its bodies get in its system.

    Raises CaseError where the system cannot be built.
    """
    if not open_joints(case):
        return case
    with shared_structures():
        first = _first_craft(case)
        return with_joints(case, {name: entry.choice for name, entry in joint_choices(case, first.crafts).items()})


def _with_given_bodies(case: Case, bodies: Mapping[str, Part]) -> ResolvedCase:
    system = system_of(case, bodies)
    check_periods(system, duration_of(case, system))
    advice = [*_large_displacements(case, system), *model_warnings(system, BodyOrigins({}), duration_of(case, system))]
    return ResolvedCase(case, system, tuple(advice), {})


@dataclass(frozen=True, eq=False)
class FirstCraft:
    """A craft with linear strain where the case leaves it open, and with all static shapes of joints.

    duration: of the run [s]; estimate: motion in the run, None where no choice depends on it
    crafts: modes of the craft with its deploying members at their first and last lengths
    """

    system: System
    origins: BodyOrigins
    duration: float
    estimate: MotionEstimate | None
    crafts: list[CraftModes]


def _first_craft(case: Case, thorough: bool = False) -> FirstCraft:
    """The first craft of a case, with its motion where the strain or a set of shapes depends on it, or if `thorough`.

    Raises CaseError with the problems of the bodies and of the loads together.
    """
    draft = with_all_static_shapes(_with_linear_strain(case)).model_copy(update={"initial": None})
    problems = problems_of_loads(draft)
    try:
        built = _built_quietly(draft)
    except CaseError as error:
        raise CaseError(case.path.name, [*error.problems, *problems]) from None
    if problems:
        raise CaseError(case.path.name, problems)
    system, origins = system_with_origins(draft, built)
    system = with_deflections(case, system)
    duration = duration_of(case, system)
    check_periods(system, duration)
    estimate = None
    if thorough or open_strains(case) or are_assessable(system, origins):
        estimate = estimate_motion(system, duration)
    response = None if estimate is None else estimate.response
    crafts = crafts_at_lengths(draft, system, origins, duration, response)
    return FirstCraft(system, origins, duration, estimate, crafts)


def _resolve_open_choices(case: Case, thorough: bool, loaded: bool) -> ResolvedCase:
    first, names = _first_craft(case, thorough), open_strains(case)
    joints = joint_choices(case, first.crafts)
    resolved = with_joints(case, {name: entry.choice for name, entry in joints.items()})
    estimate, origins = _estimate_from_start(resolved, first) if names or thorough else (first.estimate, first.origins)
    judged = estimate if names or thorough else None
    margins = {} if judged is None else buckling_margins(judged.rigid, judged.model.system, origins)
    advised = {} if judged is None else _advised_strains(case, judged, origins, margins)
    chosen = forms_that_exist(resolved, origins, {name: advised[name] for name in names if name in advised})
    forms: dict[str, Strain] = {name: chosen[name].choice if name in chosen else "linear" for name in names}
    resolved = with_strains(resolved, forms)
    built = built_bodies(resolved)
    system, origins = system_with_origins(resolved, built)
    rigid, shortfall = _rigid_estimate(estimate, system, origins, first.duration)
    if loaded and judged is None:
        margins = buckling_margins(rigid, system, origins)
    others = [name for name in advised if name not in names and _is_linear(system, name)]
    doubts = [strain_doubt(system, origins, advised[name]) for name in others]
    advice = [*joints.values(), *chosen.values(), *(entry for entry in doubts if entry.doubt)]
    advice += [Advice(name, subject, None, text) for name, body in built.items() for subject, text in body.notes]
    advice += shape_notes(system.bodies, origins)
    advice += unassessed_bodies(system, origins, rigid, shortfall)
    advice += unassessed_truncation(first.crafts[0])
    advice += buckling_warnings(system, origins, margins)
    advice += truncation_warnings(first.crafts, case.run.band or 0.0)
    advice += _large_displacements(resolved, system)
    advice += model_warnings(system, origins, first.duration)
    known = {name: body.origin for name, body in built.items() if body.origin}
    return ResolvedCase(resolved, system, tuple(advice), known)


def _estimate_from_start(case: Case, first: FirstCraft) -> tuple[MotionEstimate | None, BodyOrigins]:
    """The estimated motion of a craft from the state of its [initial], and the origins of its bodies."""
    if case.initial is None:
        return first.estimate, first.origins
    linear = _with_linear_strain(case)
    system, origins = system_with_origins(linear, _built_quietly(linear))
    return estimate_motion(system, first.duration), origins


def _advised_strains(
    case: Case, estimate: MotionEstimate, origins: BodyOrigins, margins: Mapping[str, BucklingMargin]
) -> dict[str, Advice]:
    """The advised strain of each elastic body that has linear strain in the estimated motion."""
    system = estimate.model.system
    linear = [name for name in system.bodies if _is_linear(system, name)]
    return strain_advice(system, linear, margins, estimate, origins, _largest_spin(case))


def _rigid_estimate(
    estimate: MotionEstimate | None, system: System, origins: BodyOrigins, duration: float
) -> tuple[RigidEstimate | None, str]:
    """The motion with all bodies rigid, None where it fails or no body needs it; and text on what it does not cover."""
    if estimate is not None:
        rigid, shortfall = estimate.rigid, estimate.shortfall
    elif assessed_bodies(system, origins):
        rigid, shortfall = estimate_rigid_motion(system, duration)
    else:
        return None, ""
    return rigid, shortfall if rigid is None else rigid.shortfall


def _with_linear_strain(case: Case) -> Case:
    return with_strains(case, dict.fromkeys(open_strains(case), "linear"))


def _built_quietly(case: Case) -> Built:
    """The bodies of a case; warnings are suppressed, and issued where the bodies get their strain."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        return built_bodies(case)


def _large_displacements(case: Case, system: System) -> list[Advice]:
    """Physics warnings about bodies with linear strain and large initial deflections."""
    advice = []
    for name, table in case.bodies.items():
        if table.initial is None or table.initial.marker is None or name not in system.bodies:
            continue
        if not _is_linear(system, name):
            continue
        body = system.bodies[name]
        joint_position = body.marker(system.joint_of(name).child_marker).position
        displacement, length = requested_displacement(table.initial, body, joint_position)
        size = float(np.linalg.norm(displacement))
        if size > LARGE_DISPLACEMENT * length > 0.0:
            text = (
                f"initial displacement of marker {table.initial.marker!r} of body {name!r} is {size:.4g} m, "
                f"{size / length:.0%} of the length {length:.4g} m (limit {LARGE_DISPLACEMENT:.0%}), and its strain "
                "is linear; give it strain = 'condensed', or displace it less"
            )
            advice.append(doubt(name, "bend", text, size / length, LARGE_DISPLACEMENT))
    return advice


def _is_linear(system: System, name: str) -> bool:
    body = system.bodies[name]
    return bool(body.n_modes) and body.strain_form == "linear"


def _largest_spin(case: Case) -> Array | None:
    """The largest steady spin (3,) [rad/s] of the case's Campbell diagram; None without one."""
    axis = None if case.campbell is None else case.campbell.axis or case.attitude.spin
    if case.campbell is None or axis is None:
        return None
    return np.array(axis) / np.linalg.norm(axis) * case.campbell.speeds[-1]


def crafts_at_lengths(
    case: Case, system: System, origins: BodyOrigins, end: float, response: ElasticResponse | None
) -> list[CraftModes]:
    """The modes of a craft with its members at their first lengths, and with the lengths at the time `end` [s].

    The latter are left out where no length changes, or where the system is then inconsistent, such as by loops on the
    members. response: elastic response in the run, for the modes at the first lengths.
    """
    crafts, fixed = [craft_modes(system, origins, response)], with_lengths_at(case, end)
    if fixed is None:
        return crafts
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # issued for the members at their first lengths
        try:
            last_lengths = system_with_origins(fixed.model_copy(update={"initial": None}), built_bodies(fixed))
        except CaseError:
            return crafts
    return [*crafts, craft_modes(*last_lengths, t=end)]


def joint_choices(case: Case, crafts: list[CraftModes]) -> dict[str, Advice]:
    """The static shapes of joints for each body whose case does not name them; crafts: with all such shapes."""
    places = {name: static_shapes(case, name) for name in open_joints(case)}
    return joint_advice(crafts, crafts[0].origins, places, case.run.band or 0.0)


def system_with_origins(case: Case, built: Mapping[str, BuiltBody]) -> tuple[System, BodyOrigins]:
    """The system of these bodies, and the origins of those whose origin is known."""
    origins = {name: body.origin for name, body in built.items() if body.origin is not None}
    return system_of(case, {name: body.part for name, body in built.items()}), BodyOrigins(origins)


def forms_that_exist(case: Case, origins: BodyOrigins, advised: Mapping[str, Advice]) -> dict[str, Advice]:
    """The advised strain of each body, or the other form where it cannot be built; linear if neither can be."""
    return {name: _form_that_exists(case, origins, advice) for name, advice in advised.items()}


def _form_that_exists(case: Case, origins: BodyOrigins, advice: Advice) -> Advice:
    if advice.choice == "linear":
        return advice
    if advice.body in origins and (bound := origins[advice.body].origin.bound):
        return replace(advice, choice="linear", reason=f"{bound}; {advice.reason}")
    forms: tuple[Strain, Strain] = advice.choice, OTHER[advice.choice]
    errors: list[str] = []
    for strain in forms:
        if not (error := _error_of(with_strains(case, {advice.body: strain}), advice.body)):
            text = f"; {advice.choice} strain is not possible ({errors[0]})" if errors else ""
            return replace(advice, choice=strain, reason=advice.reason + text)
        errors.append(error)
    text = f"; neither {' nor '.join(sorted(forms))} strain is possible ({errors[0]})"
    return replace(advice, choice="linear", reason=advice.reason + text)


def _error_of(case: Case, name: str) -> str:
    """The first line of the first problem of a body; empty where it can be built."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # issued where the body is built for the run
            built_body(case, name)
    except CaseError as error:
        return error.problems[0].text.partition("\n")[0].rstrip(".")
    return ""


def check_periods(system: System, duration: float) -> None:
    """Raise ValueError for a controller that a run of that duration [s] would call too often."""
    for controller in system.controllers:
        calls = duration / controller.period
        if calls > MOST_CALLS:
            raise ValueError(
                f"controller {controller.name!r} has a period of {controller.period:g} s, so a run of {duration:g} s "
                f"would call it {calls:.3g} times; the most is {MOST_CALLS:g}. Lengthen the period, shorten the run, "
                "or run the controller continuously"
            )
