"""Line members cut into segments: where the cuts are, what stays together, and what cannot be cut."""

from __future__ import annotations

import numpy as np
import pytest

from femflex import fem
from femflex.fem.line.cut import ENDS, FAR, MOST, NEAR, cut
from femflex.mesh import Mesh, line, rectangle

STEEL = fem.Material(210e9, 0.3, 7850.0)
TUBE = fem.Member("line", "beam", fem.sections.Tube(0.05, 0.002), STEEL)
BENT = line([[0, 0, 0], [2, 0, 0], [2, 1, 0.5]], 4)  # 2 m along x, then up aside


def masses(segments):
    structures = [fem.build_structure(s.mesh, s.members, s.point_masses) for s in segments]
    return np.array([sum(block.dm.sum() for block in structure.inertia) for structure in structures])


@pytest.mark.parametrize("k", [1, 2, 3, 7])
def test_segments_are_equally_long_and_follow_each_other(k):
    segments = cut(BENT, [TUBE], k, start="start")
    whole = 2 + np.sqrt(1.25)
    at = np.zeros(3)
    for segment in segments:
        nodes = segment.mesh.cells["line"]
        ends = segment.mesh.points[nodes]
        assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(whole / k, rel=1e-9)
        near, far = (segment.mesh.points[segment.mesh.point_groups[end][0]] for end in (NEAR, FAR))
        assert near == pytest.approx(at, abs=1e-12)
        assert set(segment.mesh.point_groups[ENDS]) == {segment.mesh.point_groups[e][0] for e in (NEAR, FAR)}
        at = far
    assert at == pytest.approx([2, 1, 0.5])


def test_cuts_at_nodes_add_no_nodes_and_other_cuts_split_elements():
    straight = line([[0, 0, 0], [3, 0, 0]], 6)
    assert [len(s.mesh.cells["line"]) for s in cut(straight, [TUBE], 3)] == [2, 2, 2]
    assert [len(s.mesh.cells["line"]) for s in cut(straight, [TUBE], 4)] == [2, 2, 2, 2]
    assert [len(s.mesh.cells["line"]) for s in cut(straight, [TUBE], 12)] == [1] * 12


def test_the_end_that_is_named_is_where_segments_are_counted_from():
    first = cut(BENT, [TUBE], 2, start="end")[0]
    assert first.mesh.points[first.mesh.point_groups[NEAR][0]] == pytest.approx([2, 1, 0.5])
    assert list(first.mesh.point_groups["end"]) == list(first.mesh.point_groups[NEAR])


@pytest.mark.parametrize("start", ["start", "end"])
def test_a_section_that_varies_is_seen_at_its_own_place(start):
    taper = fem.Member("line", "beam", fem.sections.Tube("0.05 - 0.01*s/L", 0.002), STEEL, {"start": "start"})
    whole = fem.build_structure(BENT, [taper])
    parts = masses(cut(BENT, [taper], 5, start=start))
    assert parts.sum() == pytest.approx(sum(block.dm.sum() for block in whole.inertia), rel=1e-9)
    heavier_first = parts if start == "start" else parts[::-1]
    r = 0.05 - 0.01 * (np.arange(5) + 0.5) / 5  # linear in s: the middle is the mean
    area = np.pi * (r**2 - (r - 0.002) ** 2)
    assert heavier_first == pytest.approx(7850 * area * (2 + np.sqrt(1.25)) / 5, rel=1e-9)


def test_second_order_cells_are_cut_at_their_middle_too():
    assert masses(cut(line([[0, 0, 0], [1, 2, 2]], 3, "line3"), [TUBE], 4)) == pytest.approx(
        masses(cut(line([[0, 0, 0], [1, 2, 2]], 6), [TUBE], 4))
    )


def boom_with_panel(at: float) -> Mesh:
    """A boom of 4 m along x with a panel of 1 m attached to it at `at`, joined along one cell or at one node."""
    panel = rectangle(1.0, 1.0, 2, 2, "triangle").moved([at, 0, 0])
    return line([[0, 0, 0], [4, 0, 0]], 8).merged(panel, tolerance=1e-9)


