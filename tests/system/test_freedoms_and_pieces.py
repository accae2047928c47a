"""Names of freedoms and which of them may be kept, pieces of profiles: whole answers, several joints at once."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.system import Joint, Latch, Profile, cylindrical, free, prismatic, revolute, spherical, universal, weld
from femflex.system.kept import keep_problems, keepable, kept
from femflex.system.law import Friction
from femflex.system.stop import Stop

JOINTS = (
    weld("slab", name="fixed"),
    universal("dish", "slab", name="cross"),
    cylindrical("drill", "slab", name="cross2"),
    free("bell", "dish"),
    spherical("orb", "slab", name="socket", rotation="modified_rodrigues"),
    Joint("cart", name="stage", translations=np.eye(3)[:2], rotations=np.eye(3)[:1]),
)


def test_freedoms_are_named_by_their_joint_and_numbered_where_there_are_several():
    found = {joint.label: joint.velocity_names() for joint in JOINTS}
    assert found == {
        "fixed": [],
        "cross": [("cross.angle1_rate", "rad/s"), ("cross.angle2_rate", "rad/s")],
        "cross2": [("cross2.slide_rate", "m/s"), ("cross2.angle_rate", "rad/s")],
        "dish-bell": [
            *((f"dish-bell.slide{k}_rate", "m/s") for k in (1, 2, 3)),
            *((f"dish-bell.omega_{axis}", "rad/s") for axis in "xyz"),
        ],
        "socket": [(f"socket.omega_{axis}", "rad/s") for axis in "xyz"],
        "stage": [("stage.slide1_rate", "m/s"), ("stage.slide2_rate", "m/s"), ("stage.angle_rate", "rad/s")],
    }
    assert JOINTS[3].coordinate_names() == [
        *((f"dish-bell.slide{k}", "m") for k in (1, 2, 3)),
        *((f"dish-bell.e{k}", "1") for k in range(4)),
    ]
    assert [name for name, _ in JOINTS[4].coordinate_names()] == ["socket.p1", "socket.p2", "socket.p3"]
    assert [(joint.n_q, joint.n_u) for joint in JOINTS] == [(0, 0), (2, 2), (2, 2), (7, 6), (3, 3), (3, 3)]


def test_what_may_be_kept_is_a_joint_that_moves_or_one_of_its_slides_and_turns():
    assert [keepable(joint) for joint in JOINTS] == [
        {},
        {"cross": [0, 1], "cross.angle1": [0], "cross.angle2": [1]},
        {"cross2": [0, 1], "cross2.slide": [0], "cross2.angle": [1]},
        {"dish-bell": [0, 1, 2, 3, 4, 5], "dish-bell.slide1": [0], "dish-bell.slide2": [1], "dish-bell.slide3": [2]},
        {"socket": [0, 1, 2]},
        {"stage": [0, 1, 2], "stage.slide1": [0], "stage.slide2": [1], "stage.angle": [2]},
    ]
    keep = ["cross.angle2", "stage.angle", "stage.slide1", "dish-bell", "dish-bell.slide2"]
    assert [kept(keep, joint) for joint in JOINTS] == [[], [1], [], [0, 1, 2, 3, 4, 5], [], [0, 2]]
    assert keep_problems([*keep, "cross2"], JOINTS) == []


def test_what_cannot_be_kept_is_named_with_what_can():
    near, far = keep_problems(["cros.angle1", "cross2", "ball"], JOINTS[1:3])
    known = "known are cross, cross.angle1, cross.angle2, cross2, cross2.slide, cross2.angle"
    text = "which is no joint that moves and no slide or turn of one; "
    assert near == f"keep names 'cros.angle1', {text}did you mean 'cross.angle1'? {known}"
    assert far == f"keep names 'ball', {text}{known}"


def test_laws_that_are_alike_are_numbered_and_states_are_those_of_latches():
    joint = Joint(
        "cart",
        name="stage",
        translations=np.eye(3)[:2],
        rotations=np.eye(3)[:1],
        laws=(
            Friction(limit=1.0),
            Stop(freedom=1, upper=2.0, stiffness=3.0),
            Friction(freedom=2, limit=4.0),
            Stop(freedom=2, name="buffer", lower=-5.0, stiffness=6.0),
        ),
        latches=(Latch(1, at=0.5), Latch(0, at=0.0, opens=2.0), Latch(2, at=0.25, stiffness=8.0)),
    )
    assert joint.law_names() == ["stage.friction1", "stage.stop", "stage.friction2", "buffer"]
    assert joint.state_names() == [
        (f"stage.latch{k}_{what}", unit) for k in (1, 2, 3) for what, unit in (("time", "s"), ("loss", "J"))
    ]
    assert joint.initial_states().tolist() == [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0]
    assert [latch.freedom for latch in joint.locking] == [1, 0]
    single = prismatic("cart", name="rail", latches=(Latch(0, at=0.5),))
    assert single.state_names() == [("rail.latch_time", "s"), ("rail.latch_loss", "J")]
    assert revolute("cart").initial_states().tolist() == []


def test_motions_that_begin_are_where_a_joint_starts():
    motion = (Profile.polynomial(0.25, -0.5, 3.0), None, 0.75)
    joint = Joint(
        "cart",
        translations=np.eye(3)[:2],
        rotations=np.eye(3)[:1],
        motion=motion,
        q0=[0.0, 2.0, 0.0],
        u0=[0.0, 4.0, 0.0],
    )
    assert joint.q0.tolist() == [0.25, 2.0, 0.75] and joint.u0.tolist() == [-0.5, 4.0, 0.0]
    assert list(joint.held) == [0, 2] and [joint.held[k].moves for k in (0, 2)] == [True, False]
    moved = joint.with_initial(u0=[-0.5, 5.0, 0.0])
    assert moved.q0.tolist() == [0.25, 2.0, 0.75] and moved.u0.tolist() == [-0.5, 5.0, 0.0]


def test_a_trapezoid_is_five_pieces_and_three_without_a_constant_rate():
    found = Profile.trapezoid(1.0, 6.0, 2.0, 10.0, 1.0)  # 8 in 5 s, less a ramp: 2 a second
    assert found.knots.tolist() == [0.0, 1.0, 2.0, 5.0, 6.0]
    assert found.coefficients.tolist() == [[2, 0, 0], [2, 0, 1], [3, 2, 0], [9, 2, -1], [10, 0, 0]]
    assert found.breaks.tolist() == [1.0, 2.0, 5.0, 6.0]
    short = Profile.trapezoid(1.0, 5.0, 2.0, 10.0, 2.0)
    assert short.knots.tolist() == [-1.0, 1.0, 3.0, 5.0]
    assert short.coefficients.tolist() == [[2, 0, 0], [2, 0, 1], [6, 4, -1], [10, 0, 0]]


def test_a_sum_of_unlike_motions_has_the_pieces_and_sines_of_all():
    parts = (
        Profile.trapezoid(1.0, 6.0, 2.0, 10.0, 1.0),
        Profile.smooth_step(2.0, 4.0, -1.0, 3.0),
        Profile.sine(0.5, 3.0, 0.25, mean=7.0),
        Profile.spline([0.5, 1.5, 2.5, 3.5, 5.5], [1.0, 2.0, -1.0, 0.5, 2.5]),
        Profile.polynomial(0.125, 0.5, -0.25, 0.0625),
    )
    total = parts[0] + parts[1] + parts[2] + parts[3] + parts[4]
    t = np.array([0.5, 0.75, 1.0, 1.9, 2.0, 3.0, 4.0, 4.5, 5.5])
    for found, *own in zip(total(t), *(part(t) for part in parts), strict=True):
        np.testing.assert_allclose(found, np.sum(own, axis=0), atol=1e-12)
    assert np.isnan(total(np.array([0.499, 5.501]))[1]).all()
    assert (total.first, total.last) == (0.5, 5.5)
    assert total.breaks.tolist() == [0.5, 1.0, 2.0, 2.5, 4.0, 5.0, 5.5, 6.0]
    assert total.sines.tolist() == [[0.5, 3.0, 0.25]]
    assert total.numbers[:5].tolist() == [len(total.knots), total.coefficients.shape[1], 1, 0.5, 5.5]


@pytest.mark.parametrize(
    ("profile", "moves"),
    [
        (Profile.constant(3.0), False),
        (Profile.polynomial(3.0, 0.0, 0.0), False),
        (Profile.polynomial(3.0, 0.0, 1e-9), True),
        (Profile.sine(0.0, 2.0, mean=1.0), False),
        (Profile.sine(2.0, 0.0, 0.5), False),
        (Profile.sine(0.1, 0.1) + Profile.sine(0.0, 1.0), True),
        (Profile.smooth_step(1.0, 2.0, 3.0, 3.0), False),
        (Profile.smooth_step(1.0, 2.0, 3.0, 4.0), True),
    ],
)
def test_a_motion_moves_unless_it_keeps_one_value(profile: Profile, moves: bool):
    assert profile.moves is moves
