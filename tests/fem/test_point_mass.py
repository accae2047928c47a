"""Concentrated masses: equivalent points carry exactly the mass, centre and inertia given."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material, Member, PointMass, build_structure
from femflex.fem.family import FAMILIES, Contribution
from femflex.fem.point_mass import equivalent_points
from femflex.fem.sections import Circle
from femflex.mesh import Mesh, line

BEAM = Member("line", "beam", Circle(0.05), Material(70e9, 0.3, 2700.0))


def random_inertia(seed: int) -> np.ndarray:
    r = np.random.default_rng(seed).normal(size=(5, 3))
    return (r**2).sum() * np.eye(3) - r.T @ r


def boom() -> Mesh:
    return line([[0, 0, 0], [1.0, 2.0, 3.0]], 3)


@pytest.mark.parametrize(
    "inertia", [random_inertia(1), random_inertia(2), np.diag([1.0, 1.0, 0.0]), np.diag([1.0, 2.0, 3.0])]
)
def test_six_points_have_the_mass_the_centre_and_the_inertia(inertia):
    masses, places = equivalent_points(2.5, inertia)
    second = np.einsum("p,pa,pb->ab", masses, places, places)
    assert masses.sum() == pytest.approx(2.5)
    assert masses @ places == pytest.approx(np.zeros(3), abs=1e-14)
    assert np.trace(second) * np.eye(3) - second == pytest.approx(inertia, rel=1e-13, abs=1e-13)


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


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"mass": -1.0}, "point mass at group 'end' is -1.0 kg; a mass is positive"),
        ({"mass": 0.0, "inertia": np.eye(3)}, "is 0.0 kg"),
        ({"mass": np.nan}, "is nan kg"),
        ({"mass": 1.0, "offset": (1.0, 2.0)}, "give three lengths"),
        ({"mass": 1.0, "offset": (1.0, 2.0, np.nan)}, "give three lengths"),
        ({"mass": 1.0, "inertia": np.ones(3)}, "give a 3 x 3 matrix"),
        ({"mass": 1.0, "inertia": np.triu(np.ones((3, 3)))}, "is not symmetric"),
        ({"mass": 1.0, "inertia": np.diag([1.0, 1.0, -1.0])}, r"is not positive: its principal moments are \[-1.0"),
        ({"mass": 1.0, "inertia": np.diag([1.0, 1.0, 2.5])}, "breaks the triangle inequality"),
        ({"mass": 1.0, "inertia": np.full((3, 3), np.nan)}, "finite numbers"),
    ],
)
def test_impossible_masses_are_refused(values, sentence):
    with pytest.raises(ValueError, match=sentence):
        PointMass("end", **values)


def test_a_mass_off_the_structure_is_refused():
    mesh = Mesh(
        np.concatenate([boom().points, [[9.0, 9, 9]]]), boom().cells, boom().cell_groups, {"away": [3, 4], "end": [3]}
    )
    with pytest.raises(
        ValueError, match="'away': 1 of its 2 nodes belong to no member; put the mass on a group that lies"
    ):
        build_structure(mesh, [BEAM], [PointMass("away", 1.0)])
    with pytest.raises(ValueError, match="group 'nowhere' is not in the mesh"):
        build_structure(mesh, [BEAM], [PointMass("nowhere", 1.0)])


def test_nodes_without_rotation_take_a_mass_but_no_inertia(monkeypatch):
    def truss(mesh, member, numbering):
        numbering.translation(np.arange(len(mesh.points)))
        return Contribution((), ())

    monkeypatch.setitem(FAMILIES, "translations only", truss)
    member = Member("line", "translations only")
    structure = build_structure(boom(), [member], [PointMass("end", 2.0)])
    assert structure.M.sum() == pytest.approx(6.0)
    for heavy in (PointMass("end", 2.0, np.eye(3)), PointMass("end", 2.0, offset=(1.0, 0, 0))):
        with pytest.raises(ValueError, match="has an inertia or an offset, but its nodes have no rotation"):
            build_structure(boom(), [member], [heavy])
