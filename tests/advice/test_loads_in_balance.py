"""Loads on a body of a moving tree: they balance, and the field of its inertia is what its points feel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.random_systems import random_tree

from femflex.advice.buckling.applied_forces import RigidMotion
from femflex.advice.buckling.applied_load import AppliedLoad, skew
from femflex.advice.buckling.applied_loads import OWN, applied_loads
from femflex.advice.buckling.few_shapes import lowest_of_few
from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.terms.without import stiffened
from femflex.rotations import dcm_from_quaternion
from femflex.system import Environment, Load, Spring, System, free, revolute, spherical, weld

ZERO = np.zeros(3)


def tree() -> tuple[System, np.ndarray]:
    """A hub that flies, a boom welded aslant to it, a panel on a hinge at the boom's end, a tip welded to the panel."""
    rng = np.random.default_rng(11)

    def body(mass: float) -> object:
        A = rng.normal(size=(3, 3))
        turned = Rotation.random(3, random_state=int(1e3 * mass)).as_matrix()
        none = np.zeros((3, 0))
        markers = {name: Marker(rng.normal(size=3), none, none, C) for name, C in zip("abc", turned, strict=True)}
        return rigid_body(mass, 0.3 * A @ A.T + 3 * np.eye(3), rng.normal(size=3), markers)

    bodies = {"hub": body(5.0), "boom": body(2.0), "panel": body(1.5), "tip": body(0.7)}
    joints = (
        free("hub"),
        weld("boom", "hub", parent_marker="a", child_marker="b"),
        revolute(
            "panel", "boom", axis=[1.0, 2.0, -1.0], parent_marker="c", child_marker="a", stiffness=[3.0], damping=[0.5]
        ),
        weld("tip", "panel", parent_marker="b", child_marker="c"),
    )
    loads = (
        Load("thrust", "hub", "b", "body", np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.2, -1.0])),
        Load("wind", "tip", "a", "inertial", np.array([0.4, 0.1, 0.9]), np.array([-0.2, 0.1, 0.4])),
        Load("jet", "boom", "a", "marker", np.array([-0.6, 0.2, 0.3]), np.array([0.0, 0.5, 0.1])),
    )
    springs = (Spring("cord", "tip", "hub", "b", "c", stiffness=2.0, length=0.6),)
    system = System(bodies, joints, loads=loads, springs=springs, environment=Environment(np.array([0.3, -0.8, 1.7])))  # type: ignore[arg-type]
    model = compile_system(replace(system, reactions=True))
    states = np.repeat(model.x0[None], 2, axis=0)
    q = model.n_q
    for row in states:
        row[q - 1] = 0.4
        row[q : q + model.n_u] = rng.normal(size=model.n_u)
    return system, states


@pytest.fixture(scope="module")
def moved():
    system, states = tree()
    full = replace(system, reactions=True)
    model = compile_system(full)
    times = np.array([0.0, 1.0])
    return full, model, times, states, applied_loads(full, list(system.bodies), times, states)


def referred(load: AppliedLoad, place: np.ndarray, row: int) -> np.ndarray:
    """Force and torque about the body's origin of what acts at a marker."""
    force, torque = load.values[row].reshape(2, 3)
    return np.concatenate([force, torque + np.cross(place, force)])


@pytest.mark.parametrize("name", ["hub", "boom", "panel", "tip"])
@pytest.mark.parametrize("row", [0, 1])
def test_all_that_acts_on_a_body_and_its_inertia_and_weight_balance(moved, name: str, row: int):
    """The field -(b + W r) dm is the body's own: b + W r is the acceleration of its points less that of free fall."""
    system, model, times, states, found = moved
    body = system.bodies[name]
    total = np.zeros(6)
    for one in found[name]:
        if one.marker is not None:
            total += referred(one, body.marker(one.marker).position, row)
    own = found[name][-1]
    assert own.name == OWN and own.marker is None
    b, W = own.values[row, :3], own.values[row, 3:].reshape(3, 3).T
    moments = body.moments
    s, P = moments.first[0], moments.second[0, :, 0, :]  # int r dm, int r r^T dm
    torque = np.cross(s, b) + np.array(
        [P[1] @ W[2] - P[2] @ W[1], P[2] @ W[0] - P[0] @ W[2], P[0] @ W[1] - P[1] @ W[0]]
    )
    assert total == pytest.approx(np.concatenate([moments.mass * b + W @ s, torque]), rel=1e-8, abs=1e-8)
    # against differences of the motion itself
    rate = model.state_rate(times[row], states[row])
    h = 1e-5
    ends = np.array([states[row] - h * rate, states[row] + h * rate])
    seen = model.observe(np.full(2, times[row]), ends)
    middle = model.observe(times[[row]], states[[row]])
    C = dcm_from_quaternion(middle[f"bodies/{name}/attitude"][0])
    alpha = np.diff(seen[f"bodies/{name}/rate"], axis=0)[0] / (2 * h)
    omega = middle[f"bodies/{name}/rate"][0]
    assert W == pytest.approx(skew(alpha) + skew(omega) @ skew(omega), rel=1e-6, abs=1e-6)
    place = body.marker("a").position
    faster = np.diff(seen[f"markers/{name}.a/velocity"], axis=0)[0] / (2 * h)
    assert b + W @ place == pytest.approx(C.T @ (faster - system.environment.gravity), rel=1e-6, abs=1e-6)


