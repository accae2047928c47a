"""Values of a case read into SI numbers, matrices, motions and laws that follow from their definitions."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from femflex.assembly.craft import controller_outputs, craft_notes, sensor_outputs, signals_of
from femflex.assembly.loads import read_load_table
from femflex.case import CaseError, parse_case, with_values
from femflex.case.base import Orientation
from femflex.case.changed import changed_tables, changed_text, toml_text, written_keys
from femflex.case.columns import column_of
from femflex.case.environment import EnvironmentTable
from femflex.case.joint import Joint
from femflex.case.joint_values import Axis
from femflex.case.law import read_laws
from femflex.case.motion import MotionOf
from femflex.case.orbit import AttitudeTable
from femflex.case.problems import item_label, near, printable
from femflex.case.run import RunTable
from femflex.case.starting_deck import DeckFacts, deck_tables, scale_of
from femflex.case.sweep import parse_sweep, read_sweep
from femflex.case.units import UnitError, to_base, to_si
from femflex.case.values import Quantity, ValueProblem
from femflex.warning import PhysicsWarning

HUB = "[run]\nduration = 4\n[bodies.hub]\nkind = 'rigid'\nmass = 2\ninertia = [3, 4, 5]\n"


def turn(axis: str, angle: float) -> np.ndarray:
    """C of a turn about one axis, from the textbook."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    C = np.eye(3)
    C[j, j] = C[k, k] = math.cos(angle)
    C[k, j], C[j, k] = math.sin(angle), -math.sin(angle)
    return C


@pytest.mark.parametrize("sequence", ["xyz", "zxy", "yzy", "intrinsic yxz", "extrinsic yxz", "extrinsic zxz"])
def test_an_orientation_by_angles_is_the_product_of_its_turns(sequence: str):
    a, b, c = angles = (0.3, -0.5, 0.8)
    p, q, r = sequence[-3:]
    expected = turn(p, a) @ turn(q, b) @ turn(r, c)
    if sequence.startswith("extrinsic"):
        expected = turn(r, c) @ turn(q, b) @ turn(p, a)
    found = TypeAdapter(Orientation).validate_python({"sequence": sequence, "angles": list(angles)})
    np.testing.assert_allclose(found, expected, atol=1e-14)
    if sequence == "xyz":
        np.testing.assert_allclose(
            TypeAdapter(Orientation).validate_python({"angles": list(angles)}), expected, atol=1e-14
        )


@pytest.mark.parametrize("first", "xyz")
@pytest.mark.parametrize("second", "xyz")
def test_an_orientation_by_two_directions_is_right_handed_and_keeps_the_first(first: str, second: str):
    a, b = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.4, 2.0])
    if first == second:
        return
    C = np.array(TypeAdapter(Orientation).validate_python({first: a.tolist(), second: b.tolist()}))
    i, j = "xyz".index(first), "xyz".index(second)
    np.testing.assert_allclose(C.T @ C, np.eye(3), atol=1e-14)
    assert np.linalg.det(C) == pytest.approx(1.0)
    np.testing.assert_allclose(C[:, i], a / np.linalg.norm(a), atol=1e-14)
    assert C[:, j] @ b > 0 and abs(np.linalg.det(np.stack([a, b, C[:, j]]))) < 1e-12


def test_a_printed_matrix_becomes_the_nearest_rotation_and_others_are_refused():
    C = turn("x", 0.3) @ turn("y", 0.7)
    found = np.array(TypeAdapter(Orientation).validate_python(np.round(C, 7).tolist()))
    np.testing.assert_allclose(found, C, atol=1e-7)
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-14)
    with pytest.raises(ValidationError, match=r"differs from 1 by 1.0e-05"):
        TypeAdapter(Orientation).validate_python([[1.000005, 0, 0], [0, 1, 0], [0, 0, 1]])
    with pytest.raises(ValidationError, match="determinant -1"):
        TypeAdapter(Orientation).validate_python([[0, 1, 0], [1, 0, 0], [0, 0, 1]])
    with pytest.raises(ValidationError, match=r"found sequence 'xyx2' \(text\); known are xyz, xzy"):
        TypeAdapter(Orientation).validate_python({"sequence": "xyx2", "angles": [0, 0, 0]})


