"""Estimates before a run of where deploying members go slack or come near buckling.

The axial force along a member follows from the acceleration of its mass, what is attached to it and its loads. The
preliminary rigid-body simulation knows these, so the watches of a run look at its rows first.
"""

from __future__ import annotations

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.deployed import SLACK, SlackWatch
from femflex.advice.deployed_bending import AxialForceWatch
from femflex.advice.limits import NEAR
from femflex.advice.motion_estimate import RigidEstimate
from femflex.dynamics import compile_system
from femflex.system import LengthTable, System

SOURCE = "by the preliminary rigid-body simulation"


def slender_members(system: System) -> list[str]:
    """Names of the deploying members whose axial force is estimated: tethers, membranes, beams of condensed strain."""
    return [
        name
        for name, variation in system.varying.items()
        if isinstance(variation.write, LengthTable)
        and variation.write.sections is not None
        and (variation.write.sections.slackens or system.bodies[name].condensed)
    ]


def deployed_estimates(rigid: RigidEstimate | None, system: System) -> list[Advice]:
    """Doubts on members that go slack, or are compressed by over 1 / NEAR of their buckling load."""
    names = slender_members(system)
    if rigid is None or not names:
        return []
    model = compile_system(rigid.system)
    rows = np.unique(np.linspace(0, len(rigid.times) - 1, min(len(rigid.times), 400)).round().astype(int))
    times = rigid.times[rows]
    seen = model.observe(times, rigid.states[rows])
    slack, axial = SlackWatch(model), AxialForceWatch(model)
    slack.watch(times, seen)
    axial.watch(times, seen)
    out = []
    for name, lowest in slack.lowest.items():
        if lowest.value < -SLACK * lowest.largest:
            out.append(
                doubt(
                    name,
                    "slack",
                    f"body {name!r} goes slack {SOURCE}: its tension falls to {lowest.value:.4g} N at t = "
                    f"{lowest.time:.6g} s, {lowest.place * lowest.length:.4g} m from the exit (length "
                    f"{lowest.length:.4g} m, largest tension {lowest.largest:.4g} N). A run carries this compression. "
                    "Deploy more slowly, brake earlier, add tension, or state a cable (`cables`), which can go slack",
                    lowest.value,
                    0.0,
                )
            )
    for name, pressed in axial.pressed.items():
        if system.bodies[name].condensed and -pressed.gain > 1.0 / NEAR:
            out.append(
                doubt(
                    name,
                    "buckling",
                    f"body {name!r} is compressed {SOURCE}: {-pressed.force:.4g} N along its axis at t = "
                    f"{pressed.time:.6g} s (length {pressed.length:.4g} m), {-pressed.gain:.0%} of its buckling load "
                    f"as a cantilever of this length (limit {1 / NEAR:.0%}). Lower the load, deploy more slowly, or "
                    "give it more bending stiffness",
                    -pressed.gain,
                    1.0 / NEAR,
                )
            )
    return out
