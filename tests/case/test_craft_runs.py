"""Runs of cases with wheels and samples, resumed, and of a separation, against its closed form."""

from __future__ import annotations

import numpy as np
import pytest

import femflex as package
from femflex.case import parse_case
from femflex.results import open_run

WHEEL = '[wheels.w]\nbody = "hub"\ninertia = 0.2\ninertia_in_body = "contained"\n'
REST = """
[run]
duration = "10 s"
output_step = 0.05

[bodies.hub]
kind = "rigid"
mass = 200
inertia = [120, 100, 140]
markers.left = { position = [0.5, 0, 0] }
"""
RIGID = REST + '[attitude]\nrates = ["2 deg/s", 0, 0.01]\n'


def test_run_with_wheels_and_samples_resumes_bit_for_bit(write_case, femflex, tmp_path):
    """Everything that acts is in the case, so no Python is needed to go on."""
    loop = """
[sensors.star]
kind = "attitude"
body = "hub"
[sensors.gyro]
kind = "rate"
body = "hub"
period = 0.2
noise = 0.01
delay = 0.3
[controllers.law]
kind = "pid"
inputs = ["star.z", "gyro.z"]
stiffness = 2
period = 0.2
integral = 0.1
damping = 4
"""
    case = write_case(RIGID + loop + WHEEL + 'command = "law.y"\n')

    def stop(t):
        raise KeyboardInterrupt

    with package.run(case, tmp_path / "whole.h5") as complete_run:
        with pytest.raises(KeyboardInterrupt):
            package.run(case, tmp_path / "part.h5", progress=stop)
        code, _, text = femflex("run", case, "-o", tmp_path / "part.h5", "--resume")
        assert code == 0, text
        with open_run(tmp_path / "part.h5") as remainder:
            for path in ("q", "u", "z", "monitors/energy", "effectors/gyro/z"):
                assert np.array_equal(remainder[path], complete_run[path]), path


SEPARATION = """
[bodies.ball]
kind = "rigid"
mass = 1
inertia = [0.1, 0.1, 0.1]

[[joints]]
name = "latch"
kind = "general"
parent = "hub"
parent_marker = "left"
child = "ball"
slides = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
turns = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
position = [0.1, 0, 0]
RELEASE

[separations.spring]
body = "ball"
parent = "hub"
parent_marker = "left"
stiffness = 200
length = 0.2

[signals.clock]
kind = "linear"
times = [0, 10]
values = [0, 5]
"""


@pytest.mark.parametrize(
    ("release", "release_time"),
    [('release = "2 s"', 2.0), ('release_at = { signal = "clock.value", above = 1.5 }', 3.0)],
)
def test_spring_pushes_a_released_body_off_at_the_speed_of_its_energy(tmp_path, release, release_time):
    with package.run(parse_case(REST + SEPARATION.replace("RELEASE", release)), tmp_path / "run.h5") as run:
        distance, t = run["effectors/spring/distance"], run.time
        assert distance[t <= release_time] == pytest.approx(0.1) and distance[t > release_time].min() > 0.1
        assert np.abs(run["monitors/momentum"]).max() < 1e-12
        speed = np.diff(distance)[-1] / np.diff(t)[-1]
        assert speed == pytest.approx(0.1 * np.sqrt(200 * (1 / 1 + 1 / 200)), rel=1e-6)  # l sqrt(k / mu)
