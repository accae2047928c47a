"""Motions in case files: what each becomes, and the sentence for each mistake."""

from pathlib import Path

import numpy as np
import pytest

from femflex.case import CaseError
from femflex.case.read import parse_case
from femflex.pipeline.decisions import build_system
from femflex.system import Profile

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


def problems(text: str, folder: Path = Path()) -> str:
    with pytest.raises(CaseError) as caught:
        build_system(parse_case(TEXT + text, folder / "case.toml"))
    return str(caught.value)


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
    found = joint(f"kind = 'revolute'\nmotion.angle = {motion}\n").held[0]
    for t in (0.0, 0.9, 2.2, 3.9):
        np.testing.assert_allclose(found(t), profile(t), atol=1e-12)


def test_every_kind_of_joint_can_be_held():
    cases = {
        "kind = 'revolute'\nangle = 0.3\nmotion.angle = 'locked'\n": ([0], [0.3]),
        "kind = 'prismatic'\nmotion.position = '20 cm'\n": ([0], [0.2]),
        "kind = 'cylindrical'\nangle = 0.1\nrate = 3\nmotion.position = 0.2\n": ([0], [0.2, 0.1]),
        f"kind = 'universal'\nangles = [0, 0.2]\nmotion.angles = [{STEP}, 'locked']\n": ([0, 1], [0, 0.2]),
        "kind = 'universal'\nangles = [0.1, 0]\nrates = [2, 0]\nmotion.angles = ['free', 0.4]\n": ([1], [0.1, 0.4]),
        "kind = 'spherical'\nsequence = 'zyx'\nangles = [0.1, 0.2, 0]\nmotion.angles = ['locked', 'free', 0.5]\n": (
            [0, 2],
            [0.1, 0.2, 0.5],
        ),
        "kind = 'free'\nposition = [1, 2, 0]\nmotion.position = ['locked', 'free', 3]\n": (
            [0, 2],
            [1, 2, 3, 1, 0, 0, 0],
        ),
        "kind = 'free'\nposition = [1, 2, 0]\nmotion = { position = ['locked', 'free', 3], angles = 'locked' }\n": (
            [0, 2, 3, 4, 5],
            [1, 2, 3, 0, 0, 0],
        ),
        "kind = 'general'\nslides = ['x']\nturns = ['z', 'y']\nmotion.angles = ['free', 0.2]\n": ([2], [0, 0, 0.2]),
    }
    for given, (held, q0) in cases.items():
        found = joint(given)
        assert list(found.held) == held
        np.testing.assert_allclose(found.q0, q0, atol=1e-15)


def test_a_motion_from_a_file_has_its_units(tmp_path: Path):
    rows = "".join(f"{k},{10 * k * k},{k}\n" for k in range(5))
    (tmp_path / "track.csv").write_text("time [s],azimuth [deg],other\n" + rows)
    text = "kind = 'revolute'\nmotion.angle = { kind = 'table', file = 'track.csv', column = 'azimuth' }\n"
    assert joint(text, tmp_path).held[0](2.5)[0] == pytest.approx(np.radians(62.5))


@pytest.mark.parametrize("head", ["time [ms],azimuth [deg]", "azimuth [deg],time (ms)"])
def test_a_motion_from_a_file_has_the_unit_of_its_times(head: str, tmp_path: Path):
    """10 deg/s^2 over times in milliseconds: a cubic through it, its rate and its acceleration are known in SI."""
    rows = [(f"{1000 * k}", f"{5 * k * k}") for k in range(6)]
    lines = [",".join(row if head.startswith("time") else row[::-1]) for row in rows]
    (tmp_path / "track.csv").write_text("\n".join([head, *lines]) + "\n")
    text = "kind = 'revolute'\nmotion.angle = { kind = 'table', file = 'track.csv', column = 'azimuth' }\n"
    found = joint(text, tmp_path).held[0](2.5)
    np.testing.assert_allclose(found, np.radians([31.25, 25.0, 10.0]), rtol=1e-12)


def test_times_of_a_motion_table_may_have_units_of_their_own():
    times = "[0, '0.01 min', '1.2 s', '1800 ms', '4 s']"
    values = "[0, '3.6 mm', '14.4 mm', '32.4 mm', '16 cm']"  # 10 mm/s^2 t^2
    found = joint(f"kind = 'prismatic'\nmotion.position = {{ kind = 'table', times = {times}, values = {values} }}\n")
    np.testing.assert_allclose(found.held[0](3.0), [0.09, 0.06, 0.02], rtol=1e-12)


