"""Building a Structure: dofs, clamps, operators, elimination of drilling rotations, and the sentences on bad input."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Circle
from femflex.mesh import Mesh

MATERIAL = Material(70e9, 0.3, 2700.0)


def cross_mesh() -> Mesh:
    """Two booms that share the node (1, 0, 0), and a point that belongs to neither."""
    points = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 3, 0], [5, 5, 5]]
    lines = [[0, 1], [1, 2], [1, 3]]
    groups = {"long": {"line": [0, 1]}, "side": {"line": [2]}, "all": {"line": [0, 1, 2]}}
    return Mesh(np.array(points, float), {"line": np.array(lines)}, groups, {"root": [0], "away": [4], "joint": [1]})


def test_members_share_the_dofs_of_shared_nodes_and_loose_nodes_have_none():
    mesh = cross_mesh()
    one = build_structure(mesh, [Member("all", "beam", Circle(0.02), MATERIAL)])
    two = build_structure(mesh, [Member(g, "beam", Circle(0.02), MATERIAL) for g in ("long", "side")])
    assert one.n_dof == two.n_dof == 4 * 6 + 3 * 5
    assert np.linalg.eigvalsh(one.M.toarray()) == pytest.approx(np.linalg.eigvalsh(two.M.toarray()), rel=1e-9)
    for operator in (one.translation, one.rotation):
        rows = operator.toarray()
        assert np.abs(rows[12:]).max() == 0.0
        assert rows[:12] @ rows[:12].T == pytest.approx(np.eye(12))
    assert abs(one.translation @ one.rotation.T).max() == 0.0


def test_a_clamp_fixes_nodes_and_the_bubbles_between_them():
    structure = build_structure(cross_mesh(), [Member("all", "beam", Circle(0.02), MATERIAL)])
    assert len(structure.clamped_dofs("root")) == 6
    assert len(structure.clamped_dofs("side")) == 2 * 6 + 5
    assert len(structure.clamped_dofs("all")) == structure.n_dof
    ball = structure.clamped_dofs("side", ["x", "y", "z"])
    assert len(ball) == 2 * 3 + 4  # its bubble of torsion is a turn
    assert len(structure.clamped_dofs("root", ["rx"])) == 1
    moved = np.abs(structure.translation.toarray()[:, structure.clamped_dofs("root", ["y"])]).sum(axis=1)
    assert np.flatnonzero(moved).tolist() == [1]
