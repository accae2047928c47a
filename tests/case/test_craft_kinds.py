"""Every kind of sensor and controller said in a case is what the Python function of that kind makes."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from femflex.case.controller import Controller as ControllerTable
from femflex.case.read import parse_case
from femflex.case.sensor import SensorTable
from femflex.pipeline.decisions import build_system
from femflex.system import Controller, Sensor, blocks
from femflex.system.sensor import Sampling

CRAFT = """
title = "kinds"
source = "the functions in Python"
[run]
duration = "10 s"
output_step = 0.05
[bodies.hub]
kind = "rigid"
mass = 200
inertia = [120, 100, 140]
markers.eye = { position = [0.5, 0, 0] }
[bodies.arm]
kind = "rigid"
mass = 2
inertia = [1, 1, 1]
[[joints]]
kind = "free"
child = "hub"
[[joints]]
kind = "revolute"
name = "hinge"
child = "arm"
parent = "hub"
axis = [0, 0, 1]
[sensors.star]
kind = "attitude"
body = "hub"
[sensors.gyro]
kind = "rate"
body = "hub"
[signals.slew]
times = [0, 1]
values = [0, 0.1]
"""
ARM = ("arm", "origin")
SENSORS = {
    "attitude": (
        'body = "hub"\nslew_axis = [0, 0, 1]\nslew_angle = "slew.value"\nbias = [1e-3, 0, 0]',
        {"turning": ((0.0, 0.0, 1.0), "slew.value"), "bias": np.array([1e-3, 0, 0])},
    ),
    "rate": ('body = "hub"\nmarker = "eye"', {}),
    "displacement": (
        'body = "hub"\nmarker = "eye"\nother_body = "arm"\noffset = [0.5, 0, 0]',
        {"other": ARM, "offset": np.array([0.5, 0, 0])},
    ),
    "velocity": ('body = "hub"\nmarker = "eye"\nother_body = "arm"', {"other": ARM}),
    "acceleration": ('body = "hub"\nmarker = "eye"\nbandwidth = 30', {"bandwidth": 30.0}),
    "pointing": (
        'body = "hub"\nmarker = "eye"\naxis = [0, 0, 1]\naim = [0, 1, 0]',
        {"axis": np.array([0, 0, 1.0]), "aim": np.array([0, 1.0, 0])},
    ),
    "joint": ('coordinate = "hinge.angle"', {"freedom": "hinge.angle"}),
    "value": ('signal = "slew.value"', {"signal": "slew.value"}),
}
A, B, C, D = [[0, 1], [-4, -1]], [[0], [1]], [[1, 0]], [[0.5]]
XYZ = ("x", "y", "z")
STAR, GYRO = [f"star.{a}" for a in XYZ], [f"gyro.{a}" for a in XYZ]
CONTROLLERS = {
    "pd": ("stiffness = 2\ndamping = [1, 2, 3]", STAR + GYRO, lambda: blocks.pd([2] * 3, [1, 2, 3]), XYZ),
    "pid": (
        "stiffness = 2\nintegral = 0.1\ndamping = 3", STAR + GYRO, lambda: blocks.pid([2] * 3, [0.1] * 3, [3] * 3), XYZ,
    ),
    "low_pass": ("frequency = 2\norder = 2", ["gyro.x"], lambda: blocks.low_pass(2.0, 2, np.sqrt(0.5), 1), ("y",)),
    "notch": ("frequency = 2\nwidth = 0.5\ndepth = 0.1", ["gyro.x"], lambda: blocks.notch(2.0, 0.5, 0.1, 1), ("y",)),
    "state_space": (
        f"A = {A}\nB = {B}\nC = {C}\nD = {D}", ["gyro.x"], lambda: blocks.state_space(A, B, C, D), ("y",),
    ),
    "observer": (
        f"A = {A}\nB = {B}\nC = {C}\nfeedback = [[1, 2]]\ncorrection = [[3], [4]]", ["gyro.x"],
        lambda: blocks.observer(A, B, C, [[1, 2]], [[3], [4]]), ("y",),
    ),
    "gain": ("matrix = [[1, 2, 3]]", GYRO, lambda: blocks.gain([[1, 2, 3]]), ("y",)),
    "allocation": (
        "effect = [[1, 0, 1], [0, 1, 1]]", GYRO[:2], lambda: blocks.allocation([[1, 0, 1], [0, 1, 1]]), XYZ,
    ),
    "momentum": (
        "rate = 0.02\neffect = [[1, 0], [0, 1], [0, 0]]", GYRO[:2],
        lambda: blocks.momentum_management(0.02, [[1, 0], [0, 1], [0, 0]]), XYZ,
    ),
}  # fmt: skip


def made(more, name):
    """The effectors of the case with that name or, of a sampled sensor, the name and its exact one."""
    system = build_system(parse_case(CRAFT + more))
    return {one.name: one for one in system.effectors if one.name in (name, f"{name}_exact")}


def same(found, expected):
    """Whether two effectors are the same: all that a run takes of them."""
    assert type(found) is type(expected)
    if isinstance(found, Controller):
        keys = ("period", "sensors", "commands", "memory", "held", "start")
    else:
        keys = ("act", "markers", "freedoms", "states", "inputs", "channels", "starts", "parameters", "z0", "breaks")
    for key in keys:
        a, b = getattr(found, key), getattr(expected, key)
        assert a == pytest.approx(b, rel=1e-14) if isinstance(b, np.ndarray) else a == b, key


def test_all_kinds_are_looked_at():
    kinds = {get_args(table.model_fields["kind"].annotation)[0] for table in get_args(get_args(ControllerTable)[0])}
    assert set(CONTROLLERS) | {"attitude", "pulses"} == kinds  # the last two below
    assert set(SENSORS) | {"strain"} == set(get_args(SensorTable.model_fields["kind"].annotation))  # strain: own test


@pytest.mark.parametrize("kind", SENSORS)
def test_a_sensor_of_a_case_is_that_of_python(kind):
    text, keys = SENSORS[kind]
    place = ("hub", "eye" if "eye" in text else "origin") if "body" in text else ("", "origin")
    exact = Sensor("s", kind, *place, **keys)
    (expected,) = exact.effectors
    same(made(f'[sensors.s]\nkind = "{kind}"\n{text}\n', "s")["s"], expected)
    sampled = made(f'[sensors.s]\nkind = "{kind}"\n{text}\nperiod = 0.1\ndelay = 0.25\nnoise = 1e-3\nseed = 4\n', "s")
    for expected in Sensor("s", kind, *place, **keys, sampling=Sampling(0.1, 0.25, 1e-3, 0.0, 4)).effectors:
        same(sampled[expected.name], expected)


@pytest.mark.parametrize("kind", CONTROLLERS)
@pytest.mark.parametrize("period", [None, 0.1])
def test_a_controller_of_a_case_is_that_of_python(kind, period):
    text, inputs, block, outputs = CONTROLLERS[kind]
    more = f'[controllers.c]\nkind = "{kind}"\ninputs = {inputs}\nlimit = 5\n{text}\n'
    found = made(more + (f"period = {period}\n" if period else ""), "c")["c"]
    expected = blocks.block("c", block(), inputs, outputs, period=period, limit=5.0)
    same(found, expected)
    if isinstance(found, Controller):  # one step of the law
        seen = {path: 0.1 * (1 + k) for k, path in enumerate(found.sensors)}
        for a, b in zip(*(one.law(0.3, seen, one.memory + 0.2) for one in (found, expected)), strict=True):
            assert a == pytest.approx(b, rel=1e-13)


def test_quaternion_feedback_and_pulses_of_a_case_are_those_of_python():
    more = '[controllers.c]\nkind = "attitude"\nerror = "star"\nrate = "gyro"\nstiffness = 2\ndamping = [1, 2, 3]\n'
    same(made(more, "c")["c"], blocks.attitude_feedback("c", STAR, GYRO, [2] * 3, [1, 2, 3]))
    more = '[controllers.c]\nkind = "pulses"\ninputs = ["gyro.x"]\noutputs = ["go"]\nfull = 2\nperiod = 0.5\n'
    same(made(more, "c")["c"], blocks.pulses("c", ["gyro.x"], ["go"], 2.0, 0.5))
