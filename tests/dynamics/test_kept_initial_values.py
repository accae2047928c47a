"""Initial values that are kept where loops close, and what cannot close with them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from support.mechanisms import four_bar

from femflex.dynamics import compile_system

CRANK, COUPLER, ROCKER, BASE = 0.5, 2.0, 1.2, 2.0


def state(system):
    """Initial coordinates and rates by name."""
    model = compile_system(system)
    names = [name for name, _ in (*system.coordinate_names(), *system.velocity_names())]
    assert np.abs(model.constraints.residuals(0.0, model.x0)).max() < 1e-12
    return dict(zip(names, model.x0, strict=True))


def rocker_at(crank):
    """The rocker's angle by the closure of the four bars, crank ahead of the rocker."""
    end = CRANK * np.array([np.cos(crank), np.sin(crank)])
    far = np.array([BASE, 0.0])
    return brentq(
        lambda a: np.hypot(*(far + ROCKER * np.array([np.cos(a), np.sin(a)]) - end)) - COUPLER, 0.4, np.pi, xtol=1e-14
    )


@pytest.mark.parametrize("name", ["drive", "drive.angle"])
def test_a_kept_crank_stays_and_the_others_follow(name):
    system = replace(four_bar(speed=2.0), keep=(name,))
    x = state(system)
    assert (x["drive.angle"], x["drive.angle_rate"]) == pytest.approx((0.3, 2.0), abs=1e-12)
    assert x["ground-rocker.angle"] == pytest.approx(rocker_at(0.3), abs=1e-11)
    h = 1e-5
    ratio = (rocker_at(0.3 + h) - rocker_at(0.3 - h)) / (2 * h)
    assert x["ground-rocker.angle_rate"] == pytest.approx(2.0 * ratio, rel=1e-8)
    free = state(four_bar(speed=2.0))
    assert abs(free["drive.angle"] - 0.3) > 1e-3  # without keep the crank gives way too


def test_a_kept_rocker_moves_the_crank():
    x = state(replace(four_bar(), keep=("ground-rocker",)))
    assert x["ground-rocker.angle"] == pytest.approx(1.6, abs=1e-12)
    assert rocker_at(x["drive.angle"]) == pytest.approx(1.6, abs=1e-10)


def test_a_loop_that_cannot_close_with_what_is_kept_is_named():
    with pytest.raises(ValueError, match=r"'closure' cannot close: .* with 'drive', 'ground-rocker' kept as given"):
        compile_system(replace(four_bar(), keep=("drive", "ground-rocker")))
    moving = replace(four_bar(speed=1.0), keep=("drive", "ground-rocker"))
    closed = state(replace(moving, keep=("drive",)))
    joints = tuple(
        j.with_initial(q0=[closed[f"{j.label}.angle"]]) if j.n_u else j for j in moving.joints
    )  # positions close, but the kept rocker is at rest while the crank turns
    with pytest.raises(ValueError, match=r"'closure' cannot be satisfied: the .* with 'drive', 'ground-rocker' kept"):
        compile_system(replace(moving, joints=joints))


def test_names_that_cannot_be_kept_are_told():
    with pytest.raises(ValueError, match=r"keep names 'drvie'.*did you mean 'drive'\? known are drive, drive.angle"):
        replace(four_bar(), keep=("drvie",))
