"""Loads at markers: what tables and frames say, and the balance of power of loads, dampers and energy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation
from support.random_systems import random_tree

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate.dop853 import Dop853
from femflex.system import Frame, Load, Orbit, System, free, spherical

TABLE = {"times": np.array([1.0, 2.0, 2.0, 4.0]), "force": np.array([[0, 0, 1.0], [0, 0, 3], [0, 0, -2], [0, 0, 0]])}


def block(*loads, mass=4.0, inertia=(2.0, 2.0, 2.0), **more):
    """A free rigid body with these loads, its marker off the centre and turned."""
    axes = Rotation.from_euler("XYZ", [0.3, -0.5, 0.9]).as_matrix()
    markers = {"pad": Marker.rigid([0.5, -0.2, 0.3], axes)}
    body = rigid_body(mass, np.diag(inertia), markers=markers)
    return compile_system(System({"block": body}, (more.pop("joint", free("block")),), loads=loads, **more))


@pytest.mark.parametrize(
    ("t", "expected"), [(0.5, 0.0), (1.0, 1.0), (1.25, 1.5), (2.0, -2.0), (3.0, -1.0), (4.0, 0.0), (4.5, 0.0)]
)
def test_a_table_is_linear_between_its_times_zero_outside_and_jumps_where_a_time_repeats(t, expected):
    model = block(Load("push", "block", **TABLE))
    assert model.observe(np.array([t]), model.x0[None])["loads/push/force"][0] == pytest.approx([0, 0, expected])
    assert model.state_rate(t, model.x0)[model.n_q + 2] == pytest.approx(expected / 4.0, abs=1e-15)


def test_velocity_under_a_table_is_its_integral_and_steps_stop_at_its_knots():
    model = block(Load("push", "block", **TABLE))
    assert list(model.breaks) == [1.0, 2.0, 4.0]
    run = Dop853(rtol=1e-9, atol=1e-12).solve(model, np.array([0.0, 2.0, 5.0]), model.x0)
    assert run.states[1:, model.n_q + 2] == pytest.approx([2.0 / 4, 0.0], abs=1e-13)  # 2 N s, then -2 N s


def test_a_constant_torque_spins_a_ball_up_uniformly():
    model = block(Load("twist", "block", torque=[0.1, 0.2, -0.2]))
    run = Dop853(rtol=1e-11, atol=1e-13).solve(model, np.array([0.0, 5.0]), model.x0)
    assert run.states[1, model.n_q + 3 :] == pytest.approx(np.array([0.1, 0.2, -0.2]) * 5.0 / 2.0, abs=1e-10)


@pytest.mark.parametrize("frame", ["body", "marker", "inertial", "orbital"])
def test_components_are_those_of_the_named_frame(frame):
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


def test_the_orbital_frame_is_normal_vertical_and_flight_direction():
    load = Load("pull", "block", frame="orbital", force=[1.0, 2.0, 3.0])
    orbit = Orbit(2e7)  # at perigee on X: the normal is Z, the vertical X, flight along Y
    model = block(load, joint=spherical("block"), orbit=orbit, frame=Frame("inertial"))
    assert model.observe(np.zeros(1), model.x0[None])["loads/pull/force"][0] == pytest.approx([2.0, 3.0, 1.0])


def loaded_tree(seed):
    """A random tree with springs, dampers and a load of every frame that needs no orbit, and a state."""
    rng = np.random.default_rng(seed)
    system, _, (q, u) = random_tree(seed)
    names = list(system.bodies)
    loads = tuple(
        Load(frame, names[k], marker, frame, force=rng.normal(size=3), torque=rng.normal(size=3))
        for k, (marker, frame) in enumerate((("a", "body"), ("b", "marker"), ("c", "inertial")))
    )
    joints = tuple(
        replace(j, stiffness=rng.uniform(0, 2, j.n_u), damping=rng.uniform(0, 2, j.n_u)) for j in system.joints
    )
    return replace(system, loads=loads, joints=joints), np.concatenate([q, u])


def load_power(model, x):
    """sum F . v + M . omega of the loads at their markers, from what the model reports."""
    out = model.observe(np.zeros(1), x[None])
    records = dict(zip(model.system.order, slices(model.system), strict=True))
    power = 0.0
    for load in model.system.loads:
        C_NB = Rotation.from_quat(np.roll(out[f"bodies/{load.body}/attitude"][0], -1))
        marker = model.system.bodies[load.body].markers[load.marker]
        d, rate = (x[start:stop] for start, stop in records[load.body])
        ahead, behind = (Rotation.from_rotvec(marker.psi @ (d + h * rate)) for h in (1e-6, -1e-6))
        spin = (ahead * behind.inv()).as_rotvec() / 2e-6  # of the marker relative to its body
        v = C_NB.inv().apply(out[f"markers/{load.body}.{load.marker}/velocity"][0])
        power += out[f"loads/{load.name}/force"][0] @ v
        power += out[f"loads/{load.name}/torque"][0] @ (out[f"bodies/{load.body}/rate"][0] + spin)
    return power


def slices(system):
    """Places in x of each body's elastic coordinates and rates, in tree order."""
    iq, iu = 0, len(system.coordinate_names())
    for name in system.order:
        joint, n = system.joint_of(name), system.bodies[name].n_modes
        iq, iu = iq + joint.n_q, iu + joint.n_u
        yield (iq, iq + n), (iu, iu + n)
        iq, iu = iq + n, iu + n


