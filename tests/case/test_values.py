"""Values of a case become the SI numbers, matrices, motions and laws of their definitions; texts are read back."""

from __future__ import annotations

import math
import tomllib
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femflex.case import Case, parse_case, read_case, with_values
from femflex.case.attitude import AttitudeTable
from femflex.case.body import FlexibleTable
from femflex.case.changed import toml_text
from femflex.case.mesh_groups import with_regions
from femflex.case.run import RunTable
from femflex.mesh.generators import line
from femflex.pipeline import prepare
from femflex.system.columns import column_of
from femflex.system.load_file import read_load_file
from femflex.system.motion import MotionOf

HUB = "[run]\nduration = 4\n[bodies.hub]\nkind = 'rigid'\nmass = 2\ninertia = [3, 4, 5]\n"


def with_marker(orientation: Any) -> Case:
    return parse_case(HUB + toml_text({"bodies": {"hub": {"markers": {"m": {"orientation": orientation}}}}}))


def orientation(value: Any) -> np.ndarray:
    """C of a marker with this orientation."""
    return np.array(with_marker(value).bodies["hub"].markers["m"].orientation)


def turn(axis: str, angle: float) -> np.ndarray:
    """C of a turn about one axis, from the textbook."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    C = np.eye(3)
    C[j, j] = C[k, k] = math.cos(angle)
    C[k, j], C[j, k] = math.sin(angle), -math.sin(angle)
    return C


@pytest.mark.parametrize("sequence", ["xyz", "zxy", "yzy", "intrinsic yxz", "extrinsic yxz", "extrinsic zxz"])
def test_orientation_by_angles_is_the_product_of_its_turns(sequence: str):
    a, b, c = angles = (0.3, -0.5, 0.8)
    p, q, r = sequence[-3:]
    expected = turn(p, a) @ turn(q, b) @ turn(r, c)
    if sequence.startswith("extrinsic"):
        expected = turn(r, c) @ turn(q, b) @ turn(p, a)
    np.testing.assert_allclose(orientation({"sequence": sequence, "angles": list(angles)}), expected, atol=1e-14)


@pytest.mark.parametrize(("first", "second"), ["xy", "xz", "yx", "yz", "zx", "zy"])
def test_orientation_by_two_directions_is_right_handed_and_keeps_the_first(first: str, second: str):
    a, b = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.4, 2.0])
    C = orientation({first: a.tolist(), second: b.tolist()})
    i, j = "xyz".index(first), "xyz".index(second)
    np.testing.assert_allclose(C.T @ C, np.eye(3), atol=1e-14)
    assert np.linalg.det(C) == pytest.approx(1.0)
    np.testing.assert_allclose(C[:, i], a / np.linalg.norm(a), atol=1e-14)
    assert C[:, j] @ b > 0 and abs(np.linalg.det(np.stack([a, b, C[:, j]]))) < 1e-12


def test_rounded_matrix_becomes_the_nearest_rotation():
    C = turn("x", 0.3) @ turn("y", 0.7)
    rotation = orientation(np.round(C, 7).tolist())
    np.testing.assert_allclose(rotation, C, atol=1e-7)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)


@pytest.mark.parametrize(
    ("gravity", "vector"), [('"981 cm/s^2"', (0, 0, -9.81)), ('[1, "2 km/s^2", -3]', (1, 2000, -3))]
)
def test_gravity_of_one_number_acts_along_minus_z(gravity: str, vector: tuple[float, ...]):
    assert parse_case(f"{HUB}[environment]\ngravity = {gravity}\n").environment.gravity == pytest.approx(vector)


@pytest.mark.parametrize(
    ("sequence", "turns"),
    [("xzy", (0.1, 0.3, 0.2)), ("yxz", (0.2, 0.1, 0.3)), ("extrinsic zyx", (0.3, 0.2, 0.1)), ("zxy", (0.3, 0.1, 0.2))],
)
def test_pitch_yaw_and_roll_are_turns_about_x_y_and_z(sequence: str, turns: tuple[float, ...]):
    table = AttitudeTable.model_validate({"pitch": 0.1, "yaw": 0.2, "roll": 0.3, "sequence": sequence})
    assert table.turn_angles() == turns
    assert AttitudeTable.model_validate({"yaw": 0.2, "sequence": sequence}).turn_angles() == tuple(
        0.2 * (t == 0.2) for t in turns
    )
    assert AttitudeTable.model_validate({"angles": [4, 5, 6], "sequence": sequence}).turn_angles() == (4, 5, 6)


@pytest.mark.parametrize(
    ("table", "times"),
    [
        ({"output_step": 0.4}, [0, 0.4, 0.8, 1.0]),
        ({"output_step": 0.25}, [0, 0.25, 0.5, 0.75, 1.0]),
        ({"output_step": 0.1}, [0.1 * k for k in range(11)]),
        ({"samples": 4}, [0, 1 / 3, 2 / 3, 1]),
    ],
)
def test_output_times_end_with_the_run(table: dict[str, Any], times: list[float]):
    run = RunTable.model_validate({"duration": 1.0} | table)
    np.testing.assert_allclose(run.times(1.0), times, atol=1e-14)
    assert run.rows(1.0) == len(times) and run.times(1.0)[-1] == 1.0
    assert len(RunTable.model_validate({"duration": 2}).times(2.0)) == 1001
    assert RunTable.model_validate({"orbits": 2.5}).length(40.0) == 100.0


MOTIONS: list[tuple[dict[str, Any], Any]] = [
    ({"kind": "constant", "value": "90 deg"}, lambda t: math.pi / 2),
    (
        {"kind": "polynomial", "coefficients": ["10 deg", "2 deg/s", 0.3, -0.1]},
        lambda t: math.radians(10 + 2 * t) + 0.3 * t**2 - 0.1 * t**3,
    ),
    (
        {"kind": "sine", "amplitude": "20 deg", "frequency": "500 mHz", "phase": "40 deg", "mean": 0.1},
        lambda t: 0.1 + math.radians(20) * math.sin(math.pi * t + math.radians(40)),
    ),
    (
        {"kind": "table", "times": ["0 s", 1, 2, 4], "values": [0, "90 deg", 0.5, -1], "degree": 3},
        {0: 0, 1: math.pi / 2, 2: 0.5, 4: -1},
    ),
    ({"kind": "smooth_step", "from": 0.2, "to": 1.2, "start": 1, "end": "3 s"}, {0.5: 0.2, 2: 0.7, 3.5: 1.2}),
    ({"kind": "trapezoid", "to": 3, "start": 1, "end": 5, "ramp": 1}, {1: 0, 2: 0.5, 3: 1.5, 4: 2.5, 6: 3}),
    ({"kind": "sum", "parts": [0.25, {"kind": "polynomial", "coefficients": [0, 1]}]}, lambda t: 0.25 + t),
]


@pytest.mark.parametrize(("table", "value"), MOTIONS, ids=[table["kind"] for table, _ in MOTIONS])
def test_motion_has_the_values_of_its_formula(table: dict[str, Any], value: Any):
    motion = MotionOf("rad").read_value(table)
    assert motion is not None and motion.profile is not None and motion.table == table
    profile = motion.profile(Path())
    for t, expected in value.items() if isinstance(value, dict) else [(t, value(t)) for t in (0.0, 0.7, 2.3)]:
        assert profile(float(t))[0] == pytest.approx(expected, abs=1e-12), t


def test_column_of_a_file_is_read_in_the_unit_of_its_head(tmp_path: Path):
    path = tmp_path / "a.csv"
    path.write_text("azimuth [deg],time (min),x\n90,0,7\n-45,0.5,\n# note\n30,2,9\n", encoding="utf-8-sig")
    times, values = column_of(path, "azimuth", "rad")
    assert times == pytest.approx([0, 30, 120]) and values == pytest.approx([math.pi / 2, -math.pi / 4, math.pi / 6])


def test_load_table_has_every_column_in_its_place(tmp_path: Path):
    path = tmp_path / "a.csv"
    path.write_text("tz [kN m],fy,TIME [ms],fx (kN),fz,ty,tx\n1,2,0,3,4,5,6\n7,8,500,9,10,11,12\n")
    times, force, torque = read_load_file(path)
    np.testing.assert_allclose(times, [0, 0.5])
    np.testing.assert_allclose(force, [[3000, 2, 4], [9000, 8, 10]])
    np.testing.assert_allclose(torque, [[6, 5, 1000], [12, 11, 7000]])


def test_regions_of_a_body_are_groups_of_its_mesh():
    mesh = line([[0, 0, 0], [4.0, 0, 0]], 8).with_groups(points={"root": [0], "mid": [3, 4, 5]})
    regions = {
        "near": {"nearest": [1.2, 5.0, 0]},
        "some": {"points": [2, 9]},
        "inside": {"box": [[1.9, -1, -1], [9, 1, 1]]},
        "within": {"box": [[1.9, -1, -1], [9, 1, 1]], "within": "mid"},
    }
    table = {"kind": "flexible", "mesh": "a.msh", "members": [{"group": "line", "family": "beam"}], "regions": regions}
    table["reduction"] = {"method": "cantilever", "clamp": "root", "modes": 3}
    mesh_with_regions = with_regions(mesh, FlexibleTable.model_validate(table))
    positions = {
        name: sorted(mesh_with_regions.points[mesh_with_regions.group_points(name)][:, 0].tolist()) for name in regions
    }
    assert positions == {"near": [1.0], "some": [0.5, 4.0], "inside": [2, 2.5, 3, 3.5, 4], "within": [2.0, 2.5]}


TABLES: dict[str, Any] = {
    "environment": {"epoch": datetime(2026, 3, 20, 12, tzinfo=UTC)},
    "title": 'é "quoted" \\ line\nbreak \U0001f6f0 of\ttwo',
    "on": True,
    "empty": [],
    "a b": {"x.y": 1, "inner": {"deep": [1, [2.5, "z"], -1e-30]}, "none": {}},
    "only": {"sub": {"k": float("inf")}},
    "rows": [{"n": 1, "more": {"p": False}}, {"n": 2, "parts": [{"q": 1}, {"q": 2}]}],
    "inline": [[{"u": 1, "v w": "t"}, {"u": 2}]],
}


def test_tables_written_as_text_are_read_back_unchanged():
    assert tomllib.loads(toml_text(TABLES)) == TABLES


def test_changed_values_reach_the_model_and_leave_the_rest(write_case):
    case = read_case(write_case())
    changes = {"bodies.hub.mass": np.float64(410.0), "run.duration": "2 min", "joints.0.name": "root"}
    changed = with_values(case, changes | {"bodies.hub.markers.left.position": np.ones(3), "run.integrator": "esdirk4"})
    assert (changed.bodies["hub"].mass, changed.run.duration, changed.joints[0].name) == (410.0, 120.0, "root")
    assert case.bodies["hub"].mass == 200.0 and changed.bodies["boom"] == case.bodies["boom"]
    assert parse_case(changed.text, case.path).model_dump() == changed.model_dump()
    assert prepare(changed).system.bodies["hub"].moments.mass == 410.0
