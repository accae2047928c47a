"""A cantilever rolled up by a moment at its end: equilibria of segments against the exact circle."""

from __future__ import annotations

import numpy as np
import pytest

import femflex
from femflex.mesh import Mesh, line, write_mesh

CASE = """
[run]
duration = "0.5 s"
samples = 3
[initial]
from = "equilibrium"
[attitude]
held = true
[sections.strip]
kind = "stiffness"
EA = "1.2e5 N"
EIy = "100 N m^2"
EIz = "1e4 N m^2"
GJ = "100 N m^2"
mass_per_length = "1 kg/m"
ry = "28.9 mm"
rz = "28.9 mm"
[bodies.beam]
kind = "flexible"
mesh = "strip.msh"
members = [{ group = "beam", family = "beam", section = "strip", segments = 24 }]
[bodies.beam.markers]
root = { group = "root" }
tip = { group = "tip" }
[[loads]]
name = "turn"
body = "beam"
marker = "tip"
frame = "inertial"
torque = [0, "MOMENT N m", 0]
"""


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.25, 0.5, 1.0])
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_a_strip_is_rolled_up_to_a_circle(share, tmp_path):
    """L = 12, EI = 100, M = share of 2 pi EI / L (Sze, Liu and Lo 2004): an arc of radius L / 2 pi share."""
    bare = line([[0, 0, 0], [12.0, 0, 0]], 24)
    points = {"root": bare.point_groups["start"], "tip": bare.point_groups["end"]}
    write_mesh(tmp_path / "strip.msh", Mesh(bare.points, bare.cells, {"beam": bare.cell_groups["line"]}, points))
    (tmp_path / "roll.toml").write_text(CASE.replace("MOMENT", str(-share * 50 * np.pi / 3)))
    with femflex.run(tmp_path / "roll.toml", tmp_path / "roll.h5") as run:
        tip = run["markers/beam.tip/position"][0]
    turn = 2 * np.pi * share
    exact = 12 / turn * np.array([np.sin(turn), 0.0, 1 - np.cos(turn)])
    np.testing.assert_allclose(tip, exact, atol=0.005 * 12)
    assert tip[2] == pytest.approx(exact[2], rel=2e-3, abs=1e-9)
