"""A finished run says what is doubtful about it."""

import re
from pathlib import Path

import numpy as np
import pytest

import femflex
from femflex.case import read_case
from femflex.cli.run_report import conserved_monitors
from femflex.integrate import IntegrationError
from femflex.pipeline.decisions import build_system
from femflex.warning import PhysicsWarning

CASES = Path(__file__).resolve().parents[1] / "cases"


def changed(tmp_path, name, **swaps):
    """A shipped case without pictures and expectations, with words swapped."""
    text = (
        (CASES / f"{name}.toml").read_text().split("[pictures]")[0].replace("../meshes", str(CASES.parent / "meshes"))
    )
    for old, new in swaps.values():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / f"{name}.toml"
    path.write_text(text)
    return path


def test_a_panel_bent_beyond_linear_strain_is_warned_of_with_both_numbers(tmp_path):
    linear = 'kind = "flexible"', 'kind = "flexible"\nstrain = "linear"'  # left out, it would be condensed
    soft = changed(tmp_path, "panel_slew", E=('"70 GPa"', '"0.05 GPa"'), short=('"60 s"', '"10 s"'), strain=linear)
    with pytest.warns(PhysicsWarning) as caught:
        femflex.run(soft, tmp_path / "run.h5").close()
    everything = [str(warning.message) for warning in caught]
    told = [text for text in everything if "displaced" in text]
    assert len(told) == 2 and len(everything) == 4  # both panels; their spin is reported too
    assert re.search(r"'panel_east' was displaced by .* m, .*% of its size of 6.18 m", told[0])


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("name", "swaps", "expected"),
    [
        ("panel_slew", {}, []),  # a load works on it
        ("tumbling_panels", {}, ["monitors/energy", "monitors/angular_momentum"]),
        ("orbiter_yaw30", {}, ["monitors/jacobi"]),
        ("orbiter_yaw30", {"free": ('"specified"', '"free"')}, ["monitors/energy"]),
        ("eccentric_pitch", {}, []),
    ],
)
@pytest.mark.filterwarnings("ignore:body .* turned at up to:femflex.warning.PhysicsWarning")  # linear, as reported
def test_only_monitors_that_ought_to_be_constant_are_told(name, swaps, expected, tmp_path):
    path = changed(tmp_path, name, **swaps)
    path.write_text(path.read_text().replace("orbits = 10", "orbits = 0.1").replace("orbits = 5", "orbits = 0.1"))
    with femflex.run(path, tmp_path / "run.h5") as run:
        assert conserved_monitors(run, build_system(read_case(path))) == expected


def drift(run, name):
    """Largest change of a monitor over its size at the start."""
    values = run[f"monitors/{name}"].reshape(len(run), -1)
    return np.linalg.norm(values - values[0], axis=1).max() / np.linalg.norm(values[0])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:body .* turned at up to:femflex.warning.PhysicsWarning")  # linear, as reported
def test_a_flexible_craft_keeps_energy_and_momentum_at_the_default_tolerance(tmp_path):
    path = changed(tmp_path, "tumbling_panels", default=("rtol = 1e-10\n", ""))
    with femflex.run(path, tmp_path / "run.h5") as run:
        assert drift(run, "energy") < 1e-7
        assert drift(run, "angular_momentum") < 1e-11


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


def test_a_rigid_craft_keeps_them_to_ten_digits_for_a_hundred_seconds(tmp_path):
    path = tmp_path / "rigid.toml"
    path.write_text(RIGID)
    with femflex.run(path, tmp_path / "run.h5") as run:
        assert drift(run, "energy") < 1e-10
        assert drift(run, "angular_momentum") < 1e-10


@pytest.mark.parametrize(
    ("load", "said"),
    [
        ("torque = [0, 0, 1e7]", r"base-hub\.omega_z is .* rad/s, beyond 100000 rad/s"),
        (
            "force = [[0, 0, 0], [0, 1e30, 0]]\ntimes = [0, 1e4]",
            r"base-hub\.slide\d_rate is .* m/s, beyond 3e\+06",
        ),
    ],
    ids=["torque", "growing force"],
)
def test_an_overloaded_rigid_craft_is_stopped_before_its_steps_shrink(tmp_path, load, said):
    """With two rows asked for, the first comes long after the motion has lost its meaning."""
    path, out = tmp_path / "rigid.toml", tmp_path / "run.h5"
    text = RIGID.replace('"100 s"', '"10000 s"').replace("samples = 201", "samples = 2")
    path.write_text(f'{text}\n[[loads]]\nname = "push"\nbody = "hub"\n{load}\n')
    with pytest.raises(IntegrationError, match=f"the run stopped at t = .*: the motion diverges: {said}"):
        femflex.run(path, out)
    with femflex.open_run(out) as run:
        assert not run.complete and "diverges" in run.ended
        assert all(np.isfinite(run[path]).all() for path in run)
