"""Systems and bodies of cases, with the strain forms and additional shapes that their tables leave open.

One pass: bodies as their tables say, with linear strain where that is open; their system; its motion with all bodies
rigid, and the elastic response to it in richer sets; from these the static shapes of joints and the strain of each
body. The bodies that get either are built once more, from the same structures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from femflex.advice.advice import Advice, doubt, notes_of, warn_of
from femflex.advice.advise import strain_doubt
from femflex.advice.bodies import BodyOrigins
from femflex.advice.buckling.margin import (
    BucklingMargin,
    assessed_bodies,
    buckling_margins,
    buckling_warnings,
    unassessed_bodies,
)
from femflex.advice.curved import shape_notes
from femflex.advice.model_warnings import model_warnings
from femflex.advice.motion_estimate import estimate_motion, estimate_rigid_motion
from femflex.advice.strain import strain_advice
from femflex.advice.truncation import unassessed_truncation
from femflex.arrays import Array
from femflex.assembly.bodies import built_bodies
from femflex.assembly.initial import requested_displacement
from femflex.assembly.open_choices import open_joints, open_strains, with_joints, with_strains
from femflex.assembly.shared import shared_structures
from femflex.assembly.system import problems_of_loads
from femflex.case.case import Case
from femflex.noun.problems import CaseError, Problem
from femflex.pipeline.chosen_strains import bodies_with_strain, rebuilt_bodies
from femflex.pipeline.joint_shapes import (
    Built,
    assessed_crafts,
    joint_choices,
    system_with_origins,
    truncation_doubts,
)
from femflex.pipeline.periods import check_periods
from femflex.pipeline.references import duration_of
from femflex.pipeline.start import system_of
from femflex.reduction.origin import Origin
from femflex.system import Part, System

LARGE_DISPLACEMENT = 0.1  # displacement over length above which linear strain is doubtful


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

    Own bodies whose strain is open get the form that the motion of the system requires. Issues the physics warnings
    about them (PhysicsWarning). Raises CaseError with all errors of the case.
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

    Physics warnings are in its advice and not issued. A run checks the stiffening that linear strain omits itself;
    thorough: it is estimated here too. loaded: bodies of requested strain are assessed for buckling as well, which
    costs a Lanczos run for each.

    Raises CaseError with all errors of the case.
    """
    with shared_structures():
        return _with_given_bodies(case, bodies) if bodies is not None else _resolve_open_choices(case, thorough, loaded)


def with_own_joints(case: Case) -> Case:
    """The case with the static shapes of joints filled in that its bodies get in its system.

    Raises CaseError where the system cannot be built.
    """
    if not open_joints(case):
        return case
    with shared_structures():
        linear = _with_linear_strain(case)
        _, system, origins, end = _first_system(linear)
        return with_joints(
            case, _choices(joint_choices(case, assessed_crafts(linear, system, origins, end)[0], origins))
        )


def _with_given_bodies(case: Case, bodies: Mapping[str, Part]) -> ResolvedCase:
    system = system_of(case, bodies)
    check_periods(system, duration_of(case, system))
    advice = [*_large_displacements(case, system), *model_warnings(system, BodyOrigins({}), duration_of(case, system))]
    return ResolvedCase(case, system, tuple(advice), {})


def _resolve_open_choices(case: Case, thorough: bool, loaded: bool) -> ResolvedCase:
    linear, names = _with_linear_strain(case), open_strains(case)
    built, system, origins, duration = _first_system(linear)
    check_periods(system, duration)
    crafts, rigid = assessed_crafts(linear, system, origins, duration)
    joints = joint_choices(case, crafts, origins)
    shortfall, margins, strains, changed = "", dict[str, BucklingMargin](), list[Advice](), Built()
    if case.initial is not None:  # it may need the static shapes, and the motion begins there
        linear, rigid = with_joints(linear, _choices(joints)), None
        built |= rebuilt_bodies(linear, [name for name, advice in joints.items() if advice.choice], silent=True)
        system, origins = system_with_origins(linear, built)
    if names or thorough:
        estimate = estimate_motion(system, duration, rigid)
        rigid, shortfall = estimate.rigid, estimate.shortfall
        margins = buckling_margins(rigid, system, origins)
        assessed = [name for name in system.bodies if name in names or _is_linear(system, name)]
        advised = strain_advice(system, assessed, margins, estimate, origins, _largest_spin(case))
        doubts = [strain_doubt(system, origins, advice) for name, advice in advised.items() if name not in names]
        strains = [doubt for doubt in doubts if doubt.doubt]
    elif rigid is None and assessed_bodies(system, origins):
        rigid, shortfall = estimate_rigid_motion(system, duration)
    case = with_joints(case, _choices(joints))
    if names:
        chosen = {name: advice for name, advice in advised.items() if name in names}
        changed, chosen_forms = bodies_with_strain(case, origins, chosen)
        built |= changed
        case = with_strains(
            case, {name: chosen_forms[name].choice if name in chosen_forms else "linear" for name in names}
        )
        strains = [*chosen_forms.values(), *strains]
    joined = [name for name, advice in joints.items() if advice.choice and name not in changed]
    built |= rebuilt_bodies(case, joined, silent=True)
    if joined or changed:
        system, origins = system_with_origins(case, built)
    if loaded and not names and not thorough:
        margins = buckling_margins(rigid, system, origins)
    advice = [*joints.values(), *strains]
    advice += [Advice(name, subject, None, text) for name, body in built.items() for subject, text in body.notes]
    advice += shape_notes(system.bodies, origins)
    advice += unassessed_bodies(system, origins, rigid, shortfall if rigid is None else rigid.shortfall)
    advice += unassessed_truncation(system, origins, crafts[0].richer)
    advice += buckling_warnings(system, origins, margins)
    advice += truncation_doubts(case, system, crafts)
    advice += _large_displacements(case, system)
    advice += model_warnings(system, origins, duration)
    known = {name: body.origin for name, body in built.items() if body.origin}
    return ResolvedCase(case, system, tuple(advice), known)


def _with_linear_strain(case: Case) -> Case:
    return with_strains(case, dict.fromkeys(open_strains(case), "linear"))


def _first_system(case: Case) -> tuple[Built, System, BodyOrigins, float]:
    """The bodies of a case as their tables say, their system as it starts, their origins, and the duration [s].

    Raises CaseError with the problems of the bodies and of the loads together.
    """
    problems = problems_of_loads(case)
    try:
        built = built_bodies(case)
    except CaseError as error:
        raise CaseError(case.path.name, [*error.problems, *problems]) from None
    if problems:
        raise CaseError(case.path.name, problems)
    system, origins = system_with_origins(case.model_copy(update={"initial": None}), built)
    return built, system, origins, duration_of(case, system)


def _choices(advice: Mapping[str, Advice]) -> dict[str, Any]:
    return {name: entry.choice for name, entry in advice.items()}


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
