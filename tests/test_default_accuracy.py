"""Runs at the default tolerance conserve energy and momentum; runs that diverge are stopped."""

from pathlib import Path

import numpy as np
import pytest

import femflex
from femflex.body.flexible import rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import IntegrationError, integrator
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import System, free, weld

CASES = Path(__file__).resolve().parents[1] / "cases"
RIGID = """
title = "Rigid tumbling"
[run]
duration = "100 s"
samples = 201
[attitude]
frame = "inertial"
rates = ["0.3 rad/s", "-0.5 rad/s", "0.4 rad/s"]
[bodies.hub]
kind = "rigid"
mass = "200 kg"
inertia = ["120 kg m^2", "100 kg m^2", "140 kg m^2"]
"""


def drift(run, name):
    """Largest change of a monitor over its size at the start."""
    values = run[f"monitors/{name}"].reshape(len(run), -1)
    return np.linalg.norm(values - values[0], axis=1).max() / np.linalg.norm(values[0])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:body .* turned at up to:femflex.warning.PhysicsWarning")  # linear, as reported
def test_flexible_craft_conserves_energy_and_momentum(tmp_path):
    text = (CASES / "tumbling_panels.toml").read_text().split("[pictures]")[0]
    text = text.replace("../meshes", str(CASES.parent / "meshes"))
    assert "rtol = 1e-10\n" in text
    path = tmp_path / "tumbling.toml"
    path.write_text(text.replace("rtol = 1e-10\n", ""))
    with femflex.run(path, tmp_path / "run.h5") as run:
        assert drift(run, "energy") < 1e-7
        assert drift(run, "angular_momentum") < 1e-11


def test_rigid_craft_conserves_energy_and_momentum(tmp_path):
    path = tmp_path / "rigid.toml"
    path.write_text(RIGID)
    with femflex.run(path, tmp_path / "run.h5") as run:
        assert drift(run, "energy") < 1e-10
        assert drift(run, "angular_momentum") < 1e-10


@pytest.mark.parametrize(
    "load",
    ["torque = [0, 0, 1e7]", "force = [[0, 0, 0], [0, 1e30, 0]]\ntimes = [0, 1e4]"],
    ids=["torque", "growing force"],
)
def test_overloaded_rigid_craft_is_stopped_and_its_rows_remain(tmp_path, load):
    """With two rows asked for, the first comes long after the motion has lost its meaning."""
    path, out = tmp_path / "rigid.toml", tmp_path / "run.h5"
    text = RIGID.replace('"100 s"', '"10000 s"').replace("samples = 201", "samples = 2")
    path.write_text(f'{text}\n[[loads]]\nname = "push"\nbody = "hub"\n{load}\n')
    with pytest.raises(IntegrationError):
        femflex.run(path, out)
    with femflex.open_run(out) as run:
        assert not run.complete and "diverges" in run.ended
        assert all(np.isfinite(run[path]).all() for path in run)


@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
@pytest.mark.parametrize("amplitude", [1e-6, 1e-9])  # m
@pytest.mark.parametrize("on_craft", [False, True], ids=["clamped", "on a free hub"])
def test_small_vibration_keeps_its_energy(method, amplitude, on_craft):
    """A beam of 6 mm, 5 kHz: 100 periods without damping. Two digits less than a vibration of metres are allowed."""
    beam = UniformBeam(length=6e-3, EA=1e4, EIy=5e-5, EIz=5e-5, GJ=4e-5, mass_per_length=5e-4)
    body, joints = beam_body(beam, BeamFunctions(y=3, z=0)), (weld("beam", child_marker="root"),)
    bodies = {"beam": body}
    if on_craft:
        bodies |= {"hub": rigid_body(1e-5, 1e-10 * np.eye(3))}
        joints = (free("hub"), weld("beam", parent="hub", child_marker="root"))
    start = np.eye(body.n_modes)[0] * amplitude / np.abs(body.marker("tip").phi[:, 0]).max()
    model = compile_system(System(bodies, joints, delta0={"beam": start}))
    times = np.linspace(0.0, 100 * 2 * np.pi / body.omega[0], 201)
    seen = model.observe(times, integrator(method).solve(model, times, model.x0).states)
    assert np.abs(seen["monitors/energy"] / seen["monitors/energy"][0] - 1.0).max() < 1e-5
