"""On a free orbit the centre of mass of a craft starts at O, at rest, unless the case says where its root body is."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.case import parse_case
from femflex.dynamics import compile_system
from femflex.pipeline.decisions import build_system

CRAFT = """
[run]
duration = 10
[orbit]
kind = "free"
perigee_altitude = "500 km"
eccentricity = 0.05
inclination = "40 deg"
true_anomaly = "70 deg"
[bodies.hub]
kind = "rigid"
mass = 4
center_of_mass = [0.3, -0.1, 0.2]
inertia = [3, 4, 5]
markers.side = { position = [1, 2, 3] }
[bodies.arm]
kind = "rigid"
mass = 1.5
center_of_mass = [0.5, 0, 0.2]
inertia = [0.2, 0.7, 0.8]
[[joints]]
kind = "revolute"
parent = "hub"
parent_marker = "side"
child = "arm"
axis = "y"
angle = 0.4
rate = 0.7
[attitude]
frame = "FRAME"
angles = ["20 deg", "-30 deg", "50 deg"]
rates = [0.1, -0.2, 0.3]
"""
POSITION, VELOCITY = [5.0, 6.0, -7.0], [0.5, -0.25, 0.125]


@pytest.mark.parametrize("frame", ["orbital", "inertial"])
@pytest.mark.parametrize("given", [(), ("position",), ("velocity",), ("position", "velocity")])
def test_what_the_case_does_not_say_puts_the_centre_of_mass_at_rest_at_the_origin(frame: str, given: tuple[str, ...]):
    """Of the whole craft, in any frame; what the case says of the root body stays as it is said."""
    text = CRAFT.replace("FRAME", frame)
    text += "".join(f"{key} = {POSITION if key == 'position' else VELOCITY}\n" for key in given)
    system = build_system(parse_case(text))
    model = compile_system(system)
    q, u, _ = model.parts(model.x0)
    assert ("position" in given) is (q[:3].tolist() == POSITION)
    assert ("velocity" in given) is (u[:3].tolist() == VELOCITY)
    seen = model.observe(np.zeros(1), model.x0[None])
    centre, momentum = seen["monitors/center_of_mass"][0], seen["monitors/momentum"][0]
    moved = 1e-9 if "position" not in given else np.inf
    assert np.abs(centre).max() < moved and (moved < 1 or np.abs(centre).max() > 1)
    still = 1e-9 if "velocity" not in given else np.inf
    assert np.abs(momentum).max() < still and (still < 1 or np.abs(momentum).max() > 0.1)