def test_loads_are_named_and_turn_as_their_joints_let_them(moved):
    system, _, _, _, found = moved
    by_name = {name: {one.name: one for one in loads} for name, loads in found.items()}
    assert set(by_name["boom"]) == {
        "its joint 'hub-boom'",
        "load 'jet'",
        "load 'wind' on 'tip'",
        "inertia and weight of the bodies attached at 'c'",
        OWN,
    }
    assert set(by_name["hub"]) == {
        f"its joint {system.joint_of('hub').label!r}",
        "load 'thrust'",
        "spring 'cord'",
        "load 'jet' on 'boom'",
        "load 'wind' on 'tip'",
        "inertia and weight of the bodies attached at 'a'",
        OWN,
    }
    assert set(by_name["panel"]) == {
        "its joint 'boom-panel'",
        "load 'wind' on 'tip'",
        "inertia and weight of the bodies attached at 'b'",
        OWN,
    }
    assert by_name["boom"]["load 'jet'"].follows and not by_name["hub"]["load 'thrust'"].follows
    assert by_name["hub"]["load 'jet' on 'boom'"].follows  # welded on
    assert not by_name["panel"]["load 'wind' on 'tip'"].follows
    stiff = by_name["panel"]["load 'wind' on 'tip'"]
    assert np.linalg.norm(stiff.arm) > 0.1 and not by_name["boom"]["load 'wind' on 'tip'"].arm.any()  # past the hinge
    assert by_name["panel"]["inertia and weight of the bodies attached at 'b'"].inertia[0, 0] == pytest.approx(0.7)
    assert not by_name["boom"]["inertia and weight of the bodies attached at 'c'"].inertia.any()
    assert not by_name["boom"]["inertia and weight of the bodies attached at 'c'"].arm.any()  # it hangs on a hinge
    hung = by_name["hub"]["inertia and weight of the bodies attached at 'a'"]
    assert hung.arm.any()
    assert np.trace(hung.inertia[:3, :3]) == pytest.approx(3 * (2.0 + 1.5 + 0.7))


def test_the_inertia_of_attached_bodies_is_that_of_points_of_mass(moved):
    """2 T of the attached bodies, which turn with the marker, by their masses and inertias; reference at the start."""
    system, model, times, states, found = moved
    (hung,) = (one for one in found["hub"] if one.name.startswith("inertia and weight"))
    seen = model.observe(times[:1], states[:1])
    C_hub = dcm_from_quaternion(seen["bodies/hub/attitude"][0])
    at = seen["bodies/hub/position"][0] + C_hub @ system.bodies["hub"].marker("a").position
    v, w = np.array([0.3, -0.2, 0.7]), np.array([-0.5, 0.4, 0.9])
    twice = 0.0
    for name in ("boom", "panel", "tip"):
        moments = system.bodies[name].moments
        C = dcm_from_quaternion(seen[f"bodies/{name}/attitude"][0])
        c = moments.center_of_mass()
        J = moments.inertia() - moments.mass * (c @ c * np.eye(3) - np.outer(c, c))
        centre = C_hub.T @ (seen[f"bodies/{name}/position"][0] + C @ c - at)
        turned = C.T @ C_hub @ w
        speed = v + np.cross(w, centre)
        twice += moments.mass * speed @ speed + turned @ J @ turned
    x = np.concatenate([v, w])
    assert x @ hung.inertia @ x == pytest.approx(twice, rel=1e-10)
    assert hung.inertia == pytest.approx(hung.inertia.T)


