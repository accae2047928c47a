"""What the parts of a system say to numbers and names that they refuse: the whole sentence, with the number in it."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.system import (
    Controller,
    Effector,
    Friction,
    Joint,
    Latch,
    LengthTable,
    Nonholonomic,
    Orbit,
    Profile,
    Sampling,
    Segments,
    Sensor,
    Sight,
    Spring,
    Stop,
    Supply,
    System,
    TabulatedDamper,
    TabulatedSpring,
    Threshold,
    Variation,
    attitude_feedback,
    block,
    cable,
    closure,
    control_moment_gyro,
    free,
    gain,
    low_pass,
    notch,
    observer,
    prismatic,
    pulse_train,
    pulses,
    revolute,
    rolling_disc,
    separation_spring,
    signal,
    spherical,
    state_space,
    tank,
    thruster,
    turns,
    universal,
    velocity_rows,
    weld,
    with_heavy_cable,
)
from femflex.system.ball import check_ball
from femflex.system.blocks import allocation
from femflex.system.evaluation import evaluation_order
from femflex.system.fixed_length import with_fixed_lengths
from femflex.system.loop import closure_problems
from femflex.system.ties import tie_problems

ENDS = (("hub", "a"), ("arm", "b"))


def hub(*names: str):
    markers = {name: Marker.rigid(np.array([0.1 * k, 0.2, -0.3])) for k, name in enumerate(names, 1)}
    return rigid_body(2.0, np.diag([1.0, 1.2, 1.5]), markers=markers)


def pair(**more) -> System:
    return System({"hub": hub("a"), "arm": hub("b")}, (free("hub"), revolute("arm", "hub", name="hinge")), **more)


def latched(latch: Latch, angle: float, rate: float = 0.0) -> System:
    """A body on a hinge with a latch."""
    return System({"arm": hub()}, (revolute("arm", name="h", q0=[angle], u0=[rate], latches=(latch,)),))


def gyro(**change):
    return control_moment_gyro("gyro", "hub", 3.0, **({"rates": [0.1]} | change))


def law(t, sensors, memory):
    return np.zeros(1), memory


def idle(seen, out):
    pass


BAD = {
    "state space: B": (
        lambda: state_space(np.eye(2), np.ones((2, 3)), np.ones((1, 2)), [[0.0, 0.0]]),
        "B of a block has shape (2, 3); with D of shape (1, 2) it needs (2, 2)",
    ),
    "state space: C": (
        lambda: state_space(np.eye(2), np.ones((2, 2)), np.ones((3, 2)), [[0.0, 0.0]]),
        "C of a block has shape (3, 2); with D of shape (1, 2) it needs (1, 2)",
    ),
    "state space: not finite": (
        lambda: state_space([[-1.0]], [[np.inf]], [[1.0]], [[0.0]]),
        "the matrices of a block must be finite",
    ),
    "low pass": (
        lambda: low_pass(2.5, order=3),
        "a low-pass of order 3 at 2.5 Hz: frequency and damping must be positive, order 1 or 2",
    ),
    "low pass damping": (lambda: low_pass(2.5, 2, damping=0.0), "a low-pass of order 2 at 2.5 Hz"),
    "low pass frequency": (lambda: low_pass(0.0), "a low-pass of order 1 at 0 Hz"),
    "notch depth": (
        lambda: notch(3.0, 0.5, 1.0),
        "a notch at 3 Hz of width 0.5 and depth 1: frequency and width must be positive, depth from 0 to 1",
    ),
    "notch width": (lambda: notch(3.0, 0.0), "a notch at 3 Hz of width 0 and depth 0"),
    "notch below": (lambda: notch(3.0, 0.5, -0.1), "depth -0.1"),
    "observer": (
        lambda: observer(np.eye(2), np.ones((2, 1)), np.ones((1, 2)), np.ones((1, 2)), np.ones((2, 2))),
        "matrices of an observer do not fit: ",
    ),
    "allocation": (
        lambda: allocation([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]]),
        "3 actuators produce 1 of 2 demands independently; add actuators, or remove demands",
    ),
    "block counts": (
        lambda: block("law", gain(np.ones((2, 3))), ("a.x", "a.y"), ("u",)),
        "block 'law' takes 3 inputs and gives 2 outputs; found 2 inputs and 1 outputs",
    ),
    "block inputs alone": (
        lambda: block("law", gain(np.ones((2, 3))), ("a.x", "a.y"), ("u", "v")),
        "found 2 inputs and 2 outputs",
    ),
    "block outputs alone": (
        lambda: block("law", gain(np.ones((2, 3))), ("a.x", "a.y", "a.z"), ("u",)),
        "found 3 inputs and 1 outputs",
    ),
    "block limits": (
        lambda: block("law", gain(np.eye(2)), ("a.x", "a.y"), ("u", "v"), limit=[1.0, 0.0]),
        "limits of block 'law' are [1.0, 0.0]; they must be positive",
    ),
    "block outputs twice": (
        lambda: block("law", gain(np.eye(3)), ("a.x", "a.y", "a.z"), ("w", "v", "v")),
        "outputs of 'law' hold 'v' twice; give each output a name of its own",
    ),
    "feedback": (
        lambda: attitude_feedback("law", ("s.x", "s.y"), ("g.x", "g.y", "g.z"), 1.0, 1.0),
        "block 'law' takes three errors, three rates and three momenta or none; found ['s.x', 's.y', 'g.x', 'g.y', "
        "'g.z']",
    ),
    "feedback of four errors": (
        lambda: attitude_feedback("law", ("s.x", "s.y", "s.z", "s.w"), ("g.x", "g.y"), 1.0, 1.0),
        "found ['s.x', 's.y', 's.z', 's.w', 'g.x', 'g.y']",
    ),
    "pulses: shortest": (
        lambda: pulses("jets", ("a.x",), ("on",), 2.0, 0.5, minimum_on=0.5),
        "minimum_on of 'jets' is 0.5 s; it must lie between 0 and the period of 0.5 s",
    ),
    "pulses: counts": (
        lambda: pulses("jets", ("a.x", "a.y"), ("on",), 2.0, 0.5),
        "'jets' has 2 demands and 1 outputs; give as many of both",
    ),
    "pulses: outputs twice": (lambda: pulses("jets", ("a.x", "a.y"), ("on", "on"), 2.0, 0.5), "hold 'on' twice"),
    "cable stiffness": (
        lambda: cable("stay", ENDS, 2.0, 0.0),
        "stiffness of cable 'stay' must be positive, and its damping not negative",
    ),
    "cable damping": (lambda: cable("stay", ENDS, 2.0, 5.0, damping=-1.0), "stiffness of cable 'stay'"),
    "cable length at its last time": (
        lambda: cable("stay", ENDS, Profile.spline([0.0, 1.0, 2.0, 3.0], [3.0, 2.0, 1.0, -0.25]), 5.0),
        "the length of cable 'stay' comes to -0.25 m; it must stay positive",
    ),
    "heavy cable": (
        lambda: with_heavy_cable(pair(), "line", ENDS, 2.0, -1.0, 0.1, 2, np.zeros((2, 3))),
        "stiffness of cable 'line' is -1 N; it must be positive",
    ),
    "heavy cable length": (
        lambda: with_heavy_cable(pair(), "line", ENDS, np.inf, 1.0, 0.1, 2, np.zeros((2, 3))),
        "length of cable 'line' is inf m; it must be positive",
    ),
    "heavy cable mass": (
        lambda: with_heavy_cable(pair(), "line", ENDS, 1.0, 1.0, 0.0, 2, np.zeros((2, 3))),
        "mass per length of cable 'line' is 0 kg/m; it must be positive",
    ),
    "heavy cable damping": (
        lambda: with_heavy_cable(pair(), "line", ENDS, 2.0, 1.0, 0.1, 2, np.zeros((2, 3)), damping=-0.5),
        "damping of cable 'line' is -0.5; it must not be negative",
    ),
    "heavy cable masses": (
        lambda: with_heavy_cable(pair(), "line", ENDS, 2.0, 1.0, 0.1, 501, np.zeros((501, 3))),
        "cable 'line' has 501 masses; give 1 to 500",
    ),
    "heavy cable no mass": (
        lambda: with_heavy_cable(pair(), "line", ENDS, 2.0, 1.0, 0.1, 0, np.zeros((0, 3))),
        "cable 'line' has 0 masses; give 1 to 500",
    ),
    "heavy cable name": (
        lambda: with_heavy_cable(
            System({"line_2": hub("a"), "arm": hub("b")}, (weld("line_2"), weld("arm", "line_2"))),
            "line", (("line_2", "a"), ("arm", "b")), 2.0, 1.0, 0.1, 2, np.zeros((2, 3)),
        ),
        "cable 'line' adds a body 'line_2', and there is one of that name; rename one of them",
    ),
    "constraint axis": (
        lambda: Nonholonomic("edge", "knife_edge", "hub", axis=np.zeros(3)),
        "axis of constraint 'edge' has no direction: [0.0, 0.0, 0.0]",
    ),
    "constraint normal": (
        lambda: rolling_disc("disc", "hub", 1.0, normal=[0.0, np.nan, 1.0]),
        "normal of constraint 'disc' has no direction: [0.0, nan, 1.0]",
    ),
    "constraint radius": (
        lambda: rolling_disc("disc", "hub", 0.0),
        "radius of constraint 'disc' is 0.0 m; a disc needs a positive radius",
    ),
    "constraint rows": (
        lambda: velocity_rows("rows", 0, law),
        "constraint 'rows' has 0 rows; give at least one",
    ),
    "controller period": (
        lambda: Controller("law", law, 0.0, commands={"u": "N"}),
        "period of controller 'law' is 0.0 s; it must be positive",
    ),
    "controller without commands": (
        lambda: Controller("law", law, 0.5),
        "controller 'law' has no command; name one, as in commands={'torque': 'N m'}",
    ),
    "controller next": (
        lambda: Controller("law", law, 0.5, commands={"u": "N", "next": "s"}),
        "controller 'law' has a command 'next', the name of its next sample; rename it",
    ),
    "controller held": (
        lambda: Controller("law", law, 0.5, commands={"u": "N", "v": "N"}, held=np.array([1.0, 2.0, 3.0])),
        "held of controller 'law' is [1.0, 2.0, 3.0]; expected 2 finite numbers",
    ),
    "controller memory": (
        lambda: Controller("law", law, 0.5, commands={"u": "N"}, memory=np.array([1.0, np.nan])),
        "memory of controller 'law' is [1.0, nan]; expected 2 finite numbers",
    ),
    "effector z0": (
        lambda: Effector("jet", idle, states={"m": "kg"}, z0=np.array([1.0, 2.0])),
        "z0 of effector 'jet' is [1.0, 2.0]; expected 1 finite numbers, one per state",
    ),
    "effector sizes": (
        lambda: Effector("jet", idle, states={"m": "kg", "s": "1"}, sizes=np.array([1.0, 0.0])),
        "sizes of effector 'jet' are [1.0, 0.0]; they must be positive",
    ),
    "effector accounts": (
        lambda: Effector("jet", idle, accounts=("energy", "heat")),
        "effector 'jet' accounts for 'heat'; known are ['energy', 'dissipation', 'supplied', 'mass_flow']",
    ),
    "effector starts": (
        lambda: Effector("jet", idle, states={"m": "kg"}, channels={"flow": "kg/s"}, starts={"flow": ("n", 1.0)}),
        "effector 'jet' is to start with channel 'flow' by its state 'n'; it has the channels ['flow'] and the states "
        "['m']",
    ),
    "effector starts by an unknown channel": (
        lambda: Effector("jet", idle, states={"m": "kg"}, channels={"flow": "kg/s"}, starts={"drain": ("m", 1.0)}),
        "effector 'jet' is to start with channel 'drain' by its state 'm'",
    ),
    "effector names": (
        lambda: Effector("jet", idle, states={"m": "kg"}, channels={"m": "kg"}),
        "effector 'jet' has two outputs named 'm'; rename one",
    ),
    "effector force": (
        lambda: Effector("jet", idle, (("hub", "a"),), channels={"torque": "N m"}),
        "effector 'jet' has two outputs named 'torque'; rename one",
    ),
    "effector effort": (
        lambda: Effector("jet", idle, freedoms=("hinge.angle",), states={"effort": "N m"}),
        "effector 'jet' has two outputs named 'effort'; rename one",
    ),
    "gyro axes": (
        lambda: gyro(spin_axis=(0.6, 0.0, 0.8)),
        "gimbal_axis and spin_axis of 'gyro' are not perpendicular: their product is 0.8",
    ),
    "gyro inner axes": (
        lambda: gyro(inner_axis=(0.6, 0.8, 0.0), rates=[0.1, 0.2]),
        "inner_axis and spin_axis of 'gyro' are not perpendicular: their product is 0.6",
    ),
    "gyro inner and outer": (
        lambda: gyro(inner_axis=(0.0, 0.6, 0.8), rates=[0.1, 0.2]),
        "inner_axis and gimbal_axis of 'gyro' are not perpendicular: their product is 0.8",
    ),
    "gyro without commands": (
        lambda: gyro(rates=None),
        "'gyro' needs commanded rates or commanded angles of its gimbals; give one of them",
    ),
    "gyro with both": (lambda: gyro(angles=[0.2]), "'gyro' needs commanded rates or commanded angles"),
    "gyro counts": (
        lambda: gyro(rates=[0.1, 0.2]),
        "'gyro' has 1 gimbals; found 2 commands and 1 initial angles",
    ),
    "gyro initial angles": (
        lambda: gyro(inner_axis=(0.0, 1.0, 0.0), rates=[0.1, 0.2], initial_angles=[0.3]),
        "'gyro' has 2 gimbals; found 2 commands and 1 initial angles",
    ),
    "gyro inertia": (
        lambda: gyro(inner_axis=(0.0, 1.0, 0.0), rates=[0.1, 0.2], gimbal_inertia=0.1),
        "gimbal_inertia of 'gyro' belongs to a single gimbal; two gimbals follow exactly",
    ),
    **{
        f"gyro {key}": (
            lambda key=key, value=value: gyro(**{key: value}),
            "gain, bandwidth and limits of 'gyro' must be positive, gimbal_inertia not negative",
        )
        for key, value in (
            ("gimbal_inertia", -0.1), ("max_rate", 0.0), ("max_torque", 0.0), ("gain", 0.0), ("bandwidth", 0.0)
        )
    },
    "gyro direction": (
        lambda: gyro(spin_axis=(0.0, 0.0, 0.0)),
        "spin_axis of 'gyro' is [0.0, 0.0, 0.0]; expected three numbers, not all zero",
    ),
    "joint rebase": (
        lambda: check_ball(None, True, "hinge"),
        "joint 'hinge' is to be re-based, but has no rotation set; only a ball has one",
    ),
    "joint rebase of Euler parameters": (
        lambda: spherical("arm", rebase=True),
        "joint 'base-arm' is to be re-based, but its rotation set 'euler_parameters' has no singularity",
    ),
    "joint rebase of shadows": (
        lambda: spherical("arm", rotation="modified_rodrigues", rebase=True),
        "its rotation set 'modified_rodrigues' switches to its shadow by itself",
    ),
    "joint axes": (
        lambda: Joint("arm", translations=np.ones((4, 3)), rotations=np.eye(3)),
        "joint 'base-arm' has 4 translations and 3 rotations; at most three of each",
    ),
    "joint many turns": (
        lambda: Joint("arm", rotations=np.ones((4, 3))),
        "joint 'base-arm' has 0 translations and 4 rotations; at most three of each",
    ),
    "joint play": (
        lambda: Joint("arm", play=-0.1),
        "play of joint 'base-arm' is -0.1 m; expected a length, zero for none",
    ),
    "joint damping": (
        lambda: turns("arm", damping=[0.0, 1.0, -2.0]),
        "damping of joint 'base-arm' is negative: [0.0, 1.0, -2.0]",
    ),
    "joint motion count": (
        lambda: universal("arm", motion=(0.1,)),
        "motion of joint 'base-arm' has 1 entries; the joint needs 2",
    ),
    "joint motion and stiffness": (
        lambda: universal("arm", name="u", stiffness=[0.0, 7.5], motion=(None, 0.1)),
        "'u.angle2' has a stiffness of 7.5 and a prescribed motion; a spring or damper has no effect on a prescribed "
        "motion. Remove one of them",
    ),
    "joint motion and damping": (
        lambda: universal("arm", name="u", damping=[2.5, 7.5], motion=(0.1, None)),
        "'u.angle1' has a damping of 2.5 and a prescribed motion",
    ),
    "joint motion begins late": (
        lambda: revolute("arm", name="h", motion=(Profile.spline([1.0, 2.0, 3.0, 5.0], [1.0, 2.0, 1.0, 0.0]),)),
        "the motion of 'h.angle' is known from 1 s to 5 s; it must begin at or before 0 s",
    ),
    "joint motion and q0": (
        lambda: revolute("arm", name="h", motion=(0.25,), q0=[0.5]),
        "q0 of 'h.angle' is 0.5, but its motion is prescribed and begins with 0.25; leave the initial value out",
    ),
    "joint motion and u0": (
        lambda: revolute("arm", name="h", motion=(Profile.polynomial(0.25, 2.0),), u0=[1.5]),
        "u0 of 'h.angle' is 1.5, but its motion is prescribed and begins with 2; leave the initial value out",
    ),
    "ball prescribed": (
        lambda: free("arm", name="f", motion=(None, None, None, None, 0.1, None)),
        "rotation 'f.omega_y' of a ball cannot be prescribed by itself; give joint 'f' turns about the axes of an "
        "angle sequence instead",
    ),
    "law of nothing": (
        lambda: revolute("arm", name="h", laws=(Friction(freedom=1, limit=1.0),)),
        "a friction of joint 'h' acts on degree of freedom 1; the joint has 1, from 0",
    ),
    "law below zero": (
        lambda: revolute("arm", name="h", laws=(Friction(freedom=-1, limit=1.0),)),
        "a friction of joint 'h' acts on degree of freedom -1; the joint has 1, from 0",
    ),
    "latch of nothing": (
        lambda: revolute("arm", name="h", latches=(Latch(2, at=1.0),)),
        "a latch of joint 'h' acts on degree of freedom 2; the joint has 1, from 0",
    ),
    "law of a ball": (
        lambda: free("arm", name="f", laws=(Friction(freedom=3, limit=1.0),)),
        "rotation 'f.omega_x' of a ball cannot have a friction; give joint 'f' turns",
    ),
    "latch and motion": (
        lambda: universal("arm", name="u", motion=(None, 0.1), latches=(Latch(1, at=1.0),)),
        "'u.angle2' has a latch and a prescribed motion, on which it has no effect. Remove one of them",
    ),
    "two latches": (
        lambda: universal("arm", name="u", latches=(Latch(1, at=1.0), Latch(0, at=1.0), Latch(1, at=-1.0))),
        "'u.angle2' has 2 latches; give it one",
    ),
    "latch that opens elsewhere": (
        lambda: latched(Latch(0, at=0.5, opens=2.0), 0.25),
        "'h.angle' starts at 0.25 at a rate of 0, and is locked at 0.5 until it opens (2.0); let it start there, at "
        "rest",
    ),
    "latch that opens in motion": (
        lambda: latched(Latch(0, at=0.5, opens=2.0), 0.5, 3.0),
        "'h.angle' starts at 0.5 at a rate of 3, and is locked at 0.5",
    ),
    "latch at its place": (
        lambda: latched(Latch(0, at=0.5), 0.5),
        "'h.angle' starts at 0.5, where it latches; lock it, or start elsewhere",
    ),
    "latch damping": (
        lambda: Latch(damping=2.0),
        "a latch has stiffness 0 and damping 2; they must not be negative, and damping needs a stiffness",
    ),
    "latch negative": (lambda: Latch(stiffness=-3.0), "a latch has stiffness -3 and damping 0"),
    "latch negative damping": (lambda: Latch(stiffness=3.0, damping=-1.0), "a latch has stiffness 3 and damping -1"),
    "latch opens early": (
        lambda: Latch(opens=-1.0),
        "a latch opens at -1.0 s with stiffness 0; one that opens is rigid, and opens at or after 0 s",
    ),
    "latch opens elastic": (lambda: Latch(stiffness=2.0, opens=1.0), "a latch opens at 1.0 s with stiffness 2"),
    "threshold": (
        lambda: Threshold("a/b"),
        "the threshold of 'a/b' has above = None and below = None; give one of them",
    ),
    "thresholds": (
        lambda: Threshold("a/b", 1.0, 2.0),
        "the threshold of 'a/b' has above = 1.0 and below = 2.0; give one of them",
    ),
    "friction": (
        lambda: Friction(limit=-1.0),
        "friction has limit -1 and velocity scale 0.001; the limit must not be negative and the scale positive",
    ),
    "friction scale": (lambda: Friction(limit=1.0, velocity=0.0), "friction has limit 1 and velocity scale 0"),
    "stop": (lambda: Stop(stiffness=1.0), "a stop needs a lower or an upper limit, or both"),
    "stop limits": (
        lambda: Stop(lower=1.0, upper=1.0, stiffness=1.0),
        "the lower limit 1 of a stop is not below its upper limit 1",
    ),
    "stop numbers": (
        lambda: Stop(lower=0.0, stiffness=1.0, damping=-2.0, width=0.5),
        "a stop has stiffness 1, damping -2 and width 0.5; stiffness and width must be positive, damping not negative",
    ),
    "stop stiffness": (lambda: Stop(upper=0.0), "a stop has stiffness 0, damping 0 and width 0.01"),
    "stop width": (lambda: Stop(upper=0.0, stiffness=1.0, width=0.0), "a stop has stiffness 1, damping 0 and width 0"),
    "table lengths": (
        lambda: TabulatedSpring(stretch=[0.0, 1.0], resisting=[1.0]).potential,
        "a tabulated spring needs two equally long lists of at least 2 numbers",
    ),
    "table of one": (
        lambda: TabulatedSpring(stretch=[0.0], resisting=[1.0]).potential,
        "a tabulated spring needs two equally long lists of at least 2 numbers",
    ),
    "table finite": (
        lambda: TabulatedDamper(rate=[0.0, 1.0], resisting=[0.0, np.nan]),
        "a tabulated damper holds a number that is not finite",
    ),
    "table order": (
        lambda: TabulatedDamper(rate=[0.0, 2.0, 1.0], resisting=[0.0, 1.0, 2.0]),
        "the first list of a tabulated damper must ascend: [0.0, 2.0, 1.0]",
    ),
    "damper that drives": (
        lambda: TabulatedDamper(rate=[-1.0, 0.0, 2.0], resisting=[-1.0, 0.0, -3.0]),
        "a damper with force -3 at rate 2 drives the joint; it must resist",
    ),
    "profile finite": (
        lambda: Profile(np.zeros(1), np.array([[np.nan]])),
        "coefficients of a profile hold a number that is not finite",
    ),
    "sensor kind": (
        lambda: Sensor("gyro", "spin"),
        "sensor 'gyro' has the kind 'spin'; known are attitude, rate, displacement, velocity, acceleration, pointing, "
        "joint, value",
    ),
    "sensor bandwidth": (
        lambda: Sensor("acc", "acceleration", "hub"),
        "sensor 'acc' measures acceleration; give its bandwidth in rad/s",
    ),
    "sensor freedom": (lambda: Sensor("enc", "joint"), "sensor 'enc' of kind 'joint' needs a freedom"),
    "sensor signal": (lambda: Sensor("tach", "value"), "sensor 'tach' of kind 'value' needs a signal"),
    **{
        f"sampling {key}": (
            lambda key=key, value=value: Sensor(
                "gyro", "rate", "hub", sampling=Sampling(**({"period": 0.5} | {key: value}))
            ),
            f"{key} of sensor 'gyro' is {value:g}; it must be positive, or zero but for the period",
        )
        for key, value in (("period", 0.0), ("delay", -0.1), ("noise", -2.0), ("quantum", np.inf))
    },
    "sampling delay": (
        lambda: Sensor("gyro", "rate", "hub", sampling=Sampling(0.5, delay=6000.0)),
        "delay of sensor 'gyro' is 1.2e+04 of its periods (limit 10000, because every delayed sample is a state)",
    ),
    "separation spring": (
        lambda: separation_spring("push", ENDS, 1.0, 0.0),
        "stiffness and length of separation spring 'push' must be positive",
    ),
    "separation spring stiffness": (lambda: separation_spring("push", ENDS, 0.0, 1.0), "separation spring 'push'"),
    "sight axis": (
        lambda: Sight("dish", "hub", axis=np.zeros(3)),
        "axis of sight 'dish' is [0.0, 0.0, 0.0]; give three numbers, not all zero",
    ),
    "sight radius": (
        lambda: Sight("dish", "hub", radius=0.0),
        "radius of sight 'dish' is 0 m; it must be above 0",
    ),
    "signal kind": (
        lambda: signal("command", [0.0], [1.0], "cubic"),
        "signal 'command' has the kind 'cubic'; known are steps, linear, smooth",
    ),
    "signal counts": (
        lambda: signal("command", [0.0, 1.0], [1.0]),
        "signal 'command' has 2 times and 1 values; give as many of both",
    ),
    "signal of nothing": (lambda: signal("command", [], []), "signal 'command' has 0 times and 0 values"),
    "signal times": (
        lambda: signal("command", [0.0, 1.0, 1.0], [1.0, 2.0, 3.0]),
        "times of signal 'command' must rise, and all numbers be finite: [0.0, 1.0, 1.0]",
    ),
    "signal values": (lambda: signal("command", [0.0, 1.0], [1.0, np.inf]), "times of signal 'command' must rise"),
    "spring": (
        lambda: Spring("strut", "hub", stiffness=1.0, length=-0.5),
        "length of spring 'strut' is -0.5; it must not be negative",
    ),
    "spring damping": (lambda: Spring("strut", "hub", damping=np.inf), "damping of spring 'strut' is inf"),
    "thruster without level": (
        lambda: thruster("jet", "hub", 2.0), "thruster 'jet' needs one of pulses, profile and command"
    ),
    "thruster with two levels": (
        lambda: thruster("jet", "hub", 2.0, command="a.x", pulses=[(0.0, 1.0)]),
        "thruster 'jet' needs one of pulses, profile and command",
    ),
    **{
        f"thruster {key}": (
            lambda key=key, value=value: thruster("jet", "hub", **({"thrust": 2.0, "command": "a.x"} | {key: value})),
            "thrust and specific_impulse of thruster 'jet' must be positive, its lag not negative",
        )
        for key, value in (("thrust", 0.0), ("specific_impulse", 0.0), ("lag", -1.0))
    },
    "thruster tank": (
        lambda: thruster("jet", "hub", 2.0, command="a.x", supply=Supply("main", "hub")),
        "thruster 'jet' draws from tank 'main' and has no specific_impulse; give it",
    ),
    "thruster profile": (
        lambda: thruster("jet", "hub", 2.0, profile=([0.0, 0.0], [1.0, 0.5])),
        "profile of thruster 'jet' needs rising times and a level for each",
    ),
    "thruster levels": (
        lambda: thruster("jet", "hub", 2.0, profile=([0.0, 1.0], [1.0, 1.5])),
        "levels of thruster 'jet' must lie between 0 and 1: [1.0, 1.5]",
    ),
    "thruster pulses": (
        lambda: thruster("jet", "hub", 2.0, pulses=[]),
        "pulses of thruster 'jet' are rows of a start and a duration: []",
    ),
    "thruster short pulse": (
        lambda: thruster("jet", "hub", 2.0, pulses=[(0.0, 0.5), (2.0, 0.25)], minimum_on=0.3),
        "thruster 'jet' has a pulse of 0.25 s, and its shortest is 0.3 s; lengthen the pulse or leave it out",
    ),
    "thruster overlap": (
        lambda: thruster("jet", "hub", 2.0, pulses=[(0.0, 0.5), (2.0, 1.25), (3.0, 1.0)]),
        "pulse 3 of thruster 'jet' starts at 3 s, before the previous pulse ends (3.25 s)",
    ),
    "pulse train": (
        lambda: pulse_train(0.0, 1.0, 0.5, 100_001),
        "found 100001 pulses of one thruster; the most is 100000. Leave out pulses beyond the end",
    ),
    "tank": (lambda: tank("main", 0.0, ("jet",)), "tank 'main' holds 0 kg of propellant; it must be positive"),
    "tank of nothing": (
        lambda: tank("main", 1.0, ()),
        "no thruster draws from tank 'main'; let one draw from it, or leave the tank out",
    ),
    "segments": (lambda: Segments(()), "a body cut into segments needs at least one; found none"),
    "segment ends": (
        lambda: Segments((hub(".near", ".far"), hub(".near"))),
        "segment 2 has no marker '.far'; segments come from reduction.reduce_segments",
    ),
    "breaks of a variation": (
        lambda: Variation(idle, ("mass",), breaks=np.array([1.0, np.nan])),
        "breaks of a variation are [1.0, nan]; give a row of finite numbers",
    ),
    "negative eccentricity": (
        lambda: Orbit(7e6, -0.1),
        "eccentricity is -0.1; a Kepler ellipse has 0 <= e < 1",
    ),
    "parabola": (lambda: Orbit(7e6, 1.0), "eccentricity is 1.0; a Kepler ellipse has 0 <= e < 1"),
    "mu": (lambda: Orbit(7e6, mu=0.0), "semi-major axis 7000000.0 m and mu 0.0 m^3/s^2 must both be positive"),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_a_part_that_cannot_be_is_refused_with_its_numbers(what: str):
    make, sentence = BAD[what]
    with pytest.raises(ValueError) as error:
        make()
    assert sentence in str(error.value)


def waiting(name: str, *inputs: str) -> Effector:
    return Effector(name, idle, inputs=inputs, channels={"x": "1", "y": "1"})


IN_SYSTEMS = {
    "two effectors": (
        {"effectors": (waiting("e"), waiting("f"), waiting("e"))},
        "2 effectors have the name 'e'; give each a name of its own",
    ),
    "body": (
        {"effectors": (Effector("e", idle, (("hub", "a"), ("leg", "a"))),)},
        "body 'leg' of effector 'e' does not exist; bodies are ['arm', 'hub']",
    ),
    "marker": (
        {"effectors": (Effector("e", idle, (("hub", "b"),)),)},
        "marker 'b' of effector 'e' is not on body 'hub'; its markers are ['a', 'origin']",
    ),
    "freedom": (
        {"effectors": (Effector("e", idle, freedoms=("hinge.angel",)),)},
        "degree of freedom 'hinge.angel' of effector 'e' is not a slide or turn of a joint; did you mean "
        "'hinge.angle'? known are base-hub.slide1, base-hub.slide2, base-hub.slide3, hinge.angle",
    ),
    "rate of a ball": (
        {"effectors": (Effector("e", idle, freedoms=("base-hub.omega_x",)),)},
        "degree of freedom 'base-hub.omega_x' of effector 'e' is not a slide or turn",
    ),
    "input": (
        {"effectors": (waiting("e", "f.z"), waiting("f"))},
        "input 'f.z' of effector 'e' is neither a state nor a channel; did you mean",
    ),
    "loop": (
        {"effectors": (waiting("a"), waiting("b", "a.x", "d.y"), waiting("c", "b.x"), waiting("d", "c.y"))},
        "algebraic loop: b -> d -> c -> b take each other's channels, so none of them can be evaluated first",
    ),
    "into a loop": (
        {"effectors": (waiting("a", "b.x"), waiting("b", "c.y"), waiting("c", "b.x"))},
        "algebraic loop: b -> c -> b take each other's channels",
    ),
    "keep": (
        {"keep": ("hinge.angle", "hinge.angel")},
        "keep names 'hinge.angel', which is no joint that moves and no slide or turn of one; did you mean "
        "'hinge.angle'? known are base-hub, base-hub.slide1, base-hub.slide2, base-hub.slide3, hinge, hinge.angle",
    ),
    "ddelta0": (
        {"ddelta0": {"arm": np.ones(3)}},
        "ddelta0 of body 'arm' has shape (3,); expected (0,)",
    ),
    "rates of no body": (
        {"delta0": {"leg": np.ones(3)}},
        "delta0 of body 'leg' has shape (3,); expected (-1,)",
    ),
    "spring to itself": (
        {"springs": (Spring("strut", "hub", "hub"),)},
        "spring 'strut' joins body 'hub' to itself; name two bodies",
    ),
    "springs of one name": (
        {"springs": (Spring("s", "hub", "arm"), Spring("t", "hub"), Spring("s", "arm"))},
        "2 springs have the name 's'; give each a name of its own",
    ),
    "loops and constraints of one name": (
        {"loops": (revolute("arm", "hub", name="s"),), "constraints": (rolling_disc("s", "hub", 1.0),)},
        "2 loops or constraints have the name 's'; give each a name of its own",
    ),
    "marker of a loop's parent": (
        {"loops": (revolute("arm", "hub", parent_marker="b", name="s"),)},
        "marker 'b' of loop 's' is not on body 'hub'; its markers are ['a', 'origin']",
    ),
    "sight without an orbit": (
        {"sights": (Sight("dish", "hub"),)},
        "sight 'dish' looks at a station on the Earth; give an orbit",
    ),
    "variation of no body": (
        {"varying": {"leg": Variation(idle, ("mass",))}},
        "body 'leg', whose properties are to vary, does not exist; bodies are ['arm', 'hub']",
    ),
    "variation of nothing": (
        {"varying": {"arm": Variation(idle, ())}},
        "body 'arm' has a variation in which nothing varies; name what it writes: mass, flow, pickup, growth, "
        "stiffness, damping, strain, marker/b, marker/origin",
    ),
    "variation of the unknown": (
        {"varying": {"arm": Variation(idle, ("mass", "marker/a"))}},
        "body 'arm' varies in 'marker/a'; what can vary is mass, flow,",
    ),
    "growth without mass": (
        {"varying": {"arm": Variation(idle, ("growth",))}},
        "body 'arm' varies in 'growth' but not in 'mass'; its moments change too: name both",
    ),
    "flow without mass": (
        {"varying": {"arm": Variation(idle, ("flow",))}},
        "body 'arm' varies in 'flow' but not in 'mass'",
    ),
    "stiffness of a rigid body": (
        {"varying": {"arm": Variation(idle, ("mass", "damping", "stiffness"))}},
        "body 'arm' is rigid and varies in damping, stiffness; leave that out",
    ),
    "length that does not exist": (
        {"varying": {"arm": Variation(LengthTable("reel.length", [{(0, 0, 0): np.ones(16)}]), ("mass",))}},
        "the length of body 'arm' is state 'reel.length', which does not exist; states are []",
    ),
    "length without its rate": (
        {
            "varying": {"arm": Variation(LengthTable("reel.length", [{(0, 0, 0): np.ones(16)}]), ("mass",))},
            "effectors": (Effector("reel", idle, states={"rate": "m/s", "length": "m"}),),
        },
        "the length of body 'arm' is state 'reel.length'; the state after it must be its rate",
    ),
}


@pytest.mark.parametrize("what", IN_SYSTEMS)
def test_a_system_says_which_of_its_parts_does_not_fit(what: str):
    more, sentence = IN_SYSTEMS[what]
    with pytest.raises(ValueError) as error:
        pair(**more)
    assert sentence in str(error.value)


def test_growth_in_an_orbit_is_refused_and_a_tree_without_joints_is_told_apart():
    joints = (spherical("hub"), revolute("arm", "hub"))
    with pytest.raises(ValueError, match="mass arrives on body 'arm', and the system is in an orbit"):
        System(
            {"hub": hub(), "arm": hub()}, joints, orbit=Orbit(7e6),
            varying={"hub": Variation(idle, ("mass",)), "arm": Variation(idle, ("mass", "growth"))},
        )  # fmt: skip
    with pytest.raises(ValueError, match=r"joint 'hub-arm' has play, but its coordinates keep it together exactly"):
        System({"hub": hub(), "arm": hub()}, (free("hub"), revolute("arm", "hub", play=0.1)))
    with pytest.raises(ValueError, match="ties body 'arm' to the base frame, whose place a specified orbit does not"):
        System({"hub": hub(), "arm": hub()}, joints, orbit=Orbit(7e6), springs=(Spring("s", "arm"),))
    assert tie_problems((), (), (Spring("s", "arm"),), Orbit(7e6, free=True)) == []
    with pytest.raises(ValueError, match=r"a specified orbit eliminates .* joint 'base-hub' must be .*, not free"):
        System({"hub": hub()}, (free("hub"),), orbit=Orbit(7e6))


@pytest.mark.parametrize(
    ("joint", "sentence"),
    [
        (revolute("arm", "hub", name="cut", damping=1.0), "loop 'cut' has a spring or a damper, a law or a latch"),
        (revolute("arm", "hub", name="cut", stiffness=1.0), "loop 'cut' has a spring or a damper, a law or a latch"),
        (revolute("arm", "hub", name="cut", laws=(Friction(limit=1.0),)), "loop 'cut' has a spring or a damper"),
        (revolute("arm", "hub", name="cut", latches=(Latch(at=1.0),)), "loop 'cut' has a spring or a damper"),
        (prismatic("arm", "hub", name="cut", motion=(0.1,)), "loop 'cut' has a locked or prescribed coordinate"),
        (
            universal("arm", "hub", name="cut", axes=[[0.0, 0.0, 2.0], [0.0, 0.0, -1.0]]),
            "the two axes of loop 'cut' are parallel: [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]; use a revolute joint",
        ),
        (free("arm", "hub", name="cut"), "loop 'cut' is free in all six motions and closes nothing; leave it out"),
    ],
)
def test_a_joint_that_cannot_close_a_loop_says_why(joint: Joint, sentence: str):
    (problem,) = closure_problems(joint)
    assert sentence in problem


def test_a_universal_joint_and_one_of_five_freedoms_may_close_a_loop():
    assert closure_problems(universal("arm", "hub", axes=[[1.0, 0.0, 0.0], [0.6, 0.8, 0.0]])) == []
    five = Joint("arm", "hub", translations=np.eye(3)[:2], ball="euler_parameters")
    assert closure_problems(five) == [] and closure(five).n_rows == 1


def test_controllers_that_wait_for_each_other_are_named_and_one_that_reads_its_own_command_is_not():
    def one(name, *sensors):
        return Controller(name, law, 0.5, sensors, {"u": "N", "v": "N"})

    own = one("a", "effectors/a/u", "effectors/b/v")
    assert [c.name for c in evaluation_order([own, one("b"), one("c", "effectors/a/v")])] == ["b", "a", "c"]
    text = "algebraic loop: a -> b -> a take each other's commands of the same instant"
    with pytest.raises(ValueError, match=re.escape(text)):
        pair(effectors=(own, one("b", "effectors/a/v"), one("c")))


def test_a_length_outside_its_times_names_the_time_and_a_free_one_its_state():
    profile = Profile.spline([0.0, 1.0, 2.0, 4.0], [1.0, 1.5, 2.0, 3.0])
    numbers = [{(0, 0, 0): np.ones(16)}]

    def with_length(length):
        return SimpleNamespace(
            bodies={"boom": hub()}, varying={"boom": Variation(LengthTable(length, numbers), ("mass",))}
        )

    with pytest.raises(ValueError, match="'boom' is known from 0 s to 4 s, and needed at 5 s; give a time within"):
        with_fixed_lengths(with_length(profile), 5.0)
    with pytest.raises(ValueError, match=r"the length of body 'boom' is free \(state 'reel.length'\)"):
        with_fixed_lengths(with_length("reel.length"), 1.0)
