"""Bodies with static shapes of their joints, selected by the modes of their craft in richer sets.

The modes of the craft in richer sets show which static shapes of the joints it needs (`advice.truncation`). For this
selection, bodies of elements that leave these shapes open are built for small motions about rest only (drafted), and
completely afterwards. Other bodies are built, and rebuilt if they get such shapes. Members that deploy are assessed at
their first and last lengths.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from femflex.advice.advice import Advice
from femflex.advice.bodies import BodyOrigins
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
    """A craft in richer sets, with its members at the lengths of a time [s]."""

    t: float
    richer: RicherCraft


@dataclass(frozen=True, eq=False)
class CraftWithShapes:
    """A case with the static shapes of joints filled in, its bodies, its craft in richer sets, and these choices.

    rigid: the estimated rigid-body motion of the craft; None where it is not estimated.
    """

    case: Case
    built: Built
    richer: list[AssessedCraft]
    choices: list[Advice]
    rigid: RigidEstimate | None


def with_joint_shapes(case: Case) -> CraftWithShapes:
    """The case with the static shapes of joints filled in.

    Bodies of open strain are linear. Members that deploy are assessed at their first and last lengths.
    """
    linear = with_strains(case, dict.fromkeys(open_strains(case), "linear"))
    drafts = _bodies_to_draft(linear)
    built = _built_with_loads(linear, drafts)
    system, origins = system_with_origins(linear.model_copy(update={"initial": None}), built)
    tables = {name: table_text(case.bodies[name]) for name in open_joints(case)}
    end = duration_of(case, system)
    richer, rigid = with_response(richer_craft(system, origins), system, end)
    crafts = [AssessedCraft(0.0, richer)]
    if (last_lengths := _system_at(linear, end)) is not None:
        crafts.append(AssessedCraft(end, richer_craft(*last_lengths)))
    chosen = joint_advice([craft.richer for craft in crafts], origins, tables, case.run.band or 0.0)
    case = with_joints(case, {name: advice.choice for name, advice in chosen.items()})
    built |= rebuild_bodies(case, drafts)
    changed = [name for name, advice in chosen.items() if advice.choice and name not in drafts]
    built |= rebuild_bodies(case, changed, silent=True)
    return CraftWithShapes(case, built, crafts, list(chosen.values()), rigid if case.initial is None else None)


def _bodies_to_draft(case: Case) -> list[str]:
    """Names of bodies of elements that leave the shapes of their joints open, without sensors of their strain."""
    measured = {sensor.body for sensor in case.sensors.values() if sensor.kind == "strain"}
    return [
        name
        for name in open_joints(case)
        if isinstance(table := case.bodies[name], FlexibleTable) and not table.recovery and name not in measured
    ]


def system_with_origins(case: Case, built: Mapping[str, BuiltBody]) -> tuple[System, BodyOrigins]:
    """The system of these bodies, and the origins of those whose origin is known."""
    origins = {name: body.origin for name, body in built.items() if body.origin is not None}
    return system_of(case, {name: body.part for name, body in built.items()}), BodyOrigins(origins)


def _system_at(case: Case, t: float) -> tuple[System, BodyOrigins] | None:
    """The system with its members at the lengths of a time [s], and the origins of its bodies.

    None where these are the first lengths, or where the system is inconsistent, such as by loops on the members.
    """
    fixed = with_lengths_at(case, t)
    if fixed is None:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # given of the members as they start
        try:
            return system_with_origins(
                fixed.model_copy(update={"initial": None}), built_bodies(fixed, _bodies_to_draft(fixed))
            )
        except CaseError:
            return None


def truncation_doubts(case: Case, system: System, crafts: Iterable[AssessedCraft]) -> list[Advice]:
    """The truncation warning of a system with the largest error, over the first and last lengths of its members."""
    band, advice = case.run.band or 0.0, list[Advice]()
    for craft in crafts:
        if craft.t:
            last_lengths = _system_at(case, craft.t)
            advice += [] if last_lengths is None else truncation_warnings(last_lengths[0], craft.richer, band, craft.t)
        else:
            advice += truncation_warnings(system, craft.richer, band)
    return sorted(advice, key=lambda entry: -(entry.value or 0.0))[:1]


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


def rebuild_bodies(case: Case, names: Iterable[str], silent: bool = False) -> Built:
    """These bodies of a case, built by its present tables; silent: without repeating warnings."""
    part = case.model_copy(update={"bodies": {name: case.bodies[name] for name in names}})
    if not part.bodies:
        return {}
    with warnings.catch_warnings():
        if silent:
            warnings.simplefilter("ignore", PhysicsWarning)
        return built_bodies(with_strains(part, dict.fromkeys(open_strains(part), "linear")))
