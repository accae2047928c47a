"""Bodies that carry several wheels of a case: each leaves its mass and inertia in the body, or takes them out of it."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from pydantic import TypeAdapter

from femflex.assembly.craft import build_wheel
from femflex.case import read_case
from femflex.case.wheel import WheelTable
from femflex.pipeline.decisions import build_system
from femflex.system import Effector
from femflex.system.wheel import reaction_wheel

WHEELS = """
[wheels.one]
body = "hub"
marker = "left"
axis = [1, 0, 0]
inertia = 0.2
inertia_in_body = "added"
mass = 3.0
transverse_inertia = 0.15

[wheels.two]
body = "hub"
axis = [0, 3, 4]
inertia = 0.5
inertia_in_body = "contained"

[wheels.three]
body = "hub"
axis = [0, 0, 1]
inertia = 0.1
inertia_in_body = "added"
mass = 5.0
transverse_inertia = 0.07
"""


def test_a_body_with_several_wheels_has_the_moments_of_all_of_them(craft, write_case):
    """About the hub's origin; the first wheel is at (0.5, 0, 0), the others at the origin."""
    body = build_system(read_case(write_case(craft + WHEELS))).bodies["hub"]
    assert body.moments.mass == pytest.approx(200.0 + 3.0 + 5.0)
    assert body.moments.first[0] == pytest.approx([3.0 * 0.5, 0.0, 0.0])
    a = np.array([0.0, 0.6, 0.8])
    expected = np.diag([120.0, 100.0, 140.0]) + 3.0 * 0.25 * np.diag([0.0, 1.0, 1.0])
    expected += 0.15 * np.diag([0.0, 1.0, 1.0]) - 0.5 * np.outer(a, a) + 0.07 * np.diag([1.0, 1.0, 0.0])
    assert body.moments.inertia() == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ({"speed": 3.0}, {"speed": 3.0}),
        (
            {"torque": 0.5, "max_torque": 0.8, "initial_speed": 2.0},
            {"torque": 0.5, "max_torque": 0.8, "initial_speed": 2.0},
        ),
        (
            {"viscous": 0.02, "coulomb": 0.03, "coulomb_speed": 0.4},
            {"torque": 0.0, "viscous": 0.02, "coulomb": 0.03, "coulomb_speed": 0.4},
        ),
    ],
)
def test_the_wheel_of_a_table_is_the_reaction_wheel_of_its_numbers(said, meant):
    own = {"body": "hub", "marker": "m", "axis": [0, 1, 0], "inertia": 0.3, "inertia_in_body": "contained"}
    one = build_wheel("w", TypeAdapter(WheelTable).validate_python(own | said))
    other = reaction_wheel("w", "hub", 0.3, marker="m", axis=[0, 1, 0], **meant)
    for part in fields(Effector):
        a, b = getattr(one, part.name), getattr(other, part.name)
        assert str(a) == str(b), part.name
