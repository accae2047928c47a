"""Gimbal lock of joints that turn successively: refused at the start, reported along a run, named at its end."""

import contextlib

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853, IntegrationError
from femflex.rotations import singularity_distance
from femflex.system import Joint, Profile, System, free, spherical, turns, universal
from femflex.system.turning import lock_angle

BODY = rigid_body(1.0, np.diag([1.0, 2.0, 2.5]))


@pytest.mark.parametrize(
    "joint",
    [
        universal("b", axes=((1, 0, 0), (1, 0, 0)), name="J"),
        turns("b", sequence="xyx", name="J"),
        turns("b", sequence="zxz", motion=(None, 0.0, None), name="J"),
        turns("b", sequence="xyz", q0=[0.2, np.pi / 2, 0.1], name="J"),
    ],
    ids=["two parallel", "three in a plane", "the middle one locked", "a quarter turn"],
)
def test_turns_that_start_in_gimbal_lock_are_refused(joint):
    with pytest.raises(ValueError, match="joint 'J' starts in gimbal lock: the axes of its free turns"):
        System({"b": BODY}, (joint,))


def test_turns_of_which_one_of_the_outer_ones_is_held_cannot_lock():
    system = System({"b": BODY}, (turns("b", sequence="zxz", motion=(0.3, None, None), name="J"),))
    assert "joints/J/singularity" not in compile_system(system).channels


@pytest.mark.parametrize("sequence", ["xyz", "zxz"])
def test_the_angle_left_is_that_of_the_rotation_set_of_the_same_turns(sequence):
    q = np.random.default_rng(1).uniform(-3, 3, (50, 3))
    assert lock_angle(turns("b", sequence=sequence, q0=[0, 1, 0]), q) == pytest.approx(
        singularity_distance(q, sequence), abs=1e-7
    )


def test_the_angle_left_is_where_the_mass_matrix_loses_its_rank():
    # three skew axes: the determinant of the axes over that of the first two, against M of the compiled model
    axes = np.array([[1.0, 0.2, 0.0], [0.1, 1.0, 0.4], [0.3, -0.2, 1.0]])
    joint = Joint("b", rotations=axes, name="J")
    model = compile_system(System({"b": rigid_body(1.0, np.eye(3))}, (joint,)))
    for angle in np.linspace(-3, 3, 13):
        x = np.array([0.4, angle, -0.7, 0, 0, 0])
        M = model.mass_matrix(0.0, x)  # J of the unit: M = B^T B with the turns' axes in B
        out_of_plane = np.sqrt(np.linalg.det(M) / np.linalg.det(M[:2, :2]))
        seen = model.observe(np.zeros(1), x[None])["joints/J/singularity"][0]
        assert np.sin(seen) == pytest.approx(out_of_plane, abs=1e-12)


def test_a_middle_angle_slewed_through_a_quarter_turn_ends_by_name():
    motion = (None, Profile.smooth_step(1, 9, 0.0, np.radians(100)), None)
    wrist = turns("c", "b", "xyz", motion=motion, name="wrist")
    hand = rigid_body(1.0, np.diag([1.0, 2.0, 2.5]), [1.0, 0, 0.2])
    model = compile_system(System({"b": BODY, "c": hand}, (free("b", u0=[0, 0, 0, 0.1, 0.05, 0.3]), wrist)))
    # on after 100 deg of the smooth step have passed 90 deg, at 6.772 s, where its rates pass all bounds
    states = []
    with contextlib.suppress(IntegrationError):
        for block in Dop853().blocks(model, np.linspace(0, 10, 101), model.x0):
            states.append((block.t, block.x.copy()))
            if block.t > 6.7684:
                break
    t, x = states[-1]
    left = model.observe(np.array([t]), x[None])["joints/wrist/singularity"][0]
    assert 6.7 < t < 6.78 and left < 0.01
    assert (
        "joint 'wrist' has reached gimbal lock: the axes of its free turns 'wrist.angle1', 'wrist.angle3'"
        in (model.diagnosis(t, x)[0])
    )


def test_a_ball_is_no_joint_of_turns():
    assert (
        compile_system(System({"b": BODY}, (spherical("b", rotation="zxz", q0=[0, 1, 0], name="J"),)))
        .channels["joints/J/singularity"]
        .description.startswith("angle left to the singularity of zxz")
    )
