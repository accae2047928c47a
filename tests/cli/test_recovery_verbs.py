"""`femflex stress`, `terms` and `plot` of runs: section forces in closed form, terms that balance."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

import femflex as package
from femflex.body.recovery import at_points, quantity_by_name
from femflex.mesh import line, write_mesh
from femflex.results import open_run
from femflex.view.paint import paints_of
from femflex.warning import PhysicsWarning

BAR = """
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
def bar_run(tmp_path_factory) -> Path:
    """Run of a clamped bar of 1 m under 3 N across its tip, until it is at rest."""
    folder = tmp_path_factory.mktemp("stress")
    write_mesh(folder / "bar.msh", line(np.array([[0, 0, 0], [1.0, 0, 0]]), 4))
    (folder / "bar.toml").write_text(BAR)
    with pytest.warns(PhysicsWarning):  # of critical damping, for a short run
        package.run(folder / "bar.toml", folder / "bar.h5").close()
    return folder / "bar.h5"


def test_moment_at_rest_is_force_times_distance(femflex, bar_run, tmp_path):
    table = tmp_path / "at.csv"
    command = ("stress", bar_run, "--at", "end", "--at", "0.1,0,0", "--quantity", "moment_y", "-o", table)
    assert femflex(*command)[0] == 0
    head, *rows = csv.reader(table.read_text().splitlines())
    distances = [float(text.split("(")[1].split(",")[0]) for text in head[1:]]
    assert len(distances) == 2 and distances[0] > 0.7 and distances[1] < 0.3
    for x, value in zip(distances, rows[-1][1:], strict=True):
        assert abs(float(value)) == pytest.approx(3.0 * (1 - x), rel=2e-2)
    assert femflex(*command)[0] == 2  # it is there now


def test_peaks_are_at_the_root_and_of_the_loaded_plane_alone(femflex, bar_run):
    """3 N along z: moment_y and shear_force_z; the rest is rounding, 1e-13 N and less, and is reported as zero."""
    code, out, _ = femflex("stress", bar_run, "--group", "all", "--json")
    rows = {row["quantity"]: row for row in json.loads(out)["rows"]}
    assert {row["members"] for row in rows.values()} == {"all"}
    assert code == 0 and rows["moment_y"]["x_m"] < 0.05
    assert rows["moment_y"]["largest"] > 3.0 * 0.9  # with the overshoot of the start
    for name in ("axial_force", "moment_z", "shear_force_y", "torque"):
        assert (rows[name]["largest"], rows[name]["time_s"]) == (0.0, None)


def test_recovery_channels_of_a_case_are_those_of_the_verb(bar_run):
    with open_run(bar_run) as run:
        assert sum(path.startswith("recovery/bar.root/") for path in run.channels) == 7
        strain_parts, y = run.bodies()["bar"].strain_field, run["bodies/bar/delta"]
        for name in ("moment_y", "shear_force_z"):
            values, positions = at_points(strain_parts, name, [0.5, 0, 0], y)
            np.testing.assert_allclose(run[f"recovery/bar.middle/{name}"], values[:, 0], rtol=1e-12, atol=1e-12)
            at_rest = -3.0 * (1 - positions[0, 0]) if name == "moment_y" else 3.0
            assert run[f"recovery/bar.middle/{name}"][-1] == pytest.approx(at_rest, rel=2e-2)
        assert run.channels["recovery/bar.middle/shear_force_z"].unit == "N"


@pytest.mark.slow
def test_map_of_peaks_agrees_with_its_table(femflex, bar_run, tmp_path):
    table, picture = tmp_path / "peaks.csv", tmp_path / "peaks.png"
    code, _, err = femflex("stress", bar_run, "--points", "--quantity", "moment_y", "-o", table, "-o", picture)
    assert code == 0, err
    head, *rows = csv.reader(table.read_text().splitlines())
    assert head[2:5] == ["x_m", "y_m", "z_m"]
    x, largest, time = (np.array([float(row[k]) for row in rows]) for k in (2, 6, 8))
    with open_run(bar_run) as run:
        values = quantity_by_name(run.bodies()["bar"].strain_field[0], "moment_y", run["bodies/bar/delta"])
        np.testing.assert_allclose(largest, np.abs(values).max(axis=0), rtol=1e-6)
        assert set(time) <= set(run.time)
        paints, _ = paints_of(run, run.bodies(), "peak:moment_y")
        skin = run.bodies()["bar"].skin
        painted_values = paints["bar"].values(np.zeros(2))
        np.testing.assert_allclose(painted_values, np.interp(skin.points[:, 0], x, largest), atol=0.05 * largest.max())
    image = imread(picture)
    assert image.shape[:2] == (720, 1280) and len(np.unique(image.reshape(-1, image.shape[2]), axis=0)) > 50


