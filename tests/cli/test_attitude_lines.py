"""Attitude angles near the singularity of their sequence are told of, with a sequence that stays away from it."""

import numpy as np
import pytest

from femflex import open_run

SPINNER = """
title = "spinner"
[run]
duration = "{duration} s"
output_step = "0.1 s"
[attitude]
frame = "inertial"
sequence = "{sequence}"
rates = {rates}
[bodies.sat]
kind = "rigid"
mass = 100
inertia = [20, 20, 30]
"""


@pytest.fixture
def output(femflex, tmp_path):
    def run(sequence="xzy", rates='[0, 0, "10 rpm"]', duration=10):
        (tmp_path / "case.toml").write_text(SPINNER.format(sequence=sequence, rates=rates, duration=duration))
        code, out, err = femflex("run", "case.toml", "-o", "run.h5", "--force", "--no-pictures")
        assert code == 0, err
        return next((line for line in out.splitlines() if line.startswith("angles")), "")

    return run


def test_a_spinner_about_the_second_axis_gets_a_sequence_that_works(output, tmp_path):
    line = output()
    assert "attitude/angles, xzy, come within" in line and "of their singularity (limit 5 deg)" in line
    assert "sequence = 'xyz' in [attitude] stays 90 deg away" in line
    assert output(sequence="xyz") == ""
    with open_run(tmp_path / "run.h5") as run:
        angle = np.unwrap(run["attitude/angles"][:, 2])
        np.testing.assert_allclose(angle, 2 * np.pi * run.time / 6.0, atol=1e-6)


def test_a_short_turn_is_not_told_of(output):
    assert output(duration=1) == ""


def test_a_craft_that_tumbles_is_pointed_to_euler_parameters(output):
    line = output(rates='["20 rpm", "11 rpm", "13 rpm"]', duration=30)
    assert line.endswith("Euler parameters are in bodies/sat/attitude")
