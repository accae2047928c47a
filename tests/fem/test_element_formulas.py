"""Formulas inside elements, each against its equation written out: shear factors, energies of fourth order, modes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from femflex.fem import Member, build_structure
from femflex.fem.beam.strain import FOURTH, fourth_order, product_maps
from femflex.fem.eigen import multifrontal
from femflex.fem.eigen.modes import lowest_modes, warn_if_rounded
from femflex.fem.eigen.multifrontal import dissection, worthwhile
from femflex.fem.plate.triangle_fields import side_shear_factor
from femflex.fem.sections.laminates import Lamina, Ply, layup
from femflex.mesh import Mesh
from femflex.warning import PhysicsWarning

FIBRE = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0, 5e9, 3.5e9)


def test_the_shear_factor_of_a_side_is_that_of_the_section_turned_along_it():
    """12 D_k / (S_k L^2), D_k = D_11 and 1 / S_k = (S^-1)_11 in axes along the side, of plies askew."""
    askew = layup([Ply(FIBRE, 0.002, angle) for angle in (0.5, -0.9, 0.5)])
    assert abs(askew.D[0, 2]) > 0.1 * askew.D[0, 0] and abs(askew.S[0, 1]) > 0.005 * askew.S[0, 0]
    angles, length = np.array([[0.3, 1.2, 2.9], [-0.4, -1.9, 0.8]]), np.array([[0.2, 0.3, 0.7], [1.1, 0.05, 0.4]])
    found = side_shear_factor(np.stack([np.cos(angles), np.sin(angles)], axis=2), length, askew.D[None], askew.S[None])
    for angle, L, f in zip(angles.ravel(), length.ravel(), found.ravel(), strict=True):
        along = askew.turned(-angle)
        assert f == pytest.approx(12 * along.D[0, 0] * np.linalg.inv(along.S)[0, 0] / L**2, rel=1e-9)


@pytest.mark.parametrize("far", [False, True])
def test_strains_of_fourth_order_store_what_the_equations_of_beams_say(far):
    """V_4 and V_6 over gradients u', v', w', r theta', v'', w'', theta, r v', r w'; with far bends, V_4 of the round
    section within."""
    rng = np.random.default_rng(3)
    EIy, EIz, r2 = np.array([3.0, 7.0]), np.array([11.0, 2.0]), np.array([0.04, 0.09])
    stiffness = fourth_order(EIy, EIz, r2, far)
    assert stiffness.shape == (2, 7)
    for _ in range(3):
        u1, v1, w1, turn, v2, w2, theta = rng.normal(size=7)
        for k in range(2):
            r = np.sqrt(r2[k])
            g = np.array([u1, v1, w1, r * turn, v2, w2, theta, r * v1, r * w1])
            strain = np.einsum("sij,i,j->s", product_maps(FOURTH), g, g) / 2
            y, z = (min(EIy[k], EIz[k]),) * 2 if far else (EIy[k], EIz[k])
            p, s = v1 * w2, w1 * v2
            V4 = -(y * p**2 - (y + z) * p * s + z * s**2) / 2 - theta**2 / 2 * (z * v2**2 + y * w2**2)
            V6 = EIz[k] * (u1 * v2) ** 2 + EIy[k] * (u1 * w2) ** 2
            assert stiffness[k] @ strain**2 / 2 == pytest.approx(V4 + V6, rel=1e-12)


def test_a_skew_shell_element_has_the_incompatible_modes_of_simo_and_rifai():
    """Sides not parallel, orthotropic askew: K - L^T D^-1 L of its in-plane dofs, by 2 x 2 points."""
    sheet = layup([Ply(FIBRE, 0.003, 0.6)])
    x = np.array([[0.0, 0.0], [1.3, 0.1], [0.9, 0.8], [0.1, 0.6]])
    mesh = Mesh(np.column_stack([x, np.zeros(4)]), {"quad": [[0, 1, 2, 3]]}, {"surface": {"quad": [0]}})
    s = build_structure(mesh, [Member("surface", "shell", sheet)])
    rows = s.translation.toarray().reshape(4, 3, -1)[:, :2].reshape(8, -1)
    found = rows @ s.K.toarray() @ rows.T

    def at(r, t):
        dh = np.array([[t - 1, r - 1], [1 - t, -r], [t, r], [-t, 1 - r]])
        return dh, x.T @ dh  # dx_i / dr_a

    def strains(J):
        """Engineering strains from (rr, ss, 2 rs)."""
        (a, b), (c, d) = np.linalg.inv(J)  # dr / dx, dr / dy; ds / dx, ds / dy
        return np.array([[a * a, c * c, a * c], [b * b, d * d, b * d], [2 * a * b, 2 * c * d, a * d + b * c]])

    J0 = at(0.5, 0.5)[1]
    T0, area0 = strains(J0), np.linalg.det(J0)
    K, L, D = np.zeros((8, 8)), np.zeros((4, 8)), np.zeros((4, 4))
    points = 0.5 + np.array([-1, 1]) / np.sqrt(12)
    for r in points:
        for t in points:
            dh, J = at(r, t)
            grad, area = dh @ np.linalg.inv(J), np.linalg.det(J)
            B = np.zeros((3, 8))
            B[0, ::2], B[1, 1::2], B[2, ::2], B[2, 1::2] = grad[:, 0], grad[:, 1], grad[:, 1], grad[:, 0]
            modes = np.array([[r - 0.5, 0, 0, 0], [0, t - 0.5, 0, 0], [0, 0, r - 0.5, t - 0.5]])
            M = T0 @ modes * area0 / area
            K += area / 4 * B.T @ sheet.A @ B
            L += area / 4 * M.T @ sheet.A @ B
            D += area / 4 * M.T @ sheet.A @ M
    np.testing.assert_allclose(found, K - L.T @ np.linalg.solve(D, L), atol=1e-9 * np.abs(K).max())


def blocks(count: int, size: int) -> sparse.csr_array:
    """Full blocks in a row, each joined to its neighbours: level sets of `size` dofs from the first."""
    path = sparse.diags_array([np.ones(count - 1), np.ones(count), np.ones(count - 1)], offsets=[-1, 0, 1])
    return sparse.kron(path, np.ones((size, size))).tocsr()


def test_fronts_pay_where_the_cube_of_the_level_sets_is_large_against_the_dofs(monkeypatch):
    """Level sets of 6 dofs in 300 of which all, or half, are reached from the first: 6^3 / n = 0.72 and 0.36."""
    one = blocks(50, 6)
    for matrix, n, edge in ((one, 300, 0.72), (sparse.block_diag([one, one]).tocsr(), 600, 0.36)):
        monkeypatch.setattr(multifrontal, "FEW_DOFS", n)
        for part, pays in ((0.98, True), (1.02, False)):
            monkeypatch.setattr(multifrontal, "WIDE", part * edge)
            assert worthwhile(matrix) == pays
        monkeypatch.setattr(multifrontal, "WIDE", 0.1)
        monkeypatch.setattr(multifrontal, "FEW_DOFS", n + 1)
        assert not worthwhile(matrix)


def test_the_first_cut_is_through_the_neck_of_a_graph():
    """Rows of eight nodes, each joined to all of the next row; the 15th of 40 is one node, eliminated last, alone."""
    sizes = np.where(np.arange(40) == 14, 1, 8)
    row = np.repeat(np.arange(40), sizes)
    edges = np.argwhere(row[:, None] + 1 == row)
    A = sparse.coo_array((np.ones(len(edges)), edges.T), shape=(len(row),) * 2)
    order, parts = dissection((A + A.T + 10 * sparse.eye_array(len(row))).tocsr())
    last = parts[-1]
    assert order[last.begin : last.end].tolist() == [8 * 14] and len(last.below) >= 2


def test_frequencies_that_rounding_reaches_are_warned_of_with_the_worst_mode():
    """Two masses on 1e15 N/m between them: of the three shapes the second leaves 5e-16 of its terms."""
    k, soft = 1e15, 2.0
    K = sparse.csr_array(np.array([[k + soft, -k, 0], [-k, k, 0], [0, 0, 5.0]]))
    phi = np.array([[0.0, 1.0, 1.0], [0.0, 1.0, -1.0], [1.0, 0, 0]])
    with pytest.warns(PhysicsWarning) as given:
        warn_if_rounded(K, np.array([2.0, 3.0, 4.0]) * 2 * np.pi, phi)
    (text,) = (str(one.message) for one in given)
    assert text == (
        f"mode 2 at 3 Hz: its strain energy is {soft / (4 * k + soft):.1e} of the terms it is summed from, below "
        "1e-14, so that few digits of the frequency are right; use fewer elements of higher order, or stiffnesses "
        "less far apart"
    )
    warn_if_rounded(K, np.array([2.0, 4.0]), phi[:, [0, 2]])


@pytest.mark.parametrize("diagonal", [[3.0, -2e7, 5e4], [1.0, 1.0, 1.0, -4e-7, 1e-7]])
def test_a_stiffness_that_is_not_positive_definite_is_refused_with_its_diagonal(diagonal):
    """Beyond every shift that is tried; and within the largest of them, but beyond the lowest elastic eigenvalue."""
    K, M = sparse.csr_array(np.diag(diagonal)), sparse.eye_array(len(diagonal), format="csr")
    with pytest.raises(ValueError) as refusal:
        lowest_modes(K, M, 1)
    assert str(refusal.value) == (
        "the stiffness matrix is not positive definite within rounding: its diagonal goes from "
        f"{min(diagonal):.3g} to {max(diagonal):.3g}. Some stiffnesses are negative, or lie too many orders apart; "
        "check stiff springs, rods and short bars."
    )