def test_a_load_reads_as_its_size():
    wrench = np.array([[3.0, 4.0, 0, 0, 0, 0], [0, 0, 0, 0, 0.5, 0], [1, 0, 0, 0, 0, 2], [0.0] * 6])
    load = AppliedLoad("x", "m", wrench, wrench)
    assert [load.size(row) for row in range(4)] == ["5 N", "0.5 N m", "1 N and 2 N m", "0 N"]


@pytest.mark.parametrize("row", [0, 1])
def test_turning_a_marker_adds_what_a_force_and_its_arm_say(row: int):
    rng = np.random.default_rng(row)
    wrench, theta = rng.normal(size=(2, 6)), rng.normal(size=3)
    force, torque = wrench[row].reshape(2, 3)
    follows = AppliedLoad("x", "m", wrench, wrench, rng.normal(size=(2, 3)), follows=True)
    added = follows.turning(row) @ np.concatenate([ZERO, theta])
    assert added == pytest.approx(np.concatenate([np.cross(theta, force), np.cross(theta, torque)]))
    arm = rng.normal(size=(2, 3))
    still = AppliedLoad("x", "m", wrench, wrench, arm).turning(row)
    assert theta @ still[3:, 3:] @ theta == pytest.approx(theta @ np.cross(np.cross(theta, arm[row]), force))
    assert still == pytest.approx(still.T) and not still[:3].any()
    constant = AppliedLoad("x", "m", wrench, wrench, arm[:1]).turning(row)
    assert theta @ constant[3:, 3:] @ theta == pytest.approx(theta @ np.cross(np.cross(theta, arm[0]), force))
    assert not AppliedLoad("x", None, np.zeros((2, 12)), wrench).turning(row).any()


def test_a_loop_passes_its_force_on_to_both_bodies_about_their_own_places():
    """Two arms on hinges, their ends joined: the sum of what the loop does to both is nothing, about any point."""
    body = rigid_body(1.0, np.eye(3), [0.5, 0.1, 0.2], {"end": Marker.rigid([1.0, 0.0, 0.0])})
    loop = replace(spherical("two", "one", parent_marker="end", child_marker="end"))
    system = System(
        {"one": body, "two": body},
        (revolute("one", axis=[0, 0, 1]), revolute("two", axis=[0, 0, 1])),
        loops=(loop,),
        environment=Environment(np.array([0.0, -3.0, 0.0])),
        reactions=True,
    )
    model = compile_system(system)
    motion = RigidMotion(system, np.zeros(1), model.observe(np.zeros(1), model.x0[None]))
    ties = [one for one in motion.pushes if not one.load]
    assert [one.body for one in ties] == ["two", "one"] and [one.held for one in ties] == [3, 3]
    assert sum(one.about(np.array([[0.3, 0.7, -0.2]])) for one in ties) == pytest.approx(np.zeros((1, 6)), abs=1e-9)


def test_the_lowest_of_few_is_that_of_the_pencil_and_held_directions_are_stiff():
    rng = np.random.default_rng(8)
    A, S = rng.normal(size=(2, 4, 4))
    K, S = A @ A.T + 4 * np.eye(4), S + S.T
    mu, x = lowest_of_few(S, K, None)
    assert mu == pytest.approx(np.linalg.eigvals(np.linalg.solve(K, S)).real.min()) and x @ K @ x == pytest.approx(1.0)
    d = np.array([0.0, 1.0, 0.0, 0.0])
    held, y = lowest_of_few(S, K, np.outer(d, d))
    rest = [0, 2, 3]
    wanted = np.linalg.eigvals(np.linalg.solve(K[np.ix_(rest, rest)], S[np.ix_(rest, rest)])).real.min()
    assert held == pytest.approx(wanted, rel=2e-2) and abs(y[1]) < 0.05 * np.abs(y).max()
    assert lowest_of_few(-1e-10 * K, K, None)[0] == 0.0


def test_a_random_tree_reports_every_body_once():
    system, _, _ = random_tree(4, 4, root=free, most=1)
    rigid = replace(stiffened(system, set(system.bodies)), reactions=True)
    model = compile_system(rigid)
    found = applied_loads(rigid, list(rigid.bodies), np.zeros(1), model.x0[None])
    assert list(found) == list(rigid.bodies)
    for name, loads in found.items():
        attached = {joint.parent_marker for joint in rigid.joints if joint.parent == name}
        assert {one.marker for one in loads if one.name.startswith("inertia")} == attached
