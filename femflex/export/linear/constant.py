"""Whether a linear model stands for its craft at all times."""

from __future__ import annotations

from femflex.effectors.constant_commands import stands_for_controller
from femflex.studies.linear import LinearModel
from femflex.system import Effector


def check_constant(model: LinearModel) -> None:
    """Raise ValueError for a craft whose equations change over time, or whose commands the model does not take."""
    system = model.model.system
    remedy = "export the craft itself for co-simulation (femflex export CASE -o NAME.fmu)"
    for name, variation in system.varying.items():
        if not variation.states:
            raise ValueError(f"body {name!r} changes over time, and a linear model in C does not; {remedy}")
    for joint in system.joints:
        if joint.latches:
            raise ValueError(
                f"joint {joint.label!r} latches, which is an event; a linear model in C has none; {remedy}"
            )
    names = {name for name, _ in model.inputs}
    for effector in system.effectors:
        if isinstance(effector, Effector) and stands_for_controller(effector):
            commands = [f"effectors/{effector.name}/{channel}" for channel in effector.channels]
            if missing := [command for command in commands if command not in names]:
                raise ValueError(
                    f"controller {effector.name!r} is sampled, so that it is not part of a linear model; "
                    f"take its commands as inputs too ({', '.join(missing)}), or {remedy}"
                )
