"""Arc length along chains of line cells, and element frames."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem.line.chain import arc_length, element_frames, straight_elements
from femflex.mesh import Mesh

RING = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], float)


def mesh(points, lines, **point_groups) -> Mesh:
    lines = np.asarray(lines)
    groups = {name: np.asarray(rows) for name, rows in point_groups.items()}
    return Mesh(np.asarray(points, float), {"line": lines}, {"boom": {"line": np.arange(len(lines))}}, groups)


def along_x(n: int) -> np.ndarray:
    return np.stack([np.arange(n) ** 2.0, np.zeros(n), np.zeros(n)], axis=1)


def test_line3_cells_are_two_elements_that_meet_in_the_middle():
    assert straight_elements({"line3": np.array([[4, 7, 5]])}).tolist() == [[4, 5], [5, 7]]
    assert straight_elements({"line": np.array([[0, 1]]), "line3": np.array([[1, 2, 3]])}).tolist() == [
        [0, 1],
        [1, 3],
        [3, 2],
    ]


def test_arc_length_runs_with_the_cells_whatever_their_order():
    chain = mesh(along_x(4), [[2, 3], [0, 1], [1, 2]])
    arc = arc_length(chain, chain.cells["line"], "boom", None)
    assert arc.ends.tolist() == [[4, 9], [0, 1], [1, 4]]
    assert arc.whole.tolist() == [9, 9, 9]
    assert arc.at(np.array([0.0, 0.5, 1.0]))[0].tolist() == [4, 6.5, 9]


def test_arc_length_starts_where_cells_point_away():
    chain = mesh(along_x(4), [[3, 2], [2, 1], [1, 0]])
    assert arc_length(chain, chain.cells["line"], "boom", None).ends.tolist() == [[0, 5], [5, 8], [8, 9]]


def test_of_two_ends_alike_the_lower_number_begins():
    chain = mesh(along_x(3), [[0, 1], [2, 1]])
    assert arc_length(chain, chain.cells["line"], "boom", None).ends.tolist() == [[0, 1], [4, 1]]


def test_every_chain_of_a_group_counts_from_its_own_start():
    points = np.concatenate([along_x(3), along_x(2) + np.array([0, 1, 0])])
    booms = mesh(points, [[0, 1], [3, 4], [1, 2]])
    arc = arc_length(booms, booms.cells["line"], "boom", None)
    assert arc.ends.tolist() == [[0, 1], [0, 1], [1, 4]]
    assert arc.whole.tolist() == [4, 1, 4]


def test_a_named_start_decides():
    chain = mesh(along_x(3), [[0, 1], [1, 2]], tip=[2])
    assert arc_length(chain, chain.cells["line"], "boom", "tip").ends.tolist() == [[4, 3], [3, 0]]


def test_branches_rings_and_doubtful_starts_are_refused():
    star = mesh([[0, 0, 0], *RING[:3]], [[0, 1], [0, 2], [0, 3]])
    with pytest.raises(ValueError, match="group 'boom' branches at 1 of its nodes, so it has no arc length"):
        arc_length(star, star.cells["line"], "boom", None)
    ring = mesh(RING, [[0, 1], [1, 2], [2, 3], [3, 0]], here=[0], both=[0, 2])
    for start in (None, "both"):
        with pytest.raises(ValueError, match='give it as the option "start"'):
            arc_length(ring, ring.cells["line"], "boom", start)
    arc = arc_length(ring, ring.cells["line"], "boom", "here")
    assert arc.ends[:, 1] == pytest.approx(np.sqrt(2) * np.array([1, 2, 1, 0]))  # the shorter way round


def test_frames_are_right_handed_and_follow_the_orientation():
    rng = np.random.default_rng(0)
    start, end = rng.normal(size=(2, 20, 3))
    for orientation in (None, np.array([0.2, -3.0, 1.0])):
        length, frame = element_frames(start, end, orientation, "boom")
        assert frame @ frame.swapaxes(1, 2) == pytest.approx(np.broadcast_to(np.eye(3), frame.shape), abs=1e-14)
        assert np.linalg.det(frame) == pytest.approx(np.ones(20))
        assert length[:, None] * frame[:, 0] == pytest.approx(end - start)
        if orientation is None:
            assert np.abs(frame[:, 1, 2]).max() < 1e-15  # y is level
            assert (frame[:, 2, 2] > 0).all()  # z points up
        else:
            assert np.abs(np.einsum("ei,i->e", frame[:, 2], orientation)).max() < 1e-14
            assert (frame[:, 1] @ orientation > 0).all()