PLATE = fem.Member("surface", "plate", fem.sections.laminates.isotropic(0.001, STEEL))


def test_other_members_and_masses_go_with_the_segment_they_hang_on():
    mesh = boom_with_panel(4.0)
    lump = fem.PointMass("end", 3.0)
    corner = fem.PointMass("top_right", 0.5)
    segments = cut(mesh, [TUBE, PLATE], 4, "line", [lump, corner], "start")
    assert ["triangle" in s.mesh.cells for s in segments] == [False, False, False, True]
    assert [len(s.point_masses) for s in segments] == [0, 0, 0, 2]
    found = masses(segments)
    assert found[3] - found[0] == pytest.approx(3.5 + 7850 * 0.001, rel=1e-9)
    assert "top_right" in segments[3].mesh.groups and "top_right" not in segments[0].mesh.groups


def test_a_mass_at_a_cut_is_carried_once():
    mesh = line([[0, 0, 0], [4, 0, 0]], 8).with_groups(points={"middle": [4], "all": range(9)})
    plain = masses(cut(mesh, [TUBE], 2))
    for group, count in (("middle", 1), ("all", 9)):
        assert masses(cut(mesh, [TUBE], 2, None, [fem.PointMass(group, 2.0)])).sum() == pytest.approx(
            plain.sum() + 2 * count
        )


def refusal(*args, **kwargs) -> str:
    with pytest.raises(ValueError) as told:
        cut(*args, **kwargs)
    return str(told.value)


def test_what_cannot_be_cut_is_told():
    tee = Mesh(
        [[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]], {"line": [[0, 1], [1, 2], [1, 3]]}, {"line": {"line": [0, 1, 2]}}
    )
    ring = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], {"line": [[0, 1], [1, 2], [2, 0]]}, {"line": {"line": [0, 1, 2]}})
    two = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], {"line": [[0, 1], [2, 3]]}, {"line": {"line": [0, 1]}})
    assert "branches at 1 of its nodes" in refusal(tee, [TUBE], 2)
    assert "is a closed line" in refusal(ring, [TUBE], 2)
    assert "falls into 2 lines" in refusal(two, [TUBE], 2)
    assert f"found 0 segments; a line member can be cut into 1 to {MOST}" in refusal(BENT, [TUBE], 0)
    assert f"found {MOST + 1} segments" in refusal(BENT, [TUBE], MOST + 1)
    assert "lies at both ends" in refusal(BENT.with_groups(points={"both": [0, 4]}), [TUBE], 2, start="both")
    assert "lies at neither end" in refusal(BENT.with_groups(points={"mid": [2]}), [TUBE], 2, start="mid")


def test_members_that_stand_in_the_way_are_told():
    mesh = boom_with_panel(1.0)  # shares the boom's nodes from 1 m to 2 m
    assert "holds several of the 3 segments of 'line' together" in refusal(mesh, [TUBE, PLATE], 3, "line")
    assert len(cut(mesh, [TUBE, PLATE], 4, "line")) == 4
    apart = line([[0, 0, 0], [4, 0, 0]], 8).merged(rectangle(1.0, 1.0, 1, 1, "triangle").moved([0, 5, 0]))
    assert "do not touch the line 'line'" in refusal(apart, [TUBE, PLATE], 2, "line")
    assert "made of triangle cells; only a member of line cells" in refusal(mesh, [TUBE, PLATE], 2, "surface")
    assert "0 members are made of line cells" in refusal(mesh, [PLATE], 2)
    assert "no member lies on group 'boom'" in refusal(mesh, [TUBE, PLATE], 2, "boom")
    stray = mesh.with_groups(points={"stray": [0]}).merged(Mesh([[9, 9, 9]], {}, {}, {"lost": [0]}))
    assert "belong to no member" in refusal(stray, [TUBE, PLATE], 4, "line", [fem.PointMass("lost", 1.0)])
