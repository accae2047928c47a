"""Strain tensors of every family against the full nonlinear finite elements, small and large."""

from __future__ import annotations

import numpy as np
import pytest
from support.nonlinear_models import STRUCTURES

from femflex.reduction.strain import tensors as module
from femflex.reduction.strain.tensors import strain_tensors

N = 6


@pytest.fixture(scope="module", params=STRUCTURES)
def reduced(request):
    """A structure, random shapes of a metre each, and their tensors."""
    structure = STRUCTURES[request.param]()
    phi = np.random.default_rng(1).normal(size=(structure.n_dof, N))
    phi /= np.abs(structure.translation @ phi).max(axis=0)
    return structure, phi, strain_tensors(structure, phi)


@pytest.mark.parametrize("size", [1e-4, 0.1, 30.0])
def test_the_elastic_force_is_that_of_the_full_finite_elements_projected(reduced, size):
    structure, phi, tensors = reduced
    elastic = structure.internal_force
    d = size * np.random.default_rng(2).normal(size=N)
    force, tangent = phi.T @ elastic.force(phi @ d), phi.T @ (elastic.tangent(phi @ d) @ phi)
    np.testing.assert_allclose(tensors.force(d), force, atol=1e-13 * np.abs(force).max(), rtol=1e-10)
    np.testing.assert_allclose(tensors.tangent(d), tangent, atol=1e-12 * np.abs(tangent).max(), rtol=1e-10)
    assert tensors.energy(d) == pytest.approx(elastic.energy(phi @ d), rel=1e-12)


def test_the_elastic_force_is_the_difference_of_the_full_energy(reduced):
    structure, phi, tensors = reduced
    elastic, h = structure.internal_force, 1e-3
    d = np.random.default_rng(3).normal(size=N)
    at, weight = np.array([-2, -1, 1, 2]) * h, np.array([1, -8, 8, -1]) / (12 * h)
    slope = [weight @ [elastic.energy(phi @ (d + t * way)) for t in at] for way in np.eye(N)]
    force = tensors.force(d)
    np.testing.assert_allclose(force, slope, atol=1e-8 * np.abs(force).max())


def test_chunks_of_any_size_give_the_same_tensors(reduced, monkeypatch):
    structure, phi, tensors = reduced
    monkeypatch.setattr(module, "ROOM", 1)  # one element at a time
    again = strain_tensors(structure, phi)
    for name in ("V1", "f0", "V2", "V3"):
        found, expected = getattr(again, name), getattr(tensors, name)
        np.testing.assert_allclose(found, expected, atol=1e-13 * np.abs(expected).max(initial=0.0))


def test_too_many_shapes_are_refused_with_the_memory_they_take(reduced, monkeypatch):
    structure, phi, _ = reduced
    monkeypatch.setattr(module, "MOST_BYTES", 1e3)
    with pytest.raises(ValueError, match=r"strain tensors of 6 shapes would take 5.83e-06 GB on the way; a body may"):
        strain_tensors(structure, phi)
