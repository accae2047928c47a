"""Properties along line members, formulas and tables, and lines cut into segments."""

from __future__ import annotations

import numpy as np
import pytest

from femflex import fem
from femflex.fem.formula import formula
from femflex.fem.line.segments import FAR, NEAR, cut_into_segments
from femflex.fem.sections import Rectangle
from femflex.fem.sections.section import evaluate_variation, varies
from femflex.mesh import Mesh, line, rectangle

S = np.linspace(0.0, 4.0, 9)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("3 - 0.5*s", 3 - 0.5 * S),
        ("2 * (1 - s/L)**3", 2 * (1 - S / 4) ** 3),
        ("-s + +1", 1 - S),
        ("exp(-s) * sin(pi * s / L)", np.exp(-S) * np.sin(np.pi * S / 4)),
        ("max(1, min(s, 2))", np.clip(S, 1, 2)),
        ("1e-3", np.full(9, 1e-3)),
    ],
)
def test_formula_values(text, expected):
    assert varies(text)
    assert evaluate_variation(text, S, 4.0) == pytest.approx(expected, rel=1e-15, abs=1e-16)


CODE = (
    "__import__('os').getcwd()", "s.__class__", "[s for s in (1, 2)]", "(lambda: 1)()", "s if s else 1", "open('x')",
    "s[0]", "exp(s, s, s, s)", "x + 1", "True", "'a' * 3", "s @ s", "exp(x=s)", "1j * s", "s < 1", "s // 2", "~1",
    "s\n+1", "exp", "(s, s)",
)  # fmt: skip


@pytest.mark.parametrize("text", CODE)
def test_formula_rejects_other_than_arithmetic(text):
    with pytest.raises(ValueError, match="formula"):
        evaluate_variation(text, S, 4.0)


def test_table_interpolation():
    at, values = [0.0, 1.0, 2.5, 4.0], [1.0, 0.5, 0.4, 2.0]
    assert evaluate_variation((at, values), np.array(at), 4.0) == pytest.approx(values, rel=1e-15)
    assert evaluate_variation([[0, 4], [1, 3]], S, 4.0) == pytest.approx(1 + S / 2, rel=1e-15)
    assert varies([[0, 4], [1, 3]])


def test_positive_table_stays_positive():
    """Where a cubic spline would overshoot below zero."""
    values = evaluate_variation(([0.0, 1.0, 2.0, 4.0], [10.0, 0.01, 0.01, 10.0]), np.linspace(0, 4, 201), 4.0)
    assert values.min() == pytest.approx(0.01)


@pytest.mark.parametrize(("function", "order"), [(lambda s: np.exp(-s / 2), 3.0), (np.cos, 2.0)], ids=["taper", "wavy"])
def test_convergence_of_smooth_table(function, order):
    """At third order where it is monotone (a taper), at second at extrema, which a monotone cubic keeps flat."""
    s, counts = np.linspace(0, 4, 3001), np.array([8, 16, 32, 64, 128])
    errors = []
    for n in counts:
        at = np.linspace(0, 4, n + 1)
        errors.append(np.abs(evaluate_variation((at, function(at)), s, 4.0) - function(s)).max())
    slope = np.polyfit(np.log(1 / counts), np.log(errors), deg=1)[0]
    assert slope == pytest.approx(order, abs=0.25)


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
def test_tapered_section_of_segments(start, k):
    """Resultants and outline at an arc length of a segment are those at that place of the line, from either end."""
    width = "0.05 - 0.02 * s / L + 0.01 * sin(3 * s)"
    member = fem.Member("line", "beam", Rectangle(width, 0.03), STEEL, {"start": "low"})
    segments = cut_into_segments(bent(), [member], k, start=start)
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
def test_formula_functions(name):
    """Against the standard library's, at values where all differ."""
    import math

    s = np.array([0.3, 0.8, 1.2])
    reference = {"arctan": math.atan, "abs": abs}.get(name) or getattr(math, name)
    assert formula(f"{name}(s - 0.1) - L", s, 2.0) == pytest.approx([reference(v - 0.1) - 2.0 for v in s], rel=1e-14)


TUBE = fem.Member("line", "beam", fem.sections.Tube(0.05, 0.002), STEEL)


def masses(segments):
    structures = [fem.build_structure(s.mesh, s.members, s.point_masses) for s in segments]
    return np.array([sum(block.dm.sum() for block in structure.inertia) for structure in structures])


def boom_with_panel(at: float) -> Mesh:
    """A boom of 4 m along x with a panel of 1 m attached to it at `at`, joined along one cell or at one node."""
    panel = rectangle(1.0, 1.0, 2, 2, "triangle").translated([at, 0, 0])
    return line([[0, 0, 0], [4, 0, 0]], 8).merged(panel, tolerance=1e-9)


PLATE = fem.Member("surface", "plate", fem.sections.laminates.isotropic(0.001, STEEL))


def test_members_and_masses_of_segments():
    mesh = boom_with_panel(4.0)
    lump = fem.PointMass("end", 3.0)
    corner = fem.PointMass("top_right", 0.5)
    segments = cut_into_segments(mesh, [TUBE, PLATE], 4, "line", [lump, corner], "start")
    assert ["triangle" in s.mesh.cells for s in segments] == [False, False, False, True]
    assert [len(s.point_masses) for s in segments] == [0, 0, 0, 2]
    computed = masses(segments)
    assert computed[3] - computed[0] == pytest.approx(3.5 + 7850 * 0.001, rel=1e-9)
    assert "top_right" in segments[3].mesh.groups and "top_right" not in segments[0].mesh.groups


def test_mass_at_cut_belongs_to_one_segment():
    mesh = line([[0, 0, 0], [4, 0, 0]], 8).with_groups(points={"middle": [4], "all": range(9)})
    plain = masses(cut_into_segments(mesh, [TUBE], 2))
    for group, count in (("middle", 1), ("all", 9)):
        assert masses(cut_into_segments(mesh, [TUBE], 2, None, [fem.PointMass(group, 2.0)])).sum() == pytest.approx(
            plain.sum() + 2 * count
        )
