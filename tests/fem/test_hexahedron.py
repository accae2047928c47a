"""Solid elements against scikit-fem forms, closed forms, and the mass and skin of the body they fill."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from scipy import sparse
from scipy.sparse.linalg import eigsh
from skfem.helpers import ddot, dot, sym_grad, trace
from support.plate_models import frequencies

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections.laminates import isotropic
from femflex.mesh import Mesh, box, rectangle

METAL = Material(70e9, 0.3, 2700.0)


def solid_structure(mesh: Mesh, material: Material = METAL):
    return build_structure(mesh, [Member("volume", "solid", material=material, options={"order": 1})])


def scikit_fem_panel(L, W, T, nx, ny, nz, E, nu, rho):
    """M, K and nodes of the same box by scikit-fem forms on vector ElementHex2, 27 quadrature points."""
    lines = (np.linspace(0, L, nx + 1), np.linspace(0, W, ny + 1), np.linspace(0, T, nz + 1))
    basis = skfem.Basis(skfem.MeshHex.init_tensor(*lines), skfem.ElementVector(skfem.ElementHex2()), intorder=4)
    lam, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)

    @skfem.BilinearForm
    def stiffness(u, v, _):
        return lam * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * mu * ddot(sym_grad(u), sym_grad(v))

    @skfem.BilinearForm
    def mass(u, v, _):
        return rho * dot(u, v)

    return mass.assemble(basis), stiffness.assemble(basis), basis.doflocs


def in_one_order(points, matrix):
    """The matrix with its dofs, three in a row per node, in the order of the nodes' places."""
    order = np.lexsort(np.round(points / 1e-9).astype(np.int64).T)
    dofs = (3 * order[:, None] + np.arange(3)).ravel()
    return sparse.csr_array(matrix)[dofs][:, dofs]


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("thickness", "agreement"), [(0.03, None), (0.6, 1e-9)])
def test_the_panel_has_the_matrices_and_frequencies_of_scikit_fem_forms(thickness, agreement):
    """The thin panel's lowest frequency is a small difference of large terms: rounding of K, of relative size eps,
    moves it by eps |phi|.|K||phi| / 2 omega^2, 6e-6 (1e-7 to 1.0e-6 seen, by processor); the thick one agrees to 1e-9.
    """
    panel = (6.0, 1.5, thickness, 16, 4, 1)
    M, K, places = scikit_fem_panel(*panel, 2e9, 0.3, 100.0)
    structure = solid_structure(box(*panel, "hexahedron27"), Material(2e9, 0.3, 100.0))
    points, rows = structure.mesh.points, structure.translation
    own = [in_one_order(points, rows @ A @ rows.T) for A in (structure.M, structure.K)]
    other = [in_one_order(places.T[::3], A) for A in (M, K)]
    for mine, theirs in zip(own, other, strict=True):
        assert mine.shape == theirs.shape
        assert abs(mine - theirs).max() < 1e-13 * abs(theirs).max()
    free = clamped_free(points)
    found = []
    for M_, K_ in (own, other):
        K_f, M_f = K_[free][:, free].tocsc(), M_[free][:, free].tocsc()
        value, phi = eigsh(K_f, 10, M_f, sigma=0, v0=np.ones(len(free)))
        found.append(np.sqrt(value))
    rounding = np.einsum("in,in->n", np.abs(phi), abs(K_f) @ np.abs(phi)) * np.finfo(float).eps / value / 2
    error = np.abs(found[0] / found[1] - 1)
    assert (error < (rounding if agreement is None else agreement)).all()
    assert error[0] < 4e-6 and error[1:].max() < 1e-7


def clamped_free(points):
    """Dofs, nodes in the order of `in_one_order`, off the plane x = 0."""
    order = np.lexsort(np.round(points / 1e-9).astype(np.int64).T)
    return np.flatnonzero(np.repeat(points[order, 0] > 1e-9, 3))


def test_a_thin_panel_of_solids_is_the_plate():
    """Clamped panel, one layer of 27-node hexahedra against DKMT triangles: model difference of order h."""
    mesh = box(1.0, 0.5, 0.02, 12, 6, 1, "hexahedron27")
    solid = solid_structure(mesh)
    plate = build_structure(rectangle(1.0, 0.5, 24, 12), [Member("surface", "plate", isotropic(0.02, METAL))])
    found = [frequencies(s, s.clamped_dofs("left"), 3) for s in (solid, plate)]
    assert found[0] == pytest.approx(found[1], rel=2e-2)
