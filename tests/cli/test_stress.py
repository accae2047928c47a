"""`femflex stress` of a short run of a beam under a tip force."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from femflex.cli.app import app
from femflex.mesh import line, write_mesh

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


def test_along_time_at_a_place(run_file, tmp_path):
    out = tmp_path / "at.csv"
    done = stress(run_file, "--body", "bar", "--at", "0.5,0,0", "--quantity", "moment_y", "-o", out)
    assert done.exit_code == 0, done.output
    head, *rows = csv.reader(out.open())
    x = float(head[1].split("(")[1].split(",")[0])
    assert abs(float(rows[-1][1])) == pytest.approx(3.0 * (1 - x), rel=2e-2)  # at rest under the force
    assert stress(run_file, "--at", "0.5,0,0", "-o", out).exit_code == 2


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (("--at", "1,2"), "give three numbers in metres"),
        (("--body", "wing"), "has no strain of"),
        (("--quantity", "xx"), "is not known of body"),
        (("--at", "0,0,0", "--quantity", "xx"), "it has axial_force"),
    ],
)
def test_mistakes_are_answered(run_file, words, found):
    done = stress(run_file, *words)
    assert done.exit_code == 2 and found in " ".join(done.stderr.split())
