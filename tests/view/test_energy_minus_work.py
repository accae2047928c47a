"""Energy minus work in the default plot: it stays where energy itself does not."""

from __future__ import annotations

import numpy as np
import pytest

import femflex
from femflex.view.curves import BALANCE, balance_of, curves_of, default_channels

PUSHED = """
[[loads]]
name = "pulse"
body = "boom"
marker = "tip"
frame = "marker"
force = [[0, 0, 0], [0, 0.4, 0.2], [0, 0, 0]]
torque = [[0, 0, 0], [0.1, 0, 0.2], [0, 0, 0]]
times = [0, 5, 10]
"""


@pytest.fixture
def pushed(write_case, craft, tmp_path):
    """A craft that a force and a torque at the deflected tip of its damped boom push."""
    text = craft.replace('"0.5 %"', "0.02").replace(
        "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", "torque = [0, 0, 1]"
    )
    text = text.replace("output_step = 0.05", "output_step = 0.005")
    assert text.count("0.02") == 1 and "times" not in text  # its push goes on, so that no power jumps
    with femflex.run(write_case(text + PUSHED), tmp_path / "run.h5") as run:
        yield run


def test_what_loads_bring_in_and_dampers_take_is_all_that_changes_the_energy(pushed):
    E = pushed["monitors/energy"]
    brought = np.ptp(E)
    assert BALANCE in default_channels(pushed) and brought > 1e-3
    assert pushed["monitors/dissipation"].max() > 1e-4 * brought
    assert np.abs(balance_of(pushed).values).max() < 1e-5 * brought
    ((curve,),) = [group for group in curves_of(pushed) if group[0].quantity == BALANCE]
    assert curve.unit == "J" and curve.label == "energy"


def test_the_power_of_a_load_is_that_of_its_force_at_its_marker(pushed):
    force, power = pushed["loads/pulse/force"], pushed["loads/pulse/power"]
    assert pushed["monitors/supplied"] == pytest.approx(power + pushed["loads/push/power"], abs=1e-12)
    velocity = pushed["markers/boom.tip/velocity"]
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_quat(pushed["bodies/boom/attitude"], scalar_first=True)
    pushes = np.einsum("tk,tk->t", turn.apply(force), velocity)
    torques = np.einsum("tk,tk->t", pushed["loads/pulse/torque"], pushed["bodies/boom/rate"])
    bending = power - pushes - torques  # the torque turns the section of the tip too
    assert 1e-4 * np.abs(power).max() < np.abs(bending).max() < 0.9 * np.abs(power).max()
