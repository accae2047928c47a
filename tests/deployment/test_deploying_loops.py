"""Deploying members in loops against linkages of one degree of freedom, and a spinning craft with a blade."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.members import solved

from femflex.body import Marker, rigid_body
from femflex.deployment import (
    DeployingLine,
    DeployingStrip,
    Reel,
    StringFunctions,
    StripFunctions,
    deploying_line,
    deploying_strip,
)
from femflex.dynamics import compile_system
from femflex.reduction import BeamFunctions
from femflex.system import Profile, System, free, revolute, weld

BASE, ROD, DENSITY, MASS = 2.0, 1.5, 0.6, 3.0


def triangle(length, functions=None, delta=None, **more):
    """A boom from the base's pin, and a rod from its far end, whose ends are joined."""
    line = DeployingLine(mass_per_length=DENSITY, EIy=40.0, EIz=40.0)
    boom = deploying_line(line, functions, length, until=2.0, stock=2.4)
    inertia = MASS * ROD**2 / 12
    bar = rigid_body(MASS, np.diag([1e-3, inertia, inertia]), center_of_mass=(ROD / 2, 0, 0),
                     markers={"end": Marker.at_position(np.array([ROD, 0.0, 0.0]))})  # fmt: skip
    plate = rigid_body(1.0, np.eye(3), markers={"far": Marker.at_position(np.array([BASE, 0.0, 0.0]))})
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


def test_drum_of_boom_in_loop_moves_linkage():
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


def test_drum_work_equals_energy_gain_of_bent_boom_in_loop():
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


def test_motor_deploys_boom_in_loop():
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


@pytest.mark.slow
def test_spinning_craft_deploys_blade():
    """Spin falls as J grows, J omega = H; the flap of a membrane from the axis has the spin's own frequency."""
    hub = np.diag([200.0, 200.0, 300.0])
    strip = DeployingStrip(mass_per_length=0.02, width=0.4, tension=1e-4, orientation=(0, 1, 0))
    length = Profile.smooth_step(0.0, 60.0, 1.0, 10.0)
    functions = StripFunctions(StringFunctions(z=1), 1)
    made = deploying_strip(strip, functions, length, until=200.0, stock=10.0)
    bodies = {"hub": rigid_body(1e6, hub), "blade": made.body}
    delta = np.array([1e-3 / made.body.marker("tip").phi[2, 0]])
    system = System(bodies, (free("hub", u0=[0, 0, 0, 0, 0, 1.0]), weld("blade", "hub")), delta0={"blade": delta},
                    varying={"blade": made.variation})  # fmt: skip
    times = np.linspace(0, 200, 4001)
    seen = solved(system, times, 1e-10)[2]
    H = seen["monitors/angular_momentum"]
    assert np.abs(H - H[0]).max() < 1e-9 * np.linalg.norm(H[0])
    L, m = length(times)[0], 0.05 * 0.4
    spin = seen["bodies/hub/rate"][:, 2]
    across = m * 10.0 * 0.4**2 / 12  # all of the blade turns with its width
    J = 300.0 + m * L**3 / 3 + across - (m * L**2 / 2) ** 2 / (1e6 + m * 10.0)
    assert spin * J == pytest.approx(spin[0] * J[0], rel=2e-6)
    assert spin[-1] < 0.98 * spin[0]
    flap = seen["markers/blade.tip/deflection"][:, 2]
    after = times > 70.0
    crossings = times[after][:-1][np.diff(np.sign(flap[after])) != 0]
    frequency = np.pi / np.diff(crossings).mean()
    # the hub of 200 kg m^2 tilts against the blade: J_b / J_t of 6.7 / 200 shifts the square by as much
    assert frequency == pytest.approx(spin[-1], rel=0.03)
    tension = seen["bodies/blade/tension"][-1]
    x = np.linspace(0.0, 1.0, 11) * 10.0
    assert tension == pytest.approx(m * spin[-1] ** 2 * (10.0**2 - x**2) / 2 + 1e-4, rel=1e-3, abs=1e-4)