def test_terms_have_the_load_and_sum_to_zero(femflex, run_folder):
    words = ("--coordinate", "base-hub.omega_z", "--coordinate", "boom.delta1")
    code, out, _ = femflex("terms", "run.h5", *words, "--to", 1.9, "--json")
    data = json.loads(out)
    assert code == 0 and data["remainder"] < 1e-10
    assert set(data) == {"base-hub.omega_z", "boom.delta1_rate", "remainder"}
    (push,) = [row for row in data["base-hub.omega_z"] if row["term"] == "loads/push"]
    assert push["peak"] == pytest.approx(-1.0) and push["rms"] == pytest.approx(1.0)  # 1 N m until 2 s


def test_stored_terms_sum_to_zero_and_other_channels_stay_equal(femflex, run_folder):
    shutil.copy("run.h5", "before.h5")
    for _ in range(2):  # the second time they are replaced
        assert femflex("terms", "run.h5", "--keep")[0] == 0
    with open_run(run_folder / "run.h5") as run, open_run(run_folder / "before.h5") as original:
        terms = {path: run[path] for path in run if path.startswith("terms/")}
        assert {"terms/inertia", "terms/loads/push", "terms/elastic"} <= set(terms)
        assert run.names("terms/elastic") == run.names("u") and run.units("terms/loads/push")[5] == "N m"
        assert np.abs(sum(terms.values())).max() < 1e-10 * max(np.abs(rows).max() for rows in terms.values())
        assert run.complete and all(np.array_equal(run[path], original[path]) for path in original)
    assert femflex("plot", "run.h5", "terms/loads/push:base-hub.omega_z", "-o", "push.svg")[0] == 0
    assert (run_folder / "push.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize(("old", "new", "words"), [("", "", "boom.inp"), ("4, 3.0", "4, 3.5", "bodies.boom.mesh")])
def test_terms_need_the_inputs_of_the_run(femflex, run_folder, old, new, words):
    """The mesh beside the case is missing, or has changed."""
    (run_folder / "elsewhere").mkdir()
    shutil.copy("craft.toml", "elsewhere")
    if old:
        Path("elsewhere/boom.inp").write_text(Path("boom.inp").read_text().replace(old, new))
    code, _, err = femflex("terms", "run.h5", "--case", "elsewhere/craft.toml")
    assert code == 2 and words in err


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("run craft.toml -o run.h5", ("run.h5", "--force")),
        ("run craft.toml -o half.h5 --resume", ("half.h5", "damaged")),
        ("info half.h5", ("half.h5", "damaged")),
        ("plot run.h5 markers/boom.tip/deflexion", ("markers/boom.tip/deflection",)),
        ("plot run.h5 q:0", ("'0'", "'q'")),
        ("plot run.h5 q --spectrum --highest -1", ("-1 Hz",)),
        ("plot run.h5 -o x.txt", (".png", ".svg")),
        ("render run.h5 --at 99", ("99 s",)),
        ("render run.h5 --theme blue", ("blue", "dark")),
        ("render run.h5 --mode 1", ("--mode", "body file")),
        ("stress run.h5 --quantity xx", ("'xx'", "moment_y")),
        ("stress run.h5 --group wing", ("wing", "BOOM")),
        ("stress run.h5 --at tipp", ("tipp", "tip", "metres")),
        ("terms run.h5 --coordinate boom.delta9", ("boom.delta9", "boom.delta4")),
        ("terms run.h5 --from 20", ("20", "10 s")),
        ("terms run.h5 --keep --to 5", ("--keep", "--to")),
    ],
)
def test_wrong_option_for_a_run_is_refused(femflex, run_folder, command, words):
    run = (run_folder / "run.h5").read_bytes()
    (run_folder / "half.h5").write_bytes(run[: len(run) // 2])
    contents = {path.name: path.read_bytes() for path in run_folder.iterdir()}
    code, out, err = femflex(*command.split())
    assert (code, out) == (2, "") and "Traceback" not in err and all(word in err for word in words), err
    assert {path.name: path.read_bytes() for path in run_folder.iterdir()} == contents
