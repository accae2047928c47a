"""The state of rest that linear results are about, and the loads that act in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.dynamics.equilibria.equilibrium import EquilibriumError
from femflex.dynamics.model import compile_system
from femflex.pipeline.rest import rest_of, rest_state, rest_system, silent, with_loads_of
from femflex.system import Environment, Load, Profile, System, prismatic, revolute

WEIGHT = 1.5 * 9.81 * 0.4  # of the arm about its hinge [N m]
PUSH = Load("push", "cart", force=np.array([3.0, 0.0, 0.0]))
HOLD = Load("hold", "arm", torque=np.array([0.0, 0.0, 0.5 * WEIGHT]))
TURN = Load("turn", "arm", torque=np.outer([2.0, 4.0], [0.0, 0.0, 1.0]), times=np.array([0.0, 2.0]))


def pendulum(*loads: Load, along: tuple[int, ...] = (1, 0, 0), ride: float | Profile | None = None) -> System:
    """A pendulum on a cart that slides freely, or as `ride` says."""
    bodies = {"cart": rigid_body(2.0, np.eye(3)), "arm": rigid_body(1.5, np.eye(3), [0.4, 0.0, 0.0])}
    slide = prismatic("cart", axis=list(along), name="ride", motion=() if ride is None else (ride,))
    hinge = revolute("arm", "cart", name="hinge", q0=[-1.4])
    return System(bodies, (slide, hinge), environment=Environment(gravity=np.array([0.0, -9.81, 0.0])), loads=loads)


def test_loads_under_which_a_craft_cannot_rest_are_left_out_and_named():
    found, left_out = rest_of(pendulum(TURN, HOLD, PUSH))
    assert left_out == (
        "load 'turn'",
        "load 'hold' (no equilibrium under it)",
        "load 'push' (no equilibrium under it)",
    )
    assert found.q[1] == pytest.approx(-np.pi / 2) and not found.model.system.loads
    assert rest_of(pendulum(TURN))[1] == ("load 'turn'",)


def test_loads_under_which_a_craft_rests_stay():
    """The torque is half the weight's largest moment: the arm hangs 30 deg off the vertical."""
    ride = Profile.sine(0.1, 2.0, 0.4, 0.2)
    found, left_out = rest_of(pendulum(TURN, HOLD, PUSH, ride=ride))
    assert left_out == ("load 'turn'", "motion of 'ride'")
    assert found.q == pytest.approx([0.2 + 0.1 * np.sin(0.4), -np.pi / 3])
    assert [load.name for load in found.moving.loads] == ["hold", "push"]


def test_a_craft_that_falls_without_loads_has_no_rest():
    with pytest.raises(EquilibriumError, match=r"nothing resists ride\.slide"):
        rest_of(pendulum(along=(0, 1, 0)))


def test_at_a_time_loads_and_motions_are_those_of_that_time():
    """At 1 s the torque is 3 N m, and the cart where its motion has it."""
    ride = Profile.sine(0.1, 2.0, 0.4, 0.2)
    system = pendulum(TURN, PUSH, ride=ride)
    found, left_out = rest_of(system, at=1.0)
    assert left_out == ()
    assert found.q == pytest.approx([0.2 + 0.1 * np.sin(2.4), -np.arccos(3.0 / WEIGHT)])
    frozen = rest_system(system, 1.0, found)
    assert [load.torque[2] for load in frozen.loads] == [3.0, 0.0] and all(one.times is None for one in frozen.loads)


def test_a_system_at_rest_keeps_the_order_of_its_loads_those_that_do_not_act_at_zero():
    system = pendulum(TURN, HOLD, PUSH, ride=Profile.sine(0.1, 2.0, 0.4, 0.2))
    about = rest_of(system)[0]
    for rest in (rest_system(system, None, about), with_loads_of(system, system, about)):
        assert [load.name for load in rest.loads] == ["turn", "hold", "push"]
        assert [load.torque.tolist() for load in rest.loads] == [[0, 0, 0], [0, 0, 0.5 * WEIGHT], [0, 0, 0]]
        assert [load.force.tolist() for load in rest.loads] == [[0, 0, 0], [0, 0, 0], [3, 0, 0]]
        assert all(load.times is None for load in rest.loads)
    both = replace(TURN, force=np.outer([1.0, 2.0], [1.0, 2.0, 3.0]), body="cart", marker="origin", frame="inertial")
    still = silent(both)
    assert (still.name, still.body, still.frame) == ("turn", "cart", "inertial")
    assert not still.force.any() and not still.torque.any() and still.force.shape == (3,)


def test_the_state_at_rest_has_no_rates():
    system = pendulum(HOLD, ride=0.3)
    system = replace(system, joints=(system.joints[0], replace(system.joints[1], u0=np.array([7.0]))))
    model = compile_system(system)
    assert rest_state(rest_of(system)[0], model) == pytest.approx([0.3, -np.pi / 3, 0.0, 0.0])