@pytest.mark.parametrize(("text", "axis"), [("x", (1, 0, 0)), ("-y", (0, -1, 0)), ("-z", (0, 0, -1)), ("z", (0, 0, 1))])
def test_an_axis_may_be_a_letter_with_a_sign(text: str, axis: tuple[int, ...]):
    assert TypeAdapter(Axis).validate_python(text) == axis


def test_gravity_of_one_number_acts_along_minus_z():
    assert EnvironmentTable.model_validate({"gravity": "981 cm/s^2"}).gravity == pytest.approx((0, 0, -9.81))
    assert EnvironmentTable.model_validate({"gravity": [1, "2 km/s^2", -3]}).gravity == (1, 2000, -3)
    with pytest.raises(ValidationError, match=r"found -9.81 m/s\^2; a single number"):
        EnvironmentTable.model_validate({"gravity": -9.81})


@pytest.mark.parametrize(
    ("sequence", "turns"),
    [("xzy", (0.1, 0.3, 0.2)), ("yxz", (0.2, 0.1, 0.3)), ("extrinsic zyx", (0.3, 0.2, 0.1)), ("zxy", (0.3, 0.1, 0.2))],
)
def test_pitch_yaw_and_roll_are_turns_about_x_y_and_z(sequence: str, turns: tuple[float, ...]):
    table = AttitudeTable.model_validate({"pitch": 0.1, "yaw": 0.2, "roll": 0.3, "sequence": sequence})
    assert table.turns() == turns
    assert AttitudeTable.model_validate({"yaw": 0.2, "sequence": sequence}).turns() == tuple(
        0.2 * (t == 0.2) for t in turns
    )
    assert AttitudeTable.model_validate({"angles": [4, 5, 6], "sequence": sequence}).turns() == (4, 5, 6)


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


@pytest.mark.parametrize(("given", "value"), MOTIONS, ids=[given["kind"] for given, _ in MOTIONS])
def test_a_motion_has_the_values_of_its_formula(given: dict[str, Any], value: Any):
    motion = MotionOf("rad").read(given)
    assert motion is not None and motion.profile is not None and motion.given == given
    profile = motion.profile(Path())
    for t, expected in value.items() if isinstance(value, dict) else [(t, value(t)) for t in (0.0, 0.7, 2.3)]:
        assert profile(float(t))[0] == pytest.approx(expected, abs=1e-12), t


def test_a_table_of_degree_five_is_another_curve_than_of_degree_three():
    times, values = [0, 1, 2, 3, 4, 5, 6], [0, 1, 0, 2, -1, 0, 1]
    read = MotionOf("m").read
    curves = [
        read({"kind": "table", "times": times, "values": values} | more)
        for more in ({}, {"degree": 5}, {"ends": "rest"})
    ]
    at = [curve.profile(Path())(0.5) for curve in curves]  # type: ignore[union-attr, misc]
    assert len({round(float(one[0]), 6) for one in at}) == 3
    start = curves[2].profile(Path())(0.0)  # type: ignore[union-attr, misc]
    assert start[1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"kind": "polynomial", "coefficients": []}, r"coefficients: found \[\] \(a list\); expected a list"),
        ({"kind": "polynomial", "coefficients": [0, 1, 2, 3, 4, "1 m"]}, r"write it as a plain number in m/s\^5"),
        ({"kind": "table", "times": [0, 1], "values": [0, 1], "degree": 4}, r"found degree 4 \(a number\)"),
        ({"kind": "table", "times": [0, 1], "values": [0, 1], "ends": "free"}, "and ends 'free'"),
        ({"kind": "table", "times": [0, 1], "file": "a.csv"}, r"found \['file', 'times'\] in a table"),
        ({"kind": "sum", "parts": [1]}, "expected a list of at least two motions"),
        ({"kind": "sum", "parts": [1, "locked"]}, "found 'free' or 'locked' among the parts"),
        (
            {"kind": "sine", "amplitude": "1 s", "frequency": 1},
            "amplitude: found '1 s', which is a time; expected a length",
        ),
        ({"kind": "smooth_step", "to": 1, "start": 0}, "key 'end' is missing in a motion of kind 'smooth_step'"),
        ({"kind": "sine", "amplitud": 1}, "found key 'amplitud' .*did you mean 'amplitude'"),
    ],
)
def test_a_motion_that_cannot_be_read_tells_its_key(given: dict[str, Any], told: str):
    with pytest.raises((ValueProblem, UnitError)) as caught:
        MotionOf("m").read(given)
    assert re.search(told, str(caught.value)), str(caught.value)


