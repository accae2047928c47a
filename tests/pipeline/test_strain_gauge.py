"""A sampled strain gauge that a case file states, against the static curvature of a beam."""

import pytest

from femflex import run

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


def test_a_gauge_shows_the_static_curvature_with_its_bias_after_its_delay(tmp_path):
    path = tmp_path / "gauge.toml"
    path.write_text(CASE)
    found = run(path, tmp_path / "gauge.h5")
    shown = found["effectors/gauge/strain"]
    assert shown[-1] == pytest.approx(0.3 * 1.5 / 30.0 + 2e-3, abs=2e-4)  # P (L - x) / EI; the quantum, six functions
    assert shown[0] == 0.0 and 0.0 < shown[1] < shown[-1]
    assert shown[-1] / 1e-4 == pytest.approx(round(shown[-1] / 1e-4), abs=1e-9)
