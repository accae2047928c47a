"""Deploying members in loops, and a spinning craft that rolls out a blade."""

import numpy as np
import pytest
from support.members import solved

from femflex.body import Marker, rigid_body
from femflex.deployment import (
    DeployingLine,
    DeployingStrip,
    StringFunctions,
    StripFunctions,
    deploying_line,
    deploying_strip,
)
from femflex.system import Environment, Profile, System, free, revolute, weld

G = 9.81


def test_a_boom_that_deploys_inside_a_loop_turns_the_linkage():
    """A triangle of base, boom of length L(t) and rod: angles by the law of cosines, energy in closed form."""
    base, rod, m, mass = 2.0, 1.5, 0.6, 3.0
    length = Profile.smooth_step(0.0, 2.0, 1.2, 1.9)
    boom = deploying_line(DeployingLine(mass_per_length=m), None, length, until=2.0, stock=2.0)
    inertia = mass * rod**2 / 12
    bar = rigid_body(mass, np.diag([1e-3, inertia, inertia]), center_of_mass=(rod / 2, 0, 0),
                     markers={"end": Marker.rigid(np.array([rod, 0.0, 0.0]))})  # fmt: skip
    plate = rigid_body(1.0, np.eye(3), markers={"far": Marker.rigid(np.array([base, 0.0, 0.0]))})

    def angles(L):
        a = np.arccos((base**2 + L**2 - rod**2) / (2 * base * L))
        b = np.pi - np.arccos((base**2 + rod**2 - L**2) / (2 * base * rod))
        return a, b

    a0, b0 = angles(1.2)
    joints = (
        weld("plate"),
        revolute("boom", "plate", q0=[a0]),
        revolute("bar", "plate", parent_marker="far", q0=[b0]),
    )
    loop = revolute("bar", "boom", parent_marker="tip", child_marker="end")
    system = System({"plate": plate, "boom": boom.body, "bar": bar}, joints, loops=(loop,),
                    varying={"boom": boom.variation}, environment=Environment(np.array([0.0, -G, 0.0])))  # fmt: skip
    times = np.linspace(0, 2.0, 21)
    _, states, seen = solved(system, times, 1e-11)
    found = states[:, :2]
    assert np.abs(found - np.stack(angles(length(times)[0]), axis=1)).max() < 1e-9

    def energy(t):
        """Of boom and bar in closed form; rates of the angles by differences of the law of cosines."""
        h = 1e-5
        (L1, U, _) = (float(v) for v in length(t))
        da, db = ((np.array(angles(float(length(t + h)[0]))) - angles(float(length(t - h)[0]))) / (2 * h)).tolist()
        a, b = angles(L1)
        kinetic = m * L1 * U**2 / 2 + m * L1**3 / 3 * da**2 / 2 + mass * rod**2 / 3 * db**2 / 2
        return kinetic + m * G * L1**2 / 2 * np.sin(a) + mass * G * rod / 2 * np.sin(b)

    exact = np.array([energy(t) for t in times[1:-1]])
    found = seen["monitors/energy"][1:-1]
    assert found - found[0] == pytest.approx(exact - exact[0], abs=1e-6 * np.ptp(exact))


@pytest.mark.slow
def test_a_spinning_craft_rolls_out_a_blade():
    """Spin falls as J grows, J omega = H; the flap of a membrane from the axis has the spin's own frequency."""
    hub = np.diag([200.0, 200.0, 300.0])
    strip = DeployingStrip(mass_per_area=0.05, width=0.4, tension=1e-4, across=(0, 1, 0))
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