MISTAKES = [
    (
        "kind = 'revolute'\nangle = 1\nmotion.angle = " + STEP,
        "found angle for a coordinate that is prescribed by motion.angle; the motion sets its initial value",
    ),
    (
        "kind = 'revolute'\nrate = 1\nmotion.angle = 'locked'",
        "found rate for a coordinate that is locked by motion.angle",
    ),
    (
        "kind = 'revolute'\nstiffness = 1\nmotion.angle = 'locked'",
        "found stiffness for a coordinate that is locked by motion.angle; it has no effect",
    ),
    (
        "kind = 'prismatic'\ndamping = 1\nmotion.position = 1",
        "found damping for a coordinate that is prescribed by motion.position",
    ),
    (
        "kind = 'universal'\nangles = [0, 1]\nmotion.angles = ['free', 0.4]",
        "found angles for a coordinate that is prescribed",
    ),
    (
        "kind = 'free'\nslide_stiffness = 1\nmotion.position = ['free', 'free', 0.4]",
        "found slide_stiffness for a coordinate",
    ),
    (
        "kind = 'spherical'\nrates = [1, 0, 0]\nmotion.angles = ['free', 'free', 0.4]",
        "found rates with motion.angles",
    ),
    (
        "kind = 'spherical'\nrotation = 'zyx'\nmotion.angles = ['free', 'free', 0.4]",
        "found rotation 'zyx' and motion.angles",
    ),
    ("kind = 'weld'\nmotion.angle = 1", "belongs to kind = 'revolute'"),
    ("kind = 'revolute'\nmotion.angles = [1]", "did you mean 'angle'?"),
    ("kind = 'revolute'\nmotion.angle = '3 m'", "a length; expected an angle"),
    ("kind = 'revolute'\nmotion.angle = 'lokced'", "a motion is 'locked', 'free', a number, or a table"),
    ("kind = 'revolute'\nmotion.angle = { kind = 'smoth_step' }", "did you mean 'smooth_step'?"),
    (
        "kind = 'revolute'\nmotion.angle = { kind = 'sine', amplitud = 1 }",
        "in a motion of kind 'sine'; did you mean 'amplitude'?",
    ),
    (
        "kind = 'revolute'\nmotion.angle = { kind = 'sine', amplitude = 1 }",
        "key 'frequency' is missing in a motion of kind 'sine'",
    ),
    (
        "kind = 'revolute'\nmotion.angle = { kind = 'smooth_step', to = 1, start = 2, end = 1 }",
        "a step from 2 s to 1 s must end after it starts",
    ),
    (
        "kind = 'revolute'\nmotion.angle = { kind = 'polynomial', coefficients = [0, '1 m/s'] }",
        "a velocity; expected an angular rate",
    ),
    (
        "kind = 'revolute'\nmotion.angle = { kind = 'sum', parts = ['locked', 1] }",
        "found 'free' or 'locked' among the parts of a sum",
    ),
    ("kind = 'universal'\nmotion.angles = ['free']", "found 1 motion; expected 2"),
    (
        "kind = 'universal'\nmotion.angles = ['free', '3 m']",
        "entry 2: found '3 m', which is a length; expected an angle",
    ),
    ("kind = 'general'\nturns = ['z']\nmotion.angles = [1, 2]", "found 2 motions in motion.angles and 1 turn;"),
]
TABLES = [
    ("times = [0, 1, 2], values = [0, 1, 2]", "a spline of degree 3 needs at least 4 points; found 3"),
    ("times = [0, 2, 1, 4], values = [0, 1, 2, 3]", "time 1 s of a spline follows 2 s; times must ascend"),
    ("times = [0, 1, 2, 4], values = [0, nan, 2, 3]", "entry 2: found nan; the number must be finite"),
    ("times = [1, 2, 3, 4], values = [0, 1, 2, 3]", "is known from 1 s to 4 s; it must begin at or before 0 s"),
    (
        "times = [0, 1, 2, 3], values = [0, 1, 2, 3]",
        "prescribed up to 3 s, the run lasts 4 s; give the",
    ),
    ("times = [0, 1, 2, 4]", "give times and values, or file and column"),
    (
        "file = 'none.csv', column = 'a'",
        "found file 'none.csv', which does not exist; names are relative",
    ),
    ("file = 'track.csv', column = 'a'", "column 'a' is not in track.csv; its first line names ['time', 'b']"),
    ("file = 'track.csv', column = 'b'", "line 3 of track.csv has 'x' for b; expected a number"),
]


@pytest.mark.parametrize(("given", "text"), MISTAKES)
def test_a_mistake_is_told_with_its_place(given: str, text: str):
    told = problems(given + "\n")
    assert "joints[arm]" in told and text in told


@pytest.mark.parametrize(("given", "text"), TABLES)
def test_a_table_that_is_no_motion_is_told(given: str, text: str, tmp_path: Path):
    (tmp_path / "track.csv").write_text("time [s],b\n0,1\n1,x\n")
    told = problems(f"kind = 'revolute'\nmotion.angle = {{ kind = 'table', {given} }}\n", tmp_path)
    assert "joints[arm]" in told and text in told
