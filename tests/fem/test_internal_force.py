"""The nonlinear elastic force, its tangent and initial stress: closed forms and differences of the energy."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from support.element_families import rough_of
from support.nonlinear_models import METAL, SANDWICH, STRUCTURES, random_state, solid
from support.plate_models import displaced

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.fem.sections.laminates import isotropic, orthotropic
from femflex.mesh import line, rectangle


@pytest.mark.parametrize("name", STRUCTURES)
def test_force_and_tangent_are_derivatives_at_large_displacements(name, size=30.0):
    structure = STRUCTURES[name]()
    elastic = structure.internal_force
    x, way = random_state(structure, size), random_state(structure, size, seed=1)
    h = 1e-3  # the energy is of degree 4 along a line: a five-point difference is exact but for rounding
    at = np.array([-2, -1, 1, 2]) * h
    weight = np.array([1, -8, 8, -1]) / (12 * h)
    slope = weight @ [elastic.energy(x + t * way) for t in at]
    work = elastic.force(x) @ way
    assert work == pytest.approx(slope, abs=1e-8 * np.abs(elastic.force(x)) @ np.abs(way))
    turn = sum(w * elastic.force(x + t * way) for w, t in zip(weight, at, strict=True))
    push = elastic.tangent(x) @ way
    np.testing.assert_allclose(push, turn, atol=1e-8 * np.abs(push).max())


@pytest.mark.parametrize("name", STRUCTURES)
def test_force_and_tangent_at_rest(name):
    structure = STRUCTURES[name]()
    elastic, rest = structure.internal_force, np.zeros(structure.n_dof)
    scale = abs(structure.K).max()
    assert abs(elastic.tangent(rest) - structure.K).max() < 1e-14 * scale
    np.testing.assert_allclose(elastic.force(rest), structure.f0, rtol=0, atol=1e-14 * abs(structure.f0).max())
    assert elastic.energy(rest) == 0.0
    stressed = any(word in name for word in ("prestressed", "pretensioned", "hot"))
    assert structure.f0.any() == stressed


def test_energy_of_solid_under_homogeneous_gradient():
    sigma0 = np.array([3e9, 1e9, -2e9, 5e8, 4e8, -1e9])
    structure = solid(prestress=sigma0)
    H = np.random.default_rng(4).normal(size=(3, 3))
    x = structure.translation.T @ (structure.mesh.points @ H.T).ravel()
    E = (H + H.T + H.T @ H) / 2
    lam, mu = METAL.E * 0.3 / 1.3 / 0.4, METAL.E / 2.6
    density = lam / 2 * np.trace(E) ** 2 + mu * np.sum(E * E)
    voigt = np.array([E[0, 0], E[1, 1], E[2, 2], 2 * E[1, 2], 2 * E[0, 2], 2 * E[0, 1]])
    volume = structure.strain[0].weight.sum()
    assert structure.internal_force.energy(x) == pytest.approx((density + sigma0 @ voigt) * volume, rel=1e-12)


@pytest.mark.parametrize("order", [3, 5])
def test_energy_of_beam_with_constant_slopes(order):
    a, b, c, d, tension = 0.3, 0.5, -0.4, 2.0, 1e5
    mesh = line([[0, 0, 0], [2.0, 0, 0]], 3)
    width, height = 0.05, 0.03
    options = {"order": order, "prestress": tension, "orientation": (0, 1, 0)}
    structure = build_structure(mesh, [Member("line", "beam", Rectangle(width, height), METAL, options)])
    x = mesh.points[:, :1]
    u, turn = x * [a, b, c], np.broadcast_to([0.0, -c, b], (len(x), 3)) + x * [d, 0, 0]
    dofs = structure.translation.T @ u.ravel() + structure.rotation.T @ turn.ravel()
    A, polar = width * height, (width**2 + height**2) / 12
    stretch = a + (a**2 + b**2 + c**2 + polar * d**2) / 2
    section = structure.strain[0].elastic[0, 0]
    GJ = section[3, 3] * polar
    expected = 2.0 * (tension * stretch + (METAL.E * A * stretch**2 + GJ * d**2) / 2)
    assert structure.internal_force.energy(dofs) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("family", ["plate", "plate_bfs"])
@pytest.mark.parametrize("section", [isotropic(0.01, METAL), SANDWICH])
def test_energy_of_plate_with_constant_slopes(family, section):
    H = np.array([[0.2, -0.1], [0.15, 0.05]])  # u,x u,y / v,x v,y
    slope, force = np.array([0.4, -0.3]), np.array([2e6, -1e6, 5e5])
    mesh = rectangle(1.2, 0.9, 3, 2, "triangle" if family == "plate" else "quad")
    structure = build_structure(mesh, [Member("surface", family, section, None, {"prestress": force})])
    x = displaced(
        structure,
        lambda p: np.column_stack([p[:, :2] @ H.T, p[:, :2] @ slope]),
        lambda p: np.broadcast_to([slope[1], -slope[0], 0.0], (len(p), 3)),
    )
    eps = np.array([H[0, 0], H[1, 1], H[0, 1] + H[1, 0]])
    eps += np.array([*(slope**2 / 2), slope[0] * slope[1]])
    expected = 1.2 * 0.9 * (force @ eps + eps @ section.A @ eps / 2)
    assert structure.internal_force.energy(x) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("given", [(3e-4, -1e-4, 2e-4), 3e-4], ids=["three strains", "one"])
@pytest.mark.parametrize("family", ["plate", "plate_bfs"])
def test_prestress_and_thermal_strain_along_skew_axis(family, given):
    """Virtual work of f0 on a homogeneous gradient H is N : H times the area, N turned by the axis as a tensor is."""
    angle, force = 0.6, np.array([2e6, -1e6, 5e5])
    heat = np.array(given if np.ndim(given) else [given, given, 0.0])  # one strain is the same in all directions
    section = orthotropic(2e-3, 140e9, 10e9, 5e9, 0.3, 1600.0)
    mesh = rectangle(1.2, 0.9, 3, 2, "triangle" if family == "plate" else "quad")
    axis = np.array([np.cos(angle), np.sin(angle), 0.0])
    options = {"axis": axis, "prestress": force, "thermal_strain": given}
    structure = build_structure(mesh, [Member("surface", family, section, None, options)])
    off = 0.3 * 10e9 / (1 - 0.09 / 14)  # of Hooke's law in plane stress, along and across the fibres
    xx, yy, xy = force - 2e-3 * np.array(
        [
            140e9 / (1 - 0.09 / 14) * heat[0] + off * heat[1],
            off * heat[0] + 10e9 / (1 - 0.09 / 14) * heat[1],
            5e9 * heat[2],
        ]
    )
    turn = np.array([axis[:2], [-axis[1], axis[0]]])  # rows: along and across the axis
    N = turn.T @ np.array([[xx, xy], [xy, yy]]) @ turn
    for k in range(4):
        H = np.zeros(4)
        H[k] = 1.0
        H = H.reshape(2, 2)
        x = displaced(
            structure,
            lambda p, H=H: np.column_stack([p[:, :2] @ H.T, np.zeros(len(p))]),
            lambda p, H=H: np.broadcast_to([0.0, 0.0, (H[1, 0] - H[0, 1]) / 2], (len(p), 3)),
        )
        assert structure.f0 @ x == pytest.approx(1.2 * 0.9 * np.sum(N * H), abs=1e-9 * np.abs(N).max())


@pytest.fixture(params=["prestressed plate", "hot bfs", "prestressed solid", "pretensioned beam"])
def structure(request):
    return STRUCTURES[request.param]()


def test_work_of_stress_matches_geometric_stiffness(structure):
    rng = np.random.default_rng(0)
    x, phi = 1e-4 * rng.standard_normal(structure.n_dof), rng.standard_normal((structure.n_dof, 3))
    elastic = structure.internal_force
    whole = phi.T @ (elastic.geometric_stiffness(x) @ phi)
    assert np.abs(elastic.work_of_stress(x[:, None], phi)[0] - whole).max() < 1e-12 * np.abs(whole).max()


def test_geometric_stiffness_equals_change_of_tangent(structure):
    """x.K_sigma(y) x = (dK/dy) x . x less twice the work of y on the second-order strain's own stress, by differences.

    Along one direction x = y all three parts of the third derivative of the energy are alike.
    """
    elastic = structure.internal_force
    x = 1e-3 * np.random.default_rng(1).standard_normal(structure.n_dof)
    third = float(elastic.second_derivative(x[:, None])[:, 0] @ x)
    assert float(x @ (elastic.geometric_stiffness(x) @ x)) == pytest.approx(third / 3, rel=1e-9)


def test_quartic_energy_at_large_displacements(structure):
    """The even part of the energy less its quadratic one, where it is all of the energy but rounding."""
    elastic = structure.internal_force
    phi = np.random.default_rng(2).standard_normal((structure.n_dof, 2))
    far = 1e4
    for shape, quartic in zip(phi.T, elastic.quartic_energy(phi), strict=True):
        even = (elastic.energy(far * shape) + elastic.energy(-far * shape)) / 2
        even -= far**2 * float(shape @ (structure.K @ shape)) / 2
        assert even / far**4 == pytest.approx(quartic, rel=1e-6)


MORE = {
    name: partial(rough_of, name) for name in ("tether", "shell quad", "shell quad9", "beam of order 5 that shears")
}


@pytest.mark.parametrize("name", ["tapered beam", "folded plate", "prestressed plate", "hot bfs", *MORE])
def test_second_derivative_matches_central_difference(name):
    """(dK/da) b at rest, of two motions of unlike size, where the energy is of degree four."""
    s = {**STRUCTURES, **MORE}[name]()
    a, b = random_state(s, 1.0, seed=2), random_state(s, 0.3, seed=3)
    V, h = s.internal_force, 1e-3
    slope = (V.tangent(h * a) @ b - V.tangent(-h * a) @ b) / (2 * h)
    computed = V.second_derivative(np.column_stack([a, b]), np.array([0]), np.array([1]))[:, 0]
    np.testing.assert_allclose(computed, slope, atol=1e-6 * np.abs(slope).max())
