"""Observed channels against material points and frames; sights of stations on the Earth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.random_systems import random_body, random_state, random_tree

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.effectors import Gyro, Thruster, Wheel
from femflex.system import (
    EARTH_RADIUS,
    Environment,
    Frame,
    Load,
    Orbit,
    Sight,
    Spring,
    System,
    cylindrical,
    free,
    spherical,
    with_effectors,
)

H = 1e-5  # s, of central differences: errors of 1e-9
G = np.array([0.4, -1.1, 0.7])


def rotation(e: np.ndarray) -> np.ndarray:
    return Rotation.from_quat(np.roll(e, -1, axis=-1)).as_matrix()


@pytest.mark.parametrize("seed", [2, 5])
def test_observed_channels_match_material_points(seed):
    system, clouds, _ = random_tree(seed, n_bodies=6)
    names = list(system.bodies)
    rng = np.random.default_rng(seed + 50)
    force, torque = rng.normal(size=(2, 3))
    inertial, other = rng.normal(size=(2, 3))
    system = replace(
        system,
        joints=tuple(
            replace(j, stiffness=np.arange(1.0, 1 + j.n_u) * (j.ball is None), rest=0.1 * np.arange(1.0, 1 + j.n_u))
            for j in system.joints
        ),
        loads=(
            Load("held", names[0], "a", "inertial", inertial), Load("push", names[2], "b", "body", force, torque),
            Load("fall", names[3], "c", "inertial", other),
        ),
        springs=(
            Spring("s", names[1], names[4], "b", "a", stiffness=3.0, length=0.4),
            Spring("t", names[5], None, "c", stiffness=2.0, length=0.2),
        ),
        environment=Environment(G), libration_sequence="xzy",
    )  # fmt: skip
    q, u = random_state(system, rng)
    model = compile_system(system)
    x = np.concatenate([q, u])
    rate = model.state_rate(0.0, x)
    seen = model.observe(np.zeros(3), np.stack([x - H * rate, x, x + H * rate]))
    assert set(seen) == set(model.channels)
    single = model.channel_values(0.0, x, model.channels)
    for path, channel in model.channels.items():
        assert seen[path].shape == (3, *channel.shape), path
        np.testing.assert_allclose(single[path], seen[path][1], rtol=1e-12, atol=1e-12, err_msg=path)
    mass = kinetic = 0.0
    first, momentum, moments = np.zeros((3, 3))
    elastic = 0.0
    for name, (dm, rho, phi) in clouds.items():
        C, delta = rotation(seen[f"bodies/{name}/attitude"]), seen.get(f"bodies/{name}/delta", np.zeros((3, 0)))
        r = rho + np.einsum("pan,tn->tpa", phi, delta)
        places = seen[f"bodies/{name}/position"][:, None] + np.einsum("tab,tpb->tpa", C, r)
        v = (places[2] - places[0]) / (2 * H)
        kinetic += 0.5 * dm @ np.sum(v**2, axis=1)
        mass += dm.sum()
        first += dm @ places[1]
        momentum += dm @ v
        moments += dm @ np.cross(places[1], v)
        elastic += system.bodies[name].strain.energy(delta[1])
        turn = Rotation.from_matrix(C[0].T @ C[2]).as_rotvec() / (2 * H)
        np.testing.assert_allclose(seen[f"bodies/{name}/rate"][1], turn, atol=1e-6)
        for key, marker in system.bodies[name].markers.items():
            path = f"markers/{name}.{key}"
            if f"{path}/position" not in seen:  # the origin of a body is reported as the body's place
                continue
            at = marker.position + delta @ marker.phi.T
            wanted = seen[f"bodies/{name}/position"] + np.einsum("tab,tb->ta", C, at)
            np.testing.assert_allclose(seen[f"{path}/position"], wanted, atol=1e-11)
            velocity = (wanted[2] - wanted[0]) / (2 * H)
            np.testing.assert_allclose(seen[f"{path}/velocity"][1], velocity, atol=1e-6)
            assert (f"{path}/deflection" in seen) == (delta.size > 0)
            if delta.size:
                np.testing.assert_allclose(seen[f"{path}/deflection"], delta @ marker.phi.T, atol=1e-11)
    centre = first / mass
    close = {"rel": 1e-6, "abs": 1e-6}
    at = {key.removeprefix("monitors/"): value[1] for key, value in seen.items() if key.startswith("monitors/")}
    assert at["kinetic"] == pytest.approx(kinetic, **close) and at["elastic"] == pytest.approx(elastic, rel=1e-9)
    np.testing.assert_allclose(at["center_of_mass"], centre, atol=1e-10)
    np.testing.assert_allclose(at["momentum"], momentum, atol=1e-6)
    np.testing.assert_allclose(at["angular_momentum"], moments - np.cross(centre, momentum), atol=1e-5)
    assert at["gravity"] == pytest.approx(-mass * G @ centre, rel=1e-9)
    spots = {one.name: seen[f"markers/{one.body}.{one.marker}/position"][1] for one in system.loads}
    stored = -inertial @ spots["held"] - other @ spots["fall"]
    assert at["load"] == pytest.approx(stored, rel=1e-9)
    C = rotation(seen[f"bodies/{names[2]}/attitude"])
    here = system.bodies[names[2]].marker("b")
    turned = C @ Rotation.from_rotvec(seen[f"bodies/{names[2]}/delta"] @ here.psi.T).as_matrix()
    omega = Rotation.from_matrix(turned[2] @ turned[0].T).as_rotvec() / (2 * H)
    power = (C[1] @ force) @ seen[f"markers/{names[2]}.b/velocity"][1] + (C[1] @ torque) @ omega
    assert at["supplied"] == pytest.approx(power, rel=1e-5, abs=1e-6)
    springs = 0.0
    coordinates = dict(zip([n for n, _ in system.coordinate_names()], q, strict=True))
    for joint in system.joints:
        if joint.ball is None:
            own = np.array([coordinates[name] for name, _ in joint.coordinate_names()])
            springs += 0.5 * joint.stiffness @ (own - joint.rest) ** 2
    place = {name: seen[f"markers/{name}/position"][1] for name in (f"{names[1]}.b", f"{names[4]}.a", f"{names[5]}.c")}
    springs += 1.5 * (np.linalg.norm(place[f"{names[1]}.b"] - place[f"{names[4]}.a"]) - 0.4) ** 2
    springs += 1.0 * (np.linalg.norm(place[f"{names[5]}.c"]) - 0.2) ** 2
    assert at["spring"] == pytest.approx(springs, rel=1e-9)
    assert at["energy"] == pytest.approx(kinetic + elastic + springs + stored - mass * G @ centre, **close)
    root = system.joint_of(system.root)
    attitude = rotation(seen[f"bodies/{system.root}/attitude"][1])
    marker = system.bodies[system.root].marker(root.child_marker)
    delta = seen[f"bodies/{system.root}/delta"][1]
    C = attitude @ Rotation.from_rotvec(marker.psi @ delta).as_matrix() @ marker.orientation
    angles = model.observation(np.zeros(1), x[None])["attitude/angles"][0]  # not reported of a root that cannot turn
    np.testing.assert_allclose(Rotation.from_euler("XZY", angles).as_matrix(), C, atol=1e-10)


WHEEL = {"inertia": 0.1, "inertia_in_body": "separate", "axis": (0.3, 0.8, 0.5), "initial_speed": 40.0, "torque": 0.1}


@pytest.mark.parametrize(
    ("devices", "absent"),
    [
        ({}, ()),
        ({"w": Wheel(body="body0", **WHEEL)}, ("friction", "saturated", "dissipation", "force")),
        ({"w": Wheel(body="body0", **WHEEL, viscous=1e-3, max_torque=0.01)}, ("force",)),
        (
            {"w": Thruster(body="body0", axis=(1, 2, 3), thrust=2.0, pulses=[(0.0, 9.0)])},
            ("flow", "mass_flow", "dissipation"),
        ),
        (
            {"w": Thruster(body="body0", axis=(1, 2, 3), thrust=2.0, pulses=[(0.0, 9.0)], specific_impulse=200.0)},
            ("dissipation",),
        ),
        (
            {
                "w": Gyro(
                    body="body0",
                    gimbal_axis=(1, 0, 0),
                    spin_axis=(0, 1, 1),
                    momentum=3.0,
                    rates=[0.2],
                    initial_angles=(0.5,),
                )
            },
            ("energy", "dissipation"),
        ),
    ],
)
def test_no_channel_is_zero_in_a_general_motion(devices, absent):
    system = random_tree(9, n_bodies=5)[0]
    x = np.concatenate(random_state(system, np.random.default_rng(1)))
    model = compile_system(with_effectors(system, devices))
    seen = model.observe(np.array([0.7]), np.concatenate([x, model.x0[len(x) :]])[None])
    assert [path for path, values in seen.items() if not np.any(values)] == []
    assert not [key for key in absent if f"effectors/w/{key}" in seen]


UP = 500e3  # m


def looking(**sight):
    """A craft in an equatorial orbit, its axes normal, up, forward."""
    body = {"craft": rigid_body(10.0, np.eye(3))}
    orbit = Orbit(EARTH_RADIUS + UP)
    sights = (Sight("down", "craft", axis=[0, -2, 0], **sight),)
    return System(body, (spherical("craft"),), orbit=orbit, frame=Frame("orbital"), sights=sights)


def observed_at_rest(system, times):
    model = compile_system(system)
    return model.observe(times, np.tile(model.x0, (len(times), 1)))


def test_sight_of_station_below_craft():
    found = observed_at_rest(looking(), np.array([0.0, 10.0]))
    assert found["sights/down/error"][0] == pytest.approx(0.0, abs=1e-12)
    assert found["sights/down/range"][0] == pytest.approx(UP, abs=1e-6)
    assert found["sights/down/elevation"][0] == pytest.approx(np.pi / 2, abs=1e-6)
    angle = (Orbit(EARTH_RADIUS + UP).mean_motion - 7.292115e-5) * 10.0  # that the station stays behind
    behind, below = EARTH_RADIUS * np.sin(angle), EARTH_RADIUS * (1 - np.cos(angle)) + UP
    assert found["sights/down/error"][1] == pytest.approx(np.arctan2(behind, below), rel=1e-9)
    assert found["sights/down/range"][1] == pytest.approx(np.hypot(behind, below), rel=1e-12)


def test_sight_of_station_off_the_ground_track():
    latitude = 0.05
    found = observed_at_rest(looking(latitude=latitude), np.zeros(1))
    beside, below = EARTH_RADIUS * np.sin(latitude), EARTH_RADIUS * (1 - np.cos(latitude)) + UP
    assert found["sights/down/error"][0] == pytest.approx(np.arctan2(beside, below), rel=1e-12)
    elevation = np.pi / 2 - latitude - np.arctan2(beside, below)
    assert found["sights/down/elevation"][0] == pytest.approx(elevation, rel=1e-9)


def test_displacement_of_hinged_panel_includes_joints():
    """A slide and a hinge carry a flexible panel on a hub that is turned and moves: closed kinematics."""
    rng = np.random.default_rng(7)
    panel, _ = random_body(rng, 3)
    here = Rotation.from_rotvec([0.3, -0.2, 0.9])
    markers = {
        "arm": Marker.at_position([0.5, 0.1, 0.0], here.as_matrix()),
        "corner": Marker.at_position([1.0, 1.0, 0.0]),
    }
    bodies = {"hub": rigid_body(10.0, np.eye(3), markers=markers), "panel": panel}
    joints = (
        free("hub", rotation="intrinsic xyz", name="craft"),
        cylindrical("panel", "hub", (0, 0, 1), parent_marker="arm", child_marker="a", name="hinge",
                    stiffness=[0.0, 5.0], damping=[0.0, 0.7], rest=[0.0, 0.4], q0=[0.2, 0.4]),
    )  # fmt: skip
    model = compile_system(System(bodies, joints, reactions=True))
    slide, angle, delta = 0.35, 0.55, rng.normal(size=3) * 0.1
    craft, rates = np.array([1.0, 2.0, 3.0, 0.4, -0.3, 0.8]), rng.normal(size=11)
    seen = model.observe(np.zeros(1), np.concatenate([craft, [slide, angle], delta, rates])[None])

    def marker_position(slide, angle, delta):
        """Marker b of the panel in axes of the hub: its marker a is held."""
        a, b = panel.marker("a"), panel.marker("b")
        C_BA = Rotation.from_rotvec(a.psi @ delta).as_matrix() @ a.orientation
        turn = here.as_matrix() @ Rotation.from_rotvec([0, 0, angle]).as_matrix() @ C_BA.T
        arm = b.position + b.phi @ delta - a.position - a.phi @ delta
        return markers["arm"].position + here.apply([0, 0, slide]) + turn @ arm

    moved = marker_position(slide, angle, delta) - marker_position(0.2, 0.4, np.zeros(3))
    assert seen["markers/panel.b/displacement"][0] == pytest.approx(moved, abs=1e-12)
    assert model.channels["markers/panel.b/displacement"].frame == "body hub"
    zero = {"markers/hub.corner/displacement", "markers/hub.corner/deflection", "monitors/supplied"}
    assert not zero & set(model.channels) and "joints/craft/rate" not in model.channels
    assert seen["joints/hinge/slide"][0] == slide and seen["joints/hinge/angle"][0] == angle
    assert seen["joints/hinge/rate"][0] == pytest.approx(rates[6:8])
    assert model.channels["joints/hinge/rate"].unit == "m/s, rad/s"
    torque = seen["joints/hinge/local_torque"][0]  # the hinge's own axis is z of the panel's marker too
    assert torque[2] == pytest.approx(-5.0 * (angle - 0.4) - 0.7 * rates[7], rel=1e-10)
    assert seen["joints/hinge/local_force"][0, 2] == pytest.approx(0.0, abs=1e-10 * np.abs(torque).max())
    C = rotation(seen["bodies/panel/attitude"][0]) @ Rotation.from_rotvec(panel.marker("a").psi @ delta).as_matrix()
    inertial = C @ panel.marker("a").orientation @ torque
    assert seen["joints/hinge/torque"][0] == pytest.approx(inertial, rel=1e-10)
