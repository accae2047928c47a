"""Joints, loops, springs, constraints and motions of a case, with every value, as the ones made from Python."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from support.same_values import same_values

from femflex.assembly.joints import build_joints, build_loops
from femflex.case.read import parse_case
from femflex.pipeline.decisions import build_system
from femflex.system import (
    Joint,
    Profile,
    Spring,
    cylindrical,
    free,
    knife_edge,
    prismatic,
    revolute,
    rolling_disc,
    spherical,
    turns,
    universal,
    weld,
)

ENDS = {"child": "b", "parent": "a", "child_marker": "end", "parent_marker": "seat", "name": "own"}
HEAD = 'child = "b"\nparent = "a"\nchild_marker = "end"\nparent_marker = "seat"\nname = "own"\n'
CASE = """
[run]
duration = 1
[bodies.a]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
markers.seat = { position = [0.1, 0, 0] }
[bodies.b]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
markers.end = { position = [0, 0.2, 0] }
"""
R = np.radians

JOINTS = [
    ('kind = "weld"', weld(**ENDS)),
    (
        'kind = "revolute"\naxis = [1, 2, 2]\nangle = "20 deg"\nrate = "3 deg/s"\nstiffness = 4\ndamping = 0.5\n'
        'rest = "5 deg"',
        revolute(axis=[1, 2, 2], q0=[R(20)], u0=[R(3)], stiffness=[4], damping=[0.5], rest=[R(5)], **ENDS),
    ),
    (
        'kind = "prismatic"\naxis = [0, 3, 4]\nposition = "20 mm"\nvelocity = 0.3\nstiffness = 40\ndamping = 5\n'
        'rest = "3 mm"',
        prismatic(axis=[0, 3, 4], q0=[0.02], u0=[0.3], stiffness=[40], damping=[5], rest=[0.003], **ENDS),
    ),
    (
        'kind = "cylindrical"\naxis = [2, 1, 2]\nposition = 0.2\nvelocity = 0.3\nangle = 0.4\nrate = 0.5\n'
        "slide_stiffness = 6\nslide_damping = 7\nslide_rest = 0.08\nstiffness = 9\ndamping = 10\nrest = 0.11",
        cylindrical(
            axis=[2, 1, 2], q0=[0.2, 0.4], u0=[0.3, 0.5], stiffness=[6, 9], damping=[7, 10], rest=[0.08, 0.11], **ENDS
        ),
    ),
    (
        'kind = "universal"\naxes = [[0, 1, 0], [1, 0, 1]]\nangles = ["10 deg", "20 deg"]\nrates = [0.1, 0.2]\n'
        "stiffness = [3, 4]\ndamping = [5, 6]\nrest = [0.7, 0.8]",
        universal(
            axes=[[0, 1, 0], [1, 0, 1]], q0=R([10, 20]), u0=[0.1, 0.2], stiffness=[3, 4], damping=[5, 6],
            rest=[0.7, 0.8], **ENDS,
        ),
    ),
    (
        'kind = "spherical"\nrotation = "rodrigues"\nrates = [0.1, 0.2, 0.3]\nstiffness = [3, 4, 5]\n'
        "damping = [6, 7, 8]",
        spherical(
            rotation="rodrigues", q0=[0, 0, 0], u0=[0.1, 0.2, 0.3], stiffness=[3, 4, 5], damping=[6, 7, 8],
            rest=[0, 0, 0], **ENDS,
        ),
    ),
    (
        'kind = "spherical"\nsequence = "zyx"\nangles = [0.1, 0.2, 0]\nmotion.angles = ["locked", "free", 0.4]',
        turns(sequence="zyx", q0=[0.1, 0.2, 0], u0=[0, 0, 0], motion=(0.1, None, 0.4), stiffness=np.zeros(3),
              damping=np.zeros(3), rest=np.zeros(3), **ENDS),
    ),
    (
        'kind = "free"\nposition = [1, 2, 3]\nvelocity = [4, 5, 6]\nrates = [7, 8, 9]\nslide_stiffness = [1, 2, 3]\n'
        "slide_damping = [4, 5, 6]\nslide_rest = [7, 8, 9]\nstiffness = [10, 11, 12]\ndamping = [13, 14, 15]",
        free(
            q0=[1, 2, 3, 1, 0, 0, 0], u0=[4, 5, 6, 7, 8, 9], stiffness=[1, 2, 3, 10, 11, 12],
            damping=[4, 5, 6, 13, 14, 15], rest=[7, 8, 9, 0, 0, 0], **ENDS,
        ),
    ),
    (
        'kind = "general"\nslides = [[1, 0, 0], [0, 1, 1]]\nturns = [[0, 0, 1]]\nposition = [0.1, 0.2]\n'
        "velocity = [0.3, 0.4]\nslide_stiffness = [4, 5]\nslide_damping = [6, 7]\nslide_rest = [0, 0.7]\n"
        "angles = [0.8]\nrates = [0.9]\nstiffness = [10]\ndamping = [11]\nrest = [1.2]",
        Joint(
            kind="general", translations=[[1, 0, 0], [0, 1, 1]], rotations=[[0, 0, 1]], q0=[0.1, 0.2, 0.8],
            u0=[0.3, 0.4, 0.9], stiffness=[4, 5, 10], damping=[6, 7, 11], rest=[0, 0.7, 1.2], **ENDS,
        ),
    ),
]  # fmt: skip


@pytest.mark.parametrize(("text", "wanted"), JOINTS, ids=[text.split('"')[1] for text, _ in JOINTS])
def test_joints_of_case_equal_those_from_python(text, wanted):
    (other, found) = build_joints(
        parse_case(f'{CASE}[[joints]]\nkind = "free"\nchild = "a"\n[[joints]]\n{HEAD}{text}\n')
    )
    assert other.child == "a" and other.kind == "free"
    for field in fields(wanted):
        assert same_values(getattr(found, field.name), getattr(wanted, field.name)), field.name


def test_loops_springs_and_constraints_are_those_made_from_python():
    tables = """
    [[joints]]
    kind = "free"
    child = "a"
    [[joints]]
    kind = "free"
    child = "b"
    [[loops]]
    kind = "universal"
    axes = [[0, 1, 0], [1, 0, 1]]
    play = "0.1 mm"
    """
    pair = HEAD.replace("child_marker", "marker").replace("child", "body")
    tables += (
        HEAD + "[[loops]]\nkind = 'spherical'\nchild = 'a'\n[[springs]]\nstiffness = 3\ndamping = 4\nlength = 0.5\n"
    )
    tables += pair + "[[springs]]\nname = 'other'\nbody = 'a'\nstiffness = 7\n[[constraints]]\nkind = 'knife_edge'\n"
    tables += (
        "across = [0, 3, 4]\n"
        + pair.replace("own", "blade")
        + "[[constraints]]\nkind = 'rolling_disc'\nname = 'wheel'\nbody = 'a'\n"
    )
    tables += "radius = 0.3\naxis = [0, 1, 0]\nnormal = [0, 0, 1]\n"
    case = parse_case(CASE + tables)
    where = {"marker": "end", "parent": "a", "parent_marker": "seat"}
    ball, cut = spherical("a"), universal(axes=[[0, 1, 0], [1, 0, 1]], play=1e-4, **ENDS)
    for made, wanted in zip(build_loops(case), (cut, ball), strict=True):
        for field in fields(wanted):
            assert same_values(getattr(made, field.name), getattr(wanted, field.name)), field.name
    assert case.constraints == [
        knife_edge("blade", "b", across=[0, 3, 4], **where),
        rolling_disc("wheel", "a", radius=0.3, axis=[0, 1, 0], normal=[0, 0, 1]),
    ]
    own = Spring("own", "b", stiffness="3 N/m", damping=4.0, length=0.5, **where)
    assert case.springs == [own, Spring("other", "a", stiffness=7.0)]


TEXT = """
[run]
duration = "4 s"
output_step = 0.1
[bodies.hub]
kind = "rigid"
mass = 10
inertia = [1, 2, 3]
[bodies.arm]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joints]]
child = "arm"
parent = "hub"
"""
STEP = "{ kind = 'smooth_step', from = 0, to = '30 deg', start = '1 s', end = 3 }"


def joint(text: str, folder: Path = Path()):
    return build_system(parse_case(TEXT + text, folder / "case.toml")).joint_of("arm")


@pytest.mark.parametrize(
    ("motion", "profile"),
    [
        (STEP, Profile.smooth_step(1.0, 3.0, 0.0, np.pi / 6)),
        ("{ kind = 'constant', value = '30 deg' }", Profile.constant(np.pi / 6)),
        ("'30 deg'", Profile.constant(np.pi / 6)),
        ("0.4", Profile.constant(0.4)),
        (
            "{ kind = 'polynomial', coefficients = [0.1, '90 deg/s', '2 rad/s^2', 3] }",
            Profile.polynomial(0.1, np.pi / 2, 2, 3),
        ),
        (
            "{ kind = 'sine', amplitude = '2 deg', frequency = '3 Hz', phase = '90 deg', mean = 1 }",
            Profile.sine(np.pi / 90, 6 * np.pi, np.pi / 2, 1),
        ),
        (
            "{ kind = 'table', times = [0, 1, 2, 3, '4 s'], values = [0, '10 deg', 0, 0, 0] }",
            Profile.spline(range(5), [0, np.pi / 18, 0, 0, 0]),
        ),
        (
            "{ kind = 'table', times = [0, 2, 4], values = [0, 1, 0], degree = 5, ends = 'rest' }",
            Profile.spline([0, 2, 4], [0, 1, 0], 5, "rest"),
        ),
        (
            "{ kind = 'sum', parts = [" + STEP + ", { kind = 'sine', amplitude = 1, frequency = 1 }] }",
            Profile.smooth_step(1.0, 3.0, 0.0, np.pi / 6) + Profile.sine(1, 2 * np.pi),
        ),
    ],
)
def test_a_motion_becomes_its_profile(motion: str, profile: Profile):
    found = joint(f"kind = 'revolute'\nmotion.angle = {motion}\n").prescribed[0]
    for t in (0.0, 0.9, 2.2, 3.9):
        np.testing.assert_allclose(found(t), profile(t), atol=1e-12)


@pytest.mark.parametrize("head", ["time [ms],azimuth [deg]", "azimuth [deg],time (ms)"])
def test_a_motion_from_a_file_has_the_unit_of_its_times(head: str, tmp_path: Path):
    """10 deg/s^2 over times in milliseconds: a cubic through it, its rate and its acceleration are known in SI."""
    rows = [(f"{1000 * k}", f"{5 * k * k}") for k in range(6)]
    lines = [",".join(row if head.startswith("time") else row[::-1]) for row in rows]
    (tmp_path / "track.csv").write_text("\n".join([head, *lines]) + "\n")
    text = "kind = 'revolute'\nmotion.angle = { kind = 'table', file = 'track.csv', column = 'azimuth' }\n"
    found = joint(text, tmp_path).prescribed[0](2.5)
    np.testing.assert_allclose(found, np.radians([31.25, 25.0, 10.0]), rtol=1e-12)