def damping_power(system, x):
    """u . c u of the joints' dampers and ddelta . D ddelta of the shapes."""
    power, iu = 0.0, len(system.coordinate_names())
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        u = x[iu : iu + joint.n_u]
        rate = x[iu + joint.n_u : iu + joint.n_u + body.n_modes]
        power += u @ (joint.damping * u) + rate @ body.damping @ rate
        iu += joint.n_u + body.n_modes
    return power


@pytest.mark.parametrize("seed", range(8))
def test_energy_changes_by_the_power_of_loads_less_that_of_dampers(seed):
    system, x = loaded_tree(seed)
    model = compile_system(system)
    rate, h = model.state_rate(0.0, x), 1e-6
    ends = np.array([x - h * rate, x + h * rate])  # energy along the tangent of the motion
    energy = model.observe(np.zeros(2), ends)["monitors/energy"]
    expected = load_power(model, x) - damping_power(system, x)
    scale = np.abs(energy).max() + np.abs(expected)
    assert np.diff(energy)[0] / (2 * h) == pytest.approx(expected, abs=1e-7 * scale)


@pytest.mark.parametrize("seed", range(4))
def test_a_constant_force_has_an_energy_that_the_motion_draws_on(seed):
    system, x = loaded_tree(seed)
    weights = tuple(replace(load, frame="inertial", torque=np.zeros(3)) for load in system.loads)
    bodies = {name: replace(body, damping=0.0 * body.damping) for name, body in system.bodies.items()}
    joints = tuple(replace(joint, damping=0.0 * joint.damping) for joint in system.joints)
    model, h = compile_system(replace(system, bodies=bodies, joints=joints, loads=weights)), 1e-6
    rate = model.state_rate(0.0, x)
    seen = model.observe(np.zeros(2), np.array([x - h * rate, x + h * rate]))
    spent = -load_power(model, x)
    assert np.diff(seen["monitors/load"])[0] / (2 * h) == pytest.approx(spent, abs=1e-7 * (1 + abs(spent)))
    assert np.diff(seen["monitors/energy"])[0] / (2 * h) == pytest.approx(0.0, abs=1e-7 * np.abs(rate).max() ** 2)


def test_forces_that_turn_or_change_have_no_energy():
    times = np.array([0.0, 1.0])
    for load in (
        Load("jet", "block", "pad", "body", force=[1.0, 0, 0]),
        Load("twist", "block", "pad", "inertial", torque=[1.0, 0, 0]),
        Load("pulse", "block", "pad", "inertial", force=np.ones((2, 3)), times=times),
    ):
        assert "monitors/load" not in block(load).channels


def test_a_force_that_changes_with_time_is_supplied_and_one_that_stays_is_stored():
    F, place, v = np.array([1.0, -2.0, 0.5]), np.array([0.4, 0.2, -0.7]), np.array([0.3, -0.1, 0.6])
    joint = free("block", q0=[*place, 1, 0, 0, 0], u0=[*v, 0, 0, 0])
    steady = Load("steady", "block", "origin", "inertial", force=F)
    pulse = Load("pulse", "block", "origin", "inertial", force=np.array([F, 3 * F]), times=np.array([0.0, 2.0]))
    model = block(steady, pulse, joint=joint)
    seen = {path: value[0] for path, value in model.observe(np.array([1.0]), model.x0[None]).items()}
    assert seen["monitors/load"] == pytest.approx(-F @ place)
    assert seen["monitors/supplied"] == pytest.approx(2 * F @ v)
    assert seen["monitors/energy"] == pytest.approx(0.5 * 4.0 * v @ v - F @ place)


def test_a_specified_orbit_takes_up_the_momentum_that_the_loads_bring():
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


def test_an_orbit_without_pushing_loads_reports_no_force():
    held = block(Load("twist", "block", torque=[0, 0.2, 0]), joint=spherical("block"), orbit=Orbit(7e6, 0.1))
    assert "orbit/force" not in held.channels
