"""Stiffness, force and work of stress by their own sums, against the full nonlinear tangent, force and energy."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import box, rectangle
from femflex.mesh.generators import line

METAL = Material(7e10, 0.3, 2700.0)


def stressed(family):
    """A small structure with initial stress."""
    if family == "solid":
        mesh = box(2.0, 1.0, 0.1, 4, 2, 1, "hexahedron27")
        return build_structure(mesh, [Member("volume", "solid", None, METAL, {"thermal_strain": 1e-3})])
    if family == "beam":
        mesh = line([[0, 0, 0], [3, 1, 0.5], [3, 4, 2]], 6)
        return build_structure(mesh, [Member("line", "beam", Rectangle(0.05, 0.03), METAL, {"prestress": 1e4})])
    mesh = rectangle(2.0, 1.0, 6, 4, "triangle" if family == "plate" else "quad")
    return build_structure(mesh, [Member("surface", family, 5e-3, METAL, {"prestress": (1e5, 5e4, -2e4)})])


@pytest.fixture(params=["plate", "plate_bfs", "solid", "beam"])
def structure(request):
    return stressed(request.param)


def test_at_rest_they_are_the_tangent_and_the_force(structure):
    elastic, rest = structure.internal_force, np.zeros(structure.n_dof)
    K, f = elastic.tangent(rest), elastic.force(rest)
    assert abs(structure.K - K).max() < 1e-13 * abs(K).max()
    assert abs(structure.K - structure.K0).max() > 1e-9 * abs(K).max()
    assert np.abs(structure.f0 - f).max() < 1e-12 * np.abs(f).max()


def test_work_of_stress_is_that_of_the_matrix(structure):
    rng = np.random.default_rng(0)
    x, phi = 1e-4 * rng.standard_normal(structure.n_dof), rng.standard_normal((structure.n_dof, 3))
    elastic = structure.internal_force
    whole = phi.T @ (elastic.geometric_stiffness(x) @ phi)
    assert np.abs(elastic.work_of_stress(x[:, None], phi)[0] - whole).max() < 1e-12 * np.abs(whole).max()


def test_geometric_stiffness_is_what_the_tangent_gains_under_stress_alone(structure):
    """x.K_sigma(y) x = (dK/dy) x . x less twice the work of y on the second-order strain's own stress, by differences.

    Along one direction x = y all three parts of the third derivative of the energy are alike.
    """
    elastic = structure.internal_force
    x = 1e-3 * np.random.default_rng(1).standard_normal(structure.n_dof)
    third = float(elastic.second_derivative(x[:, None])[:, 0] @ x)
    assert float(x @ (elastic.geometric_stiffness(x) @ x)) == pytest.approx(third / 3, rel=1e-9)


def test_quartic_energy_is_what_remains_far_out(structure):
    """The even part of the energy less its quadratic one, where it is all of the energy but rounding."""
    elastic = structure.internal_force
    phi = np.random.default_rng(2).standard_normal((structure.n_dof, 2))
    far = 1e4
    for shape, quartic in zip(phi.T, elastic.quartic_energy(phi), strict=True):
        even = (elastic.energy(far * shape) + elastic.energy(-far * shape)) / 2
        even -= far**2 * float(shape @ (structure.K @ shape)) / 2
        assert even / far**4 == pytest.approx(quartic, rel=1e-6)
