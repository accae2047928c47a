"""Loads at markers: what tables and frames say, and the balance of power of loads, dampers and energy."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate.dop853 import Dop853
from femflex.system import Frame, Load, Orbit, System, free, spherical

TABLE = {"times": np.array([1.0, 2.0, 2.0, 4.0]), "force": np.array([[0, 0, 1.0], [0, 0, 3], [0, 0, -2], [0, 0, 0]])}


def block(*loads, mass=4.0, inertia=(2.0, 2.0, 2.0), **more):
    """A free rigid body with these loads, its marker off the centre and turned."""
    axes = Rotation.from_euler("XYZ", [0.3, -0.5, 0.9]).as_matrix()
    markers = {"pad": Marker.at_position([0.5, -0.2, 0.3], axes)}
    body = rigid_body(mass, np.diag(inertia), markers=markers)
    return compile_system(System({"block": body}, (more.pop("joint", free("block")),), loads=loads, **more))


@pytest.mark.parametrize(
    ("t", "expected"), [(0.5, 0.0), (1.0, 1.0), (1.25, 1.5), (2.0, -2.0), (3.0, -1.0), (4.0, 0.0), (4.5, 0.0)]
)
def test_load_table_is_piecewise_linear_and_zero_outside(t, expected):
    model = block(Load("push", "block", **TABLE))
    assert model.observe(np.array([t]), model.x0[None])["loads/push/force"][0] == pytest.approx([0, 0, expected])
    assert model.state_rate(t, model.x0)[model.n_q + 2] == pytest.approx(expected / 4.0, abs=1e-15)


@pytest.mark.parametrize("frame", ["body", "marker", "inertial", "orbital"])
def test_load_components_in_each_frame(frame):
    F, M = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.7, -0.4])
    load = Load("push", "block", "pad", frame, force=F, torque=M)
    attitude = Rotation.from_euler("XYZ", [0.4, 0.8, -0.3])
    joint = free("block", q0=[0.1, 0.2, 0.3, *np.roll(attitude.as_quat(), 1)])
    orbit = Orbit(2e7, 0.1, inclination=0.5, node=0.7, true_anomaly=0.9, free=True)
    model = block(load, joint=joint, orbit=orbit)
    without = block(joint=joint, orbit=orbit)
    at = np.zeros(1)
    out = model.observe(at, model.x0[None])
    C_NO = Rotation.from_quat(np.roll(out["orbit/attitude"][0], -1))
    axes = Rotation.from_matrix(model.system.bodies["block"].markers["pad"].orientation)
    turn = {"body": Rotation.identity(), "marker": axes, "inertial": attitude.inv(), "orbital": attitude.inv() * C_NO}
    f, m = turn[frame].apply(F), turn[frame].apply(M)
    assert out["loads/push/force"][0] == pytest.approx(f, abs=1e-14)
    assert out["loads/push/torque"][0] == pytest.approx(m, abs=1e-14)
    gained = (model.state_rate(0.0, model.x0) - without.state_rate(0.0, model.x0))[model.n_q :]
    assert gained[:3] == pytest.approx(attitude.apply(f) / 4.0, abs=1e-9)
    assert gained[3:] == pytest.approx((m + np.cross([0.5, -0.2, 0.3], f)) / 2.0, abs=1e-9)


def test_varying_force_supplies_power_and_constant_force_has_potential():
    F, place, v = np.array([1.0, -2.0, 0.5]), np.array([0.4, 0.2, -0.7]), np.array([0.3, -0.1, 0.6])
    joint = free("block", q0=[*place, 1, 0, 0, 0], u0=[*v, 0, 0, 0])
    steady = Load("steady", "block", "origin", "inertial", force=F)
    pulse = Load("pulse", "block", "origin", "inertial", force=np.array([F, 3 * F]), times=np.array([0.0, 2.0]))
    model = block(steady, pulse, joint=joint)
    seen = {path: value[0] for path, value in model.observe(np.array([1.0]), model.x0[None]).items()}
    assert seen["monitors/load"] == pytest.approx(-F @ place)
    assert seen["monitors/supplied"] == pytest.approx(2 * F @ v)
    assert seen["monitors/energy"] == pytest.approx(0.5 * 4.0 * v @ v - F @ place)


def test_orbit_force_balances_momentum_of_loads():
    """The same body tumbling far from any orbit gains momentum at the rate that the orbit's force takes away."""
    loads = (Load("jet", "block", "pad", "marker", force=[0.3, 0.1, -0.2]), Load("twist", "block", torque=[0, 0.2, 0]))
    u0, times = [0.3, -0.4, 0.2], np.linspace(0.0, 8.0, 161)
    craft = block(*loads, joint=spherical("block", u0=u0), orbit=Orbit(7e6, 0.1), frame=Frame("inertial"))
    craft = craft.without("gravity_gradient")
    alone = block(*loads, joint=free("block", u0=[0, 0, 0, *u0]))
    force = craft.observe(times, Dop853().solve(craft, times, craft.x0).states)["orbit/force"]
    momentum = alone.observe(times, Dop853().solve(alone, times, alone.x0).states)["monitors/momentum"]
    assert np.linalg.norm(force, axis=1) == pytest.approx(np.full(161, np.linalg.norm([0.3, 0.1, -0.2])))
    gained = CubicSpline(times, -force).antiderivative()(times)
    assert gained == pytest.approx(momentum - momentum[0], abs=2e-8)
    assert np.ptp(gained, axis=0).min() > 0.3