@pytest.mark.parametrize("turning", [False, True])
def test_laws_are_read_in_the_unit_of_their_coordinate(turning: bool):
    u = {True: ("deg", math.pi / 180), False: ("cm", 0.01)}[turning]
    force = "N m" if turning else "N"
    per = "rad" if turning else "m"
    tables = (
        {"kind": "spring", "coordinate": "b", "at": [f"-1 {u[0]}", f"2 {u[0]}"], "force": [f"-3 k{force}", 4],
         "name": "soft"},
        {"kind": "damper", "coordinate": "b", "rate": [f"-5 {u[0]}/s", 6], "force": [-7, 8]},
        {
            "kind": "stop", "coordinate": "b", "lower": f"-9 {u[0]}", "upper": 10, "stiffness": f"11 k{force}/{per}",
            "damping": f"12 {force} s/{per}", "width": f"13 {u[0]}",
        },
        {"kind": "friction", "coordinate": "b", "force": 14, "velocity": f"15 {u[0]}/s"},
        {"kind": "latch", "coordinate": "b", "at": f"16 {u[0]}", "stiffness": 17, "damping": 18},
        {"kind": "latch", "coordinate": "a", "at": 1},
    )  # fmt: skip
    (spring, damper, stop, friction), (latch, other) = read_laws(tables, {"a": "m", "b": "rad" if turning else "m"})
    assert (latch.freedom, other.freedom, latch.stiffness, latch.damping) == (1, 0, 17, 18)
    assert latch.at == pytest.approx(16 * u[1]) and other.at == 1
    found: list[Any] = [spring, damper, stop, friction]
    assert [law.freedom for law in found] == [1] * 4 and found[0].name == "soft"
    assert found[0].stretch == pytest.approx((-u[1], 2 * u[1])) and found[0].resisting == pytest.approx((-3000, 4))
    assert found[1].rate == pytest.approx((-5 * u[1], 6)) and found[1].resisting == (-7, 8)
    assert (found[2].lower, found[2].upper) == pytest.approx((-9 * u[1], 10))
    assert (found[2].stiffness, found[2].damping, found[2].width) == pytest.approx((11000, 12, 13 * u[1]))
    assert (found[3].limit, found[3].velocity) == pytest.approx((14, 15 * u[1]))


@pytest.mark.parametrize(
    ("laws", "told"),
    [
        ("soft", r"found 'soft' \(text\); expected tables headed"),
        ([{"kind": "spring", "at": [0, 1]}], "entry 1: key 'force' of the spring is missing"),
        (
            [{"kind": "latch", "at": 1}, {"kind": "stop", "stifness": 1}],
            "entry 2: found key 'stifness' in a stop; did you mean 'stiffness'",
        ),
        (
            [{"kind": "latch", "at": 1}, {"kind": "spring", "at": [0, 1, 2], "force": [1]}],
            r"laws: entry 2: found 3 places and 1 force in a spring",
        ),
        ([{"kind": "latch", "at": "1 m"}], r"laws: entry 1: at: found '1 m', which is a length; expected an angle"),
        ([{"kind": "latch", "at": 1, "name": "lock"}], "entry 1: found key 'name' in a latch; known are 'at', 'coord"),
        ([{"kind": "latch", "at": 1, "coordinate": "slide"}], "which the joint does not have"),
    ],
)
def test_laws_that_cannot_be_read_tell_their_number(laws: Any, told: str):
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(Joint).validate_python({"kind": "revolute", "child": "a", "laws": laws})
    assert re.search(told, str(caught.value)), str(caught.value)


# columns, texts and keys


