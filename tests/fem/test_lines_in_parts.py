"""Lines cut into segments, arc lengths, tables and formulas: generic lines, and what their refusals count."""

from __future__ import annotations

import numpy as np
import pytest

from femflex import fem
from femflex.fem.along import along
from femflex.fem.formula import formula, formula_of_place
from femflex.fem.line.chain import arc_length, element_frames
from femflex.fem.line.cut import FAR, NEAR, cut
from femflex.fem.line.section_points import section_points
from femflex.fem.sections import Rectangle, Tube
from femflex.mesh import Mesh, line, rectangle

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


def test_options_of_the_line_are_kept_and_its_own_start_counts():
    member = fem.Member("line", "beam", Tube(0.02, 0.002), STEEL, {"start": "high", "order": 5, "extent": 9.0})
    first = cut(bent(), [member], 2)[0]
    assert first.members[0].options == {"order": 5, "extent": 9.0}
    assert first.mesh.points[first.mesh.group_points(NEAR)[0]] == pytest.approx(POINTS[2])
    plain = cut(bent(), [fem.Member("line", "beam", Tube(0.02, 0.002), STEEL)], 2)[0]
    assert plain.members[0].options["extent"] == pytest.approx(AT[-1])
    cord = fem.Member("line", "tether", fem.sections.CableSection(1e5, 0.1))
    assert "extent" not in cut(bent(), [cord], 2)[0].members[0].options


def test_two_panels_of_one_kind_keep_their_own_cells_and_groups_that_reach_further_stay_away():
    boom = line([[0, 0, 0], [4.0, 0, 0]], 8)
    one = rectangle(1.0, 1.0, 2, 1, "quad").moved([4.0, 0, 0])
    two = rectangle(1.0, 0.5, 3, 2, "quad").moved([4.0, -0.5, 0])
    names = []
    for part, name in ((one, "one"), (two, "two")):
        names.append(Mesh(part.points, {"quad": part.cells["quad"]}, {name: part.cell_groups["surface"]},
                          {f"{name} far": part.group_points("right")}))  # fmt: skip
    mesh = boom.merged(names[0], tolerance=1e-9).merged(names[1], tolerance=1e-9)
    reach = np.concatenate([mesh.group_points("start"), mesh.group_points("one far")])
    mesh = mesh.with_groups(points={"reach": reach})
    members = [fem.Member("line", "beam", Tube(0.05, 0.002), STEEL)]
    members += [fem.Member(name, "plate_bfs", 0.01 * k, STEEL) for k, name in ((1, "one"), (2, "two"))]
    segments = cut(mesh, members, 3, "line", [fem.PointMass("reach", 2.0)])
    last = segments[-1]
    assert [m.group for m in last.members] == ["line", "one", "two"]
    for name, count, area in (("one", 2, 1.0), ("two", 6, 0.5)):
        cells = last.mesh.group_cells(name)["quad"]
        x = last.mesh.points[cells]
        sides = np.linalg.norm(x[:, 1] - x[:, 0], axis=1) * np.linalg.norm(x[:, 2] - x[:, 1], axis=1)
        assert len(cells) == count and sides.sum() == pytest.approx(area)
    assert "one far" in last.groups and "reach" not in last.groups and "start" in segments[0].groups
    assert "reach" not in last.mesh.groups
    assert [len(s.mesh.group_points(m.group)) for s in segments for m in s.point_masses] == [1, 2]
    total = sum(
        block.dm.sum() for s in segments for block in fem.build_structure(s.mesh, s.members, s.point_masses).inertia
    )
    assert total == pytest.approx(7850 * (4 * np.pi * (0.05**2 - 0.048**2) + 0.01 + 0.01) + 6.0)


