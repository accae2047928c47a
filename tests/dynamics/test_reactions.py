"""Forces in joints, terms of constraints and springs, and what can be switched off, against balances by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.mechanisms import bar, flexible_four_bar
from support.random_systems import random_body

from femflex.body import Marker
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.system import Load, System, revolute


def attitude_of(out, body):
    return Rotation.from_quat(out[f"bodies/{body}/attitude"], scalar_first=True)


def momenta(model, x, body):
    """Momentum and angular momentum of a rigid body about the inertial origin."""
    out = model.observe(np.zeros(1), x[None])
    C, m = attitude_of(out, body).as_matrix()[0], model.system.bodies[body].moments
    marker = model.system.bodies[body].marker("middle")
    v = out[f"markers/{body}.middle/velocity"][0]
    c = out[f"markers/{body}.middle/position"][0]
    s = marker.position
    J = m.inertia() - m.mass * (s @ s * np.eye(3) - np.outer(s, s))
    return m.mass * v, np.cross(c, m.mass * v) + C @ J @ out[f"bodies/{body}/rate"][0]


def with_middle(body):
    return replace(body, markers={**body.markers, "middle": Marker.at_position(body.moments.center_of_mass())})


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
def test_joint_forces_balance_momentum_of_each_body(body):
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
def test_joint_torque_is_about_deflected_marker(seed):
    """Momentum and angular momentum about the moving centre of mass of a flexible body that one hinge holds."""
    rng = np.random.default_rng(seed)
    body, _ = random_body(rng, 3)
    hinge = revolute("body", axis=rng.normal(size=3), child_marker="b", stiffness=[2.0], damping=[0.1], name="hinge")
    model = compile_system(System({"body": body}, (hinge,), reactions=True))
    x = rng.normal(size=model.n_x)

    def channel(key):
        return lambda state: model.observe(np.zeros(1), state[None])[key][0]

    force, torque = channel("joints/hinge/force")(x), channel("joints/hinge/torque")(x)
    arm = channel("markers/body.b/position")(x) - channel("monitors/center_of_mass")(x)
    dp, dL = (rates_of(model, x, channel(f"monitors/{key}")) for key in ("momentum", "angular_momentum"))
    assert np.linalg.norm(channel("markers/body.b/deflection")(x)) > 0.1
    assert force == pytest.approx(dp, abs=1e-6 * np.abs(dp).max())
    assert torque + np.cross(arm, force) == pytest.approx(dL, abs=1e-6 * np.abs(dL).max())


def test_joint_and_loop_forces_balance_flexible_four_bar():
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
    middle = attitude_of(out, "rocker").apply([0.6, 0, 0]) + out["bodies/rocker/position"]
    acceleration = np.gradient(np.gradient(middle, h, axis=0, edge_order=2), h, axis=0, edge_order=2)
    assert rocker[20:-20] == pytest.approx(acceleration[20:-20], abs=5e-3 * np.abs(acceleration).max())
