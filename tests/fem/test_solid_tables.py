"""Warnings, refusals and initial stress of solids, and what raising their cells leaves alone."""

from __future__ import annotations

import numpy as np
import pytest
from support.element_meshes import brick
from support.plate_models import random_rotation

from femflex.fem import Anisotropic, Material, Member, Orthotropic, build_structure
from femflex.fem.solid.elastic import elasticity
from femflex.mesh import Mesh
from femflex.mesh.cells import CELL_TYPES

FIBRE = Orthotropic(140e9, 10e9, 9e9, 5e9, 4.5e9, 3.5e9, 0.3, 0.28, 0.4, 1600.0)


def general() -> Anisotropic:
    rows = np.random.default_rng(3).normal(size=(9, 6)) * 1e5
    return Anisotropic(rows.T @ rows, 1600.0)


@pytest.mark.parametrize("material", [general(), FIBRE, Material(70e9, 0.3, 1.0, 20e9)])
def test_a_turned_material_answers_as_its_tensor_does(material):
    """c_ijkl of its own axes by the definition of engineering strains, turned index by index."""
    A = random_rotation(14)
    pairs = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
    own = elasticity(material)
    if isinstance(material, Material):
        assert own == pytest.approx(elasticity(material, A))  # its own axes are those of the mesh
        mu, lam = 70e9 / 2.6, 70e9 * 0.3 / 1.3 / 0.4
        assert np.diag(own) == pytest.approx([lam + 2 * mu] * 3 + [20e9] * 3) and own[0, 1] == pytest.approx(lam)
        return
    c = np.zeros((3, 3, 3, 3))
    for I, (i, j) in enumerate(pairs):
        for J, (k, l) in enumerate(pairs):
            for a, b in {(i, j), (j, i)}:
                for d, e in {(k, l), (l, k)}:
                    c[a, b, d, e] = own[I, J]
    turned = np.einsum("ia,jb,kc,ld,ijkl->abcd", A, A, A, A, c)
    expected = np.array([[turned[i, j, k, l] for k, l in pairs] for i, j in pairs])
    np.testing.assert_allclose(elasticity(material, A), expected, atol=1e-10 * expected.max())


@pytest.mark.parametrize("cell", ["tetra10", "hexahedron20", "wedge15", "pyramid13"])
def test_stress_and_heat_of_a_skew_material_pull_as_their_tensor(cell):
    """Virtual work of f0 on a gradient H is sigma : H times the volume, sigma less what free strain would need."""
    A, sigma = random_rotation(15), np.array([3e5, -1e5, 2e5, 4e4, -6e4, 8e4])
    options = {"axes": [*A[0], *(A[1] + 0.3 * A[0])], "prestress": sigma, "thermal_strain": 2e-6}
    s = build_structure(brick(cell, (1, 1, 1)), [Member("volume", "solid", material=FIBRE, options=options)])
    own = np.diag([1.0, 1, 1]) * 2e-6  # the same in all axes
    heat = elasticity(FIBRE) @ np.array([*np.diag(own), 0, 0, 0])
    tensor = A.T @ np.array([[heat[0], heat[5], heat[4]], [heat[5], heat[1], heat[3]], [heat[4], heat[3], heat[2]]]) @ A
    xx, yy, zz, yz, xz, xy = sigma
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - tensor
    volume = sum(block.weight.sum() for block in s.strain)
    for k in range(9):
        H = np.zeros(9)
        H[k] = 1.0
        H = H.reshape(3, 3)
        x = s.translation.T @ (s.mesh.points @ H.T).ravel()
        assert s.f0 @ x == pytest.approx(volume * np.sum(tensor * H), abs=1e-8 * np.abs(tensor).max())


def unit_rule(shape: str) -> tuple[np.ndarray, np.ndarray]:
    """Seven Gauss points each way on the unit cell; of triangles and tetrahedra by collapsed sides."""
    g, w = np.polynomial.legendre.leggauss(7)
    g, w = (g + 1) / 2, w / 2
    r, s, t = (a.ravel() for a in np.meshgrid(g, g, g, indexing="ij"))
    weight = np.einsum("i,j,k->ijk", w, w, w).ravel()
    if shape == "hexahedron":
        return np.stack([r, s, t], axis=1), weight
    if shape == "wedge":
        return np.stack([r, s * (1 - r), t], axis=1), weight * (1 - r)
    return np.stack([r, s * (1 - r), t * (1 - r) * (1 - s)], axis=1), weight * (1 - r) ** 2 * (1 - s)


@pytest.mark.parametrize(
    "cell", ["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27", "wedge", "wedge15", "wedge18"]
)
@pytest.mark.filterwarnings("ignore:solid on group .* cells of first order")
def test_mass_and_stiffness_of_skew_cells_are_their_integrals(cell):
    """Of random motions of an affine cell, against an integration of far higher degree."""
    kind = CELL_TYPES[cell]
    A = np.array([[1.0, 0.2, 0.1], [-0.3, 0.8, 0.2], [0.1, -0.2, 0.6]])
    mesh = Mesh(kind.nodes @ A, {cell: [np.arange(len(kind.nodes))]}, {"volume": {cell: [0]}})
    s = build_structure(mesh, [Member("volume", "solid", material=FIBRE, options={"order": 1})])
    u = np.random.default_rng(1).normal(size=(len(kind.nodes), 3))
    points, weight = unit_rule(kind.shape)
    weight = weight * np.linalg.det(A)
    value = kind.interpolation(points) @ u
    H = np.einsum("qka,ki->qia", kind.gradients(points), u) @ np.linalg.inv(A).T
    e = (H + H.swapaxes(1, 2)) / 2
    eps = np.stack([e[:, 0, 0], e[:, 1, 1], e[:, 2, 2], 2 * e[:, 1, 2], 2 * e[:, 0, 2], 2 * e[:, 0, 1]], axis=1)
    x = s.translation.T @ u.ravel()
    assert x @ s.M @ x == pytest.approx(1600 * weight @ np.sum(value**2, axis=1), rel=1e-10)
    assert x @ s.K @ x == pytest.approx(np.einsum("q,qi,ij,qj->", weight, eps, FIBRE.elasticity(), eps), rel=1e-10)
