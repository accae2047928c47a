"""Packed symmetric tensors and the energy they give, against full tensors and differences."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body import StrainTensors
from femflex.body.symmetric import multiplicity, packed, packed_indices, packed_size, truncated, unpacked

N = 5


@pytest.fixture(scope="module")
def full():
    """Random tensors without any symmetry but that of their parts: V1, f0, V2, V3."""
    rng = np.random.default_rng(7)
    return rng.normal(size=(N, N)), rng.normal(size=N), rng.normal(size=(N,) * 3), rng.normal(size=(N,) * 4)


@pytest.fixture(scope="module")
def tensors(full):
    V1, f0, V2, V3 = full
    return StrainTensors((V1 + V1.T) / 2, f0, packed(V2), packed(V3))


@pytest.mark.parametrize("degree", [2, 3, 4])
def test_packed_values_stand_for_every_entry_of_the_full_tensor(degree):
    values = np.random.default_rng(degree).normal(size=packed_size(N, degree))
    whole = unpacked(values, N, degree)
    assert multiplicity(N, degree).sum() == N**degree
    assert np.array_equal(whole, np.swapaxes(whole, 0, degree - 1))
    np.testing.assert_allclose(packed(whole), values, rtol=1e-14)
    assert [tuple(row) for row in packed_indices(3, 2)] == [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
    np.testing.assert_allclose(truncated(values, N, 3, degree), packed(whole[(slice(3),) * degree]), rtol=1e-14)


def test_energy_force_and_tangent_are_those_of_the_full_tensors(full, tensors):
    V1, f0, V2, V3 = full
    d = np.random.default_rng(1).normal(size=N)
    energy = f0 @ d + 0.5 * (
        d @ V1 @ d + 2 * np.einsum("ijk,i,j,k", V2, d, d, d) + np.einsum("ijkl,i,j,k,l", V3, d, d, d, d)
    )
    assert tensors.energy(d) == pytest.approx(energy, rel=1e-13)
    V2s, V3s = unpacked(tensors.V2, N, 3), unpacked(tensors.V3, N, 4)
    force = f0 + (V1 + V1.T) @ d / 2 + 3 * np.einsum("ijk,j,k->i", V2s, d, d)
    force += 2 * np.einsum("ijkl,j,k,l->i", V3s, d, d, d)
    np.testing.assert_allclose(tensors.force(d), force, rtol=1e-12, atol=1e-12)
    tangent = (V1 + V1.T) / 2 + 6 * V2s @ d + 6 * np.einsum("ijkl,k,l->ij", V3s, d, d)
    np.testing.assert_allclose(tensors.tangent(d), tangent, rtol=1e-12, atol=1e-12)


def test_force_and_tangent_are_derivatives_of_the_energy(tensors):
    d, h = np.random.default_rng(2).normal(size=N), 1e-5
    steps = h * np.eye(N)
    force = [(tensors.energy(d + s) - tensors.energy(d - s)) / (2 * h) for s in steps]
    np.testing.assert_allclose(tensors.force(d), force, rtol=1e-8, atol=1e-8)
    tangent = [(tensors.force(d + s) - tensors.force(d - s)) / (2 * h) for s in steps]
    np.testing.assert_allclose(tensors.tangent(d), tangent, rtol=1e-8, atol=1e-8)


def test_tensors_of_fewer_coordinates_give_the_same_energy(tensors):
    d = np.random.default_rng(3).normal(size=N)
    d[3:] = 0.0
    assert tensors.truncated(3).energy(d[:3]) == pytest.approx(tensors.energy(d), rel=1e-13)


def test_a_linear_body_keeps_no_tensors():
    linear = StrainTensors.linear(np.diag([2.0, 3.0]))
    assert linear.is_linear and linear.V2.size == linear.V3.size == 0
    assert linear.energy(np.array([1.0, 2.0])) == 7.0
    assert linear.truncated(1).V2.size == 0
    np.testing.assert_array_equal(linear.force(np.array([1.0, 2.0])), [2.0, 6.0])


def test_tensors_of_a_wrong_size_are_refused():
    with pytest.raises(ValueError, match=r"V3 of 2 coordinates has 5 packed values, or none where strain is linear"):
        StrainTensors(np.eye(2), np.zeros(2), np.zeros(4), np.zeros(16))