def test_a_column_is_read_in_the_unit_of_its_head(tmp_path: Path):
    path = tmp_path / "a.csv"
    path.write_text("# a, comment\nazimuth [deg],time (min),x\n90,0,7\n\n,,\n", encoding="utf-8-sig")
    with pytest.raises(ValueError, match=r"line 5 of a.csv has '' for time"):
        column_of(path, "azimuth", "rad")
    path.write_text("azimuth [deg],time (min),x\n90,0,7\n-45,0.5,\n# note\n30,2,9\n", encoding="utf-8-sig")
    times, values = column_of(path, "azimuth", "rad")
    assert times == pytest.approx([0, 30, 120]) and values == pytest.approx([math.pi / 2, -math.pi / 4, math.pi / 6])
    with pytest.raises(ValueError, match=r"line 3 of a.csv has '' for x; expected a number"):
        column_of(path, "x", "m")
    with pytest.raises(
        ValueError, match=r"column 'y' is not in a.csv; its first line names \['azimuth', 'time', 'x'\]"
    ):
        column_of(path, "y", "m")
    path.write_text("time,x\n0,1\n1,1e99\n")
    with pytest.raises(ValueError, match=r"line 3 of a.csv has 1e99 for x; it must be zero, or its magnitude"):
        column_of(path, "x", "m")


def test_a_load_table_has_every_column_in_its_place(tmp_path: Path):
    path = tmp_path / "a.csv"
    path.write_text("tz [kN m],fy,TIME [ms],fx (kN),fz,ty,tx\n1,2,0,3,4,5,6\n7,8,500,9,10,11,12\n")
    times, force, torque = read_load_table(path)
    np.testing.assert_allclose(times, [0, 0.5])
    np.testing.assert_allclose(force, [[3000, 2, 4], [9000, 8, 10]])
    np.testing.assert_allclose(torque, [[6, 5, 1000], [12, 11, 7000]])
    for text, told in (
        ("", "a.csv is empty"),
        ("time,fx\n0,1\n", "a.csv holds 1 row of numbers"),
        ("time,fx\n0,1\n\n2,1\n1.5,1\n", "line 5 of a.csv has time 1.5 s after 2 s"),
        ("time,fx,fx\n0,1,1\n", "column 'fx' stands twice in a.csv"),
        ("time,fx [N],FX (kN)\n0,1,1\n", "column 'fx' stands twice in a.csv"),
        ("time,fw\n0,1\n", "column 'fw' of a.csv is not known; known are 'fx'"),
        ("time [m],fx\n0,1\n", "column 'time' of a.csv: found '1 m'"),
        ("time\n0\n1\n", r"a.csv has the columns \['time'\]; it needs time and at least one"),
        ("fx,tx\n0,1\n", r"a.csv has the columns \['fx', 'tx'\]"),
        ("time,fx\n0,1\n3\n", "line 3 of a.csv has 1 entry; its head names 2 columns"),
    ):
        path.write_text(text)
        with pytest.raises(ValueError, match=told):
            read_load_table(path)


TABLES: dict[str, Any] = {
    "title": 'é "quoted" \\ line\nbreak',
    "on": True,
    "empty": [],
    "a b": {"x.y": 1, "inner": {"deep": [1, [2.5, "z"], -1e-30]}, "none": {}},
    "only": {"sub": {"k": float("inf")}},
    "rows": [{"n": 1, "more": {"p": False}}, {"n": 2, "parts": [{"q": 1}, {"q": 2}]}],
    "inline": [[{"u": 1, "v w": "t"}, {"u": 2}]],
}


def test_tables_written_as_text_are_read_back_as_they_are():
    assert tomllib.loads(toml_text(TABLES)) == TABLES


def test_every_key_of_nested_tables_has_its_path():
    assert written_keys({"a": {"b": [1, {"c": 2}]}, "d": 3}) == ["a", "a.b", "a.b.0", "a.b.1", "a.b.1.c", "d"]


