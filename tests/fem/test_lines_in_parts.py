"""Lines cut into segments, arc lengths, tables and formulas: generic lines, and what their refusals count."""

from __future__ import annotations

import numpy as np
import pytest

from femflex import fem
from femflex.fem.line.cut import FAR, NEAR, cut
from femflex.fem.line.formula import formula
from femflex.fem.sections import Rectangle
from femflex.mesh import Mesh

STEEL = fem.Material(210e9, 0.3, 7850.0)
# nodes out of order, cells in both directions, of unequal length: 0 - 4 - 1 - 3 - 2 along the line
POINTS = np.array([[0, 0, 0], [1.3, 0.6, 0], [2.0, 1.9, 1.0], [1.7, 1.1, 0.4], [0.4, 0.3, -0.2]])
CELLS = np.array([[4, 1], [4, 0], [2, 3], [1, 3]])
ORDER = [0, 4, 1, 3, 2]
AT = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(POINTS[ORDER], axis=0), axis=1))])


def bent(**points) -> Mesh:
    return Mesh(POINTS, {"line": CELLS}, {"line": {"line": np.arange(4)}}, {"low": [0], "high": [2], **points})


@pytest.mark.parametrize("start", ["low", "high"])
@pytest.mark.parametrize("k", [1, 3, 5])
def test_a_tapered_section_is_the_whole_lines_on_every_segment(start, k):
    """Resultants and outline at an arc length of a segment are those at that place of the line, from either end."""
    width = "0.05 - 0.02 * s / L + 0.01 * sin(3 * s)"
    member = fem.Member("line", "beam", Rectangle(width, 0.03), STEEL, {"start": "low"})
    segments = cut(bent(), [member], k, start=start)
    length = AT[-1]
    for j, segment in enumerate(segments):
        own = segment.members[0]
        s = np.array([0.0, 0.2, 0.9]) * length / k
        at = j * length / k + s if start == "low" else length - j * length / k - s
        b = 0.05 - 0.02 * at / length + 0.01 * np.sin(3 * at)
        r = own.section.resultants(STEEL, s, np.full(3, length / k))
        assert r.mass == pytest.approx(7850 * 0.03 * b) and r.EIz == pytest.approx(210e9 * 0.03 * b**3 / 12)
        reach = np.abs(own.section.outline(s, np.full(3, length / k)).points).max(axis=1)
        assert reach == pytest.approx(np.stack([b / 2, np.full(3, 0.015)], axis=1))
        assert own.section.varies and own.options["start"] == NEAR and own.options["extent"] == pytest.approx(length)
        nodes = segment.mesh.cells["line"]
        x = segment.mesh.points
        assert np.linalg.norm(x[nodes[:, 1]] - x[nodes[:, 0]], axis=1).sum() == pytest.approx(length / k)
        ends = AT[-1] * np.array([j, j + 1]) / k
        ends = ends if start == "low" else length - ends
        for name, where in zip((NEAR, FAR), ends, strict=True):
            place = [np.interp(where, AT, POINTS[ORDER, axis]) for axis in range(3)]
            assert x[segment.mesh.group_points(name)[0]] == pytest.approx(place, abs=1e-12)
        built = fem.build_structure(segment.mesh, segment.members)
        fine = np.linspace(*ends, 4001)
        b = 0.05 - 0.02 * fine / length + 0.01 * np.sin(3 * fine)
        mass = abs(np.trapezoid(7850 * 0.03 * b, fine))
        assert sum(block.dm.sum() for block in built.inertia) == pytest.approx(mass, rel=1e-5)


FUNCTIONS = ("sin", "cos", "tan", "sinh", "cosh", "tanh", "arctan", "sqrt", "exp", "log", "abs")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_is_its_own(name):
    """Against the standard library's, at values where all differ."""
    import math

    s = np.array([0.3, 0.8, 1.2])
    known = {"arctan": math.atan, "abs": abs}.get(name) or getattr(math, name)
    assert formula(f"{name}(s - 0.1) - L", s, 2.0) == pytest.approx([known(v - 0.1) - 2.0 for v in s], rel=1e-14)
