"""`femflex stress` of a short run of a beam under a tip force."""

from __future__ import annotations

import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.image import imread
from typer.testing import CliRunner

from femflex.body.recovery import Peak, at_points, named
from femflex.cli.app import app
from femflex.cli.stress import _rounding
from femflex.mesh import line, write_mesh
from femflex.results import open_run
from femflex.view.paint import painted

CASE = """
[run]
duration = "10 s"
output_step = "0.5 s"
[sections.bar]
kind = "rectangle"
width = "20 mm"
height = "30 mm"
[materials.al]
E = "70 GPa"
density = "2700 kg/m^3"
[bodies.bar]
kind = "flexible"
mesh = "bar.msh"
members = [{ group = "all", family = "beam", section = "bar", material = "al" }]
reduction = { method = "cantilever", clamp = "start", modes = 2, loads = { end = ["z"] } }
damping = { ratio = 0.7 }
strain = "linear"
[[joints]]
kind = "weld"
child = "bar"
child_marker = "start"
[[loads]]
name = "push"
body = "bar"
marker = "end"
force = [0, 0, "3 N"]
[bodies.bar.recovery.middle]
position = ["0.5 m", "0 m", "0 m"]
quantities = ["moment_y", "shear_force_z"]
[bodies.bar.recovery.root]
position = [0, 0, 0]
[bodies.bar.markers.start]
[bodies.bar.markers.end]
"""


@pytest.fixture(scope="module")
def run_file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stress")
    write_mesh(folder / "bar.msh", line(np.array([[0, 0, 0], [1.0, 0, 0]]), 4))
    (folder / "bar.toml").write_text(CASE)
    done = CliRunner().invoke(app, ["run", str(folder / "bar.toml"), "--no-pictures", "-o", str(folder / "bar.h5")])
    assert done.exit_code == 0, done.output
    return folder / "bar.h5"


def stress(*words):
    return CliRunner().invoke(app, ["stress", *map(str, words)])


def test_peaks_and_places(run_file):
    done = stress(run_file, "--json")
    assert done.exit_code == 0, done.output
    rows = {row["quantity"]: row for row in json.loads(done.stdout)}
    assert rows["moment_y"]["x_m"] < 0.05
    assert rows["moment_y"]["largest"] > 3.0 * 0.9  # with the overshoot of the start
    table = stress(run_file, "--quantity", "moment_y").stdout
    assert "moment_y" in table and "moment_z" not in table and "N m" in table


def test_what_a_force_across_does_not_make_is_zero_without_time_and_place(run_file):
    """3 N along z: moment_y and shear_force_z alone; the rest is rounding, 1e-13 N and less."""
    nothing = ["axial_force", "moment_z", "shear_force_y", "torque"]
    options = [word for name in nothing for word in ("--quantity", name)]
    for line_ in stress(run_file, *options).stdout.splitlines()[1:]:
        assert line_.split()[3] == "0" and line_.split()[-4:] == ["-"] * 4
    for table in ([], ["--points"]):
        rows = json.loads(stress(run_file, "--json", *table, *options).stdout)
        assert {row["quantity"] for row in rows} == set(nothing)
        assert {(row["largest"], row["time_s"]) for row in rows} == {(0.0, None)}


def test_rounding_is_judged_by_kind_and_unit_and_moments_by_forces_across_a_body_too():
    """Bodies of 4 m and 2 m: 3 N and 30 N m of lines; 5 N/m of plates, whose moments are in N; 7 Pa of solids."""
    made = [("a", "line", "N", 3.0), ("a", "line", "N m", 30.0), ("b", "plate", "N/m", 5.0), ("b", "plate", "N", 1.0)]
    made += [("b", "solid", "Pa", 7.0), ("b", "line", "N m", 11.0)]
    peaks = {body: [Peak(k, "x", unit, v, 0.0, (0, 0, 0)) for b, k, unit, v in made if b == body] for body in "ab"}
    bodies = {
        body: SimpleNamespace(strain_field=[SimpleNamespace(places=np.diag([extent, 0, 1.0]))])
        for body, extent in (("a", 4.0), ("b", 2.0))
    }
    found = _rounding(bodies, peaks)
    expected = {
        ("line", "N"): 3.0,
        ("line", "N m"): 30.0,
        ("plate", "N/m"): 5.0,
        ("plate", "N"): 10.0,
        ("solid", "Pa"): 7.0,
    }
    assert {key: found[key] for key in expected} == pytest.approx({key: 1e-12 * size for key, size in expected.items()})


def test_peaks_are_printed_where_they_are_written_too_and_long_tables_are_not(run_file, tmp_path):
    done = stress(run_file, "-o", tmp_path / "peaks.csv")
    assert done.exit_code == 0 and "moment_y" in done.stdout and (tmp_path / "peaks.csv").is_file()
    for k, more in enumerate((["--points"], ["--at", "0.5,0,0"])):
        assert stress(run_file, *more, "-o", tmp_path / f"{k}.csv").stdout.strip() == ""


def test_along_time_at_a_place(run_file, tmp_path):
    out = tmp_path / "at.csv"
    done = stress(run_file, "--body", "bar", "--at", "0.5,0,0", "--quantity", "moment_y", "-o", out)
    assert done.exit_code == 0, done.output
    head, *rows = csv.reader(out.open())
    x = float(head[1].split("(")[1].split(",")[0])
    assert abs(float(rows[-1][1])) == pytest.approx(3.0 * (1 - x), rel=2e-2)  # at rest under the force
    assert stress(run_file, "--at", "0.5,0,0", "-o", out).exit_code == 2