def test_changed_values_leave_the_tables_they_come_from():
    found = changed_tables(
        TABLES,
        {"rows.1.parts.0.q": np.float64(2.5), "a b.new": {"k": (1, 2)}, "empty": np.arange(3), "on": "no"},
        "c.toml",
    )
    assert found["rows"][1]["parts"] == [{"q": 2.5}, {"q": 2}] and found["a b"]["new"] == {"k": [1, 2]}
    assert (found["empty"], found["on"]) == ([0, 1, 2], "no") and TABLES["rows"][1]["parts"][0]["q"] == 1
    assert tomllib.loads(changed_text("a = 1\n[b]\nc = [4, 5]\n", {"b.c.1": 7}, "c")) == {"a": 1, "b": {"c": [4, 7]}}
    for path, told in (
        ("rows.2.n", "'rows.2.n' is no key of c.toml: rows is a list of 2; give a number from 0"),
        ("rows.-1.n", "rows is a list of 2"),
        ("title.x", "title is '"),
        ("title.x.y", "title is '.*holds no keys"),
        ("only.sbu.k", r"only has no 'sbu'; did you mean 'sub'\? Known there are sub"),
        ("zzz.k", "the file has no 'zzz'. Known there are title, on"),
    ):
        with pytest.raises(ValueError, match=told):
            changed_tables(TABLES, {path: 1}, "c.toml")
    with pytest.raises(ValueError, match="found None of type NoneType"):
        changed_tables(TABLES, {"on": None}, "c.toml")


def test_values_of_a_list_change_one_table_of_it_alone():
    text = HUB + "".join(
        f"[[loads]]\nname = '{n}'\nbody = 'hub'\nforce = [{n}, 0, 0]\n".replace("'1'", "'a'").replace("'2'", "'b'")
        for n in (1, 2)
    )
    case = with_values(parse_case(text), {"loads.1.force": [5, 6, 7], "run.duration": 9})
    assert [load.force for load in case.loads] == [(1, 0, 0), (5, 6, 7)] and case.run.duration == 9
    again = with_values(case, {"loads.0.force": [8, 0, 0]})
    assert [load.force for load in again.loads] == [(8, 0, 0), (5, 6, 7)] and again.run.duration == 9


# sentences


def test_names_nearby_and_known_are_reported():
    assert near("bom", ["boom", "hub"]) == "did you mean 'boom'? known are 'boom', 'hub'"
    assert near("bom", ["boom"]) == "did you mean 'boom'?"
    assert near("bom", ["boom", "a1", "b2", "c3", "d4"]) == "did you mean 'boom'?"
    assert near("HUB", ["hub", "boom"]).startswith("did you mean 'hub'?")
    assert near("x", []) == "there are none" and near("zzz", ["b", "a"]) == "known are 'a', 'b'"
    items = [{"child": "a", "name": "n"}, {"child": "b"}, {"child": "b"}, {"group": "g"}, {}, 3]
    assert [item_label(items, k) for k in range(7)] == ["n", "1: b", "2: b", "g", "4", "5", "6"]
    assert printable("a" * 130 + " b\tc") == "a" * 60 + "..." + "a" * 20 + " b\\tc"
    assert printable("a" * 120) == "a" * 120


def test_units_are_hinted_at_where_another_was_meant():
    for text, unit, told in (
        ("3 Hz", "rad/s", "; cycles per second are written 'rev/s'"),
        ("3 kg", "N", "; a force in kilograms is written 'kgf'"),
        ("3 kg m", "N m", "; a force in kilograms is written 'kgf'"),
        ("3", "m", "found '3' without a unit; give a number (in m) or a string such as '33 m'"),
        ("3 deg", "kg", "which is an angle; expected a mass, such as '1 kg'"),
    ):
        with pytest.raises(UnitError) as caught:
            to_si(text, unit)
        assert told in str(caught.value)
    with pytest.raises(UnitError, match="kgf") as caught:
        to_si("3 kgf", "kg")
    assert "written 'kgf'" not in str(caught.value)
    assert to_base("3 km/h") == (pytest.approx(3 / 3.6), "m s^-1")
    assert to_si("2 kNm", "N m") == pytest.approx(2000) and to_si("2 rpm", "rad/s") == pytest.approx(math.pi / 15)
    assert to_si("3 N m/deg", "N m/rad") == pytest.approx(3 * 180 / math.pi)


