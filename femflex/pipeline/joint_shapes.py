"""The modes of a craft with all static shapes of its joints, by which these are selected and its sets are judged."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

from femflex.advice.advice import Advice
from femflex.advice.bodies import BodyOrigins
from femflex.advice.truncation import CraftModes, craft_modes, joint_advice
from femflex.assembly.bodies import BuiltBody, built_bodies
from femflex.assembly.deploying import with_lengths_at
from femflex.assembly.open_choices import open_joints
from femflex.assembly.static_shapes import static_shapes
from femflex.case.case import Case
from femflex.dynamics.linear.elastic_motion import ElasticResponse
from femflex.noun.problems import CaseError
from femflex.pipeline.start import system_of
from femflex.system import System
from femflex.warning import PhysicsWarning

Built = dict[str, BuiltBody]


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
