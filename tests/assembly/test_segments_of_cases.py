"""`segments` in a case: where joints, loads and markers go, what the run reports, and what cannot be cut."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femflex.case import read_case
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.linear.equations import linearised
from femflex.pipeline.decisions import build_system

MEMBER = 'material = "aluminium" }'
MARKERS = """markers.tip = { group = "TIP" }
markers.root = { group = 'ROOT' }
markers.middle = { position = [2, 0, 0] }"""
INITIAL = 'initial = { marker = "tip", displacement = [0, "10 mm", 0] }\n'
RATIO = 'damping = { ratio = "0.5 %" }\n'
REDUCTION = 'reduction = { method = "cantilever", clamp = "ROOT", modes = 4 }\n'


@pytest.fixture
def cut_case(craft: str) -> str:
    """The boom of the craft cut into three, reduced as a segment is when nothing is said."""
    text = craft.replace(MEMBER, 'material = "aluminium", segments = 3 }').replace(INITIAL, "").replace(RATIO, "")
    text = text.replace('markers.tip = { group = "TIP" }', MARKERS)
    return text.replace(REDUCTION, "refine = 1\n").replace('"ROOT"', '"root"')


@pytest.mark.slow
def test_boom_in_segments_has_mass_and_frequencies_of_whole_boom(
    craft: str, cut_case: str, write_case: Callable[..., Path]
):
    whole = craft.replace(INITIAL, "").replace(RATIO, "").replace("modes = 4 }", "modes = 8 }\nrefine = 1")
    found = []
    for text in (whole, cut_case.replace("segments = 3", "segments = 6")):
        system = build_system(read_case(write_case(text)))
        assert sum(body.moments.mass for body in system.bodies.values()) == pytest.approx(
            200 + 2700 * np.pi * (0.03**2 - 0.028**2) * 3
        )
        model = compile_system(system)
        rest = model.x0.copy()
        rest[model.n_q :] = 0.0
        found.append(np.sort(np.abs(linearised(model, 0.0, rest).eigenvalues().imag))[::2][6:10])
    assert found[1] == pytest.approx(found[0], rel=2e-3)


CARRIED = """
[wheels.spinner]
body = "boom"
marker = "tip"
axis = [1, 0, 0]
inertia = 0.02
inertia_in_body = "added"
mass = 2.0
transverse_inertia = 0.01
torque = 0.1
[tanks.gas]
body = "boom"
marker = "middle"
propellant = 3.0
mass_in_body = "added"
[thrusters.jet]
body = "boom"
marker = "tip"
axis = [0, 1, 0]
thrust = 0.5
tank = "gas"
specific_impulse = 60.0
pulses = [[0.1, 0.2]]
"""


def test_the_segment_at_the_marker_carries_wheels_and_tanks(cut_case: str, write_case: Callable[..., Path]):
    bare = build_system(read_case(write_case(cut_case)))
    system = build_system(read_case(write_case(cut_case + CARRIED)))
    more = {name: system.bodies[name].moments.mass - bare.bodies[name].moments.mass for name in bare.order}
    middle = next(name for name in bare.order if "middle" in bare.bodies[name].markers)
    assert more == pytest.approx({"hub": 0.0, "boom.1": 0.0, "boom.2": 0.0, "boom.3": 2.0, middle: 3.0})
    assert list(system.varying) == [middle]
    wheel = next(one for one in system.effectors if one.name == "spinner")
    assert wheel.markers == (("boom.3", "tip"),)


SPUN = """
[gyros.cmg]
body = "boom"
marker = "tip"
momentum = 5.0
gimbal_axis = [1, 0, 0]
spin_axis = [0, 1, 0]
rates = [0.3]
[bodies.rotor]
kind = "rigid"
mass = 1.5
inertia = [0.012, 0.012, 0.02]
imbalance = { static = 1e-3, dynamic = 1e-4 }
[[joints]]
kind = "revolute"
name = "bearing"
child = "rotor"
parent = "boom"
parent_marker = "middle"
axis = [0, 0, 1]
rate = 20
"""


@pytest.mark.slow
def test_gyros_and_rotors_on_segments_conserve_momentum(cut_case: str, write_case: Callable[..., Path]):
    """What turns the craft is internal; the gyro's torque on its segment is h times the gimbal rate at the start."""
    model = compile_system(replace(build_system(read_case(write_case(cut_case + SPUN))), loads=()))
    (gyro,) = model.system.effectors
    assert gyro.markers == (("boom.3", "tip"),)
    rotor = model.system.joint_of("rotor")
    assert (rotor.parent, rotor.parent_marker) in {("boom.2", "middle"), ("boom.1", "middle")}
    times = np.linspace(0.0, 0.5, 6)
    states = Dop853(rtol=1e-10, atol=1e-12).solve(model, times, model.x0).states
    seen = model.observe(times, states)
    H, p = seen["monitors/angular_momentum"], seen["monitors/momentum"]
    assert np.abs(H - H[0]).max() < 1e-8 * np.linalg.norm(H[0]) and np.linalg.norm(H[0]) > 1.0
    assert np.abs(p - p[0]).max() < 1e-8
    assert np.linalg.norm(seen["bodies/hub/rate"][-1] - seen["bodies/hub/rate"][0]) > 1e-4
