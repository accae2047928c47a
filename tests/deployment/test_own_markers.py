"""Loads, springs and effectors at a deploying member's own markers: what they do to its drum and to a free length."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.members import solved

from femflex.deployment import DeployingLine, Reel, deploying_line
from femflex.system import Effector, Load, Profile, Spring, System, revolute, weld

MASS = 2.0  # kg/m


def push_along(seen, out):
    """A force of the first parameter along the marker's x axis."""
    axis = seen.attitude[0]
    for i in range(3):
        out.force[0, i] = seen.parameters[0] * axis[0, i]


def member(length, joint=None, **more):
    made = deploying_line(DeployingLine(mass_per_length=MASS), None, length, stock=20.0, until=4.0)
    return System({"arm": made.body}, (joint or weld("arm"),), varying={"arm": made.variation}, **more)


def three():
    """A load, a spring to a fixed point and an effector at the tip, and their force along a member on the x axis."""
    jet = Effector("jet", push_along, markers=(("arm", "tip"),), parameters=np.array([0.7]))
    load = Load("push", "arm", "tip", force=np.array([-1.5, 0.0, 0.0]), frame="body")
    spring = Spring("spring", "arm", marker="tip", stiffness=3.0, length=1.0)
    acting = {"loads": (load,), "springs": (spring,), "effectors": (jet,)}
    return acting, lambda L: 0.7 - 1.5 - 3.0 * (L - 1.0)


@pytest.mark.slow
def test_the_drum_works_against_what_acts_on_the_tip():
    """F = m' L A + m' U^2 - force at the tip, for a straight member that is pushed out of a wall."""
    acting, force = three()
    times = np.linspace(0.0, 4.0, 9)
    seen = solved(member(Profile.polynomial(2.0, 0.3, 0.1), **acting), times)[2]
    L, U, A = (seen[f"bodies/arm/{key}"] for key in ("length", "length_rate", "length_acceleration"))
    assert seen["bodies/arm/drum_force"] == pytest.approx(MASS * L * A + MASS * U**2 - force(L), rel=1e-12)
    h = 1e-4
    near = np.array([2.0 - h, 2.0, 2.0 + h])
    seen = solved(member(Profile.polynomial(2.0, 0.3, 0.1), **acting), near)[2]
    change = (seen["monitors/energy"][2] - seen["monitors/energy"][0]) / (2 * h)
    own = (seen["bodies/arm/drum_power"] - seen["bodies/arm/pickup_loss"] - 0.8 * seen["bodies/arm/length_rate"])[1]
    assert change == pytest.approx(own, rel=1e-6)


def test_a_free_length_feels_what_acts_on_its_tip():
    """m' L dU/dt + m' U^2 [U > 0] = force at the tip - tension."""
    reel = Reel("reel", 2.0, 0.4, tension=0.2, damping=0.5)
    acting, force = three()
    acting["effectors"] = (*acting["effectors"], reel.effector(20.0))
    times = np.linspace(0.0, 1.0, 5)
    seen = solved(member(reel, **acting), times)[2]

    def equation(t, x):
        L, U = x
        return [U, (force(L) - 0.2 - 0.5 * U - MASS * U * U * (U > 0)) / (MASS * L)]

    exact = solve_ivp(equation, (0, 1), [2.0, 0.4], t_eval=times, rtol=1e-11, atol=1e-12, max_step=1e-2).y
    assert seen["bodies/arm/length"] == pytest.approx(exact[0], rel=1e-6)
    assert seen["bodies/arm/drum_force"] == pytest.approx(-seen["effectors/reel/tension"], abs=1e-9)


def test_a_free_length_of_a_turning_member_feels_a_spring_across_it():
    """A member on a pin, its tip on a spring from a point at its side, against Lagrange's equations of (angle, L)."""
    reel = Reel("reel", 2.0, -0.1, tension=0.1)
    spring = Spring("spring", "arm", marker="tip", stiffness=4.0, length=0.5)
    system = member(reel, revolute("arm"), springs=(spring,), effectors=(reel.effector(20.0),),
                    loads=(Load("side", "arm", "tip", force=np.array([0.3, 0.2, 0.0]), frame="inertial"),))  # fmt: skip
    times = np.linspace(0.0, 1.0, 5)
    seen = solved(system, times)[2]

    def equation(t, x):
        a, w, L, U = x
        force = 0.3 * np.cos(a) + 0.2 * np.sin(a) - 4.0 * (L - 0.5)
        across = -0.3 * np.sin(a) + 0.2 * np.cos(a)
        A = (MASS * L**2 / 2 * w**2 - MASS * U * U * (U > 0) + force - 0.1) / (MASS * L)
        return [w, (across * L - MASS * L**2 * U * w) / (MASS * L**3 / 3), U, A]

    exact = solve_ivp(equation, (0, 1), [0.0, 0.0, 2.0, -0.1], t_eval=times, rtol=1e-11, atol=1e-12, max_step=1e-2).y
    assert seen["bodies/arm/length"] == pytest.approx(exact[2], rel=1e-6)
