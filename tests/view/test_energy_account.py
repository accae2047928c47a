"""The energy account: contributors by name, which together stay zero."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

import femflex
from femflex.view import energy_account

WHEEL = """
[wheels.spin]
body = "hub"
inertia = 0.4
inertia_in_body = "contained"
torque = 0.6
viscous = 0.02
initial_speed = 12
"""


@pytest.fixture
def wheeled(write_case, craft, tmp_path):
    """A craft with a damped boom, a pushing load and a wheel that a motor drives against friction."""
    text = craft.replace('"0.5 %"', "0.02").replace(
        "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", "torque = [0, 0, 1]"
    )
    text = text.replace("output_step = 0.05", "output_step = 0.005")
    with femflex.run(write_case(text + WHEEL), tmp_path / "run.h5") as run:
        yield run


def test_every_contributor_is_named_and_together_they_stay_zero(wheeled):
    account = energy_account(wheeled)
    assert {"stored: kinetic", "stored: strain", "stored: spin", "dissipated: spin", "work: spin", "work: push"} <= set(
        account
    )
    assert "dissipated: joints and structures" in account
    largest = max(np.abs(values).max() for values in account.values())
    assert np.abs(sum(account.values())).max() < 1e-6 * largest
    t, speed = wheeled.time, wheeled["effectors/spin/speed"]
    lost = np.concatenate([[0.0], np.cumsum(0.02 * (speed[1:] ** 2 + speed[:-1] ** 2) / 2 * np.diff(t))])
    assert account["dissipated: spin"] == pytest.approx(lost, rel=1e-4, abs=1e-4 * lost[-1])


@pytest.mark.slow
def test_its_picture_is_made_by_plot(wheeled, femflex, tmp_path):
    code, out, _ = femflex("plot", wheeled.path, "--energy", "-o", "energy.png")
    assert code == 0 and "energy.png" in out
    picture = np.asarray(Image.open(tmp_path / "energy.png").convert("L"))
    assert picture.std() > 20
    code, _, said = femflex("plot", wheeled.path, "q", "--energy", "-o", "other.png")
    assert code == 2 and "leave channels, --with and --spectrum out" in said.replace("\n", " ")
