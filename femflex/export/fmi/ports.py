"""Numbers that another program gives to a craft as it moves: forces, torques, efforts and additions to signals.

Each is a state of an effector, whose rate is zero: it stays between two communication points, and is written there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.studies.linear.inputs import XYZ, Input, inputs_of
from femflex.system import Effector, System

PORTS = "fmi-input"  # name of the effector of forces, torques and efforts
CASE = "-case"  # after the name of a signal to which an input is added
FORCE, TORQUE, EFFORT = range(3)
COLUMNS = 6  # of the table of parameters: what it is, where, whether it is inertial, direction (3)


def with_ports(system: System, paths: Sequence[str]) -> tuple[System, list[Input], list[str]]:
    """The system with these inputs, the inputs one by one, and the names of the states that hold them.

    paths: as of a linear model, see `femflex.studies.linear.inputs`; they add to what the case has. Raises KeyError for
    unknown inputs and ValueError for accelerations, forces along orbital axes and commands of controllers.
    """
    inputs = inputs_of(system, paths)
    markers: list[tuple[str, str]] = []
    freedoms: list[str] = []
    states, rows, names = dict[str, str](), list[Array](), list[str]()
    for k, entry in enumerate(inputs):
        if entry.kind == "effector":
            system = _with_added_signal(system, entry)
            names.append(f"{entry.owner}.input")
            continue
        states[f"input{k + 1}"] = entry.unit
        names.append(f"{PORTS}.input{k + 1}")
        if entry.kind == "effort":
            freedoms.append(entry.owner)
            rows.append(np.array([EFFORT, len(freedoms) - 1, 0, 0, 0, 0], float))
        else:
            marker, inertial, direction = _direction(system, entry)
            markers.append(marker)
            kind = FORCE if entry.component.startswith("force") else TORQUE
            rows.append(np.array([kind, len(markers) - 1, inertial, *direction], float))
    if states:
        ports = Effector(
            PORTS, _ports, tuple(markers), tuple(freedoms), states, parameters=np.ravel(rows), accounts=("supplied",)
        )
        system = replace(system, effectors=(*system.effectors, ports))
    return system, inputs, names


def _ports(seen: Any, out: Any) -> None:
    """Force, torque or effort of every state; its table is read by number, as compiled code has no names."""
    for k in range(seen.z.size):
        row, value = 6 * k, seen.z[k]
        what, place = seen.parameters[row], int(seen.parameters[row + 1])
        if what > 1.5:
            out.effort[place] = value
            out.supplied[0] += value * seen.speed[place]
            continue
        for i in range(3):
            along = seen.parameters[row + 3 + i]
            if seen.parameters[row + 2] < 0.5:
                along = 0.0
                for j in range(3):
                    along += seen.attitude[place, i, j] * seen.parameters[row + 3 + j]
            if what < 0.5:
                out.force[place, i] = value * along
                out.supplied[0] += value * along * seen.velocity[place, i]
            else:
                out.torque[place, i] = value * along
                out.supplied[0] += value * along * seen.rate[place, i]


def _sum(seen: Any, out: Any) -> None:
    """Value and rate of a signal, with the input added to its value."""
    out.channel[0] = seen.input[0] + seen.z[0]
    out.channel[1] = seen.input[1]


def _direction(system: System, entry: Input) -> tuple[tuple[str, str], bool, Array]:
    """Marker at which a load acts, whether its direction is inertial, and the direction (3,) there."""
    axis = np.eye(3)[XYZ.index(entry.component[-1])]
    if entry.kind == "marker":
        body, _, marker = entry.owner.rpartition(".")
        return (body, marker), False, axis
    if entry.kind != "load":
        raise ValueError(
            f"input {entry.path!r} is an acceleration that is prescribed; an FMU of the whole craft takes forces, "
            "torques, efforts and signals. Take the effort of the joint, and leave its motion free"
        )
    load = next(load for load in system.loads if load.name == entry.owner)
    if load.frame == "orbital":
        raise ValueError(
            f"input {entry.path!r} is along orbital axes; take the marker's own: "
            f"markers/{load.body}.{load.marker}/{entry.component}"
        )
    if load.frame == "body":
        axis = system.bodies[load.body].marker(load.marker).orientation.T @ axis
    return (load.body, load.marker), load.frame == "inertial", axis


def _with_added_signal(system: System, entry: Input) -> System:
    """The system in which a signal is the sum of its own value and an input."""
    signal = next((effector for effector in system.effectors if effector.name == entry.owner), None)
    if not isinstance(signal, Effector) or signal.kind != "signal":
        raise ValueError(f"input {entry.path!r} is a command of a controller, which acts by itself; take a signal")
    own = replace(signal, name=f"{signal.name}{CASE}")
    total = Effector(
        signal.name, _sum, states={"input": entry.unit}, inputs=(f"{own.name}.value", f"{own.name}.rate"),
        channels=signal.channels,
    )  # fmt: skip
    effectors = [part for item in system.effectors for part in ((own, total) if item is signal else (item,))]
    return replace(system, effectors=tuple(effectors))
