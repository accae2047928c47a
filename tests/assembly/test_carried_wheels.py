"""Bodies that carry several wheels of a case: each leaves its mass and inertia in the body, or takes them out of it."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.case import read_case
from femflex.pipeline.decisions import build_system

WHEELS = """
[wheels.one]
body = "hub"
marker = "left"
axis = [1, 0, 0]
inertia = 0.2
inertia_in_body = "added"
mass = 3.0
transverse_inertia = 0.15

[wheels.two]
body = "hub"
axis = [0, 3, 4]
inertia = 0.5
inertia_in_body = "contained"

[wheels.three]
body = "hub"
axis = [0, 0, 1]
inertia = 0.1
inertia_in_body = "added"
mass = 5.0
transverse_inertia = 0.07
"""


def test_a_body_with_several_wheels_has_the_moments_of_all_of_them(craft, write_case):
    """About the hub's origin; the first wheel is at (0.5, 0, 0), the others at the origin."""
    body = build_system(read_case(write_case(craft + WHEELS))).bodies["hub"]
    assert body.moments.mass == pytest.approx(200.0 + 3.0 + 5.0)
    assert body.moments.first[0] == pytest.approx([3.0 * 0.5, 0.0, 0.0])
    a = np.array([0.0, 0.6, 0.8])
    expected = np.diag([120.0, 100.0, 140.0]) + 3.0 * 0.25 * np.diag([0.0, 1.0, 1.0])
    expected += 0.15 * np.diag([0.0, 1.0, 1.0]) - 0.5 * np.outer(a, a) + 0.07 * np.diag([1.0, 1.0, 0.0])
    assert body.moments.inertia() == pytest.approx(expected, abs=1e-10)
