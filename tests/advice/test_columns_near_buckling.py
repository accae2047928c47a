"""A column damped to rest: of automatic strain below Euler's load against the beam-column, of nonlinear strain past it
against the elastica."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import femflex
from femflex.warning import PhysicsWarning

L, EI = 3.0, 1.4e4
EULER = np.pi**2 / 4 * EI / L**2
CASE = """
[run]
duration = {end}
samples = 101
[sections.strip]
kind = "stiffness"
EA = 2.8e7
EIy = 1.4e6
EIz = 1.4e4
GJ = 1.2e4
mass_per_length = 1.2
ry = 0.005
rz = 0.005
[bodies.boom]
kind = "flexible"
mesh = "boom.inp"
members = [{{ group = "BOOM", family = "beam", section = "strip", options = {{ orientation = [0, 1, 0] }} }}]
reduction = {{ method = "cantilever", clamp = "ROOT", modes = 3, loads = {{ TIP = ["y"] }}, derivatives = "auto" }}
markers.tip = {{ group = "TIP" }}
{strain}
damping = {{ ratio = 0.299 }}
[[loads]]
name = "press"
body = "boom"
marker = "tip"
frame = "inertial"
times = [0, 1, {end}]
force = [[0, 0, 0], [{press}, {aside}, 0], [{press}, {aside}, 0]]
[[joints]]
kind = "weld"
child = "boom"
child_marker = "ROOT"
"""


def tip_at_rest(write_case, tmp_path, part, aside, end, strain=""):
    """Lateral deflection of the tip over L at rest."""
    text = CASE.format(press=-part * EULER, aside=aside * part * EULER, end=end, strain=strain)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        with femflex.run(write_case(text), tmp_path / "column.h5", force=True) as run:
            y = np.array(run["markers/boom.tip/position"])[:, 1] / L
            assert abs(y[-1] - y[-10]) < 2e-3 * abs(y[-1])
    return y[-1]


@pytest.mark.slow
def test_column_below_euler_load_matches_beam_column(write_case, tmp_path):
    """w = H / (P k) (tan k L - k L)."""
    bent = tip_at_rest(write_case, tmp_path, 0.95, 1e-3, 8)
    kL = np.pi / 2 * np.sqrt(0.95)
    assert bent == pytest.approx(1e-3 * (np.tan(kL) - kL) / kL, rel=0.02)


@pytest.mark.slow
def test_column_past_euler_load_matches_elastica(write_case, tmp_path):
    """P / P_E = (2 K(m) / pi)^2, w / L = 2 sqrt(m) / K(m)."""
    part = 1.008
    bent = tip_at_rest(write_case, tmp_path, part, 5e-5, 25, 'strain = "nonlinear"')
    m = brentq(lambda m: (2 * ellipk(m) / np.pi) ** 2 - part, 1e-6, 0.5)
    assert bent == pytest.approx(2 * np.sqrt(m) / ellipk(m), rel=0.07)
