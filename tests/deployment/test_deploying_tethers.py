"""Tethers that deploy in a circular orbit (VALIDATION rows I and I')."""

import numpy as np
import pytest
from support.members import solved

from femflex.body import rigid_body
from femflex.deployment import DeployingLine, deploying_line
from femflex.dynamics import compile_system
from femflex.system import Environment, Frame, Orbit, Profile, System, revolute, weld

ORBIT = Orbit(6.8e6)
RATE = ORBIT.mean_motion
HEAVY = 1e13  # kg, mass of the craft: the orbit point stays at the exit


def craft_with_tether(made, joint, tip_mass=0.0, **more):
    """A heavy craft held in the orbital frame (x orbit normal, y up, z forward), its tether and a subsatellite."""
    bodies = {"craft": rigid_body(HEAVY, np.eye(3)), "tether": made.body}
    joints = [weld("craft"), joint]
    if tip_mass:
        bodies["subsatellite"] = rigid_body(tip_mass, np.eye(3))
        joints.append(weld("subsatellite", "tether", parent_marker="tip"))
    return System(
        bodies,
        tuple(joints),
        varying={"tether": made.variation},
        orbit=ORBIT,
        frame=Frame("orbital"),
        environment=Environment(attraction="gradient"),
        **more,
    )


def exponential(first, rate, end):
    times = np.linspace(0, end, 61)
    return Profile.spline(times, first * np.exp(rate * times), degree=5)


@pytest.mark.parametrize(("per_length", "tip_mass", "factor"), [(1e-9, 200.0, -4 / 3), (0.01, 0.0, -2.0)])
def test_exponential_deployment_keeps_its_pitch(per_length, tip_mass, factor):
    """sin 2 theta = -(4/3) Ldot / (n L) of a massless tether with a tip mass, -2 Ldot / (n L) of a heavy tether."""
    rate, end = 0.3 * RATE, 2000.0
    steady = np.arcsin(factor * 0.3) / 2
    line = DeployingLine(mass_per_length=per_length, direction=(0, 1, 0))
    made = deploying_line(line, None, exponential(100.0, rate, end), until=end)
    joint = revolute("tether", "craft", axis=(1, 0, 0), q0=[steady])
    times = np.linspace(0, end, 21)
    _, states, _ = solved(craft_with_tether(made, joint, tip_mass), times)
    assert states[:, 0] == pytest.approx(steady, abs=2e-5)


@pytest.mark.slow
def test_retrieval_swings_a_tether_up():
    """Exponential retrieval: theta'' + 2 k theta' + 3 n^2 cos(2 steady) theta = 0 with k < 0, so it grows as 1 / L."""
    rate, end = -0.15 * RATE, 9000.0
    line = DeployingLine(mass_per_length=1e-9, direction=(0, 1, 0))
    made = deploying_line(line, None, exponential(20e3, rate, end), until=end)
    steady = np.arcsin(4 / 3 * 0.15) / 2
    joint = revolute("tether", "craft", axis=(1, 0, 0), q0=[steady + 0.01])
    times = np.linspace(0, end, 901)
    _, states, _ = solved(craft_with_tether(made, joint, 200.0), times)
    swing = states[:, 0] - steady
    w = np.sqrt(3 * np.cos(2 * steady) - 0.15**2) * RATE
    exact = 0.01 * np.exp(-rate * times) * (np.cos(w * times) + rate / w * np.sin(w * times))
    assert swing == pytest.approx(exact, abs=0.03 * np.abs(exact).max())
    assert np.abs(swing[times > 6000]).max() > 2.0 * 0.01


def test_stopped_tether_carries_its_weight_and_tip():
    """Row I at the exit: 1.5 n^2 rho L^2 + 3 n^2 m_t L; while it is let out, the Coriolis-free vertical law."""
    rho, m_t = 0.005, 40.0
    length = Profile.smooth_step(0.0, 4000.0, 200.0, 5000.0)
    line = DeployingLine(mass_per_length=rho, direction=(0, 1, 0))
    made = deploying_line(line, None, length, until=5000.0)
    model = compile_system(craft_with_tether(made, weld("tether", "craft"), m_t))
    seen = model.observe(np.array([0.0, 4500.0]), np.zeros((2, 0)))
    for k, L in enumerate((200.0, 5000.0)):
        tension = 1.5 * RATE**2 * rho * L**2 + 3 * RATE**2 * m_t * L
        assert -seen["bodies/tether/drum_force"][k] == pytest.approx(tension, rel=1e-9)
