"""Concentrated masses: equivalent points carry exactly the mass, centre and inertia given."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material, Member, PointMass, build_structure
from femflex.fem.sections import Circle
from femflex.mesh import Mesh, line

BEAM = Member("line", "beam", Circle(0.05), Material(70e9, 0.3, 2700.0))


def random_inertia(seed: int) -> np.ndarray:
    r = np.random.default_rng(seed).normal(size=(5, 3))
    return (r**2).sum() * np.eye(3) - r.T @ r


def boom() -> Mesh:
    return line([[0, 0, 0], [1.0, 2.0, 3.0]], 3)


def test_a_mass_with_offset_adds_its_rigid_mass_matrix_at_the_node():
    """m, m r x, J + m (r.r 1 - r r^T) on the node's six dofs, and nothing elsewhere."""
    mesh, r, J, m = boom(), np.array([0.1, -0.4, 0.2]), random_inertia(3), 4.0
    bare, loaded = build_structure(mesh, [BEAM]), build_structure(mesh, [BEAM], [PointMass("end", m, J, r)])
    added = (loaded.M - bare.M).toarray()
    node = mesh.group_points("end")[0]
    rows = [op.toarray()[3 * node : 3 * node + 3] for op in (loaded.translation, loaded.rotation)]
    D = np.concatenate(rows)
    cross = np.cross(np.eye(3), r)  # rows e_i x r
    expected = np.block([[m * np.eye(3), m * cross.T], [m * cross, J + m * (r @ r * np.eye(3) - np.outer(r, r))]])
    assert D @ added @ D.T == pytest.approx(expected, rel=1e-11, abs=1e-11)
    assert np.abs(added - D.T @ expected @ D).max() < 1e-11
    rho, dm = loaded.inertia[-1].rho[0], loaded.inertia[-1].dm[0]
    assert dm @ rho / m == pytest.approx(mesh.points[node] + r)


def test_every_point_of_the_group_carries_the_mass():
    mesh = boom().with_groups(points={"both": [0, 3]})
    added = build_structure(mesh, [BEAM], [PointMass("both", 2.0)]).inertia[-1]
    assert added.dm.tolist() == [[2.0], [2.0]]
    assert added.rho[:, 0] == pytest.approx(mesh.points[[0, 3]])
