"""Drums of members that close loops, and free lengths in loops, against a linkage of one degree of freedom."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.members import solved

from femflex.body import Marker, rigid_body
from femflex.deployment import DeployingLine, Reel, deploying_line
from femflex.dynamics import compile_system
from femflex.reduction import BeamFunctions
from femflex.system import Profile, System, revolute, weld

BASE, ROD, DENSITY, MASS = 2.0, 1.5, 0.6, 3.0


def triangle(length, functions=None, delta=None, **more):
    """A boom from the base's pin, and a rod from its far end, whose ends are joined."""
    line = DeployingLine(mass_per_length=DENSITY, EIy=40.0, EIz=40.0)
    boom = deploying_line(line, functions, length, until=2.0, stock=2.4)
    inertia = MASS * ROD**2 / 12
    bar = rigid_body(MASS, np.diag([1e-3, inertia, inertia]), center_of_mass=(ROD / 2, 0, 0),
                     markers={"end": Marker.rigid(np.array([ROD, 0.0, 0.0]))})  # fmt: skip
    plate = rigid_body(1.0, np.eye(3), markers={"far": Marker.rigid(np.array([BASE, 0.0, 0.0]))})
    a, b = angles(1.2)
    joints = (
        weld("plate"),
        revolute("boom", "plate", q0=[a]),
        revolute("bar", "plate", parent_marker="far", q0=[b]),
    )
    loop = revolute("bar", "boom", parent_marker="tip", child_marker="end")
    start = {} if delta is None else {"delta0": {"boom": delta}}
    return System({"plate": plate, "boom": boom.body, "bar": bar}, joints, loops=(loop,),
                  varying={"boom": boom.variation}, **start, **more)  # fmt: skip


def angles(L):
    """Of the boom and of the rod, by the law of cosines."""
    a = np.arccos((BASE**2 + L**2 - ROD**2) / (2 * BASE * L))
    return a, np.pi - np.arccos((BASE**2 + ROD**2 - L**2) / (2 * BASE * ROD))


def inertia(L):
    """mu of the kinetic energy mu U^2 / 2 at the length L and its rate U."""
    a, b = angles(L)
    da = -(1 - (BASE**2 - ROD**2) / L**2) / (2 * BASE * np.sin(a))
    db = -L / (BASE * ROD * np.sin(np.pi - b))
    return DENSITY * L + DENSITY * L**3 / 3 * da**2 + MASS * ROD**2 / 3 * db**2


def slope(L, h=1e-5):
    return (inertia(L + h) - inertia(L - h)) / (2 * h)


def test_the_drum_of_a_boom_in_a_loop_moves_the_linkage():
    """F = mu dU/dt + mu' U^2 / 2 + m' U |U| / 2, out and in; the boom carries the force of the loop to its tip."""
    times = np.linspace(0.0, 2.0, 11)
    for ends in ((1.2, 1.9), (1.9, 1.2)):
        length = Profile.smooth_step(0.0, 2.0, *ends)
        system = triangle(length)
        joints = tuple(j if j.child == "plate" else j.with_initial([angle], [0.0])
                       for j, angle in zip(system.joints, (0.0, *angles(ends[0])), strict=True))  # fmt: skip
        seen = solved(System(system.bodies, joints, loops=system.loops, varying=system.varying), times)[2]
        L, U, A = (seen[f"bodies/boom/{key}"] for key in ("length", "length_rate", "length_acceleration"))
        exact = inertia(L) * A + slope(L) * U**2 / 2 + DENSITY * U * np.abs(U) / 2
        assert seen["bodies/boom/drum_force"] == pytest.approx(exact, abs=3e-7 * np.abs(exact).max())
        assert seen["bodies/boom/drum_power"] == pytest.approx(exact * U, abs=3e-7 * np.abs(exact * U).max())
        at_exit = exact - DENSITY * U**2 * (U > 0)
        assert seen["bodies/boom/tension"][:, 0] == pytest.approx(-at_exit, abs=1e-6 * np.abs(exact).max())


def test_a_bent_boom_in_a_loop_gives_what_the_energy_gains():
    """dE/dt = drum power - pickup loss at one instant, by differences along the motion."""
    system = triangle(Profile.polynomial(1.2, 0.3, 0.1), BeamFunctions(y=2), np.array([0.01, -0.002]))
    model = compile_system(system)
    x = model.x0
    rate, change = model.state_rate(0.0, x), []
    for h in (2e-3, 1e-3):
        both = model.observe(np.array([-h, h]), np.stack([x - h * rate, x + h * rate]))
        change.append(np.diff(both["monitors/energy"])[0] / (2 * h))
    here = model.observe(np.zeros(1), x[None])
    given = here["bodies/boom/drum_power"] - here["bodies/boom/pickup_loss"]
    assert (4 * change[1] - change[0]) / 3 == pytest.approx(given[0], rel=1e-5)
    assert given[0] != pytest.approx(DENSITY * 0.3**3, rel=0.5)


def test_a_motor_lets_a_boom_out_within_a_loop():
    """mu dU/dt = F - mu' U^2 / 2 - m' U |U| / 2 of a free length, with a motor, a brake and a drum's inertia."""
    reel = Reel("reel", 1.2, 0.1, tension=-6.0, damping=4.0, mass=0.5)
    times = np.linspace(0.0, 0.6, 4)
    seen = solved(triangle(reel, effectors=(reel.effector(2.4),)), times)[2]

    def equation(t, x):
        L, U = x
        force = 6.0 - 4.0 * U - slope(L) * U**2 / 2 - DENSITY * U * abs(U) / 2
        return [U, force / (inertia(L) + 0.5)]

    exact = solve_ivp(equation, (0, 0.6), [1.2, 0.1], t_eval=times, rtol=1e-11, atol=1e-12).y
    assert exact[0][-1] > 1.45
    assert seen["bodies/boom/length"] == pytest.approx(exact[0], rel=1e-7)
    assert seen["bodies/boom/length_rate"] == pytest.approx(exact[1], rel=1e-6)