def test_every_place_and_quantity_has_its_own_column(run_file, tmp_path):
    out = tmp_path / "at.csv"
    done = stress(run_file, "--at", "0.9,0,0", "--at", "0.1,0,0", "--quantity", "moment_y", "-o", out)
    assert done.exit_code == 0, done.output
    head, *rows = csv.reader(out.read_text().splitlines())
    places = [float(text.split("(")[1].split(",")[0]) for text in head[1:]]
    assert len(places) == 2 and places[0] > 0.7 and places[1] < 0.3
    for x, value in zip(places, rows[-1][1:], strict=True):
        assert abs(float(value)) == pytest.approx(3.0 * (1 - x), rel=2e-2)


def test_channels_of_a_place_are_those_of_the_verb(run_file):
    """At rest under 3 N: moment 3 (L - x), shear force 3; all quantities of the root; equal to at_points."""
    with open_run(run_file) as run:
        names = {path for path in run.channels if path.startswith("recovery/")}
        assert {"recovery/bar.middle/moment_y", "recovery/bar.middle/shear_force_z"} <= names
        assert sum(path.startswith("recovery/bar.root/") for path in names) == 7
        parts, y = run.bodies()["bar"].strain_field, run["bodies/bar/delta"]
        for name in ("moment_y", "shear_force_z"):
            values, where = at_points(parts, name, [0.5, 0, 0], y)
            np.testing.assert_allclose(run[f"recovery/bar.middle/{name}"], values[:, 0], rtol=1e-12, atol=1e-12)
            at_rest = -3.0 * (1 - where[0, 0]) if name == "moment_y" else 3.0
            assert run[f"recovery/bar.middle/{name}"][-1] == pytest.approx(at_rest, rel=2e-2)
        channel = run.channels["recovery/bar.middle/shear_force_z"]
        assert channel.unit == "N" and "of bar at (0." in channel.description


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [('"shear_force_z"', '"shear"', "found the quantity 'shear', which the body does not have; it has")],
)
def test_a_quantity_that_the_body_lacks_is_an_error_before_the_run(run_file, old, new, words):
    case = run_file.with_name("wrong.toml")
    case.write_text(CASE.replace(old, new))
    done = CliRunner().invoke(app, ["run", str(case), "--no-pictures"])
    assert done.exit_code == 2
    text = " ".join(done.stderr.split())
    assert words in text and "bodies.bar.recovery.middle" in text


def test_a_rigid_body_has_no_recovery(tmp_path):
    case = tmp_path / "rigid.toml"
    table = 'kind = "rigid"\nmass = "1 kg"\ninertia = [1, 1, 1]\n[bodies.a.recovery.x]\nposition = [0, 0, 0]\n'
    case.write_text('[run]\nduration = "1 s"\noutput_step = "1 s"\n[bodies.a]\n' + table)
    done = CliRunner().invoke(app, ["check", str(case)])
    assert done.exit_code == 2 and "found recovery on a rigid body" in " ".join((done.stdout + done.stderr).split())


@pytest.mark.slow
def test_a_map_of_peaks_as_table_and_as_picture(run_file, tmp_path):
    table, picture = tmp_path / "peaks.csv", tmp_path / "peaks.png"
    done = stress(run_file, "--points", "--quantity", "moment_y", "-o", table, "-o", picture)
    assert done.exit_code == 0, done.output
    head, *rows = csv.reader(table.open())
    assert head[2:5] == ["x_m", "y_m", "z_m"]
    x, largest, time = (np.array([float(row[k]) for row in rows]) for k in (2, 6, 8))
    with open_run(run_file) as run:
        part = run.bodies()["bar"].strain_field[0]
        values = named(part, "moment_y", run["bodies/bar/delta"])
        np.testing.assert_allclose(largest, np.abs(values).max(axis=0), rtol=1e-6)
        assert set(time) <= set(run.time)
        paints, bar = painted(run, run.bodies(), "peak:moment_y")
        skin = run.bodies()["bar"].skin
        found = paints["bar"].values(np.zeros(2))
        np.testing.assert_allclose(found, np.interp(skin.points[:, 0], x, largest), atol=0.05 * largest.max())
        assert bar.top >= largest.max() and not bar.signed
        with pytest.raises(ValueError, match="peaks known are peak:axial_force"):
            painted(run, run.bodies(), "peak:xx")
    image = imread(picture)
    assert image.shape[:2] == (720, 1280) and len(np.unique(image.reshape(-1, image.shape[2]), axis=0)) > 50


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (("--at", "1,2"), "give three numbers in metres"),
        (("--body", "wing"), "has no strain of"),
        (("--quantity", "xx"), "no body of ['bar'] has the quantity 'xx'; known are axial"),
        (("--at", "0,0,0", "--quantity", "xx"), "known are axial_force"),
        (("--at", "0,0,0", "--points"), "two tables; give one of them"),
        (("--points", "--quantity", "xx"), "no body of ['bar'] has the quantity 'xx'; known are axial"),
        (("--quantity", "torque", "--quantity", "moment_y", "-o", "two.png"), "draws one quantity"),
    ],
)
def test_mistakes_are_answered(run_file, words, found):
    done = stress(run_file, *words)
    assert done.exit_code == 2 and found in " ".join(done.stderr.split())
