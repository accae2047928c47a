"""Lines, tables and files of the verbs, of made-up results whose numbers are all different."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest

from femflex.assembly.system import system_of
from femflex.body import rigid_body
from femflex.case import parse_case
from femflex.cli.backbone import _print_curve, amplitude_note, read_lengths
from femflex.cli.campbell_report import print_campbell, write_table
from femflex.cli.craft_modes import caption, damping_note, kinetic_energy_text, print_modes
from femflex.cli.equilibrium import frame_text, print_stability
from femflex.cli.info import kind_of_hdf5
from femflex.cli.linearize import listed, print_model
from femflex.cli.modes import group_equal_bodies, kind_counts
from femflex.cli.names import listed_names
from femflex.cli.pictures import _there, _wanted, portable_name
from femflex.cli.render import read_numbers
from femflex.cli.run import _what_is_kept
from femflex.cli.run_report import (
    _orbit_lines,
    cable_lines,
    change_line,
    latch_lines,
    print_moved_start,
    print_run_summary,
    print_verdicts,
    tank_lines,
    wheel_lines,
)
from femflex.cli.stability import one_axis, print_chart, print_locus
from femflex.cli.stability import write_table as write_stability
from femflex.cli.stress import _place
from femflex.cli.tables import folded_columns, folded_line, print_json, print_table
from femflex.cli.terms import print_term_tables, readable_part, term_rows
from femflex.cli.times import read_seconds
from femflex.studies.explain import Explanation
from femflex.studies.stability import Chart, Locus
from femflex.system import Environment

TIME = np.array([0.0, 0.5, 1.25, 3.0])


class Rows(dict):
    """Channels by path, as a run has them."""

    time = TIME
    without: tuple[str, ...] = ()
    statistics: dict[str, int] = {"accepted": 31, "rejected": 4, "evaluations": 402}  # noqa: RUF012

    def unit(self, path: str) -> str:
        return {"monitors/energy": "J", "monitors/angular_momentum": "N m s"}[path]


def lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return capsys.readouterr().out.splitlines()


# after a run


def test_latches_tell_when_they_locked_what_was_lost_and_that_they_did_not():
    run = Rows(
        {
            "latches/b.angle/time": np.array([-1.0, -1.0, 1.1234567891, 1.1234567891]),
            "latches/b.angle/loss": np.array([0.0, 0.0, 0.25, 0.375]),
            "latches/a.slide/time": np.full(4, -1.0),
            "latches/c.slide/time": np.array([0.0, -2.375, -2.375, -2.375]),
            "latches/d.slide/time": np.full(4, -9.0),
        }
    )
    assert latch_lines(run) == [
        "latch       a.slide did not lock",
        "latch       b.angle locked at t = 1.12345679 s, 0.375 J lost",
        "latch       c.slide was released at t = 0.375 s",
        "latch       d.slide was released before the start",
    ]


def test_tanks_tell_what_they_hold_or_when_they_were_empty():
    run = Rows(
        {
            "effectors/full/emptied": np.full(4, -1.0),
            "effectors/full/mass": np.array([5.0, 4.0, 3.0, 2.25]),
            "effectors/dry/emptied": np.array([-1.0, -1.0, 1.125, 1.125]),
            "effectors/dry/mass": np.array([1.0, 0.5, 0.0, 0.0]),
        }
    )
    assert tank_lines(run) == [
        "tank        dry was empty at t = 1.125 s; its thrusters gave no thrust from then on",
        "tank        full holds 2.25 kg",
    ]


def test_cables_and_wheels_tell_the_part_of_the_rows_and_its_ends():
    run = Rows(
        {
            "effectors/a/tension": np.array([0.0, 2.0, 0.0, 3.0]),
            "effectors/a/distance": np.ones(4),
            "effectors/heavy/tension": np.array([0.0, 1.0, 1.0, 1.0]),
            "effectors/heavy/slack": np.array([0.0, 0.0, 0.3, 0.0]),
            "effectors/tight/tension": np.ones(4),
            "effectors/tight/distance": np.ones(4),
            "effectors/motor/tension": np.zeros(4),
            "effectors/w/saturated": np.array([0.0, 1.0, 1.0, 1.0]),
        }
    )
    assert cable_lines(run) == [
        "cable       a was slack in 50% of the rows, first at t = 0 s, last at t = 1.25 s",
        "cable       heavy was slack in 25% of the rows, first at t = 1.25 s, last at t = 1.25 s",
    ]
    assert wheel_lines(run) == ["wheel       w was saturated in 75% of the rows, first at t = 0.5 s, last at t = 3 s"]


def test_a_change_is_the_largest_of_the_run_over_the_size_of_all_energies():
    run = Rows(
        {
            "monitors/energy": np.array([10.0, 10.5, 9.25, 10.125]),
            "monitors/kinetic": np.array([2.0, 3.0, 1.0, 2.0]),
            "monitors/elastic": np.array([1.0, -15.0, 4.0, 2.0]),
            "monitors/angular_momentum": np.array(
                [[0.0, 3.0, 4.0], [0.0, 3.0, 4.5], [0.25, 3.0, 4.0], [0.0, 3.0, 4.0]]
            ),
        }
    )
    assert (
        change_line(run, "monitors/energy") == "monitor     energy changed by up to 7.500e-01 J, 5.00e-02 of its size"
    )
    found = change_line(run, "monitors/angular_momentum")
    assert found == "monitor     angular momentum changed by up to 5.000e-01 N m s, 1.11e-01 of its size"
    run["monitors/angular_momentum"] = np.array([[0.0, 0.0, 0.0], [1e-9, 0.0, -2e-9]])
    assert change_line(run, "monitors/angular_momentum").endswith("changed by up to 2.000e-09 N m s")


def test_the_summary_of_a_run_has_its_steps_and_the_largest_violations(capsys: pytest.CaptureFixture[str]):
    names = type("Named", (Rows,), {"names": lambda self, path: ("x", "z", "y")})
    run = names(
        {
            "attitude/angles": np.zeros((4, 3)),
            "monitors/quaternion_norm": np.array([1e-12, -3e-11, 2e-11, 0.0]),
            "monitors/constraint_position": np.array([1e-9, 4e-9, 2e-9, 0.0]),
            "monitors/constraint_velocity": np.array([1e-7, 5e-8, 2e-8, 0.0]),
        }
    )
    system = SimpleNamespace(
        varying={"a": SimpleNamespace(write=None)},
        libration_sequence="xzy",
        bodies={},
        orbit=None,
        environment=Environment(),
    )
    print_run_summary(run, system, Path("a.h5"))  # type: ignore[arg-type]
    assert lines(capsys) == [
        "done        a.h5: 31 steps, 4 rejected, 402 evaluations",
        "monitor     constraint largest gap 4.000e-09 m, largest velocity residual 1.000e-07 m/s",
        "monitor     Euler parameters off unit length by up to 3.00e-11",
    ]


def test_moved_initial_values_are_listed_up_to_four(capsys: pytest.CaptureFixture[str]):
    print_moved_start(SimpleNamespace(moved=["a", "b", "c", "d"]))  # type: ignore[arg-type]
    print_moved_start(SimpleNamespace(moved=["a", "b", "c", "d", "e", "f"]))  # type: ignore[arg-type]
    print_moved_start(SimpleNamespace(moved=[]))  # type: ignore[arg-type]
    assert lines(capsys) == [
        "start       made consistent: a, b, c, d",
        "start       made consistent: a, b, c, d, and 2 more (all in the file's attribute `start_moved`)",
    ]


def test_the_heading_of_an_orbit_has_perigee_period_and_anomaly():
    case = parse_case(
        "[run]\nduration = 1\n[orbit]\nsemi_major_axis = '8000 km'\neccentricity = 0.1\ntrue_anomaly = '50 deg'\n"
        "radius = '6400 km'\n[environment]\noblateness = 1.0826e-3\n"
        "[bodies.a]\nkind = 'rigid'\nmass = 1\ninertia = [1, 2, 2.5]\n"
    )
    n = np.sqrt(3.986004418e14 / 8e6**3)
    prepared: Any = SimpleNamespace(system=system_of(case, None), case=case)
    assert _orbit_lines(prepared) == [
        "orbit       specified, perigee 800 km over 6400 km, e = 0.1",
        f"            period {2 * np.pi / n:.6g} s, n = {n:.6g} rad/s, true anomaly 50 deg at t = 0",
        "oblateness  J2 = 0.0010826, pole along the inertial Z axis",
    ]


def test_no_orbit_tells_gravity_if_there_is_any():
    system = SimpleNamespace(orbit=None, environment=Environment(np.array([0.5, 0.0, -9.81])))
    prepared: Any = SimpleNamespace(system=system, case=SimpleNamespace(orbit=None))
    assert _orbit_lines(prepared) == ["orbit       none", "gravity     (0.5, 0, -9.81) m/s^2, inertial axes"]
    system.environment = Environment()
    assert _orbit_lines(prepared) == ["orbit       none"]


def test_answers_are_not_checked_where_terms_are_switched_off(capsys: pytest.CaptureFixture[str]):
    head = "[run]\nduration = 1\n[bodies.a]\nkind = 'rigid'\nmass = 1\ninertia = [1, 2, 2.5]\n"
    low, high = "low = { channel = 'e', below = 1 }\n", "high = { channel = 'e', above = 3 }\n"
    expect = f"[expect]\n{low}{high}in = {{ channel = 'e', above = 1 }}\n"
    run: Any = Rows({"e": np.array([1.0, 2.0, 2.0, 2.0])})
    run.names = lambda path: ()
    run.unit = lambda path: "1"
    assert print_verdicts(parse_case(head + expect), run) == ["low", "high"]
    assert [line.split(": ")[-1] for line in lines(capsys)] == ["does not hold", "does not hold", "holds"]
    run.without = ("gyroscopic",)
    assert print_verdicts(parse_case(head + expect), run) == []
    assert lines(capsys) == ["expected    not checked: they are for the case with all terms"]
    assert print_verdicts(parse_case(head), run) == [] and lines(capsys) == []


def test_an_interrupted_run_tells_what_is_kept(tmp_path: Path):
    assert _what_is_kept(tmp_path / "a.h5", None) == "interrupted before the first row"
    assert _what_is_kept(tmp_path / "a.h5", (1, 2, 3)) == "interrupted before the first row"
    path = tmp_path / "b.h5"
    path.write_text("mine")
    found = path.stat()
    kept = _what_is_kept(path, (found.st_ino, found.st_size, found.st_mtime_ns))
    assert kept == f"interrupted before the first row; {path} is still that of an earlier run"


# modes and equilibria


def modes_of(**more: Any) -> Any:
    found: dict[str, Any] = {
        "names": ["hub rotation", "boom bending y", "boom bending z", "mast torsion"],
        "frequencies": np.array([0.0, 1.23456789, 2.5, 7.0]),
        "eigenvalues": np.array([0.0, -0.1 + 7.7570j, 0.2 + 15.7j, -0.4 + 44.0j]),
        "damping_ratios": np.array([0.0, 0.0129, -0.013, 0.009]),
        "growing": np.array([False, False, True, False]),
        "known": np.array([True, False, False, False]),
        "energy": {
            "hub": np.array([1.0, 0.2, 0.049, 0.051]),
            "boom": np.array([0.0, 0.8, 0.5, 0.04]),
            "mast.1": np.array([0.0, 0.0, 0.451, 0.909]),
        },
        "left_out": (),
        "held": [],
    }
    return SimpleNamespace(**found | more)


def test_shares_of_kinetic_energy_are_sorted_and_small_ones_left_out():
    modes = modes_of()
    assert kinetic_energy_text(modes, 1) == "boom 80 %, hub 20 %"
    assert kinetic_energy_text(modes, 2) == "boom 50 %, mast.1 45 %"
    assert kinetic_energy_text(modes, 3) == "mast.1 91 %, hub 5 %"


def test_a_caption_has_number_name_frequency_and_growth():
    assert caption(modes_of(), 2) == "2 · boom bending y · 1.235 Hz"
    assert caption(modes_of(), 3) == "3 · boom bending z · 2.5 Hz · grows"


def test_a_mode_whose_damping_is_not_that_of_its_body_is_reported():
    text = (
        "[run]\nduration = 1\n[bodies.{}]\nkind = 'analytic'\nlength = 1\nEA = 1\nEIy = 1\nEIz = 1\nGJ = 1\nmass = 1\n"
    )
    text += "functions = {{ y = 1 }}\ndamping = {{ ratio = {} }}\n"
    boom, mast = parse_case(text.format("boom", 0.0125)), parse_case(text.format("mast", 0.01))
    assert (
        damping_note(boom, modes_of(growing=np.zeros(4, bool), damping_ratios=np.array([0, 0.0129, 0.012, 0.009])))
        == ""
    )
    note = damping_note(boom, modes_of(damping_ratios=np.array([0.0, 0.0129, 0.0149, 0.9])))
    assert note.startswith("mode 3 has a ratio of 0.0149, and body 'boom' is given 0.0125")
    note = damping_note(mast, modes_of(damping_ratios=np.array([0.5, 0.5, 0.0105, 0.0085])))
    assert note.startswith("mode 4 has a ratio of 0.0085, and body 'mast.1' is given 0.01")


def test_modes_beyond_those_shown_are_counted(capsys: pytest.CaptureFixture[str]):
    about = SimpleNamespace(
        model=SimpleNamespace(
            system=SimpleNamespace(frame=SimpleNamespace(kind="spinning", rate=[0.1, 0, 2.5]), orbit=None, varying={})
        ),
        verdict="unstable",
        eigenvalues=(),
        share=1.0,
        motions=SimpleNamespace(known=[SimpleNamespace(name=n) for n in ("translation", "translation", "turn")]),
    )
    case = parse_case("[run]\nduration = 1\n[bodies.a]\nkind = 'rigid'\nmass = 1\ninertia = [1, 2, 2.5]\n")
    print_modes(case, modes_of(about=about, left_out=("load 'a'", "motion b")), 3, {})  # type: ignore[arg-type]
    text = lines(capsys)
    row = next(line for line in text if "bending y" in line).split()
    assert row[:1] + row[4:7] == ["2", "1.23457", "7.757", "0.0129"]
    assert "-0.013*" in next(line for line in text if "bending z" in line)
    assert not any("torsion" in line for line in text) and "and 1 modes above, which -n and --json list" in text
    assert "*           the motion grows" in text
    assert "about       at rest in the frame that spins at [0.1, 0, 2.5] rad/s" in text
    assert "left out    load 'a', motion b. Use --at TIME to evaluate them at a time" in text
    assert "rigid       translation (2 directions), turn: neither grow nor decay" in text
    print_modes(case, modes_of(about=about), 2, {})  # type: ignore[arg-type]
    text = lines(capsys)
    assert "and 2 modes above, which -n and --json list" in text and "*           the motion grows" not in text


@pytest.mark.parametrize(
    ("kind", "orbit", "text"),
    [
        ("orbital", SimpleNamespace(period=5432.1), "at rest in the orbital frame, period 5432.1 s"),
        ("inertial", SimpleNamespace(period=5432.1), "at rest in the inertial frame"),
        ("inertial", None, "at rest in the inertial frame"),
    ],
)
def test_the_frame_of_an_equilibrium_is_reported(kind: str, orbit: Any, text: str):
    system = SimpleNamespace(frame=SimpleNamespace(kind=kind), orbit=orbit)
    found: Any = SimpleNamespace(model=SimpleNamespace(system=system))
    assert frame_text(found) == text


def test_stability_has_the_growth_of_the_fastest_motion(capsys: pytest.CaptureFixture[str]):
    motions = SimpleNamespace(known=[SimpleNamespace(name="turn")])
    found: Any = SimpleNamespace(verdict="unstable", eigenvalues=[1], growth=0.12345, share=0.5, motions=motions)
    print_stability(found)
    text = lines(capsys)
    assert (
        text[0] == "stability   unstable" and text[1].startswith("growth      0.123 1/s at most; ") and len(text) == 2
    )


def test_equal_bodies_are_grouped_and_others_are_not():
    def body(mass: float, J: float) -> Any:
        return rigid_body(mass, J * np.eye(3), np.array([0.1, 0.2, 0.3]))

    bodies = {"a": body(1, 2), "b": body(1, 3), "c": body(1, 2), "d": body(1, 2), "e": body(1, 2), "f": body(1, 3)}
    assert [names for names, _ in group_equal_bodies(bodies)] == ["a to e, 4 bodies", "b, f"]
    softer = {"a": replace(bodies["a"], omega=np.array([2.0])), "c": replace(bodies["c"], omega=np.array([3.0]))}
    assert [names for names, _ in group_equal_bodies(softer)] == ["a", "c"]
    other = {"a": bodies["a"], "b": body(1, 2), "c": replace(bodies["a"], kinds=("static",))}
    assert [names for names, _ in group_equal_bodies(other)] == ["a, b", "c"]
    assert kind_counts(("vibration", "static", "vibration")) == " (2 vibration, 1 static)"
    assert kind_counts(("vibration", "vibration")) == ""


# diagrams


def branch(name: str, frequencies: list[float], growing: list[bool], **more: Any) -> Any:
    f = np.array(frequencies)
    found = {
        "name": name,
        "frequencies": f,
        "damping_ratios": np.where(np.isnan(f), np.nan, 0.01 * f),
        "growing": np.array(growing),
        "eigenvalues": np.where(np.isnan(f), np.nan, -0.3 * f) + 2j * np.pi * f,
        "characters": [f"{name}{k}" for k in range(len(f))],
        "becomes": "",
        "fastest": (2, 0.75),
    }
    return SimpleNamespace(**found | more)


def campbell(**more: Any) -> Any:
    nan = float("nan")
    found = {
        "title": "blade",
        "value": "",
        "unit": "",
        "speeds": np.array([0.0, 2.0, 3.0, 4.0]),
        "asked": np.array([True, True, False, True]),
        "branches": [
            branch("flap", [1.5, 2.25, 2.75, 3.0], [False, True, True, True], becomes="lag"),
            branch("lag", [4.0, nan, nan, 5.5], [False] * 4),
        ],
        "orders": (1, 3),
        "crossings": [
            SimpleNamespace(branch="lag", order=3, speed=1.0),
            SimpleNamespace(branch="flap", order=1, speed=2.5),
            SimpleNamespace(branch="lag", order=3, speed=3.5),
        ],
        "rigid": ("turn",),
    }
    return SimpleNamespace(**found | more)


def test_a_diagram_is_printed_in_its_unit_with_what_grows_and_what_it_meets(capsys: pytest.CaptureFixture[str]):
    print_campbell(campbell(), 0.5, "rpm")
    text = lines(capsys)
    assert text[:2] == ["blade", "frequency in the spinning frame, Hz (* unstable)"]
    rows = [line.split() for line in text]
    assert (
        ["rpm", "flap", "lag"] in rows
        and ["0", "1.5", "4"] in rows
        and ["4", "2.25*"] in rows
        and ["8", "3*", "5.5"] in rows
    )
    assert ["0", "0.015", "0.04"] in rows and ["8", "0.03*", "0.055"] in rows
    assert "followed    through 1 additional speeds, where mode shapes change fast" in text
    assert "branch      flap ends as lag" in text
    assert ["flap", "5"] in rows and ["lag", "2,", "7"] in rows
    assert "unstable    flap grows from 4 rpm on, fastest at 6 rpm, by a factor e in 0.75 s" in text
    assert "rigid       turn: neither grow nor decay, and are no branches" in text
    assert not any(line.startswith("stability   stable") for line in text)
    assert text[text.index(next(t for t in text if t.startswith("rpm") and "1/rev" in t))].split() == [
        "rpm",
        "1/rev",
        "3/rev",
    ]


def test_a_diagram_over_another_value_without_crossings_is_stable(capsys: pytest.CaptureFixture[str]):
    branches = [branch("flap", [1.5, 2.25, 2.75, 3.0], [False] * 4, damping_ratios=np.array([1e-9, -1e-7, 9e-7, 0.0]))]
    print_campbell(campbell(value="stiffness", branches=branches, crossings=[], rigid=()), 1.0, "N/m")
    text = lines(capsys)
    assert "frequency, Hz (* unstable)" in text and "crossing    none with 1/rev, 3/rev at these speeds" in text
    assert not any("damping ratio" in line for line in text)
    assert "stability   stable: no motion grows at any of these values" in text
    assert "followed    through 1 additional values, where mode shapes change fast" in text


def test_the_table_of_a_diagram_holds_every_point_once(tmp_path: Path):
    found = campbell(value="stiffness", unit="N/m")
    found.branches[0].damping_ratios[3] = np.nan
    write_table(found, tmp_path / "a.csv", force=False)
    rows = list(csv.DictReader((tmp_path / "a.csv").read_text().splitlines()))
    assert len(rows) == 6  # four of flap, two of lag
    own = [row for row in rows if row["branch"] == "flap"]
    assert [float(row["stiffness [N/m]"]) for row in own] == [0, 2, 3, 4]
    assert [row["asked"] for row in own] == ["1", "1", "0", "1"]
    assert [float(row["frequency [Hz]"]) for row in own] == [1.5, 2.25, 2.75, 3.0]
    assert [row["damping ratio"] for row in own][3] == "" and float(own[1]["damping ratio"]) == pytest.approx(0.0225)
    assert [float(row["growth [1/s]"]) for row in own] == pytest.approx([-0.45, -0.675, -0.825, -0.9])
    assert [row["stable"] for row in own] == ["1", "0", "0", "0"]
    assert [row["character"] for row in rows if row["branch"] == "lag"] == ["lag0", "lag3"]
    write_table(campbell(), tmp_path / "b.csv", force=False)
    assert (tmp_path / "b.csv").read_text().startswith("speed [rad/s],asked,branch,frequency [Hz]")


# charts of stability


def blank(kind: type, **values: Any) -> Any:
    made = object.__new__(kind)
    for key, value in values.items():
        object.__setattr__(made, key, value)
    return made


def test_a_locus_is_printed_and_written_row_by_row(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    values = np.linspace(1.0, 5.9, 50)
    branches = np.column_stack([values * (1 + 2j), values * (3 - 4j)])
    locus = blank(
        Locus, name="gain", unit="N", values=values, growth=-values / 3, kinds=np.zeros(50, int), names=("a", ""),
        branches=branches, trivial=("q1", "q2"), split=2e-5, critical=(1.23456789, 4.5), of="motion", lost=6.25,
    )  # fmt: skip
    print_locus(locus)
    text = lines(capsys)
    shown = [line.split() for line in text if re.match(r"\s*\d", line)]
    assert [float(row[0]) for row in shown] == pytest.approx(values[::3], rel=1e-5)
    assert [float(row[1]) for row in shown] == pytest.approx(-values[::3] / 3, rel=1e-5)
    assert "branches    a, named at the first value" in text
    assert "trivial     2 multipliers are 1: q1, q2" in text and any("within 2e-05" in line for line in text)
    assert "changes     1.2345679, 4.5 N" in text
    assert "lost        no equilibrium at 6.25 N; values beyond are not looked at" in text
    write_stability(locus, tmp_path / "a.csv", force=False)
    head, *rows = csv.reader((tmp_path / "a.csv").read_text().splitlines())
    assert head == ["gain", "kind", "growth", "real_1 a", "imag_1 a", "real_2", "imag_2"]
    for value, row in zip(values, rows, strict=True):
        assert list(map(float, row)) == pytest.approx([value, 0, -value / 3, value, 2 * value, 3 * value, -4 * value])


def test_a_chart_is_printed_and_written_point_by_point(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    kinds = np.array([[0, 0, 1], [1, 1, 1]])
    growth = np.arange(6.0).reshape(2, 3) / 7
    chart = blank(
        Chart, names=("a", "b"), units=("m", ""), first=np.array([1.5, 2.5]), second=np.array([3.0, 4.0, 5.0]),
        kinds=kinds, growth=growth, boundaries=[(0, 1, np.zeros((9, 2)))], error=(0.0123, 0.5),
    )  # fmt: skip
    print_chart(chart)
    text = lines(capsys)
    assert sum("33.33 %" in line for line in text) == 1 and sum("66.67 %" in line for line in text) == 1
    assert sum(line.endswith(": 9 points") for line in text) == 1
    assert text[-1] == "traced      to within 0.012 m and 0.5"
    write_stability(chart, tmp_path / "a.csv", force=False)
    head, *rows = csv.reader((tmp_path / "a.csv").read_text().splitlines())
    assert head == ["a", "b", "kind", "growth"]
    expected = [[a, b, kinds[i, j], growth[i, j]] for i, a in enumerate([1.5, 2.5]) for j, b in enumerate([3, 4, 5])]
    np.testing.assert_allclose(np.array(rows, float), expected, rtol=1e-11)


@pytest.mark.parametrize(
    ("text", "key", "between", "points"),
    [
        ("joints.0.damping=0:4:41", "joints.0.damping", [0.0, 4.0], 41),
        ("a.b = 1 : 2.5 mm : 3", "a.b", ["1 mm", "2.5 mm"], 3),
        ("a.b=1 cm:2.5 mm:3", "a.b", ["1 cm", "2.5 mm"], 3),
        ("a.b=1 cm:2.5:3", "a.b", ["1 cm", "2.5 cm"], 3),
    ],
)
def test_an_axis_of_the_command_line_has_one_unit_for_both_ends(text: str, key: str, between: list[Any], points: int):
    assert one_axis(text) == (key, {"between": between, "points": points})


# linear models, terms, curves, stress


def test_poles_are_printed_with_their_three_largest_states(capsys: pytest.CaptureFixture[str]):
    pole = {
        "name": "bending", "real": -0.125, "imag": 7.5, "frequency_hz": 1.25, "damping_ratio": 0.02,
        "participation": {"a": 0.61, "b": 0.25, "c": 0.1, "d": 0.04},
    }  # fmt: skip
    data = {
        "poles": [pole | {"real": -0.5 * k} for k in range(26)],
        "zeros": [[-0.375, 2.5]],
        "inputs": [{"name": f"u{k}"} for k in range(27)],
        "outputs": [],
    }
    small: Any = SimpleNamespace(states=[0] * 5, hankel=(1, 2), bound=0.0625)
    model: Any = SimpleNamespace(states=[0] * 9, about=None, t=1.5, left_out=())
    print_model(model, small, data)
    text = lines(capsys)
    assert sum("a 61 %, b 25 %, c 10 %" in line for line in text) == 24 and not any("d 4 %" in line for line in text)
    assert "and 2 poles above, which --json lists" in text
    assert ["-0.375", "2.5"] in [line.split() for line in text]
    assert "states      5, of 9" in text and "outputs     none" in text
    assert any(
        line.startswith("inputs      u0, u1") and line.endswith("u23 and 3 more, which --json lists") for line in text
    )
    assert text[-2:] == ["error       below 0.0625, as largest singular value", "about       the state at 1.5 s"]
    assert (
        listed(" a , ,b") == ["a", "b"] and listed(None) is None and listed_names([" a ,, b", "c"]) == ["a", "b", "c"]
    )


def test_terms_are_sorted_by_their_root_mean_square_with_the_parts_of_inertia_below_it():
    sizes = {
        "inertia": (9.0, 2.0),
        "i1": (5.0, 0.5),
        "i2": (1.0, 1.5),
        "load": (4.0, 3.0),
        "tiny": (1e-30, 1e-30),
        "h": (8.0, 1.0),
    }
    found: Any = SimpleNamespace(
        sizes=lambda k: sizes, terms=["inertia", "h", "load", "tiny"], inertia=["i1", "i2"], names=["q"], units=["N"]
    )
    assert term_rows(found, 0) == [
        ("load", "4", "3", "100.0%"),
        ("inertia", "9", "2", "66.7%"),
        ("  i2", "1", "1.5", "50.0%"),
        ("  i1", "5", "0.5", "16.7%"),
        ("h", "8", "1", "33.3%"),
    ]


def test_tables_of_terms_are_headed_by_their_coordinate_and_what_is_left_out(capsys: pytest.CaptureFixture[str]):
    t = np.linspace(0.0, 1.0, 5)
    push = np.column_stack([4.0 * t, -2.0 * t])
    terms = {"inertia": -push, "load": (1 + 1e-3) * push}
    found = Explanation(t, terms, {"inertia/a": -push}, push, ("a", "b"), ("N", "N m"), ("inertia/a",) * 2)
    print_term_tables(("gyroscopic", "hub: V3"), found, [1])
    text = lines(capsys)
    assert text[0] == "without gyroscopic, hub: V3" and text[-1] == (
        "the terms sum to zero to 1.0e-03 of the largest, over 5 instants"
    )
    assert any("b, N m" in line for line in text) and not any("a, N" in line for line in text)
    assert [line.split()[0] for line in text if "100.0%" in line] == ["load"]
    print_term_tables((), found, [0, 1])
    both = lines(capsys)
    assert not any("without" in line for line in both)
    assert [line for line in both if "a, N" in line or "b, N m" in line] == ["a, N", "b, N m"]


@pytest.mark.parametrize(("places", "period"), [([1], 1.0), ([0], 40.0), ([1, 2], 1.0), ([0, 1, 2], 40.0)])
def test_the_picture_of_terms_ends_where_the_chosen_coordinates_can_be_seen_to_swing(places: list[int], period: float):
    """A strong slow coordinate, a fast one and one that hardly moves: what is not drawn does not count."""
    t = np.linspace(0.0, 100.0, 4001)
    u = np.column_stack([20 * np.sin(2 * np.pi * t / 40), np.sin(2 * np.pi * t), 1e-3 * np.sin(0.7 * t)])
    push = np.column_stack([30 * np.cos(2 * np.pi * t / 40), 2 * np.cos(2 * np.pi * t), 1e-3 * np.cos(0.7 * t)])
    terms = {"inertia": -push, "load": push}
    found = Explanation(t, terms, {"inertia/a": -push}, u, ("a", "b", "c"), ("N", "N", "N"), ("inertia/a",) * 3)
    shown, text = readable_part(found, places, True)
    if period == 40.0:  # two and a half periods: all of it
        assert shown is found and text == ""
    else:
        last = float(shown.time[-1])
        assert 5 * period < last < 80.0 and len(shown.time) == np.count_nonzero(t <= last)
        assert text == f", 0 to {last:g} s of 100 s, which shows single oscillations (--from, --to)"
    assert readable_part(found, places, False) == (found, "")


def test_a_backbone_is_printed_over_the_frequency_of_small_motion(capsys: pytest.CaptureFixture[str]):
    _print_curve(
        {"place_m": [1.5, 0.0, -2.25], "amplitude_m": [0.01, 0.02], "frequency_hz": [2.5, 3.0], "small_hz": 2.0,
         "gaps_m": [(0.011, 0.0125)]}
    )  # fmt: skip
    text = lines(capsys)
    assert "(1.5, 0, -2.25) m" in text[0]
    rows = [line.split() for line in text]
    assert ["0.01", "2.5", "1.25000"] in rows and ["0.02", "3", "1.50000"] in rows
    assert text[-1].startswith("between 0.011 and 0.0125 m a higher harmonic")
    assert read_lengths("1 mm, 0.5,2 cm") == pytest.approx([0.001, 0.5, 0.02])
    with pytest.raises(ValueError, match=r"--backbone: .*'3 kg'"):
        read_lengths("1 mm, 3 kg")
    assert amplitude_note(SimpleNamespace(strain_form="condensed")) == ""  # type: ignore[arg-type]
    assert amplitude_note(SimpleNamespace(strain_form="linear")).startswith("linear strain")  # type: ignore[arg-type]


def test_a_place_is_three_finite_numbers():
    assert _place("0.3, -1,2e-3") == [0.3, -1.0, 0.002]
    for text in ("1,2", "1,2,x", "1,2,nan", "1,2,3,4"):
        with pytest.raises(ValueError, match=f"--at is '{text}'; give three numbers"):
            _place(text)
    assert read_numbers("1,-2.5", 2, "--size") == (1.0, -2.5)
    with pytest.raises(ValueError, match="--view: found '1,2'; expected 3 numbers, such as 1,1,1"):
        read_numbers("1,2", 3, "--view")


@pytest.mark.parametrize(("text", "seconds"), [("2 min", 120.0), (" 1.5e1 ", 15.0), ("-3", -3.0), (None, None)])
def test_times_are_seconds_or_texts_with_a_unit(text: str | None, seconds: float | None):
    assert read_seconds(text, "--at") == seconds


def test_times_that_are_none_are_refused_with_their_option():
    for text in ("2 m", "1-2", "soon"):
        with pytest.raises(ValueError, match="--from: "):
            read_seconds(text, "--from")


# tables, files and names


def test_columns_are_shared_out_evenly_over_as_few_tables_as_fit():
    assert folded_columns([4, 10, 10, 10, 10, 10], 1, 40) == [[0, 1, 2, 3], [0, 4, 5]]
    assert folded_columns([4, 10, 10, 10], 1, 40) == [[0, 1, 2, 3]]
    assert folded_columns([4, 10, 10, 10], 1, 39) == [[0, 1, 2], [0, 3]]
    assert folded_columns([4, 30, 5, 5, 5], 1, 40) == [[0, 1], [0, 2, 3, 4]]
    assert folded_columns([9], 1, 4) == [[0]]


def test_columns_of_numbers_stand_right_and_others_left(capsys: pytest.CaptureFixture[str]):
    print_table(["name", "value", "note"], [["a", "1.5", "up"], ["bcd", "-20", "downwards"]], "title")
    assert lines(capsys) == [
        "title", "name  value  note", "─" * 22, "a       1.5  up", "bcd     -20  downwards", "",
    ]  # fmt: skip


def test_a_long_line_is_folded_under_its_label():
    line = "label       " + "word " * 12
    folded = folded_line(line.rstrip(), 40)
    assert all(len(part) <= 40 for part in folded) and all(part.startswith(" " * 12 + "word") for part in folded[1:])
    assert " ".join(" ".join(folded).split()) == " ".join(line.split())
    assert folded_line("x" * 40, 40) == ["x" * 40]


def test_json_has_null_for_what_is_no_number(capsys: pytest.CaptureFixture[str]):
    print_json({1: np.array([1.5, np.nan]), "b": (float("inf"), [np.float64(2.5), True, "x", None])})
    assert json.loads(capsys.readouterr().out) == {"1": [1.5, None], "b": [None, [2.5, True, "x", None]]}


def test_pictures_are_named_after_the_run_and_what_they_show():
    table = parse_case(
        "[run]\nduration = 9\n[bodies.a]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n[pictures]\ntimes = [1.5, 4]\n"
        "picture = true\nmovie = true\nplots = ['q:a b']\nspectra = ['x/y']\nspectrograms = ['z']\n"
    ).pictures
    assert table is not None
    found = {path.name: what for path, what in _wanted(table, Path("out/run.v2.h5"))}
    assert found == {
        "run.v2.png": ("picture", None),
        "run.v2_1.5s.png": ("picture", 1.5),
        "run.v2_4s.png": ("picture", 4.0),
        "run.v2.mp4": ("movie", None),
        "run.v2_q_a_b.png": ("plot", "q:a b"),
        "run.v2_x_y_spectrum.png": ("spectrum", "x/y"),
        "run.v2_z_spectrogram.png": ("spectrogram", "z"),
    }
    assert portable_name("a/b:c é.1-2") == "a_b_c__.1-2"


def test_pictures_of_what_a_run_leaves_out_are_not_there():
    run: Any = {"q": 1, "u": 2}
    bodies: Any = {"stiff": SimpleNamespace(n_modes=0), "soft": SimpleNamespace(n_modes=2)}
    assert _there(run, bodies, "plot", "q:a over u:b") and not _there(run, bodies, "plot", "q:a over w:b")
    assert _there(run, bodies, "spectrum", "u") and not _there(run, bodies, "spectrogram", "w")
    assert _there(run, bodies, "modes", "soft") and not _there(run, bodies, "modes", "stiff")
    assert _there(run, bodies, "picture", 3.0)


def test_the_kind_of_a_file_is_reported_by_its_format(tmp_path: Path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.attrs["format"] = "femflex body"
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["M"] = np.eye(2)
    (tmp_path / "c.h5").write_text("text")
    assert [kind_of_hdf5(tmp_path / f"{name}.h5") for name in "abc"] == ["femflex body", "", ""]
    with pytest.raises(FileNotFoundError, match=r"d.h5 does not exist"):
        kind_of_hdf5(tmp_path / "d.h5")
    with pytest.raises(FileNotFoundError, match="is a folder; name a file in it"):
        kind_of_hdf5(tmp_path)
