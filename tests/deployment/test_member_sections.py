"""Forces in sections of deploying members: tension and bending moments along them."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, trapezoid
from support.members import TIP, falling_chain, hub_with_arms, solved, wall_beam

from femflex.body import rigid_body
from femflex.deployment import DeployingLine, MaterialTaper, Reel, deploying_line, deploying_tapered_line
from femflex.dynamics import compile_system
from femflex.reduction import BeamFunctions
from femflex.rotations import dcm_from_quaternion
from femflex.system import Frame, Orbit, Profile, System, revolute, weld

STATIONS = np.linspace(0.0, 1.0, 11)


def test_vertical_tether_in_orbit_has_textbook_tension():
    """T = 1.5 n^2 rho (L^2 - x^2), VALIDATION row I, at a constant length from the orbit's point."""
    orbit, L, rho = Orbit(6.8e6), 2000.0, 0.005
    n = orbit.mean_motion
    line = DeployingLine(mass_per_length=rho, direction=(0, 1, 0))
    made = deploying_line(line, None, Profile.constant(L), stock=L)
    bodies = {"craft": rigid_body(1e9, 1e12 * np.eye(3)), "tether": made.body}
    system = System(
        bodies, (weld("craft"), weld("tether", "craft")), varying={"tether": made.variation}, orbit=orbit,
        frame=Frame("orbital"),
    )  # fmt: skip
    model = compile_system(system)
    seen = model.observe(np.zeros(1), model.x0[None])["bodies/tether/tension"][0]
    assert seen == pytest.approx(1.5 * n**2 * rho * L**2 * (1 - STATIONS**2), rel=1e-5, abs=1e-9)
    assert model.channels["bodies/tether/tension"].names[3] == "0.3"


@pytest.mark.parametrize("tip_mass", [0.0, 5.0])
def test_chain_falling_from_heap_has_no_tension(tip_mass):
    """Outboard of x all accelerates with A: T = (m' (L - x) + m_t)(g - A); at the exit T = m' U^2 - drum force."""
    reel = Reel("reel", 4.0, 0.7, tension=20.0, damping=3.0)
    times = np.linspace(0, 1.0, 3)
    seen = solved(falling_chain(reel, tip_mass=tip_mass), times)[2]
    L, A, U = (seen[f"bodies/chain/{key}"] for key in ("length", "length_acceleration", "length_rate"))
    wanted = (2.0 * L[:, None] * (1 - STATIONS) + tip_mass) * (9.81 - A)[:, None]
    assert seen["bodies/chain/tension"] == pytest.approx(wanted, rel=1e-9, abs=1e-9)
    assert seen["bodies/chain/tension"][:, 0] == pytest.approx(2.0 * U**2 - seen["bodies/chain/drum_force"], rel=1e-9)


@pytest.mark.parametrize("drum", ["root", "tip"])
def test_tension_of_a_spinning_tapered_arm_that_deploys(drum):
    """A point mass at r(t) on a turning axis: a = r'' - omega^2 r; by quadrature, the drum's mass at the tip."""
    points, factors, m, stock = (0.0, 1.2, 4.0), (1.0, 2.0, 0.5), 0.4, 4.0
    taper = MaterialTaper.table(points, mass=factors)
    length = Profile.smooth_step(0.0, 3.0, 1.0, 2.0)
    line = DeployingLine(mass_per_length=m)
    made = deploying_tapered_line(line, taper, None, length, until=3.0, stock=stock, drum=drum)
    system = System(
        {"arm": made.body}, (revolute("arm", axis=(0, 0, 1), u0=[0.6]),), varying={"arm": made.variation},
    )  # fmt: skip
    model = compile_system(system)
    t = 1.1
    L, U, A = (float(v) for v in length(t))
    x0 = model.x0
    rate = float(x0[-1])
    found = model.observe(np.array([t]), x0[None])["bodies/arm/tension"][0]
    x = np.linspace(0.0, L, 200001)
    mass = m * np.interp(L - x if drum == "root" else x, points, factors)
    load = mass * ((rate**2 * x - A) if drum == "root" else rate**2 * x)
    outboard = trapezoid(load, x) - cumulative_trapezoid(load, x, initial=0.0)
    wanted = np.interp(STATIONS * L, x, outboard)
    if drum == "tip":
        y = np.linspace(L, stock, 200001)
        stowed = trapezoid(m * np.interp(y, points, factors), y)
        flux = m * np.interp(L, points, factors) * U**2
        wanted = wanted + stowed * (rate**2 * L - A) + flux
    assert found == pytest.approx(wanted, rel=1e-5, abs=3e-6)  # kinks lie between points


def test_bending_moments_are_those_of_the_curvature():
    """At the wall of a bent beam EI w''; nothing at the tip. Against the bending of the tip's own shape."""
    system = wall_beam(Profile.constant(1.0), 3)
    model = compile_system(system)
    seen = model.observe(np.zeros(1), model.x0[None])
    moment = seen["bodies/beam/moment_z"][0]
    assert moment[0] == pytest.approx(1.87510407**2 * TIP, rel=1e-6)  # EI w'' = (beta L)^2 tip of the first mode
    assert abs(moment[-1]) < 1e-9 * moment[0]
    assert np.abs(seen["bodies/beam/moment_y"]).max() < 1e-12 * moment[0]


def test_exit_of_bent_arm_carries_force_on_free_hub():
    """Momentum of hub and stowed part along the arm: m_h a_h + m_s a_s = T - m' U^2, with velocities by differences."""
    m, mass, stock = 0.3, 20.0, 3.0
    line = DeployingLine(mass_per_length=m, EIy=2.0, EIz=2.0, root=(0.5, 0, 0), direction=(1, 0.4, 0))
    length = Profile.smooth_step(0.0, 3.0, 1.0, 2.0)
    arms = {"a": (line, BeamFunctions(y=2, z=1), length, {"stock": stock})}
    model, states, _ = solved(hub_with_arms(arms, (0.1, 0.2, 0.9), 3.0, mass), np.linspace(0, 3, 4), 1e-10)
    h = 1e-5
    for t, x in zip(np.linspace(0, 3, 4)[1:3], states[1:3], strict=True):
        dx = model.state_rate(t, x)
        times, both = np.array([t - h, t, t + h]), np.stack([x - h * dx, x, x + h * dx])
        seen = model.observe(times, both)
        C_NB = dcm_from_quaternion(seen["bodies/hub/attitude"])
        away, exit_ = np.array([0.5, 0, 0]), seen["markers/a.root/velocity"]
        hub = exit_ - np.einsum("tij,tj->ti", C_NB, np.cross(seen["bodies/hub/rate"], away))
        L, U, _ = (float(v) for v in length(t))
        axis = C_NB[1] @ (np.array([1, 0.4, 0]) / np.hypot(1, 0.4))
        force = mass * (hub[2] - hub[0]) / (2 * h) + m * (stock - L) * (exit_[2] - exit_[0]) / (2 * h)
        found = seen["bodies/a/tension"][1]
        assert found[0] == pytest.approx(float(force @ axis) + m * U**2, abs=1e-5 * max(1.0, abs(found[0])))
        assert abs(found[-1]) < 1e-12