def test_a_panel_of_triangles_and_quadrilaterals_beyond_a_cut_keeps_all_its_cells_there():
    """It hangs on the cut and beyond: with the second segment; a mass at the cut stays with the first."""
    points = [[x, 0, 0] for x in range(5)] + [[2.0, 1, 0], [3.0, 1, 0], [3.0, 2, 0]]
    cells = {"line": [[k, k + 1] for k in range(4)], "quad": [[2, 3, 6, 5]], "triangle": [[5, 6, 7]]}
    groups = {"line": {"line": range(4)}, "panel": {"quad": [0], "triangle": [0]}}
    mesh = Mesh(points, cells, groups, {"cut": [2], "far": [7]})
    members = [fem.Member("line", "beam", Tube(0.05, 0.002), STEEL), fem.Member("panel", "shell", 0.01, STEEL)]
    first, second = cut(mesh, members, 2, "line", [fem.PointMass("cut", 2.0), fem.PointMass("far", 3.0)])
    assert [len(s.members) for s in (first, second)] == [1, 2]
    assert [[m.mass for m in s.point_masses] for s in (first, second)] == [[2.0], [3.0]]
    held = second.mesh.group_cells("panel")
    assert {kind: len(rows) for kind, rows in held.items()} == {"quad": 1, "triangle": 1}
    assert sorted(second.mesh.points[held["triangle"][0]].tolist()) == sorted(np.array(points, float)[5:].tolist())
    assert second.mesh.points[second.mesh.group_points("far")[0]] == pytest.approx(points[7])
    both = fem.Member("panel", "beam", Tube(0.05, 0.002), STEEL)
    assert refusal(lambda: cut(mesh, [both], 2, "panel")) == (
        "the member on group 'panel' is made of quad, triangle cells; only a member of line cells can be cut into "
        "segments"
    )
    other = Mesh(points, {k: cells[k] for k in ("triangle", "quad", "line")}, {
        "line": groups["line"], "panel": {"triangle": [0], "quad": [0]}})  # fmt: skip
    assert "made of quad, triangle cells" in refusal(lambda: cut(other, [both], 2, "panel"))


def test_three_struts_at_one_segment_keep_their_own_cells():
    """All of line cells, as the line itself; each has its own group, length and mass."""
    points = [[x, 0, 0] for x in range(5)] + [[3.5, 1, 0], [3.0, 0, 2], [4.0, -3, 0], [4.0, -3.5, 0]]
    lines = [[4, 7], [7, 8], [0, 1], [1, 2], [2, 3], [3, 4], [3, 5], [3, 6]]
    groups = {"line": {"line": [2, 3, 4, 5]}, "a": {"line": [6]}, "b": {"line": [7]}, "c": {"line": [0, 1]}}
    mesh = Mesh(points, {"line": lines}, groups)
    radius = {"line": 0.05, "a": 0.01, "b": 0.02, "c": 0.03}
    members = [fem.Member(g, "beam", fem.sections.Circle(r), STEEL) for g, r in radius.items()]
    first, second = cut(mesh, members, 2, "line")
    built = [fem.build_structure(s.mesh, s.members) for s in (first, second)]
    length = {"line": 2.0, "a": np.hypot(0.5, 1.0), "b": 2.0, "c": 3.5}
    assert [m.group for m in second.members] == ["line", "a", "b", "c"] and [m.group for m in first.members] == ["line"]
    for member, block in zip(second.members, built[1].inertia, strict=True):
        x = second.mesh.points[second.mesh.group_cells(member.group)["line"]]
        assert np.linalg.norm(x[:, 1] - x[:, 0], axis=1).sum() == pytest.approx(length[member.group])
        area = np.pi * radius[member.group] ** 2
        assert block.dm.sum() == pytest.approx(7850 * area * length[member.group])


def refusal(make) -> str:
    with pytest.raises(ValueError) as told:
        make()
    return str(told.value)


