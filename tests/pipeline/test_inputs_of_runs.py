"""Digests of all inputs of a run, advice written as TOML, and a sampled strain gauge."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from femflex import run
from femflex.case import read_case
from femflex.pipeline.advised_case import toml
from femflex.pipeline.file_digests import file_digests
from femflex.pipeline.inputs import changed_inputs, inputs_text

HUB = "[run]\nduration = 4\n[bodies.hub]\nkind = 'rigid'\nmass = 2\ninertia = [3, 4, 5]\n"

# advice written into a case


@pytest.mark.parametrize(
    "value", [True, 3, 2.0, 1e-9, 'é "q" \\', [1, [2.5, "x"]], {}, {"a-b": {"c d": [0.1]}, "é": "x"}, ("y", 1e300)]
)
def test_toml_values_round_trip(value: Any):
    read = tomllib.loads(f"a = {toml(value)}")["a"]
    assert read == (list(value) if isinstance(value, tuple) else value) and type(read) is not tuple
    assert isinstance(read, float) == isinstance(value, float)


# inputs of a run


def loads(*, mass: float = 2.0, more: str = "") -> str:
    return HUB.replace("mass = 2", f"mass = {mass}") + f"[[loads]]\nname = 'l'\nbody = 'hub'\ntable = 'l.csv'\n{more}"


def test_changed_files_and_values_are_found(tmp_path: Path):
    (tmp_path / "l.csv").write_text("time,fx\n0,1\n2,3\n")
    path = tmp_path / "a.toml"
    path.write_text(loads())
    begun = json.loads(inputs_text(read_case(path)))
    assert begun["length"] == {"duration": 4.0} and list(begun["files"]) == ["loads[0].table"]
    path.write_text("title = 'other'\n" + loads().replace("duration = 4", "duration = 5\nsamples = 7"))
    assert changed_inputs(begun, read_case(path)) == ""
    (tmp_path / "l.csv").write_text("# same numbers\ntime [s],fx [mN]\n0,1000\n2,3000\n")
    assert changed_inputs(begun, read_case(path)) == ""
    (tmp_path / "l.csv").write_text("time,fx\n0,1\n2,3.5\n")
    path.write_text(loads(mass=2.5))
    changed = changed_inputs(begun, read_case(path))
    assert "l.csv" in changed and "bodies.hub.mass" in changed


def test_digest_of_every_file_of_a_case(craft: str, write_case: Any):
    path = write_case(
        craft.replace("torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", "table = 'l.csv'").replace(
            "markers.left",
            "shapes = [{ kind = 'box', size = [1, 1, 1] }, { kind = 'mesh', file = 'hull.inp' }]\nmarkers.left",
        )
        + "[[loads]]\nname = 'second'\nbody = 'hub'\nforce = [1, 0, 0]\n"
        "[[loads]]\nname = 'third'\nbody = 'hub'\ntable = 'm.csv'\n"
    )
    folder = path.parent
    (folder / "hull.inp").write_text((folder / "boom.inp").read_text())
    (folder / "l.csv").write_text("time,fx\n0,1\n2,3\n")
    (folder / "m.csv").write_text("time,fy\n0,1\n2,3\n")
    case = read_case(path)
    first = file_digests(case)
    assert {where: entry["file"] for where, entry in first.items()} == {
        "bodies.boom.mesh": "boom.inp",
        "bodies.hub.shapes[1].file": "hull.inp",
        "loads[0].table": "l.csv",
        "loads[2].table": "m.csv",
    }
    assert first["bodies.boom.mesh"]["digest"] == first["bodies.hub.shapes[1].file"]["digest"]
    for name, where, old, new in (
        ("boom.inp", "bodies.boom.mesh", "3.0, 0.0, 0.0", "3.0, 0.0, 0.125"),
        ("hull.inp", "bodies.hub.shapes[1].file", "NSET=TIP", "NSET=TOP"),
        ("l.csv", "loads[0].table", "2,3", "2.5,3"),
        ("m.csv", "loads[2].table", "fy", "fz"),
    ):
        text = (folder / name).read_text()
        (folder / name).write_text(text.replace(old, new))
        now = file_digests(case)
        assert [key for key in first if now[key] != first[key]] == [where]
        (folder / name).write_text(text)
    assert file_digests(case) == first


# watching a run


# names of channels


# resuming


# linear motion


# choices


# reading files


def test_digest_of_a_body_file_does_not_depend_on_its_version(tmp_path: Path):
    def digest(version: str, value: float, name: str = "M") -> str:
        with h5py.File(tmp_path / "b.h5", "w") as file:
            file.attrs["femflex_version"] = version
            file.attrs["format"] = "femflex body"
            file[f"group/{name}"] = np.array([value, 2.0])
        (tmp_path / "a.toml").write_text("[run]\nduration = 4\n[bodies.b]\nkind = 'file'\nfile = 'b.h5'\n")
        return file_digests(read_case(tmp_path / "a.toml"))["bodies.b.file"]["digest"]

    assert digest("1", 3.0) == digest("2", 3.0) != digest("1", 4.0)
    assert digest("1", 3.0, "K") != digest("1", 3.0)


CASE = """
[run]
duration = "8 s"
output_step = "0.25 s"
rtol = 1e-9

[bodies.beam]
kind = "analytic"
length = "2 m"
mass_per_length = "0.5 kg/m"
EA = "1e6 N"
EIy = "20 N m^2"
EIz = "30 N m^2"
GJ = "20 N m^2"
rotary_inertia = false
functions = { y = 6, z = 0 }
strain = "linear"
damping = { ratio = 0.2 }

[[joints]]
kind = "weld"
child = "beam"
child_marker = "root"

[[loads]]
name = "push"
body = "beam"
marker = "tip"
force = [0, "0.3 N", 0]

[sensors.gauge]
kind = "strain"
body = "beam"
point = ["0.5 m", 0, 0]
component = "curvature_z"
period = "0.1 s"
delay = "0.3 s"
quantum = 1e-4
bias = [2e-3]
"""


def test_sampled_gauge_reads_static_curvature_with_bias_and_delay(tmp_path):
    path = tmp_path / "gauge.toml"
    path.write_text(CASE)
    gauge_run = run(path, tmp_path / "gauge.h5")
    strain = gauge_run["effectors/gauge/strain"]
    assert strain[-1] == pytest.approx(0.3 * 1.5 / 30.0 + 2e-3, abs=2e-4)  # P (L - x) / EI; the quantum, six functions
    assert strain[0] == 0.0 and 0.0 < strain[1] < strain[-1]
    assert strain[-1] / 1e-4 == pytest.approx(round(strain[-1] / 1e-4), abs=1e-9)
