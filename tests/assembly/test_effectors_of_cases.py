"""Effectors and controllers of a case, two of each, with every value of their tables, as the ones made from Python."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest
from support.effector_builders import (
    reaction_wheel,
)
from support.same_values import same_values

from femflex.assembly import build_bodies
from femflex.assembly.system import build_craft
from femflex.case import read_case

TABLES = """
[signals.level]
times = [1, 2, "3 s"]
values = [0.1, 0.4, 0.2]
kind = "smooth"

[signals.spin]
times = [0, 5]
values = ["3 rad/s", 7]
unit = "rad/s"
kind = "steps"

[sensors.turn]
kind = "attitude"
body = "hub"

[sensors.rate]
kind = "rate"
body = "hub"

[controllers.hold]
kind = "attitude"
error = "turn"
rate = "rate"
stiffness = [4, 5, 6]
damping = [7, 8, 9]
inertia = [[120, 1, 2], [1, 100, 3], [2, 3, 140]]
limit = 0.7
period = "0.2 s"

[controllers.smooth]
kind = "low_pass"
inputs = ["rate.y", "rate.x"]
outputs = ["b", "a"]
frequency = 3
order = 2
damping = 0.6
limit = [2, 3]
scaled = true

[controllers.share]
kind = "allocation"
inputs = ["hold"]
effect = [[1, 0, 0, 0.5], [0, 1, 0, 0.5], [0, 0, 1, 0.5]]
period = "0.3 s"

[controllers.pulse]
kind = "pulses"
inputs = ["level", "smooth.a"]
outputs = ["p", "q"]
full = [2, 5]
period = "0.5 s"
minimum_on = "20 ms"

[wheels.one]
body = "hub"
marker = "left"
axis = [1, 2, 2]
inertia = 0.2
inertia_in_body = "contained"
command = "level.value"
max_torque = 0.3
max_speed = "600 rad/s"
initial_speed = "20 rad/s"
viscous = 1e-4
coulomb = 2e-3
coulomb_speed = "0.05 rad/s"

[wheels.two]
body = "boom"
marker = "tip"
inertia = 0.01
inertia_in_body = "added"
mass = 0.4
transverse_inertia = 0.007
command = "spin.value"
commanded = "speed"
bandwidth = 4

[gyros.single]
body = "hub"
marker = "left"
momentum = 30
gimbal_axis = [0, 3, 4]
spin_axis = [1, 0, 0]
rates = ["0.1 rad/s"]
initial_angles = ["10 deg"]
gimbal_inertia = 0.3
max_rate = "1 rad/s"
max_torque = 9

[gyros.double]
body = "hub"
momentum = -20
gimbal_axis = [0, 0, 1]
spin_axis = [1, 0, 0]
inner_axis = [0, 1, 0]
angles = ["5 deg", "level.value"]
gain = 0.4
bandwidth = 3

[thrusters.jet]
body = "hub"
marker = "left"
thrust = 2
axis = [0, 1, 0]
misalignment = ["1 deg", 0, "2 deg"]
train = { start = 1, period = 2, width = 0.5, count = 3 }
lag = 0.02
minimum_on = 0.1
specific_impulse = 220
tank = "fuel"

[thrusters.push]
body = "hub"
thrust = 5
profile = { times = [0, 2, 6], levels = [0.2, 1, 0] }
specific_impulse = 300
tank = "fuel"

[thrusters.kick]
body = "boom"
marker = "tip"
thrust = 0.1
command = "pulse.q"
switched = true

[tanks.fuel]
body = "hub"
marker = "left"
propellant = 8
mass_in_body = "added"
gyration = 0.2

[separations.spring]
parent = "hub"
parent_marker = "left"
body = "boom"
marker = "tip"
stiffness = 40
length = 5

[cables.line]
parent = "boom"
parent_marker = "tip"
body = "hub"
marker = "left"
length = 2.5
EA = 1e5
damping = 12
"""


def expected() -> dict[str, Any]:
    made = (
        reaction_wheel(
            "one", "hub", 0.2, marker="left", axis=[1, 2, 2], torque="level.value", max_torque=0.3, max_speed=600,
            initial_speed=20, viscous=1e-4, coulomb=2e-3, coulomb_speed=0.05,
        ),
    )  # fmt: skip
    return {one.name: one for one in made}


def test_effectors_of_case_equal_those_from_python(craft, write_case):
    case = read_case(write_case(craft + TABLES))
    bodies = build_bodies(case)
    found = build_craft(case, bodies)
    made = {one.name: one for one in found.effectors}
    wanted = expected()
    assert set(wanted) <= set(made)
    for name, one in wanted.items():
        assert type(made[name]) is type(one)
        for field in fields(one):
            if field.name in ("coasting", "silent"):  # functions of the noun
                continue
            assert same_values(getattr(made[name], field.name), getattr(one, field.name)), (name, field.name)
    hub, boom = found.parts["hub"].moments, found.parts["boom"].moments
    assert hub.mass == pytest.approx(200 + 8) and boom.mass == pytest.approx(bodies["boom"].moments.mass + 0.4)
    assert set(found.varying) == {"hub"}
