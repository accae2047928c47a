"""Static shapes of the joints of bodies, selected by the modes of their craft in richer sets, and its truncation.

The modes of the craft in richer sets, and its response in them, show which static shapes of the joints it needs
(`advice.truncation`). Members that deploy are assessed at their first and last lengths.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from femflex.advice.advice import Advice
from femflex.advice.bodies import BodyOrigins
from femflex.advice.motion_estimate import RigidEstimate
from femflex.advice.truncation import RicherCraft, joint_advice, richer_craft, truncation_warnings, with_response
from femflex.assembly.bodies import BuiltBody, built_bodies
from femflex.assembly.deploying import with_lengths_at
from femflex.assembly.open_choices import open_joints, table_text
from femflex.case.case import Case
from femflex.noun.problems import CaseError
from femflex.pipeline.start import system_of
from femflex.system import System
from femflex.warning import PhysicsWarning

Built = dict[str, BuiltBody]


@dataclass(frozen=True, eq=False)
class AssessedCraft:
    """A craft in richer sets, with its members at the lengths of a time [s]."""

    t: float
    richer: RicherCraft


def assessed_crafts(
    case: Case, system: System, origins: BodyOrigins, end: float
) -> tuple[list[AssessedCraft], RigidEstimate | None]:
    """The craft of a case with linear strain in richer sets, at its first and last lengths, and its rigid-body motion
    up to a time [s]; None where it is not estimated."""
    richer, rigid = with_response(richer_craft(system, origins), system, end)
    crafts = [AssessedCraft(0.0, richer)]
    if (last_lengths := _system_at(case, end)) is not None:
        crafts.append(AssessedCraft(end, richer_craft(*last_lengths)))
    return crafts, rigid


def joint_choices(case: Case, crafts: Iterable[AssessedCraft], origins: BodyOrigins) -> dict[str, Advice]:
    """The static shapes of its joints for each body that leaves them open."""
    tables = {name: table_text(case.bodies[name]) for name in open_joints(case)}
    return joint_advice([craft.richer for craft in crafts], origins, tables, case.run.band or 0.0)


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
            return system_with_origins(fixed.model_copy(update={"initial": None}), built_bodies(fixed))
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
