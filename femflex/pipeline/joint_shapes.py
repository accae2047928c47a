"""Bodies with the static shapes that their joints ask for, chosen from their craft in richer sets.

The modes of the craft in richer sets show which static shapes of the joints it needs (`advice.truncation`). Bodies of
elements that leave these open are drafted for that, for small motions about rest, and built when it is known; others
are built, and built again if they get such shapes. Members that deploy are assessed at their first and last lengths.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from femflex.advice.advice import Advice
from femflex.advice.bodies import KnownBodies
from femflex.advice.motion_estimate import RigidEstimate
from femflex.advice.truncation import RicherCraft, joint_advice, richer_craft, truncation_warnings, with_response
from femflex.assembly.bodies import BuiltBody, built_bodies
from femflex.assembly.deploying import with_lengths_at
from femflex.assembly.open_choices import open_joints, open_strains, table_text, with_joints, with_strains
from femflex.assembly.system import problems_of_loads
from femflex.case.body import FlexibleTable
from femflex.case.case import Case
from femflex.case.problems import CaseError
from femflex.pipeline.references import duration_of
from femflex.pipeline.start import system_of
from femflex.system import System
from femflex.warning import PhysicsWarning

Built = dict[str, BuiltBody]


@dataclass(frozen=True, eq=False)
class AssessedCraft:
    """A craft in richer sets, with the lengths that its members have at a time [s]."""

    t: float
    richer: RicherCraft


@dataclass(frozen=True, eq=False)
class CraftWithShapes:
    """A case with the static shapes of joints written out, its bodies, its craft in richer sets, and these choices.

    rigid: the estimated motion of the craft's bodies as rigid ones; None where it is not estimated.
    """

    case: Case
    built: Built
    richer: list[AssessedCraft]
    choices: list[Advice]
    rigid: RigidEstimate | None


def with_joint_shapes(case: Case) -> CraftWithShapes:
    """The case with the static shapes of joints written out.

    Bodies that do not say their strain are linear. Members that deploy are assessed at their first and last lengths.
    """
    linear = with_strains(case, dict.fromkeys(open_strains(case), "linear"))
    drafts = _drafts(linear)
    built = _built_with_loads(linear, drafts)
    system, known = known_system(linear.model_copy(update={"initial": None}), built)
    alike = {name: table_text(case.bodies[name]) for name in open_joints(case)}
    end = duration_of(case, system)
    richer, rigid = with_response(richer_craft(system, known), system, end)
    views = [AssessedCraft(0.0, richer)]
    if (later := _system_at(linear, end)) is not None:
        views.append(AssessedCraft(end, richer_craft(*later)))
    chosen = joint_advice([view.richer for view in views], known, alike, case.run.band or 0.0)
    case = with_joints(case, {name: one.choice for name, one in chosen.items()})
    built |= built_again(case, drafts)
    changed = [name for name, one in chosen.items() if one.choice and name not in drafts]
    built |= built_again(case, changed, silent=True)
    return CraftWithShapes(case, built, views, list(chosen.values()), rigid if case.initial is None else None)


def _drafts(case: Case) -> list[str]:
    """Bodies of elements that leave the static shapes of their joints open; none whose strain the case measures."""
    measured = {sensor.body for sensor in case.sensors.values() if sensor.kind == "strain"}
    return [
        name
        for name in open_joints(case)
        if isinstance(table := case.bodies[name], FlexibleTable) and not table.recovery and name not in measured
    ]


def known_system(case: Case, built: Mapping[str, BuiltBody]) -> tuple[System, KnownBodies]:
    """The system of these bodies, and of which of them it is known what they were reduced from."""
    origins = {name: one.origin for name, one in built.items() if one.origin is not None}
    return system_of(case, {name: one.part for name, one in built.items()}), KnownBodies(origins)


def _system_at(case: Case, t: float) -> tuple[System, KnownBodies] | None:
    """The system, and what is known of it, with the lengths that its members have at a time [s].

    None where they have the first ones, or where it does not fit together, as of loops that follow the members.
    """
    held = with_lengths_at(case, t)
    if held is None:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # given of the members as they start
        try:
            return known_system(held.model_copy(update={"initial": None}), built_bodies(held, _drafts(held)))
        except CaseError:
            return None


def truncation_doubts(case: Case, system: System, views: Iterable[AssessedCraft]) -> list[Advice]:
    """Doubts on the sets of a system's bodies, at the first and the last lengths of its members."""
    band, found = case.run.band or 0.0, list[Advice]()
    for view in views:
        if view.t:
            later = _system_at(case, view.t)
            found += [] if later is None else truncation_warnings(later[0], view.richer, band, view.t)
        else:
            found += truncation_warnings(system, view.richer, band)
    return sorted(found, key=lambda one: -(one.value or 0.0))[:1]


def _built_with_loads(case: Case, drafts: Collection[str]) -> Built:
    """The bodies of a case, some drafted. Raises CaseError with their problems and those of the loads together."""
    problems = problems_of_loads(case)
    try:
        built = built_bodies(case, drafts)
    except CaseError as error:
        raise CaseError(case.path.name, [*error.problems, *problems]) from None
    if problems:
        raise CaseError(case.path.name, problems)
    return built


def built_again(case: Case, names: Iterable[str], silent: bool = False) -> Built:
    """These bodies of a case, built as its tables are now; silent: what was warned of before is not again."""
    asked = case.model_copy(update={"bodies": {name: case.bodies[name] for name in names}})
    if not asked.bodies:
        return {}
    with warnings.catch_warnings():
        if silent:
            warnings.simplefilter("ignore", PhysicsWarning)
        return built_bodies(with_strains(asked, dict.fromkeys(open_strains(asked), "linear")))