def test_refused_lines_count_what_is_wrong():
    star = Mesh(
        np.concatenate([POINTS, POINTS + np.array([0, 0, 3.0])]),
        {"line": [[0, 1], [0, 2], [0, 3], [4, 5], [4, 6], [4, 7], [3, 8], [8, 4], [4, 9]]},
        {"line": {"line": np.arange(9)}},
    )
    tube = fem.Member("line", "beam", Tube(0.02, 0.002), STEEL)
    assert refusal(lambda: cut(star, [tube], 2)).startswith("group 'line' branches at 2 of its nodes; only a single")
    assert refusal(lambda: arc_length(star, star.cells["line"], "line", None)).startswith(
        "group 'line' branches at 2 of its nodes, so it has no arc length"
    )
    three = Mesh(POINTS[[0, 1, 2, 3, 4, 4]] + np.arange(6)[:, None], {"line": [[0, 1], [2, 3], [4, 5]]},
                 {"line": {"line": [0, 1, 2]}}, {"some": [0, 1, 2]})  # fmt: skip
    assert refusal(lambda: cut(three, [tube], 2)).startswith("group 'line' falls into 3 lines that share no node")
    assert refusal(lambda: arc_length(three, three.cells["line"], "line", "some")) == (
        "the 3 chains of group 'line' have [2, 1, 0] points where the arc length may start; name one point of each in "
        'a point group and give it as the option "start"'
    )
    masses = [fem.PointMass("mixed", 1.0)]
    loose = bent().merged(Mesh([[9.0, 9, 9], [8.0, 9, 9]], {}, {}, {"loose": [0, 1]}))
    loose = loose.with_groups(points={"mixed": [0, 5, 6]})
    assert refusal(lambda: cut(loose, [tube], 2, point_masses=masses)).startswith(
        "2 of the 3 points of group 'mixed' belong to no member, so no mass can stand there"
    )
    two = [tube, fem.Member("other", "beam", Tube(0.02, 0.002), STEEL)]
    both = Mesh(POINTS, {"line": CELLS}, {"line": {"line": [0, 1]}, "other": {"line": [2]}})
    assert refusal(lambda: cut(both, two, 2)).startswith("2 members are made of line cells (['line', 'other']); name")
    assert refusal(lambda: cut(both, two, 2, "boom")) == (
        "no member lies on group 'boom'; members lie on ['line', 'other']"
    )


def test_arc_lengths_of_unequal_chains_have_their_own_whole():
    arc = arc_length(bent(), CELLS, "line", "high")
    back = dict(zip(ORDER, AT[-1] - AT, strict=True))
    assert arc.ends == pytest.approx(np.array([[back[a], back[b]] for a, b in CELLS]))
    assert arc.whole == pytest.approx(np.full(4, AT[-1]))


def test_frames_judge_length_and_direction_by_their_own_size():
    """Elements far from the origin, elements of a millionth of a metre, and orientation vectors of any length."""
    start, x = np.array([[1e9, 0, 0], [0, 0, 0]]), np.array([[3.0, 4.0, 0], [0, 1e-6, 0]])
    length, frame = element_frames(start[1:], start[1:] + x[1:], np.array([0, 0, 1e-5]), "g")
    assert length == pytest.approx([1e-6]) and frame[0, 1] == pytest.approx([0, 0, 1.0])
    said = refusal(lambda: element_frames(start, start + np.array([[5e-4, 0, 0], [0, 1.0, 0]]), None, "g"))
    assert said == (
        "group 'g' has 1 line cells of no length, the first is cell 0 at (1e+09, 0, 0) m; join its two nodes or take "
        "it out"
    )
    said = refusal(lambda: element_frames(np.zeros((3, 3)), np.eye(3), np.array([0.0, 500.0, 0.1]), "g"))
    assert said.startswith("orientation [0.0, 500.0, 0.1] is parallel to 1 of the 3 elements of group 'g'; give")


