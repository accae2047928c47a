"""Parts with one wrong number among good ones, names of every kind, and states put into a system and read again."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import (
    Effector,
    Friction,
    Joint,
    Latch,
    LengthTable,
    Load,
    Profile,
    Sensor,
    Spring,
    System,
    TabulatedDamper,
    Variation,
    prismatic,
    reaction_wheel,
    signal,
    spherical,
    started,
    thruster,
    weld,
)
from femflex.system.fixed_length import with_fixed_lengths
from femflex.system.sensor import Sampling, without_quantum

FORCE = np.array([[0.0, 0, 1], [0, np.inf, 0], [1, 0, 0]])
BAD = {
    "time that is not finite": (
        lambda: signal("s", [0.0, np.inf], [1.0, 2.0]),
        "times of signal 's' must rise, and all",
    ),
    "play without end": (lambda: Joint("arm", play=np.inf), "play of joint 'base-arm' is inf m; expected a length"),
    "play that is no number": (lambda: Joint("arm", play=np.nan), "play of joint 'base-arm' is nan m"),
    "wheel without a friction speed": (
        lambda: reaction_wheel("w", "hub", 0.1, coulomb_speed=0.0),
        "coulomb_speed and bandwidth of wheel 'w' must be positive",
    ),
    "wheel without a bandwidth": (
        lambda: reaction_wheel("w", "hub", 0.1, bandwidth=0.0),
        "coulomb_speed and bandwidth of wheel 'w' must be positive",
    ),
    "abscissa that is not finite": (
        lambda: TabulatedDamper(rate=[0.0, np.inf], resisting=[0.0, 1.0]),
        "a tabulated damper holds a number that is not finite",
    ),
    "force that is not finite": (
        lambda: Load("push", "hub", force=FORCE, times=np.array([0, 1, 2.0])),
        "force of load 'push' holds a value that is not finite",
    ),
    "load that goes back": (
        lambda: Load("push", "hub", force=np.ones((3, 3)), times=np.array([0, 2.0, 1.0])),
        "times of load 'push' must be finite, at least two, and not decreasing: [0.0, 2.0, 1.0]",
    ),
    "load without an end": (
        lambda: Load("push", "hub", force=np.ones((2, 3)), times=np.array([0, np.inf])),
        "times of load 'push' must be finite, at least two",
    ),
    "load at one time": (
        lambda: Load("push", "hub", force=np.ones((1, 3)), times=np.array([0.0])),
        "times of load 'push' must be finite, at least two",
    ),
    "second axis without direction": (
        lambda: Joint("arm", rotations=[[0, 0, 1], [0, 0, 0]]),
        "a rotation axis of joint 'base-arm' has no direction: [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]",
    ),
    "slides in a plane": (
        lambda: Joint("arm", translations=[[1, 0, 0], [0, 1, 0], [1, 1, 0]]),
        "translation axes of joint 'base-arm' depend on each other",
    ),
    "one soft freedom below zero": (
        lambda: Joint("arm", translations=np.eye(3), stiffness=[1.0, -2.0, 3.0]),
        "stiffness of joint 'base-arm' is negative: [1.0, -2.0, 3.0]",
    ),
    "numbers of another joint": (
        lambda: Joint("arm", translations=np.eye(3), damping=[1.0, 2.0]),
        "damping of joint 'base-arm' has 2 values; the joint needs 3",
    ),
    "level below nothing": (
        lambda: thruster("jet", "hub", 2.0, profile=([0.0, 1.0, 2.0], [1.0, -0.1, 0.5])),
        "levels of thruster 'jet' must lie between 0 and 1: [1.0, -0.1, 0.5]",
    ),
    "pulse that is no number": (
        lambda: thruster("jet", "hub", 2.0, pulses=[(0.0, 0.5), (np.nan, 0.5)]),
        "pulses of thruster 'jet' are rows of a start and a duration: [[0.0, 0.5], [nan, 0.5]]",
    ),
    "state without a size": (
        lambda: Effector("e", "signal", states={"x": "1", "y": "1"}, sizes=[1.0, 0.0]),
        "sizes of effector 'e' are [1.0, 0.0]; they must be positive",
    ),
    "breaks in rows": (
        lambda: Variation(lambda *a: None, ("mass",), numbers=np.ones((2, 2))),
        "numbers of a variation are [[1.0, 1.0], [1.0, 1.0]]; give a row of finite numbers",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_one_wrong_number_is_enough_to_be_refused(what: str):
    make, sentence = BAD[what]
    with pytest.raises(ValueError, match=re.escape(sentence)):
        make()


def body(*markers: str):
    return rigid_body(2.0, np.eye(3), markers={name: Marker.rigid([0.1, 0, 0]) for name in markers})


NAMED = {
    "body": lambda n: System({n: body()}, (weld(n, name="w"),)),
    "marker": lambda n: System({"b": body("good", n)}, (weld("b"),)),
    "joint or loop": lambda n: System({"b": body()}, (weld("b", name=n),)),
    "law": lambda n: System({"b": body()}, (prismatic("b", name="p", laws=(Friction(limit=1.0, name=n),)),)),
    "load": lambda n: System({"b": body()}, (weld("b"),), loads=(Load("good", "b"), Load(n, "b"))),
    "spring": lambda n: System({"b": body()}, (weld("b"),), springs=(Spring(n, "b"),)),
    "effector": lambda n: System({"b": body()}, (weld("b"),), effectors=(signal(n, [0.0], [1.0]),)),
}


@pytest.mark.parametrize("kind", NAMED)
def test_a_name_that_no_file_can_hold_is_refused_with_its_kind(kind: str):
    assert NAMED[kind]("fine") is not None
    with pytest.raises(ValueError) as caught:
        NAMED[kind]("a/b")
    assert f"found the name 'a/b' of a {kind}; a name holds letters" in str(caught.value)


BEAM = UniformBeam(1.0, EA=1e4, EIy=10.0, EIz=7.0, GJ=10.0, mass_per_length=1.0)


def craft() -> System:
    """A hub that is not the first of the bodies, two beams of 2 and 1 functions, a latch and lagged states."""
    near, far = (beam_body(BEAM, BeamFunctions(y=n, z=0, axial=0, torsion=0)) for n in (2, 1))
    return System(
        {"far": far, "hub": body("rim"), "near": near},
        (
            weld("far", "near", parent_marker="tip", child_marker="root"),
            prismatic("near", "hub", name="rail", child_marker="root", latches=(Latch(at=2.0),)),
            spherical("hub", name="ball"),
        ),
        effectors=Sensor("gauge", "acceleration", "hub", "rim", bandwidth=4.0).effectors,
    )


def test_a_system_started_at_a_state_begins_there_whatever_the_order_of_its_bodies():
    system = craft()
    assert [name for name, _ in system.coordinate_names()] == [
        *(name for name, _ in system.joints[2].coordinate_names()),
        "rail.slide",
        "near.delta1",
        "near.delta2",
        "far.delta1",
    ]
    x = np.concatenate([[0.5, -0.5, 0.5, 0.5], np.arange(1.0, 5.0), -np.arange(1.0, 8.0), [-1.0, 0.0, 0.3, 0.2, 0.1]])
    found = started(system, x)
    assert found.initial_state().tolist() == x.tolist() and system.initial_state().tolist() != x.tolist()
    assert found.joints[1].q0.tolist() == [1.0] and found.joints[1].u0.tolist() == [-4.0]
    assert {name: value.tolist() for name, value in found.delta0.items() if len(value)} == {"near": [2, 3], "far": [4]}
    assert {name: value.tolist() for name, value in found.ddelta0.items() if len(value)} == {
        "near": [-5, -6],
        "far": [-7],
    }
    names = [name for name, _ in system.all_state_names()]
    assert len(names) == len(x) and names[8:11] == [name for name, _ in system.velocity_names()][:3]
    assert names[-5:] == ["rail.latch_time", "rail.latch_loss", *(f"gauge.lagged_{a}" for a in "xyz")]
    assert system.state_sizes().tolist() == [1.0, 1.0, *system.effectors[0].sizes]


def test_a_summary_counts_bodies_mass_freedoms_and_what_acts():
    system = replace(craft(), loads=(Load("push", "hub"),))
    title, rows = system.summary()
    told = dict(rows)
    assert title == "System" and told["mass"] == "4 kg" and told["degrees of freedom"] == "7, 3 of them elastic"
    assert told["bodies"].startswith("3: hub, near, far") and told["frame"] == "inertial"
    assert told["loads"] == "push" and told["effectors"] == "gauge" and "springs" not in told and "orbit" not in told


def test_lengths_are_fixed_of_bodies_that_have_one_alone():
    """A body whose mass a function changes stays as it is; of two tables the one that moves is fixed."""
    block = [{(0, 0, 0): np.ones(16)}]
    written = Variation(lambda t, numbers, out: None, ("mass",))
    still = Variation(LengthTable(Profile.constant(2.0), block), ("mass",), whole=body())
    moving = Variation(LengthTable(Profile.polynomial(1.0, 0.5), block), ("mass",), whole=body())
    joints = tuple(weld(name) for name in "abc")
    system = System({name: body() for name in "abc"}, joints, varying={"a": written, "b": still, "c": moving})
    found = with_fixed_lengths(system, 3.0).varying
    assert found["a"] is written and found["b"] is still
    assert not found["c"].write.length.moves and found["c"].write.length(7.0)[0] == pytest.approx(2.5)


def test_steps_are_taken_out_of_sampled_sensors_alone():
    (_, stepped) = Sensor("gyro", "rate", "hub", sampling=Sampling(0.1, noise=0.2, quantum=0.5, seed=3)).effectors
    (_, smooth) = Sensor("gyro", "rate", "hub", sampling=Sampling(0.1, noise=0.2, seed=3)).effectors
    seen = {path: np.array(0.3 + k) for k, path in enumerate(stepped.sensors)}
    rough = stepped.law(0.0, seen, stepped.memory)[0]
    fine = without_quantum(stepped).law(0.0, seen, stepped.memory)[0]
    assert fine.tolist() == smooth.law(0.0, seen, smooth.memory)[0].tolist()
    assert rough == pytest.approx(0.5 * np.round(fine / 0.5)) and np.abs(rough - fine).max() > 0.01
    assert without_quantum(smooth) is smooth


def test_terms_that_are_nothing_take_no_room_in_the_numbers_of_a_length_table():
    rng = np.random.default_rng(4)
    kept = {(1, 0, 0): rng.normal(size=8), (2, 1, 0): rng.normal(size=8)}
    profile = Profile.polynomial(1.0, 0.5, 0.25)
    own = [LengthTable(profile, [piece]).numbers() for piece in (kept, {**kept, (3, 0, 1): np.zeros(8)})]
    n = len(profile.numbers)
    assert own[1][1] == own[0][1] + 1 == 3 and own[1][2:4].tolist() == own[0][2:4].tolist() and own[1][6] == n
    assert own[1][12 : 12 + n].tolist() == profile.numbers.tolist() and (
        own[0][4:6].tolist(),
        own[1][4:6].tolist(),
    ) == ([1, 2], [1, 3])
    assert own[1][-16:].tolist() == own[0][-16:].tolist() and len(own[1]) == len(own[0]) + 3
