"""Every row that a run observes, against points and frames that are followed by differences of the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.random_systems import random_state, random_tree

from femflex.dynamics import compile_system
from femflex.dynamics.channels import channels_of, row_length, row_places
from femflex.dynamics.reports.momenta import momenta_channels
from femflex.system import Environment, Frame, Load, Orbit, Spring, System, knife_edge, revolute, rolling_disc, turns

H = 1e-5  # s, of central differences: errors of 1e-9
G = np.array([0.4, -1.1, 0.7])


def rotation(e: np.ndarray) -> np.ndarray:
    return Rotation.from_quat(np.roll(e, -1, axis=-1)).as_matrix()


@pytest.mark.parametrize("seed", [2, 5])
def test_a_row_holds_the_mechanics_of_its_points(seed):
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
    for path, channel in model.channels.items():
        assert seen[path].shape == (3, *channel.shape), path
    mass = kinetic = 0.0
    first, momentum, moments = np.zeros((3, 3))
    elastic = 0.0
    for name, (dm, rho, phi) in clouds.items():
        C, delta = rotation(seen[f"bodies/{name}/attitude"]), seen[f"bodies/{name}/delta"]
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
    angles = seen["attitude/angles"][1]
    np.testing.assert_allclose(Rotation.from_euler("XZY", angles).as_matrix(), C, atol=1e-10)


def test_rows_are_as_long_as_their_channels_and_each_number_has_one_place():
    system, _, _ = random_tree(4, n_bodies=5)
    for changed in (system, replace(system, environment=Environment(G)), replace(system, loads=(Load("p", "body0"),))):
        taken = np.zeros(row_length(changed), int)
        for place in row_places(changed).values():
            taken[place] += 1
        assert taken.max() == 1
        assert set(row_places(changed)) <= set(channels_of(changed))


def test_channels_say_what_they_are_in_words_units_and_axes():
    system, _, _ = random_tree(4, n_bodies=3)
    root = system.root
    other = next(name for name in system.order if name != root)
    system = replace(
        system, momenta=True, frame=Frame("inertial"), libration_sequence="extrinsic zxz",
        loops=(revolute(other, root, name="cut"),),
        constraints=(rolling_disc("disc", other, 0.5, marker="b"), knife_edge("edge", root, [1, 0, 0])),
    )  # fmt: skip
    found = channels_of(system)
    angles = found["attitude/angles"]
    assert angles.unit == "rad" and angles.names == ("z1", "x2", "z3")
    assert angles.description == f"attitude of {root} from the inertial frame, extrinsic zxz"
    assert found["q"].names == tuple(n for n, _ in system.coordinate_names())
    assert found["u"].unit == ", ".join(unit for _, unit in system.velocity_names())
    assert found["loops/cut/torque"].description == f"its torque on {other} about {other}.origin"
    assert found["constraints/disc/force"].description == f"force of the constraint on {other}"
    assert found["constraints/disc/torque"].description == f"its torque on {other} about {other}.b"
    assert found["constraints/edge/place"].description.startswith(f"where {root} touches")
    assert found[f"bodies/{root}/position"].description == f"origin of {root} from the inertial origin"
    assert found["monitors/kinetic"].description == "kinetic energy" and "monitors/gravity" not in found
    units = {"m/s": "kg m/s", "rad/s": "kg m^2/s", "kg^1/2 m/s": "kg^1/2 m/s"}
    wanted = ", ".join(units[unit] for _, unit in system.velocity_names())
    assert found["momenta"].unit == wanted == momenta_channels(system)["momenta"].unit
    assert momenta_channels(replace(system, momenta=False)) == {}


def test_channels_of_an_orbit_are_those_of_pitch_yaw_and_roll_and_of_its_kind():
    system, _, _ = random_tree(4, n_bodies=1)
    body = system.bodies[system.root]
    free_body = System(
        {"craft": body}, (turns("craft"),), orbit=Orbit(7e6), frame=Frame("orbital"), libration_sequence="zxy"
    )
    found = channels_of(free_body)
    assert found["attitude/angles"].names == ("roll", "pitch", "yaw")
    assert found["attitude/angles"].description == "attitude of craft from the orbital frame, intrinsic zxy"
    assert found["bodies/craft/position"].description == "origin of craft from O" and "monitors/jacobi" in found
    assert found["monitors/kinetic"].description == "kinetic energy relative to O"
    assert found["monitors/gravity"].description == "energy of the gravity gradient"
