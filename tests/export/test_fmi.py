"""FMUs as fmpy reads, validates and simulates them: linear ones against exact steps, whole crafts against runs."""

from __future__ import annotations

import shutil
from importlib.util import find_spec
from zipfile import ZipFile

import numpy as np
import pytest

import femflex
from femflex.export.fmi import write_craft_fmu, write_linear_fmu
from femflex.studies.linear import linear_model

fmpy = pytest.importorskip("fmpy")
needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
needs_pythonfmu3 = pytest.mark.skipif(find_spec("pythonfmu3") is None, reason="pythonfmu3 is not installed")
TORQUE, RATE, TIP = "loads/slew/torque:y", "bodies/hub/rate:y", "markers/panel_east.corner/deflection:z"
SLEW = ((0, 40), (5, 40), (5, -40), (10, -40), (10, 0), (60, 0))


def described(path):
    """Problems and variables, as fmpy finds them."""
    from fmpy.validation import validate_fmu

    return validate_fmu(str(path)), {v.name: v for v in fmpy.read_model_description(str(path)).modelVariables}


def simulated(path, stop, step, rows=None, name=TORQUE, **options):
    """Outputs of an FMU; rows: (time, value) of the input of that name."""
    signals = None if rows is None else np.array(list(rows), dtype=[("time", float), (name, float)])
    return fmpy.simulate_fmu(str(path), stop_time=stop, output_interval=step, input=signals, **options)


@pytest.fixture(scope="module")
def slew(slewed):
    return linear_model(slewed, [TORQUE], [RATE, TIP])


@needs_compiler
def test_linear_fmu_steps_and_integrates_as_the_model(slew, tmp_path):
    path = tmp_path / "slew.fmu"
    write_linear_fmu(slew, path)
    problems, variables = described(path)
    assert not problems
    assert {name: variables[name].unit for name in (TORQUE, RATE, TIP)} == {TORQUE: "N m", RATE: "rad/s", TIP: "m"}
    times = np.arange(0, 12.01, 0.05)
    exact, x = [], np.zeros(len(slew.A))
    from scipy.signal import cont2discrete

    A, B = cont2discrete((slew.A, slew.B, slew.C, slew.D), 0.05)[:2]
    for t in times:
        exact.append(slew.y0 + slew.C @ x)
        x = A @ x + B @ [40.0 if t < 5 - 1e-9 else -40.0 if t < 10 - 1e-9 else 0.0]
    for kind, accuracy in (("CoSimulation", 1e-9), ("ModelExchange", 1e-4)):
        found = simulated(path, 6, 0.05, SLEW, fmi_type=kind, relative_tolerance=1e-7)
        on_grid = np.interp(found["time"], times, np.transpose(exact)[0])
        assert found[RATE] == pytest.approx(on_grid, abs=accuracy * np.abs(on_grid).max())
    found = simulated(path, 12, 0.05, SLEW, fmi_type="CoSimulation")
    assert found[TIP][[40, 150, 240]] == pytest.approx(np.transpose(exact)[1][[40, 150, 240]], rel=1e-8)


@needs_compiler
def test_linear_fmu_keeps_states_and_gives_derivatives(slew, tmp_path):
    from fmpy.fmi3 import FMU3Slave

    write_linear_fmu(slew, tmp_path / "slew.fmu")
    folder, description = (
        fmpy.extract(str(tmp_path / "slew.fmu")),
        fmpy.read_model_description(str(tmp_path / "slew.fmu")),
    )
    fmu = FMU3Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier="slew")
    fmu.instantiate()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.setFloat64([1], [40.0])
    fmu.doStep(0.0, 1.0)
    kept, before = fmu.getFMUState(), fmu.getFloat64([0, 2, 3])
    fmu.doStep(1.0, 0.5)
    assert fmu.getFloat64([2]) != before[1:2]
    fmu.setFMUState(kept)
    assert fmu.getFloat64([0, 2, 3]) == before
    assert fmu.getDirectionalDerivative([2, 3], [1], [2.0]) == pytest.approx(2.0 * slew.D[:, 0], abs=1e-15)
    first = 4 + len(slew.A)
    assert fmu.getDirectionalDerivative([first + 26], [1], [1.0]) == pytest.approx([slew.B[26, 0]])
    fmu.freeFMUState(kept)
    fmu.freeInstance()
    shutil.rmtree(folder)


