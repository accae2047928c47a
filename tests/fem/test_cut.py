"""Line members cut into segments: where the cuts are, what stays together, and what cannot be cut."""

from __future__ import annotations

import numpy as np
import pytest

from femflex import fem
from femflex.fem.line.cut import ENDS, FAR, NEAR, cut
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
