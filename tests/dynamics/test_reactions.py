"""Forces in joints, terms of constraints and springs, and what can be switched off, against balances by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.mechanisms import bar, flexible_four_bar, four_bar, sleigh
from support.random_loops import random_loops
from support.random_systems import random_body, random_tree

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.system import Friction, Load, Profile, Spring, System, cylindrical, free, prismatic, revolute, weld


def turned(out, body):
    return Rotation.from_quat(out[f"bodies/{body}/attitude"], scalar_first=True)


def momenta(model, x, body):
    """Momentum and angular momentum of a rigid body about the inertial origin."""
    out = model.observe(np.zeros(1), x[None])
    C, m = turned(out, body).as_matrix()[0], model.system.bodies[body].moments
    marker = model.system.bodies[body].marker("middle")
    v = out[f"markers/{body}.middle/velocity"][0]
    c = out[f"markers/{body}.middle/position"][0]
    s = marker.position
    J = m.inertia() - m.mass * (s @ s * np.eye(3) - np.outer(s, s))
    return m.mass * v, np.cross(c, m.mass * v) + C @ J @ out[f"bodies/{body}/rate"][0]


def with_middle(body):
    return replace(body, markers={**body.markers, "middle": Marker.rigid(body.moments.center_of_mass())})


def chain():
    """Three bars in space under weight, hinged about different axes, the second hinge with a spring and a damper."""
    bodies = {name: with_middle(bar(1.0 + 0.2 * k, 1.0 + k)) for k, name in enumerate("abc")}
    joints = (
        revolute("a", axis=(0, 1, 0.3), q0=[0.4], u0=[1.0], name="first"),
        revolute(
            "b",
            "a",
            parent_marker="end",
            axis=(0, 0, 1),
            q0=[-0.7],
            u0=[2.0],
            name="second",
            stiffness=[3.0],
            damping=[0.2],
        ),
        revolute("c", "b", parent_marker="end", axis=(1, 1, 0), q0=[0.9], u0=[-1.5], name="third"),
    )
    loads = tuple(
        Load(f"weight_{k}", k, "middle", "inertial", force=[0, 0, -9.81 * bodies[k].moments.mass]) for k in "abc"
    )
    return System(bodies, joints, loads=loads, reactions=True)


def rates_of(model, x, quantity, h=1e-4):
    """Time derivative of a function of the state along the motion, by the sixth-order central difference."""
    states = {0: x}
    for sign in (1, -1):
        times = sign * h * np.arange(4)
        if sign > 0:
            found = Dop853(rtol=1e-13, atol=1e-14).solve(model, times, x).states
        else:
            found = [x]
            for _ in range(3):
                y, dt = found[-1], -h
                k1 = model.state_rate(0, y)
                k2 = model.state_rate(0, y + dt / 2 * k1)
                k3 = model.state_rate(0, y + dt / 2 * k2)
                k4 = model.state_rate(0, y + dt * k3)
                found.append(y + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        states |= {sign * k: found[k] for k in range(1, 4)}
    return sum(w * (quantity(states[k]) - quantity(states[-k])) for k, w in ((1, 45), (2, -9), (3, 1))) / (60 * h)


@pytest.mark.parametrize("body", ["a", "b", "c"])
def test_each_body_moves_as_the_forces_in_its_joints_say(body):
    model = compile_system(chain())
    out = model.observe(np.zeros(1), model.x0[None])
    joints = {"a": ("first", "second"), "b": ("second", "third"), "c": ("third", None)}
    own, next_ = joints[body]
    weight = np.array([0, 0, -9.81 * model.system.bodies[body].moments.mass])
    r, c = out[f"bodies/{body}/position"][0], out[f"markers/{body}.middle/position"][0]
    force = out[f"joints/{own}/force"][0] + weight
    torque = out[f"joints/{own}/torque"][0] + np.cross(r, out[f"joints/{own}/force"][0]) + np.cross(c, weight)
    if next_:
        end = out[f"markers/{body}.end/position"][0]
        force = force - out[f"joints/{next_}/force"][0]
        torque = torque - out[f"joints/{next_}/torque"][0] - np.cross(end, out[f"joints/{next_}/force"][0])
    dp, dL = (rates_of(model, model.x0, lambda x, i=i: momenta(model, x, body)[i]) for i in (0, 1))
    assert force == pytest.approx(dp, abs=1e-6)
    assert torque == pytest.approx(dL, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_the_torque_in_a_joint_is_about_its_marker_where_that_has_bent_to(seed):
    """Momentum and angular momentum about the moving centre of mass of a flexible body that one hinge holds."""
    rng = np.random.default_rng(seed)
    body, _ = random_body(rng, 3)
    hinge = revolute("body", axis=rng.normal(size=3), child_marker="b", stiffness=[2.0], damping=[0.1], name="hinge")
    model = compile_system(System({"body": body}, (hinge,), reactions=True))
    x = rng.normal(size=model.n_x)

    def seen(key):
        return lambda state: model.observe(np.zeros(1), state[None])[key][0]

    force, torque = seen("joints/hinge/force")(x), seen("joints/hinge/torque")(x)
    arm = seen("markers/body.b/position")(x) - seen("monitors/center_of_mass")(x)
    dp, dL = (rates_of(model, x, seen(f"monitors/{key}")) for key in ("momentum", "angular_momentum"))
    assert np.linalg.norm(seen("markers/body.b/deflection")(x)) > 0.1
    assert force == pytest.approx(dp, abs=1e-6 * np.abs(dp).max())
    assert torque + np.cross(arm, force) == pytest.approx(dL, abs=1e-6 * np.abs(dL).max())


def test_channels_of_joints_have_the_units_of_what_they_are():
    """Of slides N, m, m/s and J; of turns N m, rad, rad/s and J; of whatever a joint carries N and N m."""
    body = bar(1.0)
    drag = Friction(limit=0.1)
    system = System(
        {name: body for name in ("slider", "arm", "both", "hand")},
        (
            prismatic("slider", motion=(Profile.constant(0.0),), name="rail"),
            revolute("arm", "slider", motion=(0.3,), name="elbow"),
            cylindrical("both", "arm", motion=(0.1, 0.2), name="screw"),
            cylindrical("hand", "both", laws=(drag, replace(drag, freedom=1)), name="wrist"),
        ),
        reactions=True,
    )
    units = {path: channel.unit for path, channel in compile_system(system).channels.items()}
    for name in ("rail", "elbow", "screw", "wrist"):
        assert (units[f"joints/{name}/force"], units[f"joints/{name}/torque"]) == ("N", "N m")
    assert [units[f"joints/{name}/drive"] for name in ("rail", "elbow", "screw")] == ["N", "N m", "N, N m"]
    assert [units[path] for path in sorted(units) if path.startswith("laws/wrist")] == ["N", "N m"]
    assert units["monitors/drive_power"] == units["monitors/dissipation"] == "W"
    assert units["q"].split(", ") == ["m", "rad", "m", "rad", "m", "rad"]
    assert units["u"].split(", ") == ["m/s", "rad/s"] * 3


def test_torque_along_a_free_axis_is_that_of_its_spring_and_damper():
    model = compile_system(chain())
    out = model.observe(np.zeros(1), model.x0[None])
    axis = turned(out, "b").apply([0, 0, 1.0])[0]
    assert out["joints/second/torque"][0] @ axis == pytest.approx(3.0 * 0.7 - 0.2 * 2.0, abs=1e-12)
    axis = turned(out, "c").apply(np.array([1, 1, 0]) / np.sqrt(2))[0]
    assert out["joints/third/torque"][0] @ axis == pytest.approx(0.0, abs=1e-12)


def test_closed_loop_and_tree_joints_balance_a_flexible_four_bar():
    """Momentum of everything but the ground changes by what the two joints to the ground pass on."""
    model = compile_system(replace(flexible_four_bar(), reactions=True))
    times = np.linspace(0, 0.05, 801)  # fine compared with the third bending mode, 970 rad/s
    states = Dop853().solve(model, times, model.x0).states
    out = model.observe(times, states)
    labels = [model.system.joint_of(name).label for name in ("crank", "rocker")]
    force = sum(out[f"joints/{label}/force"] for label in labels)
    h, p = times[1], out["monitors/momentum"]
    rate = (45 * (p[4:-2] - p[2:-4]) - 9 * (p[5:-1] - p[1:-5]) + (p[6:] - p[:-6])) / (60 * h)
    assert force[3:-3] == pytest.approx(rate, abs=2e-5 * np.abs(rate).max())
    rocker = out[f"joints/{labels[1]}/force"] + out["loops/closure/force"]  # all that acts on the rocker
    middle = turned(out, "rocker").apply([0.6, 0, 0]) + out["bodies/rocker/position"]
    acceleration = np.gradient(np.gradient(middle, h, axis=0, edge_order=2), h, axis=0, edge_order=2)
    assert rocker[20:-20] == pytest.approx(acceleration[20:-20], abs=5e-3 * np.abs(acceleration).max())


def test_forces_in_joints_do_no_work_but_along_their_freedoms():
    model = compile_system(replace(four_bar(speed=3.0), reactions=True))
    times = np.linspace(0, 1, 11)
    out = model.observe(times, Dop853().solve(model, times, model.x0).states)
    for label in [joint.label for joint in model.system.joints if joint.n_u == 1]:
        assert out[f"joints/{label}/torque"][:, 2] == pytest.approx(np.zeros(11), abs=1e-10)


def closed(terms):
    rows = np.array(list(terms.values()))
    return np.abs(rows.sum(axis=0)).max() <= 1e-10 * np.abs(rows).max()


@pytest.mark.parametrize("seed", range(4))
def test_terms_with_loops_sum_to_zero(seed):
    system, _, (q, u) = random_loops(seed, 2)
    model = compile_system(system)
    x = np.concatenate([q, u])
    model.project(0.0, x, model.table, model.pool, model.work)
    found = model.terms(np.zeros(1), x[None])
    assert {"loops/loop0", "loops/loop1"} <= set(found)
    assert closed(found)


def test_terms_with_a_knife_edge_and_a_spring_sum_to_zero_and_the_edge_gives_no_power():
    start = sleigh(1.7)
    spring = Spring("tether", "body", stiffness=4.0, damping=0.5, length=0.3)
    body = start.bodies["body"]
    hook = replace(body, markers={**body.markers, "hook": Marker.rigid([0.5, 0.1, 0])})
    system = replace(start, bodies={"body": hook}, springs=(replace(spring, marker="hook"),))
    model = compile_system(system)
    times = np.linspace(0, 1, 6)
    states = Dop853().solve(model, times, model.x0).states
    found = model.terms(times, states)
    assert closed(found)
    power = np.sum(found["constraints/blade"] * states[:, model.n_q :], axis=1)
    assert power == pytest.approx(np.zeros(6), abs=1e-11)
    assert np.abs(found["springs/tether"]).max() > 0.1


def test_terms_of_springs_between_bodies_of_a_random_tree_sum_to_zero():
    system, _, (q, u) = random_tree(3)
    names = list(system.bodies)
    springs = (
        Spring("s", names[0], names[1], "a", "b", 3.0, 0.7, 0.2),
        Spring("t", names[2], None, "a", stiffness=2.0),
    )
    model = compile_system(replace(system, springs=springs))
    assert closed(model.terms(np.zeros(1), np.concatenate([q, u])[None]))
    without = model.without("s", "t")
    assert without.system.springs == ()


def test_a_driven_crank_needs_the_torque_that_its_reaction_shows():
    """A held freedom in a closed loop: drive torque, force in the joint and power balance."""
    system = four_bar(speed=3.0)
    joints = tuple(
        replace(j, motion=(Profile.polynomial(0.3, 3.0, 0.4),)) if j.label == "drive" else j for j in system.joints
    )
    model = compile_system(replace(system, joints=joints, reactions=True))
    times = np.linspace(0, 1, 401)
    states = Dop853().solve(model, times, model.x0).states
    out = model.observe(times, states)
    drive = out["joints/drive/drive"][:, 0]
    assert drive == pytest.approx(out["joints/drive/torque"][:, 2], abs=1e-9 * np.abs(drive).max())
    energy, power = out["monitors/energy"], out["monitors/drive_power"]
    h = times[1]
    rate = (45 * (energy[4:-2] - energy[2:-4]) - 9 * (energy[5:-1] - energy[1:-5]) + energy[6:] - energy[:-6]) / (
        60 * h
    )
    assert power[3:-3] == pytest.approx(rate, abs=1e-5 * np.abs(rate).max())
    assert out["monitors/constraint_position"].max() < 1e-11
    assert closed(model.terms(times[:3], states[:3]))


def test_a_loop_can_be_switched_off_from_the_same_start():
    model = compile_system(four_bar(speed=3.0))
    free_ = model.without("closure")
    assert free_.constraints is None and free_.omitted == ("loops/closure",)
    assert free_.x0 == pytest.approx(model.x0)


def test_springs_between_markers_count_in_the_highest_frequency():
    anchor = rigid_body(1.0, np.eye(3), markers={"nail": Marker.rigid([0, 0, 2.0])})
    ball = rigid_body(2.0, 0.1 * np.eye(3))
    spring = Spring("s", "ball", "anchor", parent_marker="nail", stiffness=50.0, length=1.0)
    system = System(
        {"anchor": anchor, "ball": ball}, (weld("anchor"), free("ball", q0=[0, 0, 1.0, 1, 0, 0, 0])), springs=(spring,)
    )
    assert compile_system(system).max_frequency == pytest.approx(5.0, rel=1e-5)
