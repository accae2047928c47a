"""A run whose free length comes to the end of its stock: what it says, and what it keeps."""

from pathlib import Path

import numpy as np
import pytest

import femflex
from femflex.integrate import IntegrationError

CASE = """
title = "to the end of the stock"
[run]
duration = "60 s"
output_step = "0.2 s"
[bodies.craft]
kind = "rigid"
mass = 100
inertia = [200, 200, 200]
[bodies.craft.markers]
mount = { position = [0.5, 0, 0] }
[bodies.tether]
kind = "deploying"
family = "tether"
reel = { length = "2 m", speed = "0.2 m/s", tension = "0.001 N" }
stock = 8
mass_per_length = 0.02
[bodies.tip]
kind = "rigid"
mass = 0.5
inertia = [1e-4, 1e-4, 1e-4]
[[joints]]
kind = "free"
child = "craft"
rates = [0, 0, 0.1]
[[joints]]
kind = "universal"
axes = [[0, 0, 1], [0, 1, 0]]
child = "tether"
parent = "craft"
parent_marker = "mount"
[[joints]]
kind = "weld"
child = "tip"
parent = "tether"
parent_marker = "tip"
"""


def test_a_run_to_the_end_of_its_stock_keeps_its_rows_and_names_the_body(tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    with pytest.raises(IntegrationError, match=r"free length of body 'tether' has reached .* stock = 8 m, at .* m/s"):
        femflex.run(femflex.read_case(path), tmp_path / "run.h5")
    with femflex.open_run(tmp_path / "run.h5") as run:
        assert len(run) > 50 and run["bodies/tether/length"][-1] == pytest.approx(8.0, abs=1e-3)
        energy = run["monitors/energy"]
        assert np.isfinite(energy).all() and np.isfinite(run["markers/tether.tip/velocity"]).all()
