"""Shape functions of the beam element against scikit-fem's elements and against the polynomials they must hold."""

from __future__ import annotations

import numpy as np
import pytest
from skfem import Basis, ElementLineHermite, ElementLinePp, MeshLine

from femflex.fem.beam.shapes import NODAL, BeamOrder, field_rows

XI = np.linspace(0.0, 1.0, 7)
H = np.array([0.5, 2.0])


def test_cubic_bending_is_the_hermite_element_of_scikit_fem():
    mesh = MeshLine(np.array([0.0, 0.5]))
    basis = Basis(mesh, ElementLineHermite(), quadrature=(XI[None], np.ones(7)))
    rows = [field_rows(BeamOrder(3, 5, 2), XI, H[:1], d)[0] for d in (0, 1, 2)]
    for local, dof in enumerate([1, 5, 7, 11]):  # v1, theta_z1, v2, theta_z2
        field = basis.basis[local][0]
        for row, reference in zip(rows, (np.asarray(field), field.grad[0], field.hess[0, 0]), strict=True):
            assert row[:, 1, dof] == pytest.approx(reference[0], abs=1e-12)


def test_axial_and_torsional_bubbles_are_those_of_scikit_fem_but_for_scale():
    order = BeamOrder(6, 5, 5)
    rows = field_rows(order, XI, np.ones(1), 0)[0]
    element = ElementLinePp(5)
    for k in range(4):
        reference = element.lbasis(XI[None], 2 + k)[0]
        for field, start in ((0, NODAL), (3, NODAL + 4)):
            mine = rows[:, field, start + k]
            assert mine / np.abs(mine).max() == pytest.approx(reference / np.abs(reference).max(), abs=1e-12)


@pytest.mark.parametrize("bending", range(3, 9))
def test_every_polynomial_of_the_order_is_held_and_its_derivatives_agree(bending):
    """A random polynomial, with slopes as rotations, is found again by least squares on the element's rows."""
    order = BeamOrder(bending, 2 * bending - 1, bending - 1)
    rng = np.random.default_rng(bending)
    xi = np.linspace(0, 1, 25)
    for field, degree in ((0, order.axial), (1, bending), (2, bending), (3, order.torsion)):
        p = np.polynomial.Polynomial(rng.normal(size=degree + 1))
        values, first, second = (field_rows(order, xi, H, d)[:, :, field] for d in (0, 1, 2))
        for e, h in enumerate(H):
            dofs, *_ = np.linalg.lstsq(values[e], p(xi), rcond=None)
            assert values[e] @ dofs == pytest.approx(p(xi), abs=1e-10)
            assert first[e] @ dofs == pytest.approx(p.deriv()(xi) / h, abs=1e-8)
            assert second[e] @ dofs == pytest.approx(p.deriv(2)(xi) / h**2, abs=1e-6)
        if field in (1, 2):
            slope = {1: 1.0, 2: -1.0}[field]  # theta_z = v', theta_y = -w'
            ends = [5, 11] if field == 1 else [4, 10]
            assert dofs[ends] == pytest.approx(slope * p.deriv()(np.array([0.0, 1.0])) / H[-1], abs=1e-8)


@pytest.mark.parametrize("bending", [4, 8])
def test_bubbles_vanish_with_their_slopes_at_both_nodes(bending):
    order = BeamOrder(bending, 2 * bending - 1, bending - 1)
    ends = np.array([0.0, 1.0])
    assert np.abs(field_rows(order, ends, H, 0)[..., NODAL:]).max() < 1e-13
    assert np.abs(field_rows(order, ends, H, 1)[:, :, 1:3, NODAL:]).max() < 1e-11


@pytest.mark.parametrize("bending", range(3, 9))
def test_an_axial_field_of_twice_the_order_takes_back_the_stretch_of_any_bend(bending):
    """u' = -(v'^2 + w'^2) / 2 point by point, for random bending dofs; one order less cannot."""
    rng = np.random.default_rng(bending)
    xi = np.linspace(0, 1, 41)
    left = []
    for axial in (2 * bending - 1, 2 * bending - 2):
        rows = field_rows(BeamOrder(bending, axial, 2), xi, H[:1], 1)[0]
        bend = rng.normal(size=rows.shape[-1])
        stretch = ((rows[:, 1:3] @ bend) ** 2).sum(axis=1) / 2
        u = np.linalg.lstsq(rows[:, 0], -stretch, rcond=None)[0]
        left.append(np.abs(rows[:, 0] @ u + stretch).max() / stretch.max())
    assert left[0] < 1e-10
    assert left[1] > 1e-5
