"""Rotation sets in case files: what the words mean, what a run reports and warns of."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import femflex
from femflex import rotations
from femflex.case import read_case
from femflex.pipeline.decisions import build_system
from femflex.warning import PhysicsWarning

CASE = """
title = "turning"
[run]
duration = 4
samples = 41
[attitude]
ATTITUDE
[bodies.hub]
kind = "rigid"
mass = 2
inertia = [3, 4, 5]
[bodies.arm]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joints]]
child = "arm"
parent = "hub"
JOINT
"""
BALL = "kind = 'spherical'\n"


@pytest.fixture
def system_of(tmp_path):
    """The system of the case with those words in [attitude] and in its joint."""

    def build(attitude="", joint=BALL):
        (tmp_path / "case.toml").write_text(CASE.replace("ATTITUDE", attitude).replace("JOINT", joint))
        return build_system(read_case(tmp_path / "case.toml"))

    return build


@pytest.fixture
def run_of(tmp_path):
    """The run of the case with those words in [attitude]."""

    def run(attitude, samples=41):
        text = CASE.replace("ATTITUDE", attitude).replace("JOINT", "kind = 'weld'")
        (tmp_path / "case.toml").write_text(text.replace("samples = 41", f"samples = {samples}"))
        return femflex.run(tmp_path / "case.toml", tmp_path / "run.h5", force=True)

    return run


@pytest.mark.parametrize("chosen", rotations.ROTATION_SETS)
def test_angles_given_in_a_sequence_become_coordinates_of_the_set(chosen, system_of):
    words = f"{BALL}sequence = 'extrinsic zyx'\nangles = ['20 deg', 0.5, -0.4]\nrotation = '{chosen}'\n"
    joint = system_of(joint=words).joint_of("arm")
    x, y, z = (Rotation.from_rotvec(axis) for axis in np.diag([-0.4, 0.5, np.radians(20)]))
    expected = (x * y * z).as_matrix()  # z first, about axes that stay
    assert rotations.dcm_from_coordinates(joint.q0, chosen) == pytest.approx(expected, abs=1e-13)


def test_librations_may_be_extrinsic(system_of):
    given = "sequence = 'extrinsic xzy'\nangles = [0.3, 0.2, -0.1]"
    system = system_of(given, "kind = 'weld'")
    model = femflex.compile_system(system)
    out = model.observe(np.zeros(1), model.x0[None])
    assert out["attitude/angles"][0] == pytest.approx([0.3, 0.2, -0.1], abs=1e-14)
    assert model.channels["attitude/angles"].names == ("x", "z", "y")


NEAR = "rotation = 'xyz'\nsequence = 'xyz'\nangles = [0, 0, 0.02]\nrates = [0, 1, 0]"  # passes 90 deg of yaw


def test_rebased_run_passes_singularity(run_of):
    passing = NEAR.replace("rates = [0, 1, 0]", "rates = [0.3, 1, 0.5]")
    with run_of(passing.replace("'xyz'", "'euler_parameters'", 1)) as run:
        expected = run["bodies/hub/attitude"]
    with warnings.catch_warnings():
        warnings.simplefilter("error", PhysicsWarning)
        run = run_of(passing + "\nrebase = true")
    with run:
        assert run.complete
        assert np.abs((run["bodies/hub/attitude"] * expected).sum(axis=1)) == pytest.approx(np.ones(41), abs=1e-12)
        assert run["joints/base-hub/singularity"].min() > 0.5
