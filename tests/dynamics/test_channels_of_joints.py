"""What joints report that are locked, prescribed, latched and damped, several at once; bodies between two ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.random_systems import random_body

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.constraints.conflicts import bodies_between, held_freedoms
from femflex.dynamics.joints.held_places import held_places
from femflex.dynamics.joints.law_report import is_damped, latch_places, law_channels, law_places
from femflex.dynamics.terms.prescribed_motion_report import held_channels
from femflex.system import (
    Friction,
    Joint,
    Latch,
    Profile,
    Spring,
    Stop,
    System,
    free,
    knife_edge,
    revolute,
    spherical,
    universal,
    weld,
)

MASS, ARM, LOCKED = 2.0, 0.3, 0.2  # kg, m from the joint to the centre of mass, rad
SLIDE = (0.1, 0.4, -0.05)  # m, m/s, m/s^2 / 2


def gantry(**more) -> Joint:
    """A slide along x that is prescribed, one along y with a damper, and a turn about z that is locked."""
    return Joint(
        "load",
        name="gantry",
        kind="general",
        translations=np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        rotations=np.array([[0.0, 0.0, 1.0]]),
        damping=np.array([0.0, 3.0, 0.0]),
        motion=(Profile.polynomial(*SLIDE), None, LOCKED),
        q0=np.array([0.0, 0.7, 0.0]),
        u0=np.array([0.0, -0.6, 0.0]),
        **more,
    )


def craft() -> System:
    """Three bodies on the base: on the gantry, on a hinge that latches, and a flexible one on two turns."""
    load = rigid_body(MASS, np.diag([0.1, 0.1, 0.1]), [0.0, ARM, 0.0])
    door = rigid_body(1.0, np.diag([0.2, 0.3, 0.4]))
    flag = replace(random_body(np.random.default_rng(5), 2)[0], damping=np.array([[0.5, 0.1], [0.1, 0.3]]))
    hinge = revolute(
        "door",
        name="gantry2",
        damping=0.25,
        u0=[0.8],
        laws=(Stop(lower=-1.0, stiffness=5.0), Friction(limit=0.3, velocity=0.1, name="rub")),
        latches=(Latch(0, at=0.9),),
    )
    pan = universal(
        "flag",
        name="pan",
        u0=[0.5, 0.0],
        damping=[0.7, 0.0],
        laws=(Friction(freedom=1, limit=0.2, velocity=0.5),),
        latches=(Latch(1, at=0.0, opens=4.0), Latch(0, at=0.6, stiffness=2.0)),
    )
    bodies = {"load": load, "door": door, "flag": flag}
    return System(bodies, (gantry(), hinge, pan), ddelta0={"flag": np.array([0.2, -0.4])})


def test_every_joint_that_is_held_has_channels_of_its_own():
    found = held_channels(craft())
    assert {path: (one.unit, one.shape, one.names) for path, one in found.items()} == {
        "joints/gantry/drive": ("N, N m", (2,), ("slide1", "angle")),
        "joints/gantry2/drive": ("N m", (1,), ("angle",)),
        "joints/pan/drive": ("N m", (1,), ("angle2",)),
        "monitors/drive_power": ("W", (), ()),
    }
    assert held_channels(System({"door": craft().bodies["door"]}, (free("door"),))) == {}
    assert [(joint.label, k, q, u) for joint, k, q, u in held_places(craft())] == [
        ("gantry", 0, 0, 0), ("gantry", 2, 2, 2), ("gantry2", 0, 3, 3), ("pan", 1, 5, 5),
    ]  # fmt: skip
    assert held_freedoms(craft()) == {0: ("gantry.slide1", "load"), 2: ("gantry.angle", "load")}


def test_forces_that_hold_joints_are_those_of_newton_and_euler():
    model = compile_system(craft())
    t = 0.5
    seen = model.observe(np.array([t]), model.x0[None])
    ax, ay = 2.0 * SLIDE[2], 3.0 * 0.6 / MASS
    rx, ry = -ARM * np.sin(LOCKED), ARM * np.cos(LOCKED)
    wanted = [MASS * ax, MASS * (rx * ay - ry * ax)]
    assert seen["joints/gantry/drive"][0] == pytest.approx(wanted)
    assert seen["joints/gantry2/drive"][0] == pytest.approx([0.0])  # it has not latched
    assert abs(seen["joints/pan/drive"][0, 0]) > 1e-3  # locked until it opens
    assert seen["monitors/drive_power"] == pytest.approx([wanted[0] * (SLIDE[1] + 2.0 * SLIDE[2] * t)])


def test_laws_and_latches_stand_where_their_joints_do():
    laws = [(one.name, one.joint.label, one.q, one.u, one.time, one.unit) for one in law_places(craft())]
    assert laws == [
        ("gantry2.stop", "gantry2", 3, 3, -1, "N m"),
        ("rub", "gantry2", 3, 3, -1, "N m"),
        ("pan.friction", "pan", 5, 5, -1, "N m"),
        ("pan.angle1.latch", "pan", 4, 4, 4, "N m"),
    ]
    latches = [(one.joint.label, one.latch.at, one.q, one.u, one.time) for one in latch_places(craft())]
    assert latches == [("gantry2", 0.9, 3, 3, 0), ("pan", 0.0, 5, 5, 2), ("pan", 0.6, 4, 4, 4)]
    channels = law_channels(craft())
    assert {path: one.unit for path, one in channels.items()} == {
        f"latches/{name}/{what}": unit
        for name in ("gantry2.angle", "pan.angle2", "pan.angle1")
        for what, unit in (("locked", "1"), ("time", "s"), ("loss", "J"))
    } | {"monitors/dissipation": "W"}
    assert channels["latches/pan.angle2/loss"].description == "energy lost when pan.angle2 latched"
    assert craft().state_names() == [
        ("gantry2.latch_time", "s"), ("gantry2.latch_loss", "J"), ("pan.latch1_time", "s"), ("pan.latch1_loss", "J"),
        ("pan.latch2_time", "s"), ("pan.latch2_loss", "J"),
    ]  # fmt: skip


def test_the_power_that_is_lost_counts_dampers_laws_and_shapes():
    model = compile_system(craft())
    seen = model.observe(np.zeros(1), model.x0[None])
    rates = np.array([0.2, -0.4])
    wanted = 3.0 * 0.6**2 + 0.25 * 0.8**2 + 0.7 * 0.5**2 + 0.3 * np.tanh(8.0) * 0.8
    wanted += rates @ [[0.5, 0.1], [0.1, 0.3]] @ rates
    assert seen["monitors/dissipation"] == pytest.approx([wanted])
    assert [float(seen[f"latches/{name}/locked"][0]) for name in ("gantry2.angle", "pan.angle2", "pan.angle1")] == [
        0.0,
        1.0,
        0.0,
    ]


@pytest.mark.parametrize("damped", ["joint", "law", "latch", "spring", "body"])
def test_a_craft_is_damped_by_any_one_of_its_parts(damped):
    body = rigid_body(2.0, np.eye(3))
    flag = random_body(np.random.default_rng(3), 2)[0]
    still = replace(flag, damping=0.0 * flag.damping)
    keys = {
        "joint": {"damping": 0.1},
        "law": {"laws": (Friction(limit=0.1),)},
        "latch": {"latches": (Latch(0, at=0.5),)},
    }.get(damped, {})
    springs = (Spring("a", "flag", stiffness=1.0), Spring("b", "door", stiffness=1.0, damping=0.5))
    joints = (revolute("flag"), revolute("door", "flag", **keys))
    bodies = {"flag": replace(still, damping=np.diag([0.0, 0.2])) if damped == "body" else still, "door": body}
    assert is_damped(System(bodies, joints, springs=springs if damped == "spring" else springs[:1]))
    assert not is_damped(System({"flag": still, "door": body}, (revolute("flag"), revolute("door", "flag"))))


def test_bodies_between_the_ends_of_a_tie_leave_out_those_that_carry_both():
    names = ("hub", "a", "a1", "b", "b1")
    bodies = {name: rigid_body(1.0, np.eye(3)) for name in names}
    joints = (weld("hub"), revolute("a", "hub"), revolute("a1", "a"), revolute("b", "hub"), revolute("b1", "b"))
    loops = (spherical("b1", "a1", name="pin"), spherical("a", "a1", name="pin2"))
    edges = (knife_edge("edge", "b1", [0, 1, 0]), knife_edge("edge2", "b1", [0, 1, 0], parent="a"))
    system = System(bodies, joints, loops=loops, constraints=edges)
    assert bodies_between(system, "pin") == {"a", "a1", "b", "b1"}
    assert bodies_between(system, "pin2") == {"a1"}
    assert bodies_between(system, "edge") == {"hub", "b", "b1"}
    assert bodies_between(system, "edge2") == {"a", "b", "b1"}
