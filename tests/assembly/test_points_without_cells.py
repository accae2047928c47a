"""Members of the family nodes in a case: groups of points that no cell has, with masses and springs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femflex.case import read_case
from femflex.pipeline.case_bodies import advised_bodies
from femflex.reduction import effective_mass

POINTS = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 0, 2, 0
4, 0, 0, 3
5, 0, -1, 0
*ELEMENT, TYPE=T3D2, ELSET=BAR
1, 1, 2
2, 1, 5
*NSET, NSET=FOOT
1, 2, 5
*NSET, NSET=HEAVY
3
*NSET, NSET=LIGHT
4
"""
CASE = """
[run]
duration = 1

[sections.thin]
kind = "cable"
EA = 1e6
mass_per_length = 0.1

[bodies.lump]
kind = "flexible"
mesh = "points.inp"
members = [
  { group = "BAR", family = "rod", section = "thin" },
  { group = "HEAVY", family = "nodes", options = { rotations = false } },
  { group = "LIGHT", family = "nodes" },
]
point_masses = [
  { group = "HEAVY", mass = 5 },
  { group = "LIGHT", mass = 2, inertia = [0.1, 0.2, 0.3] },
]
bushings = [
  { group = "HEAVY", translation = [20, 45, 80] },
  { group = "LIGHT", translation = [200, 300, 400], rotation = [60, 70, 80] },
]
reduction = { method = "cantilever", clamp = "FOOT", modes = 9 }
"""


@pytest.mark.filterwarnings("ignore:.*2 of 5 points belong to no cell")
def test_lumped_masses_of_a_case_vibrate_on_their_springs(tmp_path: Path):
    (tmp_path / "points.inp").write_text(POINTS, encoding="utf-8")
    (tmp_path / "lump.toml").write_text(CASE, encoding="utf-8")
    bodies, _ = advised_bodies(read_case(tmp_path / "lump.toml"), ["lump"])
    found = effective_mass(bodies["lump"])
    wanted = [20 / 5, 45 / 5, 80 / 5, 200 / 2, 300 / 2, 400 / 2, 80 / 0.3, 70 / 0.2, 60 / 0.1]
    np.testing.assert_allclose(found.omega**2, wanted, rtol=1e-8)
    assert found.carried[:3] == pytest.approx(7 / 7.2)


def test_a_member_of_another_family_is_refused_on_points_alone(tmp_path: Path):
    (tmp_path / "points.inp").write_text(POINTS, encoding="utf-8")
    text = CASE.replace(
        '"HEAVY", family = "nodes", options = { rotations = false }', '"HEAVY", family = "rod", section = "thin"'
    )
    (tmp_path / "lump.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"bodies\.lump\.members\[HEAVY\]\.group: cell group 'HEAVY' is not in the"):
        advised_bodies(read_case(tmp_path / "lump.toml"), ["lump"])