def test_tables_are_refused_short_at_either_end_but_not_by_rounding():
    s = np.linspace(1.0, 4.0, 5)
    table = ([1.0 + 1e-10, 4.0 - 1e-10], [2.0, 5.0])
    assert along(table, s, 4.0) == pytest.approx(1 + s)
    assert refusal(lambda: along(([1.2, 4.0], [1.0, 2.0]), s, 4.0)) == (
        "a table covers s = 1.2 to 4 m, but the member is used from 1 to 4 m; extend the table over the whole arc "
        "length"
    )
    assert "covers s = 0 to 3.99 m" in refusal(lambda: along(([0.0, 3.99], [1.0, 2.0]), s, 4.0))
    assert refusal(lambda: along(([0.0, 2.0, 2.0], [1.0, 2.0, 3.0]), s, 4.0)) == (
        "arc lengths of a table along a member must increase; got [0.0, 2.0, 2.0] m"
    )
    assert refusal(lambda: along(np.inf, s, 4.0)) == "inf is inf at s = 1 m; it must be finite along the whole member"


def test_formulas_of_places_name_their_coordinates():
    x = np.random.default_rng(0).normal(size=(2, 4, 3))
    found = formula_of_place("x - 2 * y / (3 + z**2) + pi", x)
    assert found == pytest.approx(x[..., 0] - 2 * x[..., 1] / (3 + x[..., 2] ** 2) + np.pi)
    x[1, 2] = [0.5, -2.0, 0.25]
    said = refusal(lambda: formula_of_place("1 / (y + 2)", x))
    assert "'1 / (y + 2)' is inf at x = 0.5 m, y = -2 m, z = 0.25 m" in said
    assert "it may use the names ['pi', 'x', 'y', 'z'], numbers, + - * / ** and sin, cos, tan" in refusal(
        lambda: formula_of_place("s", x)
    )


FUNCTIONS = ("sin", "cos", "tan", "sinh", "cosh", "tanh", "arctan", "sqrt", "exp", "log", "abs")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_is_its_own(name):
    """Against the standard library's, at values where all differ."""
    import math

    s = np.array([0.3, 0.8, 1.2])
    known = {"arctan": math.atan, "abs": abs}.get(name) or getattr(math, name)
    assert formula(f"{name}(s - 0.1) - L", s, 2.0) == pytest.approx([known(v - 0.1) - 2.0 for v in s], rel=1e-14)


def test_long_formulas_are_shown_cut_and_where_they_break():
    s = np.ones(3)
    long = "+".join(["s"] * 100) + "+x"
    assert refusal(lambda: formula(long, s, 1.0)).startswith(f"formula '{long[:77]}...' holds 'x'; it may use")
    whole = "+".join(["s"] * 39) + "+x"  # 79 characters
    assert refusal(lambda: formula(whole, s, 1.0)).startswith(f"formula {whole!r} holds 'x'; it may use")
    assert "at character 5" in refusal(lambda: formula("s + * 2", s, 1.0))
    assert formula("+".join(["s"] * 1000) + " ", s, 1.0) == pytest.approx(np.full(3, 1000.0))


def test_points_of_a_section_have_its_moments_of_mass():
    """Also about skew axes, at several stations; without rotary inertia only that of twist remains."""
    rng = np.random.default_rng(1)
    y, z, dm = rng.normal(size=(4, 2, 6)), rng.normal(size=(4, 2, 6)), rng.uniform(size=6)
    y, z = (v - (v @ dm / dm.sum())[..., None] for v in (y, z))
    yy, zz, yz = (p @ dm / dm.sum() for p in (y * y, z * z, y * z))
    for product in (yz, None):
        o, share = section_points(yy, zz, True, product)
        second = np.einsum("k,...ki,...kj->...ij", share, o, o)
        zero = 0 * yy
        cross = zero if product is None else yz
        expected = np.array([[zero, zero, zero], [zero, yy, cross], [zero, cross, zz]])
        assert second == pytest.approx(np.moveaxis(expected, (0, 1), (-2, -1)), abs=1e-13)
        assert share.sum() == pytest.approx(1.0) and np.einsum("k,...ki->...i", share, o) == pytest.approx(
            0.0, abs=1e-13
        )
    o, share = section_points(yy, zz, False, yz)
    second = np.einsum("k,...ki,...kj->...ij", share, o, o)
    inertia = np.trace(second, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - second
    assert inertia == pytest.approx((yy + zz)[..., None, None] * np.diag([1.0, 0, 0]), abs=1e-13)