def test_entries_that_cannot_be_read_are_numbered_from_one():
    with pytest.raises(ValueProblem, match=r"entry 2: found true .*; entry 3: found 'x m'"):
        Quantity("m", (None,)).read([1, True, "x m"])
    with pytest.raises(ValueProblem) as caught:
        Quantity("m", (None, 2)).read([[1, 2], [1, True], [3], [True, 1], [True, 1]])
    found = str(caught.value)
    assert (
        found.startswith("row 2: entry 2: found true") and "row 3: found 1 entry; expected a list of 2 numbers" in found
    )
    assert found.endswith("; and 1 more") and "row 5" not in found


def test_plies_and_foams_of_another_unit_are_reported():
    materials = "[materials.{}]\nkind = 'isotropic'\nE = 7e10\ndensity = {}\n"
    layup = "[sections.s]\nkind = 'layup'\n"
    layup += "plies = [{{ material = 'a', thickness = {} }}, {{ material = 'a', thickness = 0.06 }}]\n"
    text = HUB + materials.format("a", 2700)
    with pytest.warns(PhysicsWarning, match=r"sections.s.plies: found a ply of 0.2 m; .* write \"0.2 mm\"$"):
        parse_case(text + layup.format(0.2))
    parse_case(text + layup.format(0.06))  # no warning of plies that are thick together alone
    with pytest.warns(
        PhysicsWarning, match=r"materials.b.density: found 7.8 kg/m\^3, that of a foam; .*\(7800 kg/m\^3\)"
    ):
        parse_case(text + materials.format("b", 7.8))


# crafts


CRAFT = (
    HUB
    + """
[sensors.att]
kind = "attitude"
body = "hub"
[sensors.spin]
kind = "rate"
body = "hub"
[sensors.look]
kind = "pointing"
body = "hub"
[signals.want]
times = [0, 1]
values = [2, 3]
[controllers.one]
kind = "gain"
inputs = ["look"]
matrix = [[2]]
[controllers.two]
kind = "gain"
inputs = ["look", "want"]
matrix = [[2, 1], [3, 4]]
[controllers.own]
kind = "gain"
inputs = ["look"]
matrix = [[2], [3]]
outputs = ["p", "q"]
[controllers.pd]
kind = "pd"
inputs = ["att", "spin"]
stiffness = 1
damping = 2
[controllers.body]
kind = "attitude"
error = "att"
rate = "spin"
stiffness = 3
damping = 4
[wheels.w]
body = "hub"
inertia = 0.5
inertia_in_body = "added"
mass = 3.25
transverse_inertia = 0.125
speed = "60 rpm"
[wheels.v]
body = "hub"
inertia = 0.25
inertia_in_body = "contained"
[thrusters.jet]
body = "hub"
thrust = 1
pulses = [[0, 1]]
specific_impulse = 200
tank = "t"
[tanks.t]
body = "hub"
propellant = 7.5
mass_in_body = "contained"
[tanks.u]
body = "hub"
propellant = 2.5
mass_in_body = "added"
"""
)


def test_names_of_sensors_controllers_and_signals_stand_for_all_of_their_outputs():
    case = parse_case(CRAFT)
    found = signals_of(case, ["att", "look", "want", "one", "two", "own", "pd", "body", "hand.made"])
    xyz = ["x", "y", "z"]
    assert found == [
        *(f"att.{a}" for a in xyz), "look.angle", "want.value", "one.y", "two.y1", "two.y2", "own.p", "own.q",
        *(f"pd.{a}" for a in xyz), *(f"body.{a}" for a in xyz), "hand.made",
    ]  # fmt: skip
    assert controller_outputs(case, case.controllers["body"]) == xyz and sensor_outputs(case.sensors["spin"]) == xyz
    with pytest.raises(ValueError, match="found 'lok', which is no sensor, controller or signal; did you mean 'look'"):
        signals_of(case, ["lok"])