def test_without_a_compiler_an_fmu_has_its_sources(slew, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    lines = write_linear_fmu(slew, tmp_path / "slew.fmu")
    assert any("no C compiler" in line for line in lines)
    names = ZipFile(tmp_path / "slew.fmu").namelist()
    assert {f"sources/{name}" for name in ("model.c", "model.h", "fmi3.c", "buildDescription.xml")} < set(names)
    assert not any(name.startswith("binaries") for name in names) and not described(tmp_path / "slew.fmu")[0]


@pytest.mark.slow
@needs_pythonfmu3
def test_whole_craft_as_fmu_moves_as_its_run(tmp_path):
    """Part of the loads and the spring at rest are of the case, and part is given from outside."""
    outputs, path = ["bodies/hub/rate", "markers/panel.tip/deflection:y"], tmp_path / "craft.fmu"
    less = CRAFT.replace("[0, 3, 2]", "[0, 3, 0]").replace("[0, 0.4, 0]", "[0, 0, 0]").replace("0.2 rad", "0 rad")
    (tmp_path / "craft.toml").write_text(CRAFT)
    (tmp_path / "less.toml").write_text(less)
    write_craft_fmu(tmp_path / "less.toml", path, list(INPUTS), outputs)
    problems, variables = described(path)
    assert not problems and variables["joints/hinge.angle/effort"].unit == "N m"
    names = [(name, float) for name in ("time", *INPUTS)]
    signals = np.array([(0.0, *INPUTS.values()), (3.0, *INPUTS.values())], names)
    found = fmpy.simulate_fmu(str(path), stop_time=3, output_interval=0.1, input=signals)
    with femflex.run(tmp_path / "craft.toml", tmp_path / "run.h5") as run:
        rate = np.column_stack([found[f"bodies/hub/rate:{axis}"] for axis in "xyz"])
        assert rate == pytest.approx(run["bodies/hub/rate"], abs=1e-8)
        tip = run["markers/panel.tip/deflection"][:, 1]
        assert found[outputs[1]] == pytest.approx(tip, abs=1e-7 * np.abs(tip).max())


INPUTS = {  # of the craft, with what the case without them lacks
    "loads/slew/torque:z": 2.0,
    "joints/hinge.angle/effort": 1.0,
    "markers/panel.tip/force:y": 0.4,
}
CRAFT = """
title = "a hub with a hinged panel"
[run]
duration = "3 s"
output_step = "0.1 s"
integrator = "dop853"
[bodies.hub]
kind = "rigid"
mass = 20
inertia = [4, 5, 6]
markers.rim = { position = [0.5, 0, 0], orientation = { x = [0, 1, 0], y = [-1, 0, 0] } }
[bodies.panel]
kind = "analytic"
length = "2 m"
mass_per_length = "1.5 kg/m"
EA = "1e7 N"
EIy = "200 N m^2"
EIz = "200 N m^2"
GJ = "100 N m^2"
functions = { y = 2, z = 1, axial = 0, torsion = 0 }
strain = "linear"
[[joints]]
kind = "free"
child = "hub"
[[joints]]
name = "hinge"
kind = "revolute"
parent = "hub"
parent_marker = "rim"
child = "panel"
child_marker = "root"
stiffness = "5 N m/rad"
rest = "0.2 rad"
[[loads]]
name = "slew"
body = "hub"
marker = "rim"
torque = [0, 3, 2]
[[loads]]
name = "tip"
body = "panel"
marker = "tip"
frame = "marker"
force = [0, 0.4, 0]
"""
