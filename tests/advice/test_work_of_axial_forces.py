"""What linear strain leaves out of bodies, against clouds of points of mass: the work of all that acts on them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.random_systems import random_tree

from femflex.advice.stiffening import OmittedStiffness, StiffeningWatch, attached_masses, lowest_frequency
from femflex.advice.strain import pendulum_stiffening
from femflex.body import FlexibleBody, Foreshortening, Marker, MassMoments, StrainTensors, rigid_body
from femflex.dynamics import compile_system
from femflex.rotations import dcm_from_quaternion
from femflex.system import Environment, Frame, Load, Orbit, System, free, revolute, spherical, weld
from femflex.warning import PhysicsWarning

GRAVITY = Environment(np.array([0.7, -1.1, 2.3]))
CASES = {
    "free": (free, {}, (), True),
    "free, with weight": (free, {"environment": GRAVITY}, (), True),
    "hinged, with weight": (revolute, {"environment": GRAVITY}, (), False),
    "in orbit": (spherical, {"orbit": Orbit(7.1e6, inclination=0.4), "frame": Frame("inertial")}, (), False),
}


def loads_on(names: list[str], rng: np.random.Generator) -> tuple[Load, ...]:
    frames = ("inertial", "body", "inertial", "body")
    return tuple(
        Load(f"l{k}", name, str(rng.choice(["a", "b", "c"])), frame, rng.normal(size=3))
        for k, (name, frame) in enumerate(zip([*names, names[0]], frames, strict=False))
    )


def carried_by(system: System, name: str) -> list[str]:
    """A body and all that stand on it."""
    out = [name]
    for joint in system.joints:
        if joint.parent == name:
            out += carried_by(system, joint.child)
    return out


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", [2, 5])
def test_the_gain_is_the_work_of_forces_and_inertia_on_the_foreshortening(name: str, seed: int):
    """- sum f.theta over the points of the body, the bodies at its markers, its own joint and its loads."""
    root, more, _, free_root = CASES[name]
    system, clouds, (q, u) = random_tree(seed, 4, root=root, **more)
    rng = np.random.default_rng(seed)
    system = replace(system, loads=loads_on(list(system.bodies), rng))
    model = compile_system(system)
    at = 0
    for body in system.order:  # bodies are not deformed
        at += system.joint_of(body).n_q
        q[at : at + system.bodies[body].n_modes] = 0.0
        at += system.bodies[body].n_modes
    x = model.x0.copy()
    x[: model.n_q], x[model.n_q : model.n_q + model.n_u] = q, u
    seen = model.observe(np.zeros(1), x[None])
    theta = {body: rng.normal(size=(7, 3)) for body in system.bodies}
    at_marker = {body: {one: rng.normal(size=3) for one in ("a", "b", "c")} for body in system.bodies}
    known = {}
    for body, (mass, rho, _) in clouds.items():
        z = np.column_stack([np.ones(7), rho])
        known[body] = Foreshortening(np.einsum("p,pz,pa->za", mass, z, theta[body]), at_marker[body])
    found = OmittedStiffness(system, known).gains(seen)

    C = {body: dcm_from_quaternion(seen[f"bodies/{body}/attitude"][0]) for body in system.bodies}
    origin = seen["monitors/center_of_mass"][0] if free_root or system.orbit else np.zeros(3)
    points = {b: seen[f"bodies/{b}/position"][0] - origin + clouds[b][1] @ C[b].T for b in system.bodies}
    g = system.environment.gravity
    force = {body: np.zeros(3) for body in system.bodies}
    for load in system.loads:
        force[load.body] += load.force if load.frame == "inertial" else C[load.body] @ load.force
    whole = sum(mass.sum() for mass, _, _ in clouds.values())
    away = sum(force.values()) / whole + g if free_root else np.zeros(3)
    tide = np.zeros((3, 3))
    if system.orbit is not None:
        up = dcm_from_quaternion(seen["orbit/attitude"][0])[:, 1]
        tide = -system.orbit.mu / seen["orbit/radius"][0] ** 3 * (np.eye(3) - 3 * np.outer(up, up))
    for body in system.bodies:
        omega = C[body] @ seen[f"bodies/{body}/rate"][0]

        def pushed(of: str, omega: np.ndarray = omega) -> np.ndarray:
            """Force (7, 3) on the points of mass in the frame that turns at omega: weight, tide, and inertia."""
            r = points[of]
            inertia = np.cross(omega, np.cross(omega, r)) - r @ tide + away - g
            return -clouds[of][0][:, None] * inertia

        work = np.sum(pushed(body) * (theta[body] @ C[body].T))
        for joint in system.joints:
            if joint.parent == body:
                on = sum(pushed(b).sum(axis=0) + force[b] for b in carried_by(system, joint.child))
                work += on @ C[body] @ at_marker[body][joint.parent_marker]
        all_on = sum(pushed(b).sum(axis=0) + force[b] for b in carried_by(system, body))
        work -= all_on @ C[body] @ at_marker[body][system.joint_of(body).child_marker]
        for load in system.loads:
            if load.body == body:
                own = load.force if load.frame == "body" else C[body].T @ load.force
                work += own @ at_marker[body][load.marker]
        assert found[body] == pytest.approx([-work], rel=1e-9, abs=1e-9), body


def test_rows_are_taken_one_by_one_and_bodies_without_foreshortening_left_out():
    system, _, _ = random_tree(3, 4, root=free)
    names = list(system.bodies)
    rng = np.random.default_rng(1)
    theta = Foreshortening(rng.normal(size=(4, 3)), {"a": rng.normal(size=3), "b": rng.normal(size=3)})
    stiffness = OmittedStiffness(system, {names[1]: theta, names[2]: None})
    model = compile_system(system)
    states = model.x0 + 0.3 * rng.normal(size=(3, model.n_x))
    together = stiffness.gains(model.observe(np.zeros(3), states))
    assert list(together) == [names[1]] and together[names[1]].shape == (3,)
    for k in range(3):
        alone = stiffness.gains(model.observe(np.zeros(1), states[[k]]))
        assert together[names[1]][k] == pytest.approx(alone[names[1]][0], rel=1e-12)
    assert OmittedStiffness(system, {}).gains({}) == {}


def boom(k: float = 5.0, mass: float = 2.0) -> FlexibleBody:
    """A body of one shape of stiffness k and mass 3, whose marker "tip" moves 0.5 along y per unit of it.

    Its foreshortening is along x, -0.4 / k at its tip, and of all its mass, at x = 1.5, -0.3 / k.
    """
    second = np.zeros((2, 3, 2, 3))
    second[0, 0, 0, 0] = mass * 3.0
    second[1, 1, 1, 1] = 3.0
    moments = MassMoments(mass, np.array([[mass * 1.5, 0, 0], [0, 0.6, 0]]), second)
    theta = np.zeros((4, 3))
    theta[0, 0], theta[1, 0] = -0.3 * mass / k, -0.3 * 1.5 * mass / k
    marker = Marker(np.array([3.0, 0, 0]), np.array([[0.0], [0.5], [0.0]]), np.zeros((3, 1)))
    return FlexibleBody(
        moments,
        StrainTensors.linear(np.array([[k]])),
        np.zeros((1, 1)),
        {"tip": marker},
        foreshortening=Foreshortening(theta, {"tip": np.array([-0.4 / k, 0.0, 0.0])}),
        omega=np.array([np.sqrt(k / 3)]),
    )


def test_the_lowest_frequency_is_that_with_point_masses_at_all_markers():
    rng = np.random.default_rng(4)
    A, B = rng.normal(size=(2, 3, 3))
    second = np.zeros((4, 3, 4, 3))
    second[1:, 0, 1:, 0] = B @ B.T + np.eye(3)
    markers = {
        name: Marker(rng.normal(size=3), rng.normal(size=(3, 3)), rng.normal(size=(3, 3))) for name in ("a", "b")
    }
    body = FlexibleBody(
        MassMoments(1.0, np.zeros((4, 3)), second), StrainTensors.linear(A @ A.T + np.eye(3)), np.zeros((3, 3)), markers
    )
    M = B @ B.T + np.eye(3) + sum(m * markers[n].phi.T @ markers[n].phi for n, m in (("a", 2.0), ("b", 0.7)))
    wanted = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, A @ A.T + np.eye(3))).real.min())
    assert lowest_frequency(body, {"a": 2.0, "b": 0.7}) == pytest.approx(wanted)


def test_masses_at_one_marker_and_at_two_are_summed_marker_by_marker():
    bodies = {
        name: rigid_body(m, np.eye(3), markers={"p": Marker.rigid([1, 0, 0]), "q": Marker.rigid([0, 1, 0])})
        for name, m in (("a", 1.0), ("b", 2.0), ("c", 4.0), ("d", 8.0), ("e", 16.0))
    }
    joints = (
        free("a"),
        weld("b", "a", parent_marker="p"),
        weld("c", "a", parent_marker="q"),
        weld("d", "a", parent_marker="p"),
        weld("e", "c", parent_marker="q"),
    )
    system = System(bodies, joints)
    assert attached_masses(system, "a") == {"p": 10.0, "q": 20.0} and attached_masses(system, "c") == {"q": 16.0}


@pytest.mark.parametrize("carried", [0.0, 1.5])
def test_a_boom_on_a_hinge_is_said_to_stiffen_by_its_spin_with_both_frequencies(carried: float):
    """Spin w about z through the hinge: theta works against m w^2 r, with the mass at the tip, 3 from it."""
    bodies = {"boom": boom()}
    joints = [revolute("boom", axis=[0, 0, 1], q0=[0.0], u0=[1.2])]
    if carried:
        bodies["load"] = rigid_body(carried, np.eye(3))
        joints.append(weld("load", "boom", parent_marker="tip"))
    model = compile_system(System(bodies, tuple(joints)))
    guard = StiffeningWatch(model)
    x = model.x0.copy()
    x[model.n_q] = 1.2
    guard.watch(model.observe(np.zeros(1), x[None]))
    gain = 1.2**2 * (0.3 * 1.5 * 2.0 + carried * 3.0 * 0.4) / 5.0
    omega = np.sqrt(5.0 / (3.0 + carried * 0.25))
    hertz = omega / (2 * np.pi)
    with pytest.warns(PhysicsWarning) as told:
        guard.warn("turned at")
    more = f", clamped, with the {carried:.4g} kg that it carries" if carried else ""
    (text,) = (str(one.message) for one in told)
    raised = np.sqrt(1 + gain) - 1
    assert text == (
        f"body 'boom' turned at 1.2 rad/s: a stiffening of {raised:.0%} of its first frequency ({hertz:.4g} Hz, not "
        f"{hertz * (1 + raised):.4g} Hz{more}) is left out by linear strain. Give it strain = 'condensed'."
    )


def test_a_boom_that_a_load_stretches_or_presses_is_told_so():
    def said(force: float) -> list[str]:
        load = Load("pull", "boom", "tip", "body", np.array([force, 0.0, 0.0]))
        model = compile_system(System({"boom": boom()}, (weld("boom"),), loads=(load,)))
        guard = StiffeningWatch(model)
        guard.watch(model.observe(np.zeros(1), model.x0[None]))
        with pytest.warns(PhysicsWarning) as told:
            guard.warn()
        return [str(one.message) for one in told]

    (pulled,) = said(6.0)  # 6 (0.4 / 5) = 0.48
    assert pulled.startswith(
        "body 'boom' is stretched by loads or weight: a stiffening of 22% of its first frequency ("
    )
    (pressed,) = said(-6.0)
    assert pressed == (
        f"body 'boom' was compressed, by loads or inertia, so that its first frequency "
        f"({np.sqrt(5 / 3) / (2 * np.pi):.4g} "
        f"Hz, not {np.sqrt(0.52 * 5 / 3) / (2 * np.pi):.4g} Hz) falls by {1 - np.sqrt(0.52):.0%}, which linear strain "
        "leaves out. Give it strain = 'condensed', or divide it into several bodies, welded to each other."
    )
    (buckled,) = said(-20.0)
    assert "by loads or inertia, up to 1.6 of its first buckling load, which linear strain leaves out. Give" in buckled


def test_of_segments_the_worst_is_named_and_none_is_said_to_be_pressed():
    body = boom()
    system = System(
        {"s1": body, "s2": body, "hub": rigid_body(1.0, np.eye(3))},
        (free("hub"), weld("s1", "hub"), weld("s2", "s1", parent_marker="tip")),
        segments={"wing": ("s1", "s2")},
    )
    guard = StiffeningWatch(compile_system(system))
    for rows in (
        {"s1": np.array([0.1, 0.2]), "s2": np.array([0.69, -0.5])},
        {"s1": np.array([0.3, 0.0]), "s2": np.array([0.1, 0.0])},
    ):
        guard._ignored = SimpleNamespace(gains=lambda seen, rows=rows: rows)
        guard.watch({f"bodies/{name}/rate": np.array([[3.0, 0.0, 4.0], [0.0, 1.0, 0.0]]) for name in ("s1", "s2")})
    with pytest.warns(PhysicsWarning) as told:
        guard.warn()
    (text,) = (str(one.message) for one in told)
    assert text == (
        "body 'wing' turned at up to 5 rad/s: a stiffening of 30% of the first shape of its segment 's2' is left "
        "out by "
        "linear strain within segments; limit 2%. Cut it into more than 2 segments, or give it strain = 'condensed'."
    )


def test_gravity_in_the_worst_direction_counts_for_bodies_that_may_turn():
    """Hung by its root a boom has the gain g (0.3 m + 0.4 m_tip) / k, less that of its own joint; none if welded."""
    bodies = {"boom": boom(), "load": rigid_body(1.5, np.eye(3))}
    gravity = Environment(np.array([1.0, -2.0, 2.0]))
    turning = System(
        bodies, (revolute("boom", axis=[0.3, 1, 0]), weld("load", "boom", parent_marker="tip")), environment=gravity
    )
    found = pendulum_stiffening(turning)
    assert found == pytest.approx({"boom": 3.0 * (0.3 * 2.0 + 0.4 * 1.5) / 5.0})
    fixed = replace(turning, joints=(weld("boom"), turning.joints[1]))
    assert pendulum_stiffening(fixed) == {} and pendulum_stiffening(replace(turning, environment=Environment())) == {}
