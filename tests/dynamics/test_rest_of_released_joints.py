"""Joints that are released or latched, at rest: which of them are locked, and where a run may go on from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.equilibrium import equilibrium
from femflex.dynamics.equilibria.linearised import free_directions, held_freedoms
from femflex.dynamics.equilibria.system_modes import system_modes
from femflex.dynamics.latches import Latches
from femflex.system import Latch, Load, System, Threshold, revolute, signal, started

AXIS = 0.3  # kg m^2, of each of the two bodies about the axis that both turn about
STIFFNESS, REST = (5.0, 7.0), (0.4, -0.2)


def craft(opens=0.5) -> System:
    """Two bodies, one on the other, that turn about one axis on springs; the first is locked at 0.1 rad until then."""
    body = rigid_body(2.0, np.diag([0.1, 0.2, AXIS]))
    return System(
        {"a": body, "b": body},
        (
            revolute("a", name="one", stiffness=5.0, rest=0.4, q0=[0.1], latches=(Latch(0, at=0.1, opens=opens),)),
            revolute("b", "a", name="two", stiffness=7.0, rest=-0.2),
        ),
    )


@pytest.mark.parametrize("at", [None, 0.0, 0.499])
def test_a_joint_is_locked_at_rest_until_it_is_released(at):
    found, modes = equilibrium(craft(), at), system_modes(craft(), at)
    assert found.q == pytest.approx([0.1, -0.2])
    assert modes.frequencies == pytest.approx([np.sqrt(7.0 / AXIS) / (2 * np.pi)])
    assert found.stable and found.verdict.startswith("stable")


@pytest.mark.parametrize("channel", ["monitors/kinetic", "effectors/clock/value"])
def test_a_joint_that_awaits_a_value_is_locked_at_rest(channel):
    clock = signal("clock", [0.0, 1.0], [0.0, 2.0])
    found = equilibrium(replace(craft(Threshold(channel, above=1.0)), effectors=(clock,)), 0.7)
    assert found.q == pytest.approx([0.1, -0.2])
    assert found.motions.eigenvalues == pytest.approx([1j * np.sqrt(7.0 / AXIS)])


@pytest.mark.parametrize("at", [0.5, 0.7])
def test_a_released_joint_rests_where_its_spring_is_free_and_vibrates(at):
    found, modes = equilibrium(craft(), at), system_modes(craft(), at)
    assert found.q == pytest.approx(REST)
    M = AXIS * np.array([[2.0, 1.0], [1.0, 1.0]])
    squares = np.linalg.eigvals(np.linalg.solve(M, np.diag(STIFFNESS)))
    assert modes.frequencies == pytest.approx(np.sort(np.sqrt(squares)) / (2 * np.pi))


def test_a_run_may_go_on_from_a_joint_that_was_released():
    model = compile_system(started(craft(), equilibrium(craft(), 0.7).x))
    assert model.x0 == pytest.approx([0.4, -0.2, 0.0, 0.0, -2.0, 0.0])
    assert model.state_rate(0.0, model.x0) == pytest.approx(np.zeros(6), abs=1e-9)
    assert not held_freedoms(model).any()
    assert held_freedoms(model, compile_system(craft()).x0).tolist() == [True, False]


def test_a_run_may_go_on_from_a_joint_that_has_latched():
    joints = (
        revolute("a", name="one", u0=[1.0], latches=(Latch(0, at=0.3),)),
        revolute("b", "a", name="two", u0=[2.0], latches=(Latch(0, at=0.9, stiffness=4.0),)),
    )
    system = System(craft().bodies, joints)
    on = compile_system(started(system, np.array([0.3, 0.9, 0.0, 1.5, 0.2, 0.7, 0.6, 0.0])))
    assert held_freedoms(compile_system(system)).tolist() == [False, False]
    assert held_freedoms(on).tolist() == [True, False]
    assert free_directions(on, 0.0, on.x0)[0].tolist() == [1]
    assert on.state_rate(0.0, on.x0)[2:4] == pytest.approx([0.0, 0.0])  # locked, and where its spring is free


def test_a_latch_that_does_not_fit_the_start_is_refused_by_the_craft():
    turning = revolute("a", name="one", q0=[0.1], u0=[0.2], latches=(Latch(0, at=0.1, opens=2.5),))
    away = revolute("b", "a", name="two", q0=[0.3], latches=(Latch(0, at=0.4, opens=1.5),))
    with pytest.raises(ValueError) as raised:
        System(craft().bodies, (turning, away))
    assert str(raised.value).splitlines() == [
        "'one.angle' starts at 0.1 at a rate of 0.2, and is locked at 0.1 until it opens (2.5); let it start there, at "
        "rest",
        "'two.angle' starts at 0.3 at a rate of 0, and is locked at 0.4 until it opens (1.5); let it start there, at "
        "rest",
    ]
    with pytest.raises(ValueError) as raised:
        System({"a": craft().bodies["a"]}, (revolute("a", name="one", q0=[0.4], latches=(Latch(0, at=0.4),)),))
    assert str(raised.value) == "'one.angle' starts at 0.4, where it latches; lock it, or start elsewhere"


def test_what_a_joint_awaits_comes_near_at_the_rate_of_its_channel():
    """A clock that runs by time alone, and kinetic energy that grows by the power of a torque."""
    body = rigid_body(2.0, np.diag([0.1, 0.2, AXIS]))
    late, slow = Threshold("effectors/clock/value", above=7.0), Threshold("monitors/kinetic", below=0.05)
    joints = (
        revolute("a", name="one", q0=[0.1], latches=(Latch(0, at=0.1, opens=late),)),
        revolute("b", name="two", q0=[0.4], latches=(Latch(0, at=0.4, opens=slow),)),
        revolute("c", name="three", u0=[1.5]),
    )
    clock = signal("clock", [0.0, 10.0], [1.0, 31.0])
    push = Load("push", "c", torque=[0.0, 0.0, 0.6])
    model = compile_system(System({"a": body, "b": body, "c": body}, joints, loads=(push,), effectors=(clock,)))
    latches = Latches(model)
    assert latches.values(0.5, model.x0) == pytest.approx([7.0 - 2.5, 0.5 * AXIS * 1.5**2 - 0.05])
    assert latches.rates(0.5, model.x0) == pytest.approx([-3.0, 0.6 * 1.5], rel=1e-6)