def test_what_a_craft_adds_to_its_bodies_is_reported_with_its_numbers():
    assert craft_notes(parse_case(CRAFT)) == [
        "Wheel w was added to hub: mass 3.25 kg, transverse inertia 0.125 kg m^2.",
        "Wheel v is contained in hub: its axial inertia of 0.25 kg m^2 was taken out of the body's.",
        "Propellant of tank t, 7.5 kg, is contained in the mass of hub.",
        "Propellant of tank u, 2.5 kg, was added to hub.",
    ]


# starting cases of decks


def test_a_starting_case_is_scaled_to_the_deck():
    facts = DeckFacts(
        file="w.bdf", solver="Nastran", units="mm-t-s", units_reason="a guess", supports=("spc_1",), clamp="spc_1",
        root=3, tip=8,
        groups=tuple(f"g{k}" for k in range(26)), mass=5.3, extent=7.1, frequencies=(0.4, 1.3, 7.7),
        materials=("mat_1", "mat_2"), weightless=(), notes=("look",),
    )  # fmt: skip
    scale = {key: float(value.split()[0]) for key, value in scale_of(facts).items()}
    assert scale["mass"] == 50 and scale["size"] == 2 and scale["half"] == 1  # 53 and 2.37, rounded down to 1, 2, 5
    assert scale["duration"] == 50  # twenty periods of the lowest mode
    assert scale["step"] == 0.01  # a tenth of the shortest period is 0.013 s
    assert scale["inertia"] == 20  # m s^2 / 6 = 33
    assert scale["middle"] == pytest.approx(50 / 6, rel=1e-5) and scale["end"] == pytest.approx(50 / 3, rel=1e-5)
    assert scale["torque"] == 0.2  # (20 + 5.3 7.1^2) 0.1 / (50 / 6)^2 = 0.41 -> 0.2
    read = tomllib.loads(deck_tables(facts))
    body = read["bodies"]["flexible"]
    assert (body["deck"], body["units"]) == ("w.bdf", "mm-t-s")
    assert body["reduction"] == {"method": "cantilever", "clamp": "spc_1", "modes": 3}
    assert body["markers"] == {"root": {"group": "node_3"}, "tip": {"group": "node_8"}}
    assert read["joints"][0]["child_marker"] == "root" and "where it is clamped" in deck_tables(facts)
    text = " ".join(deck_tables(facts).replace("\n# ", " ").split())
    all_shown = " ".join(deck_tables(replace(facts, groups=facts.groups[:24])).replace("\n# ", " ").split())
    assert "g22, g23. A node" in all_shown
    assert "g23 and 2 more" in text and "g24" not in text and "# overrides = { mat_1 = { density" in deck_tables(facts)


def test_a_starting_case_of_a_free_deck_without_mass_has_densities_to_look_at():
    facts = DeckFacts(
        file="w.inp", solver="Abaqus", units="m-kg-s", units_reason="as stated", supports=(), clamp="",
        root=3, tip=3, groups=(),
        mass=0.0, extent=0.0, weightless=("mat_1", "mat_2"),
    )  # fmt: skip
    read = tomllib.loads(deck_tables(facts))
    body = read["bodies"]["flexible"]
    assert body["overrides"] == {"mat_1": {"density": "2700 kg/m^3"}, "mat_2": {"density": "2700 kg/m^3"}}
    assert body["reduction"] == {"method": "free_free", "modes": 6} and set(body["markers"]) == {"root"}
    assert "at its middle" in deck_tables(facts) and "Groups of the deck: none." in deck_tables(facts)
    scale = scale_of(facts)
    assert (scale["mass"], scale["size"], scale["duration"], scale["step"]) == ("1 kg", "1 m", "60 s", "0.05 s")


# sweeps


def test_a_sweep_that_cannot_be_read_tells_its_file(tmp_path: Path):
    with pytest.raises(CaseError, match=r"none.toml: there is no such file"):
        read_sweep(tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00\xff")
    with pytest.raises(CaseError, match=r"bytes.toml: this file cannot be read as text"):
        read_sweep(tmp_path / "bytes.toml")
    with pytest.raises(CaseError, match=r"s.toml: this is no TOML file"):
        parse_sweep("a = ", "s.toml")
    with pytest.raises(CaseError, match=r"s.toml: vary: this key is missing"):
        parse_sweep("case = 'a'\nhistories = ['q']\n", "s.toml")
